#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# kill.sh PROGRAM SCENES FOLDER KILLS: kills the program at random moments, KILLS times over all commands that write
# files, in turns by SIGKILL and SIGTERM. Every file must be whole or not be there, those that were there before must be
# as they were or new, and recordings must replay. SIGTERM leaves no temporary file; SIGKILL may leave one whose name
# no user takes for the result: .hybrid-NUMBER.part, .compose-PROCESS, FILE.partPROCESS. KILL_SEED sets the moments.
set -u
program=$1 scenes=$2 folder=$3 kills=$4
RANDOM=${KILL_SEED:-1}
failures=0 signals=0 reached=0
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder" || exit 1

fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

# A scene that plays in a moment, and a segmentation of two blocks.
cat > small.toml << 'TOML'
format = 1
units = "mm"
[tool]
radius = 6
stiffness = 800
[material.gel]
young = 8000
poisson = 0.3
[[soft]]
name = "block"
formula = "block"
size = [32, 32, 16]
spacing = 4
material = "gel"
[path]
kind = "waypoints"
speed = 80
points = [[0, 0, 16], [0, 0, 11, 0.05], [0, 0, 16]]
TOML
{
  printf 'NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 16 16 16\n'
  printf 'space directions: (4,0,0) (0,4,0) (0,0,4)\nspace origin: (0,0,0)\nencoding: ascii\n\n'
  awk 'BEGIN { for (k = 0; k < 16; ++k) for (j = 0; j < 16; ++j) for (i = 0; i < 16; ++i) {
    m = i < 3 || i > 12 || j < 3 || j > 12 || k < 3 || k > 12; print m ? 0 : k < 8 ? 1 : 2 } }'
} > labels.nrrd
printf 'number,name\n1,femur\n2,muscle\n' > labels.csv

whole_json() {
  [ "$(head -c 1 "$1")" = "{" ] && [ "$(tail -c 2 "$1")" = "}" ] &&
    [ "$(tr -cd '{' < "$1" | wc -c)" = "$(tr -cd '}' < "$1" | wc -c)" ]
}

