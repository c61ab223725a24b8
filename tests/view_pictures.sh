#!/usr/bin/env bash
# view_pictures.sh PAGE [FRAGMENT]: pictures of a page of `soda view` in headless Chromium, 1280 and
# 390 pixels wide, light and dark, beside the page: to be looked at.
set -euo pipefail
[[ $# -ge 1 && -r $1 ]] || { echo "usage: view_pictures.sh PAGE [FRAGMENT]" >&2; exit 2; }
page=$(realpath "$1")
profile=$(mktemp -d)
trap 'rm -rf "$profile"' EXIT
for size in 1280,800 390,844; do
  for scheme in light dark; do
    picture=${page%.html}-${size%,*}-$scheme.png
    chromium --headless=new --no-sandbox --disable-dev-shm-usage --enable-unsafe-swiftshader \
      --use-angle=swiftshader --hide-scrollbars --user-data-dir="$profile" --window-size="$size" \
      --virtual-time-budget=3000 --screenshot="$picture" "file://$page#${2:-}&scheme=$scheme" \
      2> /dev/null
    echo "$picture"
  done
done
