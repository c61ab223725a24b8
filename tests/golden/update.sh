#!/usr/bin/env bash
# Writes tests/golden/digests.txt anew: whole runs of every library and case scene. To be run when a
# change is meant to change the physics; the difference belongs into that commit.
set -euo pipefail
cd "$(dirname "$0")/../.."
cmake --build --preset release --target golden_update >&2
build/release/golden_update >tests/golden/digests.new
mv tests/golden/digests.new tests/golden/digests.txt
