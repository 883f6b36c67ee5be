#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# video.sh PROGRAM SCENES FOLDER: `view --video` and `run --video` hand every frame to ffmpeg, and write a video whole
# or not at all. A stand-in for ffmpeg stores the frames unchanged. Without a display, the test is skipped.
set -u
program=$1 scenes=$2 folder=$3
failures=0
rm -rf "$folder"
mkdir -p "$folder/good" "$folder/bad" "$folder/none"
cd "$folder" || exit 1
[ -n "${DISPLAY:-}" ] || exit 77

fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

printf '#!/bin/sh\nfor last; do :; done\necho "$@" > words\ncat > "$last"\n' > good/ffmpeg
printf '#!/bin/sh\nfor last; do :; done\nhead -c 1000 > "$last"\nexit 1\n' > bad/ffmpeg
chmod +x good/ffmpeg bad/ffmpeg

# check FRAMES COMMAND...: with a good ffmpeg, the command must write v.mp4 with this number of frames. With a bad one,
# it must fail and leave the old file.
check() {
  local frames=$1 size
  shift
  rm -f v.mp4 words log
  PATH=$folder/good:$PATH "$@" > log 2>&1 || fail "a good ffmpeg: $(cat log)"
  size=$(grep -oE '[0-9]+x[0-9]+' words | head -1)
  [ "$(stat -c %s v.mp4)" = $((frames * 3 * ${size%x*} * ${size#*x})) ] ||
    fail "$frames frames of $size are not in the video"

  echo old > v.mp4
  PATH=$folder/bad:$PATH "$@" > log 2>&1 && fail "a bad ffmpeg passes"
  grep -q "ffmpeg" log || fail "the error does not name ffmpeg"
  [ "$(cat v.mp4)" = old ] || fail "a video that failed replaced the old one"
  [ "$(find . -maxdepth 1 -type f | wc -l)" = 3 ] || fail "files are left: $(ls -A)"

  PATH=$folder/none "$@" > log 2>&1 && fail "no ffmpeg passes"
  grep -q "not installed.*--out FOLDER" log || fail "the remedy is missing: $(cat log)"
}

check 3 "$program" view "$scenes/wall.toml" --frames 3 --video v.mp4
check 4 "$program" run "$scenes/wall.toml" --seconds 0.11 --samples 0 --video v.mp4
"$program" run "$scenes/wall.toml" --video v.mp4 --realtime > log 2>&1 && fail "a video in real time passes"
grep -q "leave out --realtime" log || fail "the remedy is missing: $(cat log)"
exit $((failures > 0))
