#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# readme.sh README FOLDER INCLUDE LIBRARY [PYTHON]: the README's scene, C program and Python program must do what
# the README says.
set -euo pipefail
readme=$1 folder=$2 include=$3 library=$4 python=${5-}
mkdir -p -- "$folder"
# block LANGUAGE WORD: prints the first block of the language that contains the word.
block() {
  awk -v fence="\`\`\`$1" -v word="$2" '
    $0 == fence { inside = 1; text = ""; next }
    inside && /^```/ { inside = 0; if (index(text, word)) { printf "%s", text; exit } }
    inside { text = text $0 "\n" }' "$readme"
}
block toml 'format = 1' >"$folder/mine.toml"
block c '#include <hybrid.h>' >"$folder/mine.c"
block python 'import hybrid' >"$folder/mine.py"
cd -- "$folder"
cc -std=c11 -Wall -Wextra -Wpedantic -Werror -I "$include" mine.c "$library" "-Wl,-rpath,$(dirname -- "$library")" -o mine
./mine
if [[ -n $python ]]; then
  HYBRID_LIBRARY=$library PYTHONPATH=$include PYTHONDONTWRITEBYTECODE=1 "$python" mine.py
fi
echo 'the README is right'
