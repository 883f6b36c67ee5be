#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# window.sh PROGRAM FOLDER SCENE...: simulates a user with mouse and keys in the window of each scene. The session must
# end well, the driver report no error, every picture be written, and the recording replay. $PAUSE_S: seconds between two
# actions (0.15). Without Xvfb and xdotool, the test is skipped.
set -u
program=$1 folder=$2
shift 2
failures=0
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder" || exit 1
command -v Xvfb xdotool > /dev/null || exit 77
export MESA_DEBUG=1 # makes Mesa write every error of a call
export XDG_STATE_HOME=$folder/state
pause_s=${PAUSE_S:-0.15}

fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

# keys NAME...: presses and releases each key.
keys() {
  local key
  for key in "$@"; do
    xdotool key "$key"
    sleep "$pause_s"
  done
}

# drag BUTTON X Y TO_X TO_Y: drags without releasing the button. Places are in pixels of the window.
drag() {
  xdotool mousemove "$2" "$3" mousedown "$1"
  for n in 1 2 3 4; do
    xdotool mousemove $(($2 + ($4 - $2) * n / 4)) $(($3 + ($5 - $3) * n / 4))
    sleep "$pause_s"
  done
}

# await FILE: waits until the file exists. Fails if it does not appear.
await() {
  for ((n = 0; n < 1800; ++n)); do
    [ -e "$1" ] && return 0
    kill -0 "$session" 2> /dev/null || break
    sleep 0.1
  done
  fail "$name: $1 is missing: $(tail -3 view.log)"
  return 1
}

# visit SCENE: does more than twenty actions of a user. A script does some of them at given times: it compares models of
# the tissue, changes the tissue's energy, place and model, and changes the tool's stiffness.
visit() {
  local name window tissue
  name=$(basename "$1" .toml)
  mkdir "$name"
  cp -r "$(dirname "$1")/." "$name/scene"
  cd "$name" || exit 1
  printf '0.2 picture begin.png\n0.3 stack on\n0.3 watch tick\n' > user.txt
  tissue=$(awk '/^\[/ {soft = /^\[\[soft\]\]/} soft && /^name/ {print; exit}' "$1" | cut -d'"' -f2)
  if [ -n "$tissue" ]; then # actions that a scene does not allow are refused
    cat >> user.txt <<- END
	1 select "$tissue"
	1.5 difference "$tissue" as-is rigid 1 1000
	3 difference off
	4 energy "$tissue" trilinear
	6 move "$tissue" 0.5 0 0
	8 model "$tissue" rigid
	10 model "$tissue" voxels
	11 edit tool stiffness 500
	END
  fi
  "$program" view "scene/$name.toml" --script user.txt --record r.rec --width 1280 --height 900 > view.log 2>&1 &
  session=$!
  if ! await begin.png; then
    cd ..
    return
  fi
  window=$(xdotool search --onlyvisible --name hybrid | head -1)
  xdotool windowmove "$window" 0 0 windowfocus "$window"
  sleep "$pause_s"

  drag 3 400 450 420 560           # 1 the tool is pulled, into contact where something is below it
  xdotool click --repeat 4 4 click 5 # and in depth
  keys c v                         # 2 a view of the contact, 3 slices
  drag 1 300 300 360 340           # 4 the view turns
  xdotool mouseup 1 click 4 click 5
  keys m m m m g v                 # 5 recoloured, 6 grey values
  xdotool mouseup 3                # 7 the tool is let go
  keys k bracketright bracketright bracketleft k # 8 a clip plane
  keys p && await "$name-1.png"    # 9 a picture
  keys space n n 3 space 2 1       # 10 pause, 11 single ticks, 12 slow motion
  keys e                           # 13 the force at rest
  keys o && drag 1 420 450 440 430 && xdotool mouseup 1 # 14 arrows
  keys o x y z f t h h i i         # 15 views, 16 dark, 17 without a panel
  keys comma b e                   # 18 the past, from which the session goes on
  echo 'nonsense' >> "scene/$name.toml" # 19 the file is broken, and mended
  sleep 2
  keys p && await "$name-2.png"
  sed -i '$d' "scene/$name.toml"
  sleep 1
  keys Tab Down Down Return Escape # 20 the panel by keys
  keys w && await "$name-1.rec"    # 21 a recording
  xdotool windowsize "$window" 700 560 # 22 other sizes
  sleep 0.5
  xdotool windowsize "$window" 2560 1800
  sleep 0.5
  keys p && await "$name-3.png"
  keys l                           # 23 the file is loaded again
  sleep 1
  cp "scene/$name.toml" before.toml
  keys ctrl+s                      # 24 saved
  drag 3 900 900 920 1000
  xdotool mouseup 3
  keys p && await "$name-4.png"
  keys Escape                      # 25 closed
  wait "$session" || fail "$name: exit status $?: $(tail -3 view.log)"
  grep -q "User error\|GL_INVALID" view.log && fail "$name: $(grep -m3 "User error\|GL_INVALID" view.log)"
  cp "scene/$name.toml" saved.toml
  for recording in "$name-1.rec" r.rec; do # the last one may be of the saved text
    cp before.toml "scene/$name.toml"
    "$program" replay "$recording" > replay.log 2>&1 && continue
    cp saved.toml "scene/$name.toml"
    "$program" replay "$recording" > replay.log 2>&1 || fail "$name: $recording does not replay: $(cat replay.log)"
  done
  cp saved.toml "scene/$name.toml"
  "$program" check "scene/$name.toml" > check.log 2>&1 || fail "$name: the saved scene is refused: $(cat check.log)"
  cd ..
}

