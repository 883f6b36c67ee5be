#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# stop.sh PROGRAM SCENES FOLDER: signals end a session properly. All requested files are written, and cover the
# ticks that were played.
set -u
program=$1 scenes=$2 folder=$3
failures=0
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder" || exit 1

fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

# The session would last far longer than the time until the signal.
session=("$program" run "$scenes/cube.toml" --seconds 2000 --samples 0 --trace t.csv --record r.rec --json j.json)

# stopped SIGNAL STATUS WORDS WHEN COMMAND…: sends the signal settle_s seconds after the command has printed WHEN.
settle_s=0
stopped() {
  local signal=$1 wanted=$2 words=$3 when=$4 process status n
  shift 4
  rm -f t.csv r.rec j.json
  "$@" > run.log 2>&1 &
  process=$!
  for ((n = 0; n < 600; ++n)); do
    grep -q "$when" run.log && break
    sleep 0.1
  done
  sleep "$settle_s"
  kill "-$signal" "$process"
  wait "$process"
  status=$?
  [ "$status" = "$wanted" ] || fail "$signal: status $status, not $wanted"
  grep -q "$words" run.log || fail "$signal: '$words' was not said, but: $(tail -n 3 run.log)"
}

for mode in "" --realtime; do
  when="tick [0-9]" settle_s=0
  # In real time a running session prints nothing. The build prints its notes soon before the first tick.
  [ -z "$mode" ] || when="note: block" settle_s=6
  for signal in INT TERM; do
    status=130 name=Ctrl-C
    [ $signal = TERM ] && status=143 name=SIGTERM
    # shellcheck disable=SC2086
    stopped $signal $status "stopped by $name after .* s of 2000.00 s; trace, recording, report were written" "$when" \
      "${session[@]}" $mode
    grep -q '"end": "stopped"' j.json || fail "the report does not say that it was stopped"
    ticks=$(sed -n 's/^  "ticks": \([0-9]*\),/\1/p' j.json)
    rows=$(($(wc -l < t.csv) - 1))
    if [ "$ticks" != "$rows" ] || [ "$rows" = 0 ]; then
      fail "$ticks ticks in the report, $rows rows in the trace"
    fi
    "$program" replay r.rec > replay.log 2>&1 || fail "the recording does not replay: $(cat replay.log)"
    grep -q "equal: $ticks ticks" replay.log || fail "the replay is not of $ticks ticks: $(cat replay.log)"
  done
done

# From a terminal, Ctrl-C also reaches the child processes of the program. A stand-in for ffmpeg stores the frames
# unchanged. It does not handle the signal, so the signal ends it.
mkdir bin
printf '#!/bin/sh\nfor last; do :; done\ncat > "$last"\n' > bin/ffmpeg
chmod +x bin/ffmpeg
PATH=$PWD/bin:$PATH setsid env --default-signal=INT "$program" run "$scenes/wall.toml" --seconds 2000 --samples 0 \
  --video v.mkv > run.log 2>&1 &
process=$!
for ((n = 0; n < 600; ++n)); do
  grep -q "tick [0-9]" run.log && break
  sleep 0.1
done
kill -INT -- "-$process"
wait "$process"
status=$?
[ "$status" = 130 ] || fail "a video, INT: status $status, not 130"
[ -s v.mkv ] || fail "the video was lost: $(tail -n 3 run.log)"

settle_s=0
# A study keeps its finished rows. Its first message must come long before its end.
stopped INT 130 "stopped by Ctrl-C after .* rows; report was written" "^slide" \
  "$program" bench rigid --only slide --meshes ico2,ico3,ico5,ico6,ico7 --json j.json
grep -q '"stopped": true' j.json || fail "the report of bench does not say that it was stopped"
stopped INT 130 "stopped by Ctrl-C after .* rows; report was written" "of [0-9]*: stable" \
  "$program" stability "$scenes/wall.toml" --json j.json
grep -q '"stopped": true' j.json || fail "the report of stability does not say that it was stopped"

# If there is nothing to keep, the command ends at once and leaves no file.
stopped INT 130 "by Ctrl-C" "left: the truth" "$program" compare "$scenes/head.toml" --models --json j.json
[ ! -e j.json ] || fail "compare left a report"
if ((failures > 0)); then exit 1; fi
echo "all was kept"
