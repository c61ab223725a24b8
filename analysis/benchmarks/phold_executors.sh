#!/usr/bin/env bash
# PHOLD on every executor: M events/s of time that passes, medians, and the efficiency of the last
# run, as a table. The window is 4 units (in sequence: none). Runs of different executors take turns.
# Ends with 1 if a digest differs.
#   phold_executors.sh [CONFIGURATION...]   default C1 to C6
# Runs are 10 times as long as a configuration says, of C6 twice, of C4 once; on virtual processors
# once. Environment: SODA (default build/release/soda), RUNS (3)
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
soda=${SODA:-$root/build/release/soda}
runs=${RUNS:-3}
[ $# -gt 0 ] || set -- C1 C2 C3 C4 C5 C6
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

value() { # key, report
  sed -n "s/^ *\"$1\": \"*\([0-9a-f.e+-]*\)\"*,*$/\1/p" "$2" | head -n 1
}

end_of() { # configuration
  case $1 in
    C1 | C5) echo 10000 ;;
    C2 | C3) echo 1000 ;;
    C4) echo 4 ;;
    C6) echo 40000 ;;
    *) echo "no configuration $1: C1 to C6" >&2; exit 2 ;;
  esac
}

measure() { # name, command
  local name=$1
  shift
  "$@" --json > "$folder/$name"
  value events_per_s "$folder/$name" >> "$folder/$name.rates"
  if [ "$name" != virtual ]; then value digest "$folder/$name" >> "$folder/digests"; fi
}

cell() { # name
  sort -g "$folder/$1.rates" | sed -n "$((($(wc -l < "$folder/$1.rates") + 1) / 2))p" |
    awk '{ printf "%.2f", 1e-6 * $1 }'
  [ "$1" = sequential ] || value efficiency "$folder/$1" | awk '{ printf ", %.1f %%", 100 * $1 }'
}

row() { # configuration
  local end run phold
  end=$(end_of "$1")
  rm -f "$folder"/*
  phold=("$soda" phold "--$1" --end "$end")
  for ((run = 0; run < runs; ++run)); do
    measure sequential "${phold[@]}"
    measure one-thread "${phold[@]}" --executor threads --threads 1 --window 4
    measure two-threads "${phold[@]}" --executor threads --threads 2 --window 4
    measure two-ranks mpirun -n 2 "${phold[@]}" --executor mpi --window 4
  done
  measure virtual "$soda" phold "--$1" --executor virtual --processors 2 --window 4
  "$soda" phold "--$1" --json > "$folder/short"
  [ "$(sort -u "$folder/digests" | wc -l)" = 1 ] &&
    [ "$(value digest "$folder/short")" = "$(value digest "$folder/virtual")" ] ||
    { echo "$1: digests differ" >&2; exit 1; }
  echo "| $1 | $(cell sequential) | $(cell one-thread) | $(cell two-threads) |" \
    "$(cell two-ranks) | $(cell virtual) |"
}

echo "| | sequential | 1 thread | 2 threads | 2 MPI ranks | 2 virtual processors |"
echo "|---|---|---|---|---|---|"
for configuration; do row "$configuration"; done
echo "load $(cut -d' ' -f1 /proc/loadavg)" >&2
