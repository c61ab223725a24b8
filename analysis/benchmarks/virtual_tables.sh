#!/usr/bin/env bash
# The tables of docs/decisions that come of the virtual cluster, as they stand there: the cluster
# is a function of its options, so every machine prints the same, and a row that differs is news.
#   virtual_tables.sh [TABLE...]           scaling, rollback, gating, islands, ghosts,
#                                          balancing; or all
#   virtual_tables.sh --check [TABLE...]   which rows are not in models-*.md there; exit 1 if any
# All takes some 5 minutes. Environment: SODA (default build/release/soda)
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
soda=${SODA:-$root/build/release/soda}
library=$root/scenarios/library
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Leaves the report of a run on the cluster in $1; digests of one $2 must agree.
cluster() { # report, digest's name, scenario file, options
  local report=$1 scene=$2
  shift 2
  "$soda" run "$@" --executor virtual --quiet --json > "$folder/$report"
  value digest "$report" >> "$folder/$scene.digest"
  [ "$(sort -u "$folder/$scene.digest" | wc -l)" = 1 ] ||
    { echo "digests of $scene differ" >&2; exit 1; }
}

value() { # key, report: the first of this key
  sed -n "s/^ *\"$1\": \"*\([0-9a-f.e+-]*\)\"*,*$/\1/p" "$folder/$2" | head -n 1
}

calculated() { # format, expression over numbers
  awk "BEGIN { printf \"$1\", $2 }"
}

makespan_ms() { # report, digits
  calculated "%.${2}f" "1e3 * $(value makespan_s "$1")"
}

# In metres to millimetres, two digits; 0 as it is.
millimetres() { calculated "%.2g" "1e3 * $1"; }

rollback_rows() { # scene
  "$soda" compare "$library/$1.json" --over rollback --steps 120 --latency-us 100 --json \
    > "$folder/modes"
  local mode apart
  for mode in propagate warm; do
    grep "\"setting\": \"$mode\"" "$folder/modes" | tr ',{}' '\n' > "$folder/mode"
    apart=0
    if [ $mode = warm ]; then
      apart="$(millimetres "$(value position_deviation_m mode)") mm,"
      apart="$apart $(millimetres "$(value velocity_deviation_m_s mode)") mm/s"
    fi
    echo "| \`$1\` | \`$mode\` | $(value islands_wasted mode) |" \
      "$(calculated %.1f "$(value iterations mode) / $(value islands_solved mode)") |" \
      "$(makespan_ms mode 1) | $apart |"
  done
}

rollback() {
  echo "| scene | rollback | solves wasted | iterations a solve | makespan, ms | off by |"
  echo "|---|---|---|---|---|---|"
  rollback_rows border-stack
  rollback_rows eight-corner
}

advanced() { echo $(($(value solved "$1") + $(value at_rest "$1"))); } # islands, by a solve or not

gating_row() { # scene, steps, latency, on|off|both
  local file=$library/$1.json options=(--latency-us "$3" --steps "$2") gating=$4 lockstep=
  cluster run "$1-$2" "$file" "${options[@]}" --gating "${gating/both/on}"
  if [ "$gating" != off ]; then
    cluster lockstep "$1-$2" "$file" "${options[@]}" --policy lockstep
    lockstep=$(makespan_ms lockstep 1)
  fi
  if [ "$gating" = both ]; then
    cluster other "$1-$2" "$file" "${options[@]}" --gating off
    [ "$(value makespan_s run)" = "$(value makespan_s other)" ] || gating=on
  fi
  local solves="($(advanced run) + $(value reused run)) / $(value solves_committed run)"
  echo "| \`$1\`, $2 | $3 | ${gating/both/on, off} | $(makespan_ms run 1) |" \
    "$(calculated %.2f "$solves") |" \
    "$(calculated %.1f "100 * $(value efficiency run)") | $(value messages run) |${lockstep:+ $lockstep} |"
}

gating() {
  echo "| scene, steps | latency, us | gating | makespan, ms | rework | efficiency, % | messages |" \
    "lockstep, ms |"
  echo "|---|---|---|---|---|---|---|---|"
  local scene steps latencies latency
  while read -r scene steps latencies; do
    for latency in $latencies; do
      gating_row "$scene" "$steps" "$latency" on
      gating_row "$scene" "$steps" "$latency" off
    done
  done <<< "border-stack 300 6 60 300
five-worlds-chain 60 15 200 2000
crowd 200 10 70 700
pyramid 30 150 1500"
  gating_row pyramid 90 150 on
  gating_row twelve-worlds 200 12 both
}

# Told / dead-reckoning / predicted.
ghosts_row() { # name, digest's name, scenario file, latency, options
  local name=$1 digest=$2 file=$3 latency=$4
  shift 4
  local mode
  for mode in told dead-reckoning predicted; do
    cluster $mode "$digest" "$file" --latency-us "$latency" --ghosts $mode "$@"
  done
  each() { echo "$(value "$1" told) / $(value "$1" dead-reckoning) / $(value "$1" predicted)"; }
  right() {
    calculated %.0f "100 * $(value ghosts_confirmed "$1") / ($(value ghosts_answered "$1") + 1e-9)"
  }
  echo "| $name, $latency | $(each contacts_false) | $(each contacts_missed) | $(each rollbacks) |" \
    "$(advanced told) / $(advanced dead-reckoning) / $(advanced predicted)" \
    "of $(value solves_committed told) |" \
    "$(makespan_ms told 2) / $(makespan_ms dead-reckoning 2) / $(makespan_ms predicted 2) |" \
    "$(right dead-reckoning) / $(right predicted) |"
}

