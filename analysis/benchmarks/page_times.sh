#!/usr/bin/env bash
# page_times.sh PAGE: how long a page of `soda view` takes to load and to draw in headless Chromium,
# whose WebGL is the processor's. Needs chromium.
set -euo pipefail
[[ $# == 1 && -r $1 ]] || { echo "usage: page_times.sh PAGE" >&2; exit 2; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
{
  sed '$d' "$1"
  echo '<script>'
  cat "$(dirname "$0")/page_times.js"
  echo '</script></body></html>'
} > "$folder/page.html"
chromium --headless=new --no-sandbox --disable-dev-shm-usage --enable-unsafe-swiftshader \
  --use-angle=swiftshader --window-size=1280,800 --user-data-dir="$folder/profile" \
  --dump-dom "file://$folder/page.html" 2> /dev/null |
  sed -n '/<pre id="times">/,/<\/pre>/ { s/<[^>]*>//g; p }'
