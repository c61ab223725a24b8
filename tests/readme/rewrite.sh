#!/usr/bin/env bash
# Puts what the built program prints into the READMEs that quote it, where more than times differ.
# Look at the result with git diff before it is committed.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
cmake --build "$root/build/release" --target readme_test soda
SODA_REWRITE_READMES=1 "$root/build/release/readme_test" --gtest_filter=Readmes.QuoteWhat*
git -C "$root" diff --stat -- '*README.md'
