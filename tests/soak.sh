#!/usr/bin/env bash
# A minute of what should not move, with its energy: pyramid, stack under a thousandfold load, house
# of cards, arch (and the chain, once there is a file). Prints how far each drifts; exit 1 if one
# misses what it must reach. Takes about a minute.
#   soak.sh [DT,...]   default: the steps of the files, 1/60 s. Environment: SODA
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
soda=${SODA:-$root/build/release/soda}
cases="pyramid-60s stack-1000 card-house arch"
[ -e "$root/scenarios/cases/chain.json" ] && cases="$cases chain"
# shellcheck disable=SC2086
"$soda" accuracy $cases --cases "$root/scenarios/cases" --repeat 0 --budget 600 --check ${1:+--dt "$1"}