ghosts() {
  echo "| scene, latency in us | false | missed | rollbacks | solves | makespan, ms |" \
    "guessed right, % |"
  echo "|---|---|---|---|---|---|---|"
  sed 's/0.0, 0.0, 0.0]/0.0, 0.0, -9.81]/' "$library/sparse-10000.json" > "$folder/gas.json"
  local gas=(gas "$folder/gas.json")
  ghosts_row "falling gas" "${gas[@]}" 6 --worlds 64 --steps 40
  ghosts_row "falling gas" "${gas[@]}" 60 --worlds 64 --steps 40
  ghosts_row "the same, gating off" "${gas[@]}" 6 --worlds 64 --steps 40 --gating off
  ghosts_row "the same, gating off" "${gas[@]}" 60 --worlds 64 --steps 40 --gating off
  ghosts_row '`fast-crosser`' crosser "$library/fast-crosser.json" 1.4
  ghosts_row '`twelve-worlds`, 200 steps' twelve "$library/twelve-worlds.json" 12 --steps 200
  ghosts_row '`crowd`, 400 steps' crowd "$library/crowd.json" 7 --steps 400
  ghosts_row '`crowd`, 400 steps' crowd "$library/crowd.json" 70 --steps 400
  local stack=(stack "$library/border-stack.json")
  ghosts_row '`border-stack`' "${stack[@]}" 7.5
  ghosts_row '`border-stack`' "${stack[@]}" 75
  ghosts_row "the same, gating off" "${stack[@]}" 7.5 --gating off
  ghosts_row "the same, gating off" "${stack[@]}" 75 --gating off
}

balancing_row() { # scene, processors
  local file=$library/$1.json options=(--processors "$2" --jitter-us 5)
  cluster off "$1-whole" "$file" "${options[@]}" --balancing off
  cluster paper "$1-whole" "$file" "${options[@]}" --balancing paper
  echo "| \`$1\` | $2 | $(makespan_ms off 0) | $(makespan_ms paper 0) |" \
    "$(calculated %.2f "$(value makespan_s off) / $(value makespan_s paper)") |" \
    "$(value cells_transferred paper) |"
}

balancing() {
  echo "| scene | processors | off | paper | off / paper | cells moved |"
  echo "|---|---|---|---|---|---|"
  local scene processors
  for scene in crowd factory-line; do
    for processors in 12 6 3; do balancing_row "$scene" "$processors"; done
  done
}

islands_row() { # scenario file, processors, latency
  local options=(--steps 40 --worlds 8 --processors "$2" --latency-us "$3") report
  for report in on off; do
    cluster $report islands "$1" "${options[@]}" --split-islands $report
  done
  millions() { calculated %.1f "1e-6 * ($(value row_sweeps "$1") + $(value block_row_sweeps "$1"))"; }
  echo "| $2 | $3 | $(makespan_ms off 0) | $(millions off) | $(makespan_ms on 0) |" \
    "$(millions on) | $(calculated %.2f "$(value makespan_s off) / $(value makespan_s on)") |"
}

islands() {
  sed 's/"rows": 20/"rows": 40/; s/-9\.5/-19.5/; s/\[-12.0, -2.0, 0.0\]/[-24.0, -2.0, 0.0]/
    s/"cell_size_m": 2.0/"cell_size_m": 4.0/; s/\[12, 2, 11\]/[12, 1, 11]/
    s/"steps":/"solver": {"direct": false}, "steps":/' \
    "$library/pyramid.json" > "$folder/pile.json"
  echo "| processors | latency, us | whole: makespan | row sweeps | split: makespan | row sweeps |" \
    "whole / split |"
  echo "|---|---|---|---|---|---|---|"
  islands_row "$folder/pile.json" 8 10
  islands_row "$folder/pile.json" 4 10
  islands_row "$folder/pile.json" 2 10
  islands_row "$folder/pile.json" 8 100
}

# Of lines of `soda scaling --csv`; shares of processors x makespan, Time Warp's four in one.
scaling_rows() {
  tail -n +2 "$1" | awk -F, '{
    printf "| `%s` | %d | %s | %s | %s | %s | %s | %.3g | %s | %s |\n",
      $1, $2, $4, $7, $9, $10, $11, $12 + $13 + $14 + $16, $15, $17 }'
}

scaling() {
  echo "| scene | steps | worlds | speed-up | useful, % | replicated | division | Time Warp |" \
    "rolled back | waiting |"
  echo "|---|---|---|---|---|---|---|---|---|---|"
  "$soda" scaling --library "$library" --steps 60 --csv > "$folder/library"
  scaling_rows "$folder/library"
}

check=false
if [ "${1-}" = --check ]; then
  check=true
  shift
fi
[ $# -gt 0 ] || set -- scaling rollback gating islands ghosts balancing
missing=0
for table; do
  case $table in
    scaling | rollback | gating | islands | ghosts | balancing) ;;
    *) sed -n 2,7p "$0" >&2; exit 2 ;;
  esac
  "$table" > "$folder/table"
  if $check; then
    cat "$root"/docs/decisions/models-*.md | grep -vxFf - "$folder/table" && missing=1
  else
    cat "$folder/table"
    echo
  fi
done
if $check && [ $missing = 0 ]; then echo "every row stands in docs/decisions"; fi
exit $missing
