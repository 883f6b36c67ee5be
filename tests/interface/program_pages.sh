#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# program_pages.sh PROGRAM FOLDER: the manual page must have every command and option of the help, and format without a
# warning. The completions of bash must offer commands, options, values and files.
set -euo pipefail
program=$1 folder=$2
rm -rf -- "$folder"
mkdir -p -- "$folder/more"
cd -- "$folder"
"$program" --man-page >hybrid.1
"$program" --bash-completion >hybrid.bash

fail() {
  printf 'wrong: %s\n' "$1"
  exit 1
}

# Commands, as the help lists them.
mapfile -t commands < <("$program" --help | sed -n '/^Subcommands:/,$s/^  \([a-z]\+\) .*/\1/p')
((${#commands[@]} >= 11)) || fail "only ${#commands[@]} commands in the help"
plain=$(sed -e 's/\\f[BIR]//g' -e 's/\\-/-/g' -e 's/\\://g' hybrid.1)
for command in "${commands[@]}"; do
  section=$(awk -v name=".SS hybrid $command" '$0 == name { inside = 1; next } /^\.SS / && inside { exit } inside' <<<"$plain")
  [[ -n $section ]] || fail "hybrid $command is not in the manual page"
  mapfile -t options < <("$program" "$command" --help | sed -n 's/^  \(--[a-z-]\+\).*/\1/p')
  ((${#options[@]} > 0)) || fail "no options in the help of $command"
  for option in "${options[@]}"; do
    grep -Eq "^$option( |\$)" <<<"$section" || fail "$option is not in the manual page of hybrid $command"
  done
done
if command -v groff >/dev/null; then
  warnings=$(groff -man -Tutf8 -ww -z hybrid.1 2>&1) || fail 'groff refuses the manual page'
  [[ -z $warnings ]] || fail "the manual page: $warnings"
fi

# offered WORDS…: prints the completions of the last word.
# shellcheck disable=SC1091 # the program has just written it
source ./hybrid.bash
offered() {
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  _hybrid
  printf '%s\n' "${COMPREPLY[@]-}" | sort | tr '\n' ' '
}
# offers EXPECTED WORDS…: the completions of the last word must be EXPECTED.
offers() {
  local expected=$1 found
  shift
  found=$(offered "$@")
  [[ ${found% } == "$expected" ]] || fail "\`$*\` offers '${found% }', not '$expected'"
}
touch a.toml b.toml notes.txt 'two words.toml' s.rec more/c.toml
all=$(printf '%s\n' "${commands[@]}" | sort | tr '\n' ' ')
offers "${all% }" hybrid ''
offers 'compare compose' hybrid comp
offers 'a.toml b.toml more two words.toml' hybrid run ''
offers 'more/c.toml' hybrid run --realtime more/
offers 's.rec' hybrid replay s
offers 'full quick' hybrid run a.toml --reference ''
offers 'full' hybrid run a.toml --reference = f
offers 'full quick' hybrid run a.toml --reference =
offers '--realtime --record --reference --relaxation --report' hybrid run a.toml --re
offers '' hybrid run a.toml --seconds ''
offers 'slide,tap' hybrid bench rigid --only slide,ta
offers 'soft' hybrid bench so
offers '--all' hybrid bench compare --a
offers 'notes.txt' hybrid bench compare n
offers 'cm' hybrid check --unit c
echo 'pages and completions are those of the help'
