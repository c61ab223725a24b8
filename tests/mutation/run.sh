#!/usr/bin/env bash
# Seeds each defect of README.md into a copy of the sources, builds it, and runs the tests that must
# catch it.
#   run.sh [NAME...]   these defects, or all; exit 1 unless every one is caught
#   run.sh --check     only whether every patch applies and every named test exists
# Environment: SODA_MUTATION_FOLDER, where copy and build are kept (default build/mutation).
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
work=${SODA_MUTATION_FOLDER:-$root/build/mutation}
build=$work/build/release
seconds=60  # a defect that makes a test hang is caught, too

# Rows of the table: | `name` | defect | `test`, `test` |
names() { sed -n 's/^| `\([a-z0-9-]*\)` |.*/\1/p' "$here/README.md"; }
tests_of() {
  grep "^| \`$1\` |" "$here/README.md" | sed 's/.*|\(.*\)|$/\1/' | grep -o '`[^`]*`' | tr -d '`'
}

check_test() {
  local program=${1%% *} rest=${1#* }
  if [ "$program" = soda ]; then
    for word in $rest; do
      case $word in *.json) [ -f "$root/$word" ] || echo "no file $word" ;; esac
    done
  else
    grep -rqF "soda_test($program" "$root/tests" || echo "no program $program"
    grep -rqE "TEST(_F|_P)?\(${rest%%.*}, ${rest#*.}\)" "$root/tests" || echo "no test $rest"
  fi
}

check() {
  local faults=0 name test fault
  for file in "$here"/*.patch; do
    name=$(basename "$file" .patch)
    if ! grep -qx "$name" <(names); then echo "$name: not in the table"; faults=1; fi
  done
  for name in $(names); do
    if ! patch --dry-run -s -f -F0 -p1 -d "$root" < "$here/$name.patch" > /dev/null; then
      echo "$name: does not apply"
      faults=1
    fi
    if [ -z "$(tests_of "$name")" ]; then echo "$name: no test named"; faults=1; fi
    while read -r test; do
      fault=$(check_test "$test")
      if [ -n "$fault" ]; then echo "$name: $fault"; faults=1; fi
    done < <(tests_of "$name")
  done
  [ $faults -eq 0 ] && echo "$(names | wc -l) defects: every patch applies, every test exists"
  return $faults
}

# The copy as the sources are now. Only what differs is written, so only that is built again.
copy_sources() {
  (cd "$root" && find . -type f -not -path './build/*' -not -path './.*' -print0) | while IFS= read -r -d '' file; do
    cmp -s "$root/$file" "$work/$file" && continue
    mkdir -p "$work/$(dirname "$file")"
    cp "$root/$file" "$work/$file"
  done
}

# The programs that the tests of the given defects need.
build_programs_of() {
  ninja -C "$build" -j2 $(for name in "$@"; do tests_of "$name"; done | sed 's/ .*//' | sort -u) \
    > "$work/build.log" 2>&1
}

# Exit code of one test.
run_test() {
  local program=${1%% *} rest=${1#* }
  (
    ulimit -c 0 -v 8000000
    cd "$work" || exit 70
    if [ "$program" = soda ]; then
      # shellcheck disable=SC2086
      timeout $seconds "$build/soda" $rest
    else
      timeout $seconds "$build/$program" --gtest_filter="$rest:*/$rest/*" --gtest_brief=1
    fi
  ) > "$work/test.log" 2>&1
}

# Without a defect every named test must pass, and be there.
check_baseline() {
  local test
  build_programs_of "$@" || { tail -20 "$work/build.log"; return 1; }
  for name in "$@"; do tests_of "$name"; done | sort -u | while read -r test; do
    if ! run_test "$test" || grep -q ' 0 tests\.' "$work/test.log"; then
      echo "without any defect, $test does not pass"
      return 1
    fi
  done
}

# Prints what comes of one defect; false unless every test that must catch it does.
try() {
  local name=$1 outcome
  outcome=$(seed "$name" && judge "$name")
  seed "$name" -R > /dev/null
  printf '%-36s %s\n' "$name" "$outcome"
  [ "${outcome#caught}" != "$outcome" ]
}

# Without fuzz: with it, a patch that is undone can come to lie in another place than it was taken
# from, and all that follow have that defect, too.
seed() {
  patch -s -f -F0 -p1 --no-backup-if-mismatch -r - ${2:-} -d "$work" \
    < "$here/$1.patch" > /dev/null && return
  echo "does not apply"
  return 1
}

judge() {
  local test code outcome=caught
  if ! build_programs_of "$1"; then
    echo "does not build"
    return
  fi
  while read -r test; do
    run_test "$test"
    code=$?
    if [ $code -eq 0 ]; then
      echo "NOT CAUGHT by $test"
      return
    fi
    if [ $code -eq 124 ]; then outcome="caught (hangs)"; fi
  done < <(tests_of "$1")
  echo "$outcome"
}

# Works on the copy of this folder, too: what is edited meanwhile does not matter.
main() {
  if [ "${1:-}" = --check ]; then
    check
    return
  fi
  local name
  for name in "$@"; do
    names | grep -x -- "$name" > /dev/null && continue  # -q would end before names does
    case $name in -h | --help) ;; *) echo "no defect '$name'" >&2 ;; esac
    sed -n '2,6s/^# //p' "$here/run.sh" >&2
    return 2
  done
  mkdir -p "$work"
  copy_sources
  here=$work/tests/mutation
  [ $# -eq 0 ] && set -- $(names)
  [ -f "$build/build.ninja" ] || (cd "$work" && cmake --preset release > /dev/null) || return
  check_baseline "$@" || return
  local missed=0
  for name in "$@"; do try "$name" || missed=$((missed + 1)); done
  echo "$(($# - missed)) of $# caught"
  [ $missed -eq 0 ]
}

main "$@"
exit
