#!/usr/bin/env bash
# A minute of what should not move, with its energy: pyramid, stack under a thousandfold load, house
# of cards, arch, all of them solved in each step and once more left at rest, a hanging chain of a
# hundred links with a hundredfold weight; and that chain let go 30 degrees off the vertical, which
# should keep its energy. Prints how far each drifts; exit 1 if one misses what it must reach. Takes
# a minute or two.
#   soak.sh [DT,...]   default: the steps of the files, 1/60 s. Environment: SODA
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
soda=${SODA:-$root/build/release/soda}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for chain in chain chain-swing; do
  sed 's/"duration_s": 10,/"duration_s": 60,/' "$root/scenarios/cases/$chain.json" \
    > "$folder/$chain-60s.json"
  grep -q '"duration_s": 60,' "$folder/$chain-60s.json"
done
solved=()
for case in pyramid-60s stack-1000 card-house arch; do
  solved+=("$folder/$case-solved.json")
  sed 's/"format": 1,/"format": 1, "solver": {"rest": false},/' "$root/scenarios/cases/$case.json" \
    > "${solved[-1]}"
  grep -q '"rest": false' "${solved[-1]}"
done
"$soda" accuracy "${solved[@]}" pyramid-60s stack-1000 card-house arch "$folder"/chain-60s.json \
  "$folder"/chain-swing-60s.json --cases "$root/scenarios/cases" --repeat 0 --budget 600 --check \
  ${1:+--dt "$1"}
