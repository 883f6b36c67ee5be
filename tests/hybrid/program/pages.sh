#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# pages.sh PROGRAM SCENES FOLDER [PAGE…]: opens report pages in Chromium, by default one of each command that writes
# pages. A page must load nothing from elsewhere, cause no error, and fit into widths of 400 and 1600 pixels. It is
# shown light, dark and printed, and pictures of these forms stay in FOLDER. Without Chromium the test is skipped.
set -u
program=$1 scenes=$2 folder=$3
shift 3
failures=0
chromium=$(command -v chromium || command -v chromium-browser || command -v google-chrome) || exit 77
rm -rf "$folder"
mkdir -p "$folder/user"
cd "$folder" || exit 1

fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

# browse OPTIONS… PAGE: opens the page in Chromium.
browse() {
  HOME=$folder/user timeout 120 "$chromium" --headless --no-sandbox --disable-gpu --disable-background-networking \
    --disable-component-update --disable-sync --no-first-run --hide-scrollbars \
    --user-data-dir="$folder/user/profile" "$@" 2> browser.log
}

# make NAME COMMAND…: makes the page NAME/report.html of a command.
pages=()
make() {
  local name=$1
  shift
  "$program" "$@" --report "$name" > "$name.log" 2>&1
  if [ -f "$name/report.html" ]; then pages+=("$folder/$name/report.html"); else fail "$name: $(tail -3 "$name.log")"; fi
}

if [ $# -gt 0 ]; then
  pages=("$@")
else
  cat > small.toml << 'TOML'
format = 1
[tool]
radius = 4
stiffness = 1500
[material.gel]
young = 8000
[[soft]]
name = "block <of> gel & \"more\""
formula = "block"
size = [24, 24, 10]
spacing = 2
material = "gel"
[path]
kind = "press"
from = [0, 0, 10]
to = [0, 0, 6.5]
hold = 0.1
speed = 40
TOML
  sed 's/8000/9000/' small.toml > stiffer.toml
  make run run small.toml
  make compare compare small.toml
  make scenes compare small.toml stiffer.toml
  make models compare small.toml --models
  make tune tune small.toml --quick
  make stability stability "$scenes/wall.toml" --quick
  make validate validate --quick
  make thesis bench thesis --quick
fi

# probe PAGE WIDTH: writes probe.html, which shows the page in a frame of this width. The browser's own window cannot be
# narrower than 500 pixels. A security policy forbids the framed copy to load anything. A script in the copy counts
# errors and refused requests and measures the width. The title of probe.html reports them.
probe() {
  {
    printf '<meta http-equiv="Content-Security-Policy" content="default-src %s; img-src data:; ' "'none'"
    printf 'style-src %s; script-src %s"><script>var bad=[];' "'unsafe-inline'" "'unsafe-inline'"
    printf 'window.onerror=function(m){bad.push(m)};document.addEventListener("securitypolicyviolation",'
    printf 'function(e){bad.push("asks for "+e.blockedURI)});</script>'
    cat "$1"
    printf '<script>window.onload=function(){parent.postMessage("PROBE errors="+bad.length+" "+bad.join(";")+'
    printf '" width="+document.documentElement.scrollWidth+" of="+innerWidth,"*");};</script>'
  } > framed.html
  printf '<!doctype html><meta name="color-scheme" content="light dark"><body style="margin:0"><script>' > probe.html
  printf 'onmessage=function(e){document.title=e.data};</script>' >> probe.html
  printf '<iframe src="framed.html" width="%s" height="2400" style="border:0"></iframe>' "$2" >> probe.html
}

for page in "${pages[@]}"; do
  name=$(basename "$(dirname "$page")")
  grep -qE "(src|href)=[\"']?(https?:)?//|@import|url\([\"']?(https?:)?//" "$page" && fail "$name: refers to the network"
  browse --enable-logging=stderr --dump-dom "file://$page" > dom.html ||
    fail "$name: Chromium does not open it: $(tail -2 browser.log)"
  grep -E 'CONSOLE.*(error|Error|Refused|Failed|violat)' browser.log && fail "$name: the browser's console has errors"
  for width in 400 1600; do
    probe "$page" $width
    at="file://$folder/probe.html"
    title=$(browse --window-size=$width,2400 --dump-dom "$at" | grep -o '<title>PROBE[^<]*' | tail -1)
    case $title in
      *"errors=0 "*) ;;
      *) fail "$name at $width: $title" ;;
    esac
    wide=${title##*width=}
    [ "${wide%% *}" = $width ] || fail "$name is not $width pixels wide: $title"
    browse --window-size=$width,2400 --screenshot="$folder/$name-light-$width.png" "$at" > /dev/null
    browse --window-size=$width,2400 --blink-settings=preferredColorScheme=0 \
      --screenshot="$folder/$name-dark-$width.png" "$at" > /dev/null
  done
  browse --print-to-pdf="$folder/$name.pdf" "file://$page" > /dev/null
  for made in "$name-light-400.png" "$name-dark-400.png" "$name-light-1600.png" "$name-dark-1600.png" "$name.pdf"; do
    [ -s "$made" ] || fail "$name: no $made"
  done
  cmp -s "$name-light-1600.png" "$name-dark-1600.png" && fail "$name: dark is as light"
  echo "$name: opened"
done
exit $((failures > 0))
