#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# exports.sh LIBRARY LIST: the library must export the functions of the list, with their version, and nothing else.
set -euo pipefail
found=$(nm --dynamic --defined-only --extern-only "$1" | awk '$2 != "A" { print $3 }' | sort)
expected=$(sed 's/$/@@HYBRID_1/' "$2" | sort)
if ! diff <(printf '%s\n' "$expected") <(printf '%s\n' "$found"); then
  echo "exported functions (>) are not those of $2 (<); a change needs a new node in interface/exports.map"
  exit 1
fi
echo "$(wc -l <"$2") functions, as listed"
