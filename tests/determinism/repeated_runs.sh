#!/usr/bin/env bash
# The same run again and again, as users start it: seed 0, the options of the file. Every run must
# end with 0 and with the digest of the first. A campaign, not a test.
#   repeated_runs.sh default [RUNS]   every library scene at full length (RUNS: 10)
#   repeated_runs.sh mpi [RUNS]       scenes whose bodies meet on borders, 1, 2 and 4 ranks of 1 and 2
#                                     threads, 60 steps (RUNS: 30)
set -euo pipefail
cd "$(dirname "$0")/../.."
soda=$PWD/build/release/soda
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
border_scenes=(border-stack eight-corner five-worlds-chain third-world twelve-worlds-piles)
failures=0

# repeat NAME RUNS COMMAND...
repeat() {
  local name=$1 runs=$2 first='' digest out code
  shift 2
  for ((run = 1; run <= runs; ++run)); do
    code=0
    out=$("$@" 2>&1) || code=$?
    digest=$(sed -n 's/.*digest of the state after the last step *//p' <<<"$out")
    first=${first:-$digest}
    if ((code != 0)) || [[ -z $digest || $digest != "$first" ]]; then
      echo "$name, run $run: exit code $code, digest ${digest:-none}, the first was ${first:-none}"
      tail -3 <<<"$out"
      failures=$((failures + 1))
    fi
  done
  echo "$name: $runs runs, digest $first"
}

case ${1:-} in
  default)
    for file in scenarios/library/*.json; do
      repeat "$(basename "$file" .json)" "${2:-10}" "$soda" run "$file" --quiet
    done
    ;;
  mpi)
    for scene in "${border_scenes[@]}"; do
      for ranks in 1 2 4; do
        for threads in 1 2; do
          repeat "$scene, $ranks ranks of $threads threads" "${2:-30}" \
            mpirun -n "$ranks" --oversubscribe "$soda" run "scenarios/library/$scene.json" \
            --executor mpi --threads "$threads" --steps 60 --worlds 12 --quiet
        done
      done
    done
    ;;
  *)
    sed -n '2,/^set/{/^#/p}' "$0" >&2
    exit 2
    ;;
esac
((failures == 0)) || { echo "$failures runs failed"; exit 1; }
