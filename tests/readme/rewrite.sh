#!/usr/bin/env bash
# Puts what the built program prints into the pages that quote it, where more than times differ.
# Look at the result with git diff before it is committed.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
cmake --build "$root/build/release" --target readme_test soda
program=$(find "$root/build/release" -name readme_test -type f -perm -u+x | head -n 1)
SODA_REWRITE_READMES=1 "$program" --gtest_filter=Readmes.QuoteWhat*
git -C "$root" diff --stat -- '*.md'
