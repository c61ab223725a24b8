#!/usr/bin/env bash
# What two threads gain: wall times of one scene on one world, on its worlds in sequence, on one
# thread, on two, and on two in lockstep; and of one world while another run does the same beside
# it and shares nothing: as much longer as that takes, two processors of this machine give less than
# twice one. Runs alternate, so that what else the machine does meets all of them; medians are
# printed. Every run must end with the same digest, or the exit is 1.
#   two_threads.sh [FILE [STEPS [RUNS]]]   default: twelve-worlds-piles, 48 steps, 9 runs of each
# Environment: SODA (the program, default build/release/soda), BEFORE (what it is started by, such
# as "chrt -f 5" on a machine that others use, too; runs shorter than a second then).
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
file=${1:-$root/scenarios/library/twelve-worlds-piles.json}
steps=${2:-48}
runs=${3:-9}
soda=${SODA:-$root/build/release/soda}
results=$(mktemp)
trap 'rm -f "$results"' EXIT

soda_run() { ${BEFORE:-} "$soda" run "$file" --quiet --json --steps "$steps" "$@"; }

measure() { # name, options
  local name=$1 report
  shift
  sleep 0.5
  report=$(soda_run "$@")
  note "$name" "$report"
}

note() { # name, report
  local report=$2
  value() { sed -n "s/^ *\"$1\": \"*\([0-9a-f.e+-]*\)\"*,*$/\1/p" <<< "$report" | head -n 1; }
  echo "$1 $(value wall_s) $(value cpu_s) $(value digest)" >> "$results"
}

measure_pair() {
  local report
  sleep 0.5
  soda_run --executor sequential --worlds 1 > /dev/null &
  report=$(soda_run --executor sequential --worlds 1)
  wait $!
  note one-world-beside-another "$report"
}

load_before=$(cut -d' ' -f1 /proc/loadavg)
for ((run = 0; run < runs; ++run)); do
  measure one-world --executor sequential --worlds 1
  measure worlds-in-sequence --executor sequential
  measure one-thread --executor threads --threads 1
  measure two-threads --executor threads --threads 2
  measure two-threads-lockstep --executor threads --threads 2 --policy lockstep
  measure_pair
done

[ "$(cut -d' ' -f4 "$results" | sort -u | wc -l)" = 1 ] || { echo "digests differ" >&2; exit 1; }
echo "$(basename "$file" .json), $steps steps, medians of $runs alternating runs," \
  "digest $(head -n 1 "$results" | cut -d' ' -f4), load $load_before before and" \
  "$(cut -d' ' -f1 /proc/loadavg) after"
median() { # name, column
  grep "^$1 " "$results" | cut -d' ' -f"$2" | sort -g | sed -n "$(((runs + 1) / 2))p"
}
for name in one-world worlds-in-sequence one-thread two-threads two-threads-lockstep \
  one-world-beside-another; do
  echo "$name $(median $name 2) $(median $name 3)"
done | awk 'BEGIN {
    printf "%-24s %9s %9s %18s %20s\n", "", "wall s", "CPU s", "one world / this", "in sequence / this" }
  { wall[NR] = $2; printf "%-24s %9.4f %9.4f %18.2f", $1, $2, $3, wall[1] / $2
    if (NR > 1) printf " %20.2f", wall[2] / $2
    print "" }
  END { printf "two processors give %.2f; two threads use %.2f of it\n", 2 * wall[1] / wall[6],
          wall[6] / wall[4] / 2 }'
