#!/usr/bin/env bash
# One trajectory over the full product: every library scene x {threads, two ranks} x rollback mode x
# gating x ghosts x balancing, with the scene's own user input and with random input beside it. What
# the tests of every day draw by seed, here all of it. Takes some ten minutes; a campaign, not a test.
#   all_modes.sh [SODA]   default build/release/soda; exit 1 at the first scene that diverges
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
soda=${1:-$root/build/release/soda}
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1

for file in "$root"/scenarios/library/*.json; do
  scene=$(basename "$file" .json)
  steps=$(sed -n "s/^set(steps_of_$scene \([0-9]*\))/\1/p" "$here/../scenario_steps.cmake")
  for input in "" "--random-inputs 1"; do
    # shellcheck disable=SC2086
    "$soda" verify "$file" --steps "$steps" --all-modes --threads 1,2 --worlds 4,12 \
      --buffers 4,48 --seeds 1 $input
    # shellcheck disable=SC2086
    mpirun -n 2 "$soda" verify "$file" --steps "$steps" --all-modes --threads 1 --worlds 4 \
      --buffers 8 --seeds 1 $input
  done
done