# Whether a file is whole, by its ending.
whole() {
  local file=$1
  case $file in
    */page/*.csv) [ -z "$(tail -c 1 "$file")" ] ;; # its fields may hold commas
    *.csv) awk -F, 'NR == 1 { n = NF } NF != n { exit 1 }' "$file" && [ -z "$(tail -c 1 "$file")" ] ;;
    *.svg) [ "$(tail -n 1 "$file")" = "</svg>" ] ;;
    *.html) [ "$(tail -n 1 "$file")" = "</html>" ] ;;
    *.png) [ "$(tail -c 8 "$file" | head -c 4)" = IEND ] ;;
    *.json) whole_json "$file" ;;
    *.nii.gz) gzip -t "$file" ;; # with its checksum
    *.rec) "$program" replay "$file" > replay.log 2>&1 ;;
    *.ply) "$program" check --unit m "$file" > check.log 2>&1 && ! grep -q refused check.log ;;
    *.stl) "$program" check "$file" > check.log 2>&1 && ! grep -q refused check.log ;;
    *.toml) "$program" check "$file" > check.log 2>&1 ;;
    *) fail "$file is no file that was asked for" ;;
  esac
}

# A file that is as it was when it was last found whole needs no second look.
declare -A seen
check_files() {
  local what=$1 signal=$2 file stamp
  while IFS= read -r file; do
    [ "$signal" = KILL ] || fail "$what: $file is left"
    rm -rf "$file"
  done < <(find out -depth \( -name '.hybrid-*.part' -o -name '.compose-*' -o -name '*.part[0-9]*' \))
  while IFS= read -r file; do
    stamp=$(stat -c '%i %s %y' "$file")
    [ "${seen[$file]:-}" = "$stamp" ] && continue
    if whole "$file"; then seen[$file]=$stamp; else fail "$what: $file is not whole"; fi
  done < <(find out -type f)
}

random_below() { awk -v most="$1" -v part="$RANDOM" 'BEGIN { print most * part / 32768 }'; }

# killed NAME SIGNAL DELAY_S COMMAND…
killed() {
  local name=$1 signal=$2 delay_s=$3 process status
  shift 3
  "$@" > run.log 2>&1 &
  process=$!
  sleep "$delay_s"
  kill "-$signal" "$process" 2> /dev/null && reached=$((reached + 1))
  wait "$process" 2> /dev/null
  status=$?
  signals=$((signals + 1))
  case $signal$status in
    KILL137 | TERM143 | KILL0 | TERM0) ;;
    *) fail "$name, after $delay_s s: status $status after SIG$signal: $(tail -n 3 run.log)" ;;
  esac
  check_files "$name, SIG$signal after $delay_s s" "$signal"
}

signal_of() { if (($1 % 2 == 0)); then echo KILL; else echo TERM; fi; }

# mode NAME KILLS COMMAND…: the first run is not killed, so that the others find its files. Every second moment is in the
# last third of the time that the first run took, because most files are written there.
mode() {
  local name=$1 count=$2 n start took_s delay_s
  shift 2
  rm -rf out
  mkdir out
  seen=()
  start=$EPOCHREALTIME
  "$@" > run.log 2>&1 || fail "$name: status $? of the first run: $(tail -n 3 run.log)"
  took_s=$(awk -v a="$start" -v b="$EPOCHREALTIME" 'BEGIN { print b - a }')
  check_files "$name, not killed" TERM
  [ -n "$(find out -type f)" ] || fail "$name: the first run left nothing: $(cat run.log)"
  for ((n = 0; n < count; ++n)); do
    delay_s=$(random_below "$took_s")
    ((n / 2 % 2 == 0)) || delay_s=$(awk -v a="$took_s" -v b="$delay_s" 'BEGIN { print 0.67 * a + 0.4 * b }')
    killed "$name" "$(signal_of "$n")" "$delay_s" "$@"
  done
  echo "$name: $count kills"
}

# long_mode NAME KILLS LONGEST_S COMMAND…: of a command that takes minutes; no run is whole.
long_mode() {
  local name=$1 count=$2 longest_s=$3 n
  shift 3
  rm -rf out
  mkdir out
  seen=()
  for ((n = 0; n < count; ++n)); do
    killed "$name" "$(signal_of "$n")" "$(random_below "$longest_s")" "$@"
  done
  echo "$name: $count kills"
}

# The short form leaves out modes that take long, and gives their kills to the others.
short=$((kills < 100 ? 1 : 0))
# share PERCENT: of the kills. The modes of the short form have 54 percent.
share() { echo $((short ? (kills * $1 + 27) / 54 : kills * $1 / 100)); }

mode run "$(share 16)" "$program" run small.toml --samples 0 --trace out/t.csv --record out/r.rec --json out/j.json \
  --save-surface out/s.stl --save-volume out/v.nii.gz
cp out/r.rec kept.rec
mode replay "$(share 4)" "$program" replay kept.rec --json out/j.json
mode compose "$(share 8)" "$program" compose --out out/starter --force --json out/j.json
mode "compose of labels" "$(share 8)" "$program" compose --labels labels.nrrd --names labels.csv --out out/body --force \
  --json out/j.json
mode check "$(share 4)" "$program" check small.toml --json out/j.json
mode "compare of whole scenes" "$(share 8)" "$program" compare small.toml small.toml --samples 0 --plot out/c.svg \
  --json out/c.json --report out/page
mode bench "$(share 6)" "$program" bench occupancy --quick --only lookup --cells 1000 --plot out/b.svg --json out/b.json
if ((short == 0)); then
  mode "compare of models" "$(share 7)" "$program" compare small.toml --plot out/c.svg --json out/c.json --report out/page
  mode "models in the scene" "$(share 8)" bash -c 'cp small.toml next.toml; mv next.toml out/scene.toml; exec "$@"' -- \
    "$program" compare out/scene.toml --models --cache out/cache --write-variants --plot out/m.svg --json out/m.json \
    --report out/page
  mode "pictures and pages" "$(share 9)" "$program" run small.toml --samples 0 --plot out/p.svg --picture out/p.png \
    --report out/page
  long_mode "bench of tissue" "$(share 4)" 12 "$program" bench soft --quick --plot out/b.svg --json out/b.json
  long_mode tune "$(share 7)" 12 "$program" tune small.toml --quick --cache out/cache --plot out/t.svg --json out/t.json
  # What was kept is kept: the same command comes to its end.
  "$program" tune small.toml --quick --cache out/cache --plot out/t.svg --json out/t.json > run.log 2>&1 ||
    fail "tune does not go on: $(tail -n 3 run.log)"
  check_files "tune, not killed" TERM
  rm -rf kept
  mv out/cache kept
  mode "tune --apply" "$(share 4)" bash -c 'cp small.toml next.toml; mv next.toml out/scene.toml; exec "$@"' -- \
    "$program" tune out/scene.toml --quick --cache kept --apply --json out/t.json
  long_mode stability "$(share 3)" 10 "$program" stability "$scenes/wall.toml" --plot out/s.svg --json out/s.json \
    --report out/page
  long_mode validate "$(share 2)" 10 "$program" validate --quick --json out/v.json --report out/page
  if command -v Xvfb > /dev/null; then
    exec {said}<> <(:)
    Xvfb -displayfd "$said" -screen 0 800x600x24 > xvfb.log 2>&1 &
    display=$!
    read -r -t 20 -u "$said" number && export DISPLAY=:$number
    mode view "$(share 2)" "$program" view small.toml --frames 4 --out out/frames --record out/r.rec
    kill "$display"
  else
    echo "view: skipped, there is no Xvfb"
  fi
fi
if ((failures > 0)); then exit 1; fi
echo "$signals signals, $reached while the program ran: every file was whole or not there"
