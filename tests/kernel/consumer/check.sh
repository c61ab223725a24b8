#!/usr/bin/env bash
# Installs the kernel of a build into a new folder; configures, builds and runs a program with it.
# Arguments: cmake, build folder, folder of the program, compiler, build type, generator.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$1" --install "$2" --component kernel --prefix "$folder/installed"
"$1" -S "$3" -B "$folder/build" -DCMAKE_PREFIX_PATH="$folder/installed" \
  -DCMAKE_CXX_COMPILER="$4" -DCMAKE_BUILD_TYPE="$5" -G "$6"
"$1" --build "$folder/build"
"$folder/build/consumer"
if "$1" -S "$3" -B "$folder/other" -G "$6" -DCMAKE_PREFIX_PATH="$folder/none" >/dev/null 2>&1; then
  echo "found without an installation: the check proves nothing" >&2
  exit 1
fi
