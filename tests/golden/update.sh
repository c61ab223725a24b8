#!/usr/bin/env bash
# Writes tests/golden/digests.txt anew, from build/release/soda. To be run when a change is meant to
# change the physics; the difference belongs into that commit.
set -euo pipefail
cd "$(dirname "$0")/../.."
for file in scenarios/library/*.json; do
  name=$(basename "$file" .json)
  case $name in
    bin-1000 | pyramid | sparse-10000 | twelve-worlds-piles) steps=6 ;; # minutes at -O0 otherwise
    *) steps=40 ;;
  esac
  digest=$(build/release/soda run "$file" --executor sequential --worlds 1 --steps $steps --json --quiet |
    sed -n 's/^ *"digest": "\([0-9a-f]*\)".*/\1/p')
  echo "$name $steps $digest"
done > tests/golden/digests.txt
