#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# video.sh PROGRAM SCENES FOLDER: `view --video` hands every frame to ffmpeg, and writes a video whole or not at all.
# A stand-in for ffmpeg stores the frames as they come. Without a display, the test is skipped.
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
view=("$program" view "$scenes/wall.toml" --frames 3 --video v.mp4)

PATH=$folder/good:$PATH "${view[@]}" > log 2>&1 || fail "a good ffmpeg: $(cat log)"
size=$(grep -oE '[0-9]+x[0-9]+' words | head -1)
[ "$(stat -c %s v.mp4)" = $((3 * 3 * ${size%x*} * ${size#*x})) ] || fail "three frames of $size are not in the video"

echo old > v.mp4
PATH=$folder/bad:$PATH "${view[@]}" > log 2>&1 && fail "a bad ffmpeg passes"
grep -q "ffmpeg" log || fail "the error does not name ffmpeg"
[ "$(cat v.mp4)" = old ] || fail "a video that failed replaced the old one"
[ "$(find . -maxdepth 1 -type f | wc -l)" = 3 ] || fail "files are left: $(ls -A)"

PATH=$folder/none "${view[@]}" > log 2>&1 && fail "no ffmpeg passes"
grep -q "not installed.*--out FOLDER" log || fail "the remedy is missing: $(cat log)"
exit $((failures > 0))
