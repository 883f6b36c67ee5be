#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# lost_display.sh PROGRAM SCENES FOLDER: a window that is destroyed, or whose display server dies, ends the session with
# a message. The recording is kept and replays. Without the server Xvfb, the test is skipped.
set -u
program=$1 scenes=$2 folder=$3
failures=0
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder" || exit 1
command -v Xvfb > /dev/null || exit 77
export XDG_STATE_HOME=$folder/state # the list of recent scenes

fail() {
  echo "FAILED: $*"
  failures=$((failures + 1))
}

# begin_session: starts a server with a free number and a session on it. Waits until the session has shown pictures.
begin_session() {
  rm -f r.rec seen.png view.log
  : > number # before the server opens it
  Xvfb -displayfd 3 -screen 0 1300x1000x24 3> number > server.log 2>&1 &
  server=$!
  for ((n = 0; n < 300 && $(wc -c < number) == 0; ++n)); do sleep 0.1; done
  printf '1 picture seen.png\n' > user.txt
  DISPLAY=:$(cat number) "$program" view "$scenes/cube.toml" --script user.txt --record r.rec > view.log 2>&1 &
  session=$!
  for ((n = 0; n < 600; ++n)); do
    [ -e seen.png ] && break
    sleep 0.1
  done
  [ -e seen.png ] || fail "no window: $(cat view.log)"
}

# check_end WORDS: the session must end with these words, and its recording must replay.
check_end() {
  local status
  wait "$session"
  status=$?
  [ "$status" = 1 ] || fail "$1: exit status $status: $(cat view.log)"
  grep -q "the session ended: .*$1" view.log || fail "$1: not said: $(cat view.log)"
  "$program" replay r.rec > replay.log 2>&1 || fail "$1: the recording does not replay: $(cat replay.log)"
  grep -q "^equal" replay.log || fail "$1: the recording does not replay: $(cat replay.log)"
}

begin_session
kill -9 "$server"
check_end "the connection to the display is broken"
wait "$server"

if command -v xdotool > /dev/null; then
  begin_session
  export DISPLAY=:$(cat number)
  xdotool windowclose "$(xdotool search --name hybrid | head -1)"
  check_end "the display no longer has the window"
  kill "$server"
  wait "$server"
fi
exit $((failures > 0))
