#!/usr/bin/env bash
# Sets up, builds, runs and tests soda on Debian 12. Needs root or sudo only to install packages.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

packages=(
  g++ cmake ninja-build pkg-config
  libfcl-dev libccd-dev libeigen3-dev libboost-dev libassimp-dev libqhull-dev
  nlohmann-json3-dev libcli11-dev libxxhash-dev libzstd-dev libedit-dev
  libopenmpi-dev openmpi-bin
)
test_packages=(git patch libgtest-dev librapidcheck-dev libvalijson-dev valgrind iproute2
  pybind11-dev python3-dev python3-numpy)
main_scenario=scenarios/library/wrecking-balls.json

usage() {
  cat <<USAGE
usage: ./soda.sh build              install missing packages and build build/release/soda
       ./soda.sh configure          install all packages, those of the tests too, and configure
       ./soda.sh run [ARGUMENTS]    build, then soda run ARGUMENTS
                                    (without: $main_scenario)
       ./soda.sh test [ARGUMENTS]   build everything, then run all tests (ARGUMENTS go to ctest)

examples: ./soda.sh run scenarios/library/pyramid.json --executor threads --threads 2
          ./soda.sh test -LE slow
USAGE
}

fail() {
  echo "soda.sh: $1" >&2
  exit "${2:-1}"
}

missing_packages() {
  local package
  for package in "$@"; do
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed ||
      echo "$package"
  done
}

install_packages() {
  command -v dpkg-query >/dev/null || fail "needs a Debian system (dpkg-query not found)"
  local missing
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]})) || return 0
  local as_root=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null ||
      fail "missing packages: ${missing[*]}; run as root or install sudo"
    as_root=(sudo)
  fi
  echo "installing ${#missing[@]} packages and what they need (a minute or two): ${missing[*]}"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq ||
    fail "apt-get update failed"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null ||
    fail "could not install: ${missing[*]}"
}

# Says what is still to be compiled: about two seconds of one processor a file.
announce() {
  local files processors minutes
  files=$(ninja -C build/release -n "$@" | grep -c '\.o$' || true)
  processors=$(nproc)
  minutes=$(((files * 2 / processors + 59) / 60))
  ((files == 0)) ||
    echo "building $files files with $processors processors: some $minutes min (from then on, only what changes)"
}

# build_for_use: the program only. build_for_tests: everything.
build_for_use() {
  install_packages "${packages[@]}"
  local tests=()
  [[ -f build/release/CMakeCache.txt ]] || tests=(-DBUILD_TESTING=OFF)
  cmake --preset release "${tests[@]}" >/dev/null
  announce soda
  cmake --build --preset release --target soda
}

configure_all() {
  install_packages "${packages[@]}" "${test_packages[@]}"
  cmake --preset release -DBUILD_TESTING=ON
}

build_for_tests() {
  configure_all
  announce all
  cmake --build --preset release
}

command=${1:-}
(($# == 0)) || shift
case $command in
  build)
    (($# == 0)) || fail "build takes no arguments, got: $*" 2
    build_for_use
    ;;
  configure)
    (($# == 0)) || fail "configure takes no arguments, got: $*" 2
    configure_all
    ;;
  run)
    (($# > 0)) || set -- "$main_scenario" --view build/main-scenario.html --force
    build_for_use >&2
    exec build/release/soda run "$@"
    ;;
  test)
    build_for_tests
    exec ctest --test-dir build/release --output-on-failure --parallel 2 "$@"
    ;;
  help | -h | --help)
    usage
    ;;
  *)
    usage >&2
    if [[ -z $command ]]; then fail "no command given" 2; fi
    fail "unknown command '$command'" 2
    ;;
esac
