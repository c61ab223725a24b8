#!/usr/bin/env bash
# The program under the address and undefined-behaviour sanitizers, or under the thread sanitizer:
# library scenes by all executors and modes, inputs that come live, PHOLD, random clusters. Builds
# with the preset of that name, first. A campaign, not a test: some minutes beside the build.
#   sanitizers.sh asan|tsan   exit code other than 0 at the first finding
# MPI is left out: Open MPI takes two of its own locks in both orders, which `tsan` reports.
set -euo pipefail
[[ ${1-} == asan || ${1-} == tsan ]] || { sed -n 2,6p "$0" >&2; exit 2; }
cd "$(dirname "$0")/.."
cmake --preset "$1" > /dev/null
ninja -C "build/$1" -j "${JOBS:-2}" soda
export UBSAN_OPTIONS=print_stacktrace=1 TSAN_OPTIONS=second_deadlock_stack=1:halt_on_error=1
soda=build/$1/soda
library=scenarios/library
log=$(mktemp)
trap 'rm -f "$log"' EXIT

for file in "$library"/*.json; do
  scene=$(basename "$file" .json)
  steps=$(sed -n "s/^set(steps_of_$scene \([0-9]*\))/\1/p" tests/scenario_steps.cmake)
  "$soda" verify "$file" --steps "$steps" --threads 2 --worlds 4,12 --buffers 4,48 --seeds 1 \
    --random-inputs 1 | tail -1
done
"$soda" verify $library/five-worlds-chain.json --steps 2 --all-modes --threads 2 --worlds 4 \
  --buffers 4 --seeds 1 | tail -1

inputs() {
  sleep 0.4
  echo '{"id": 1, "type": "push", "body": 0, "impulse_newton_s": [0, 0, 3000]}'
  sleep 0.2
  echo '{"id": 2, "type": "remove", "body": 1}'
}
for mode in "--gating on" "--gating off --rollback invalidate" \
  "--balancing random --balancing-interval 3" "--ghosts predicted"; do
  # shellcheck disable=SC2086
  inputs | "$soda" run $library/eight-corner.json --threads 2 --worlds 4 --steps 120 --realtime \
    --inputs - --quiet --log "$log" --force $mode > /dev/null
  "$soda" replay "$log" --quiet > /dev/null
done

"$soda" phold --lps 256 --end 50 --executor threads --threads 2 > /dev/null
"$soda" phold --lps 32 --end 100 --executor threads --threads 2 --window 2 --order-sensitive \
  --zero-delay-rounds 2 > /dev/null
"$soda" phold --lps 64 --end 50 --executor virtual --processors 8 --window 4 > /dev/null
"$soda" swarm --seeds 1..300 | tail -1
"$soda" swarm $library/{third-world,eight-corner,border-stack,big-body}.json --seeds 1..8 --steps 8 |
  tail -1
"$soda" fuzz --seeds 1..6 | tail -1
"$soda" fuzz --seeds 1..6 --joints | tail -1
"$soda" fuzz --seeds 1..6 --springs | tail -1
echo "$1: nothing found"
