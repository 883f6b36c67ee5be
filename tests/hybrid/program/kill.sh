#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# kill.sh PROGRAM SCENES FOLDER KILLS: kills the program at random moments, KILLS times in each mode. Every file must be
# whole or not be there, those that were there before must be as they were or new, and recordings must replay.
set -u
program=$1 scenes=$2 folder=$3 kills=$4
failures=0
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder" || exit 1

fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

# Whether a file is whole, by its ending.
whole() {
  local file=$1
  case $file in
    *.csv) awk -F, 'NR == 1 { n = NF } NF != n { exit 1 }' "$file" && [ -z "$(tail -c 1 "$file")" ] ;;
    *.svg) [ "$(tail -n 1 "$file")" = "</svg>" ] ;;
    *.png) [ "$(tail -c 8 "$file" | head -c 4)" = IEND ] ;;
    *.json) [ "$(head -c 1 "$file")" = "{" ] && [ "$(tail -n 1 "$file")" = "}" ] ;;
    *.rec) "$program" replay "$file" > replay.log 2>&1 ;;
    *.ply) "$program" check --unit m "$file" > check.log 2>&1 && ! grep -q refused check.log ;;
    *.stl) "$program" check "$file" > check.log 2>&1 && ! grep -q refused check.log ;;
    *.toml) "$program" check "$file" > check.log 2>&1 ;;
    *) fail "$file is no file that was asked for" ;;
  esac
}

check_files() {
  local what=$1 file
  # A folder that is not put in place yet is named with a dot, and goes with the next call.
  while IFS= read -r file; do
    whole "$file" || fail "$what: $file is not whole"
  done < <(find out -type f -not -path '*/.compose-*')
}

# mode NAME LONGEST_S COMMAND…: the first run is not killed, so that the others find its files.
mode() {
  local name=$1 longest_s=$2 n process
  shift 2
  rm -rf out
  mkdir out
  for ((n = 0; n <= kills; ++n)); do
    "$@" > run.log 2>&1 &
    process=$!
    if ((n > 0)); then
      sleep "$(awk -v most="$longest_s" -v part="$RANDOM" 'BEGIN { print most * part / 32768 }')"
      kill -KILL "$process" 2> /dev/null
    fi
    wait "$process" 2> /dev/null
    check_files "$name, kill $n"
  done
  [ -n "$(find out -type f)" ] || fail "$name: the first run left nothing: $(cat run.log)"
  echo "$name: $kills kills"
}

mode run 2 "$program" run "$scenes/cube.toml" --samples 0 --trace out/t.csv --plot out/p.svg --record out/r.rec \
  --save-surface out/s.stl --json out/j.json
mode compare 2 "$program" compare "$scenes/cube.toml" --plot out/c.svg --json out/c.json
mode bench 2 "$program" bench occupancy --quick --only lookup --cells 1000 --plot out/b.svg --json out/b.json
mode compose 1 "$program" compose --out out/starter --force
if ((failures > 0)); then exit 1; fi
echo "every file was whole or not there"
