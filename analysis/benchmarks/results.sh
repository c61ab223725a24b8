#!/usr/bin/env bash
# Writes what this machine measures to docs/results/NAME.md, a section a command; the command stands
# above what it printed. Takes some minutes; nothing else should run meanwhile.
#   results.sh NAME        such as amd-epyc-2-cores
# Environment: SODA (the program, default build/release/soda)
set -euo pipefail
cd "$(dirname "$0")/../.."
[ $# = 1 ] || { sed -n 2,6p "$0" >&2; exit 2; }
export SODA=${SODA:-build/release/soda}
file=docs/results/$1.md
mkdir -p docs/results
costs=$(mktemp -d)
trap 'rm -rf "$costs"' EXIT

processor() { sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1; }

section() { # title, command
  local title=$1
  shift
  echo "## $title"
  echo
  echo '```'
  echo "\$ $*" | sed "s|$costs/||g"
  "$@" 2>&1 | sed 's/ *$//'
  echo '```'
  echo
}

heaviest=(scenarios/library/{bin-1000,factory-line,pyramid,twelve-worlds-piles,wrecking-balls,mixed-shapes,crowd}.json)
{
  echo "# Results: $1"
  echo
  echo "$(processor), $(nproc) processors; $("$SODA" --version); $(date -u +%F)." \
    "Written by \`analysis/benchmarks/results.sh $1\`."
  echo
  section "The main scenario" "$SODA" run scenarios/library/wrecking-balls.json
  section "What work costs" \
    "$SODA" calibrate "${heaviest[@]}" --steps 200 --predict 2 -o "$costs/costs.json"
  section "What ranks take" \
    mpirun -n 2 "$SODA" calibrate "${heaviest[@]}" --steps 200 --predict 1 --costs "$costs/costs.json"
  section "Two threads" analysis/benchmarks/two_threads.sh
} > "$costs/page"
mv "$costs/page" "$file"
echo "$file"
