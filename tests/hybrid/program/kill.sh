#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# kill.sh PROGRAM SCENES FOLDER KILLS [MODE…]: ends every command that writes files at KILLS random moments, in turns by
# SIGKILL, SIGTERM and SIGINT. MODE: names from `modes` below (default: all). Every file must be whole or absent. An older
# file must be unchanged or replaced as a whole, and recordings must replay. SIGTERM and SIGINT leave no temporary file.
# SIGKILL may leave one with a name that no user takes for the result: .hybrid-NUMBER.part, .compose-PROCESS,
# FILE.partPROCESS. KILL_SEED sets the moments.
set -u
program=$1 scenes=$2 folder=$3 kills=$4
shift 4
modes="run pictures realtime video replay check compose labels objects scenes measured models tune apply study
bench-rigid bench-soft bench-occupancy bench-scenes bench-threads stability extremes validate view"
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

# Whether a file is whole. Each kind of file has its own check.
whole() {
  local file=$1
  case $file in
    */page/*.csv | */study/*.csv) [ -z "$(tail -c 1 "$file")" ] ;; # its fields may hold commas
    *.csv) awk -F, 'NR == 1 { n = NF } NF != n { exit 1 }' "$file" && [ -z "$(tail -c 1 "$file")" ] ;;
    *.svg) [ "$(tail -n 1 "$file")" = "</svg>" ] ;;
    *.html) [ "$(tail -n 1 "$file")" = "</html>" ] ;;
    *.png) [ "$(tail -c 8 "$file" | head -c 4)" = IEND ] ;;
    *.mkv) [ -s "$file" ] && [ $(($(stat -c %s "$file") % (3 * 1280 * 960))) = 0 ] ;; # whole frames
    *.json) whole_json "$file" ;;
    *.nii.gz) gzip -t "$file" ;; # with its checksum
    *.rec) "$program" replay "$file" > replay.log 2>&1 ;;
    *.ply) "$program" check --unit m "$file" > check.log 2>&1 && ! grep -q refused check.log ;;
    *.stl) "$program" check "$file" > check.log 2>&1 && ! grep -q refused check.log ;;
    *.toml) "$program" check "$file" > check.log 2>&1 ;;
    *) fail "$file is no file that was asked for" ;;
  esac
}

# Checks all files. A file that has not changed since it was found whole is not checked again.
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

# killed NAME SIGNAL DELAY_S COMMAND…: SIGINT goes to the command and its child processes, as from a terminal. The shell
# makes background commands ignore SIGINT. `env` restores the default.
killed() {
  local name=$1 signal=$2 delay_s=$3 process status
  shift 3
  setsid env --default-signal=INT "$@" > run.log 2>&1 &
  process=$!
  sleep "$delay_s"
  if [ "$signal" = INT ]; then kill -INT -- "-$process"; else kill "-$signal" "$process"; fi 2> /dev/null &&
    reached=$((reached + 1))
  wait "$process" 2> /dev/null
  status=$?
  signals=$((signals + 1))
  case $signal$status in
    KILL137 | TERM143 | INT130 | KILL0 | TERM0 | INT0) ;;
    *) fail "$name, after $delay_s s: status $status after SIG$signal: $(tail -n 3 run.log)" ;;
  esac
  check_files "$name, SIG$signal after $delay_s s" "$signal"
}

kinds=(KILL TERM INT)

# short_mode COMMAND…: the first run is not killed, so that the others find its files. For every second round of signals,
# the moments are in the last third of a run, because most files are written then. The assumed length of a run follows
# the machine's load. It shrinks after a signal that came too late, and grows after one that came in time.
short_mode() {
  local n start took_s delay_s in_time
  start=$EPOCHREALTIME
  "$@" > run.log 2>&1 || fail "$mode: status $? of the first run: $(tail -n 3 run.log)"
  took_s=$(awk -v a="$start" -v b="$EPOCHREALTIME" 'BEGIN { print b - a }')
  check_files "$mode, not killed" TERM
  [ -n "$(find out -type f)" ] || fail "$mode: the first run left nothing: $(cat run.log)"
  for ((n = 0; n < kills; ++n)); do
    delay_s=$(awk -v took="$took_s" -v part="$RANDOM" -v late="$((n / 3 % 2))" \
      'BEGIN { r = part / 32768; print took * (late ? 0.67 + 0.4 * r : r) }')
    in_time=$reached
    killed "$mode" "${kinds[n % 3]}" "$delay_s" "$@"
    took_s=$(awk -v took="$took_s" -v late="$((reached == in_time))" 'BEGIN { print took * (late ? 0.8 : 1.03) }')
  done
}

# long_mode LONGEST_S COMMAND…: for a command that takes long. Every run is killed.
long_mode() {
  local longest_s=$1 n
  shift
  for ((n = 0; n < kills; ++n)); do
    killed "$mode" "${kinds[n % 3]}" \
      "$(awk -v most="$longest_s" -v part="$RANDOM" 'BEGIN { print most * part / 32768 }')" "$@"
  done
}

# with_scene COMMAND…: before each run, out/scene.toml becomes a fresh copy of small.toml.
with_scene() { short_mode bash -c 'cp small.toml next.toml; mv next.toml out/scene.toml; exec "$@"' -- "$@"; }

# kept_cache: makes a complete cache of `tune` in the folder kept. No signal is sent meanwhile.
kept_cache() {
  [ -d kept ] && return
  cp small.toml kept.toml
  "$program" tune kept.toml --quick --cache kept > run.log 2>&1 || fail "tune: $(tail -n 3 run.log)"
}

in_mode() {
  case $mode in
    run) short_mode "$program" run small.toml --samples 0 --trace out/t.csv --record out/r.rec --json out/j.json \
      --save-surface out/s.stl --save-volume out/v.nii.gz ;;
    pictures) short_mode "$program" run small.toml --plot out/p.svg --picture out/p.png --report out/page ;;
    realtime) short_mode "$program" run small.toml --realtime --samples 0 --trace out/t.csv --record out/r.rec \
      --json out/j.json --black-box out/b.csv ;;
    video)
      # A stand-in for ffmpeg stores the frames unchanged.
      mkdir bin
      printf '#!/bin/sh\nfor last; do :; done\ncat > "$last"\n' > bin/ffmpeg
      chmod +x bin/ffmpeg
      PATH=$PWD/bin:$PATH short_mode "$program" run small.toml --samples 0 --video out/v.mkv
      ;;
    replay)
      "$program" run small.toml --samples 0 --record kept.rec > run.log 2>&1 || fail "run: $(tail -n 3 run.log)"
      short_mode "$program" replay kept.rec --json out/j.json
      ;;
    check) short_mode "$program" check small.toml labels.nrrd --json out/j.json ;;
    compose) short_mode "$program" compose --out out/starter --force --json out/j.json ;;
    labels) short_mode "$program" compose --labels labels.nrrd --names labels.csv --out out/body --force \
      --json out/j.json ;;
    objects) short_mode "$program" compare small.toml --plot out/c.svg --json out/c.json --report out/page ;;
    scenes) short_mode "$program" compare small.toml small.toml --plot out/c.svg --json out/c.json --report out/page ;;
    measured)
      "$program" run small.toml --samples 0 --trace kept.csv > run.log 2>&1 || fail "run: $(tail -n 3 run.log)"
      short_mode "$program" compare small.toml --measured kept.csv --plot out/c.svg --json out/c.json --report out/page
      ;;
    models) with_scene bash -c 'rm -rf out/cache; exec "$@"' -- "$program" compare out/scene.toml --models \
      --cache out/cache --write-variants --plot out/m.svg --json out/m.json --report out/page ;;
    tune)
      long_mode 5 "$program" tune small.toml --quick --cache out/cache --plot out/t.svg --json out/t.json \
        --report out/page
      # The cache is still usable, so the same command must complete.
      "$program" tune small.toml --quick --cache out/cache --plot out/t.svg --json out/t.json > run.log 2>&1 ||
        fail "tune does not go on: $(tail -n 3 run.log)"
      check_files "tune, not killed" TERM
      ;;
    apply)
      kept_cache
      with_scene "$program" tune out/scene.toml --quick --cache kept --apply --json out/t.json --report out/page
      ;;
    study) with_scene bash -c 'rm -rf out/study; exec "$@"' -- "$program" study labels.nrrd --labels labels.nrrd \
      --names labels.csv --out out/study --json out/s.json ;;
    bench-rigid) short_mode "$program" bench rigid --quick --only slide --meshes ico1 --trace out/trace \
      --json out/b.json ;;
    bench-soft) short_mode "$program" bench soft --quick --only load,wave --sizes 16 --plot out/b.svg \
      --json out/b.json ;;
    bench-occupancy) short_mode "$program" bench occupancy --quick --only lookup --cells 1000 --plot out/b.svg \
      --json out/b.json ;;
    bench-scenes) short_mode "$program" bench small.toml --quick --json out/b.json ;;
    bench-threads) short_mode "$program" bench threads --scenes small.toml --seconds 0.2 --json out/b.json ;;
    stability) long_mode 5 "$program" stability "$scenes/wall.toml" --quick --plot out/s.svg --json out/s.json \
      --report out/page ;;
    extremes) short_mode "$program" stability "$scenes/wall.toml" --extremes --quick --json out/e.json ;;
    validate) long_mode 5 "$program" validate --quick --json out/v.json --report out/page ;;
    view)
      command -v Xvfb > /dev/null || { echo "view: skipped, there is no Xvfb" && return; }
      exec {said}<> <(:)
      Xvfb -displayfd "$said" -screen 0 800x600x24 > xvfb.log 2>&1 &
      local display=$!
      read -r -t 20 -u "$said" number && export DISPLAY=:$number
      short_mode "$program" view small.toml --frames 4 --width 320 --height 240 --out out/frames --record out/r.rec
      kill "$display"
      ;;
    *) fail "'$mode' is no mode; known are" $modes ;;
  esac
}

for mode in ${*:-$modes}; do
  rm -rf out
  mkdir out
  seen=()
  before=$signals
  in_mode
  echo "$mode: $((signals - before)) signals"
done
if ((failures > 0)); then exit 1; fi
echo "$signals signals, $reached while the program ran: every file was whole or not there"
