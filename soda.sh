#!/usr/bin/env bash
# Sets up, builds, runs and tests soda on Debian 12. Needs root or sudo only to install packages.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

packages=(
  g++ cmake ninja-build pkg-config git
  libfcl-dev libccd-dev libeigen3-dev libboost-dev libassimp-dev libqhull-dev
  nlohmann-json3-dev libcli11-dev libxxhash-dev libzstd-dev
  libopenmpi-dev openmpi-bin
  libgtest-dev librapidcheck-dev libvalijson-dev valgrind iproute2
)
main_scenario=scenarios/library/twelve-worlds.json

usage() {
  cat <<USAGE
usage: ./soda.sh build              install missing packages and build build/release/soda
       ./soda.sh run [ARGUMENTS]    build, then soda run ARGUMENTS
                                    (without: $main_scenario)
       ./soda.sh test [ARGUMENTS]   build, then run all tests (ARGUMENTS go to ctest)

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
  for package in "${packages[@]}"; do
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed ||
      echo "$package"
  done
}

install_packages() {
  command -v dpkg-query >/dev/null || fail "needs a Debian system (dpkg-query not found)"
  local missing
  mapfile -t missing < <(missing_packages)
  ((${#missing[@]})) || return 0
  local as_root=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null ||
      fail "missing packages: ${missing[*]}; run as root or install sudo"
    as_root=(sudo)
  fi
  echo "installing: ${missing[*]}"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq ||
    fail "apt-get update failed"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" ||
    fail "could not install: ${missing[*]}"
}

build() {
  install_packages
  cmake --preset release
  cmake --build --preset release
}

command=${1:-}
(($# == 0)) || shift
case $command in
  build)
    (($# == 0)) || fail "build takes no arguments, got: $*" 2
    build
    ;;
  run)
    (($# > 0)) || set -- "$main_scenario"
    build >&2
    exec build/release/soda run "$@"
    ;;
  test)
    build
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