# offered SCENE: a window without a scene offers some. Files are opened as if they were dropped: those that are broken or
# no scene are refused, and what was shown goes on; a mesh is added; another scene takes the place of the first.
offered() {
  name=offered
  mkdir "$name"
  cd "$name" || exit 1
  cp "$1" first.toml
  sed 's/^title = .*/title = "second"/' "$1" > second.toml
  echo 'format = 1 nonsense' > broken.toml
  printf 'solid s\nendsolid s\n' > empty.stl
  printf 'OFF\n4 4 0\n200 0 0\n205 0 0\n200 5 0\n200 0 5\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n' > corner.off
  cat > user.txt <<- END
	0.1 picture list.png
	0.2 open $PWD/broken.toml
	1.2 picture refused.png
	1.3 open $PWD/first.toml
	END
  # What follows counts from the opening of the window, so it waits long enough for the scene to be built.
  cat >> user.txt <<- END
	8 open $PWD/broken.toml
	9 open $PWD/empty.stl
	10 open $PWD/scan.nii.gz
	11 open $PWD/corner.off
	14 trail on
	14 wires on
	15 picture added.png
	15.1 record added.rec
	15.2 open $PWD/second.toml
	20 picture second.png
	20.5 record second.rec
	21 quit
	END
  "$program" view --script user.txt --width 1280 --height 900 > view.log 2>&1 &
  session=$!
  for file in list.png refused.png added.png added.rec second.png second.rec; do await "$file"; done
  wait "$session" || fail "$name: exit status $?: $(tail -3 view.log)"
  grep -q "User error\|GL_INVALID" view.log && fail "$name: $(grep -m3 "User error\|GL_INVALID" view.log)"
  for recording in added.rec second.rec; do
    "$program" replay "$recording" > replay.log 2>&1 || fail "$name: $recording does not replay: $(cat replay.log)"
  done
  grep -q corner added.rec || fail "$name: the mesh was not added"
  printf '%s\n' "$PWD/second.toml" "$PWD/first.toml" | cmp -s - "$XDG_STATE_HOME/hybrid/recent" ||
    fail "$name: the list of recent scenes is $(cat "$XDG_STATE_HOME/hybrid/recent")"
  cd ..
}

touch number # before the server opens it
Xvfb -displayfd 3 -screen 0 2600x1900x24 3> number > server.log 2>&1 &
server=$!
for ((n = 0; n < 300 && $(wc -c < number) == 0; ++n)); do sleep 0.1; done
DISPLAY=:$(cat number)
export DISPLAY
offered "$1"
for scene in "$@"; do visit "$scene"; done
kill "$server"
wait "$server" 2> /dev/null
exit $((failures > 0))
