#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# locale.sh PROGRAM SCENES FOLDER: the program must write the same bytes where a comma is the decimal point. The script
# makes the locale itself, and ends with status 77 if it cannot.
set -u
program=("$1") scenes=$2 folder=$3
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder" || exit 1
if ! command -v localedef > /dev/null || ! localedef -i de_DE -f UTF-8 "$PWD/de_DE.UTF-8" > localedef.log 2>&1; then
  echo "skipped: localedef cannot make de_DE (install the package locales)"
  exit 77
fi

sample() {
  mkdir -p "$1"
  "${program[@]}" run "$scenes/cube.toml" --samples 0 --seconds 0.5 --trace "$1/t.csv" --record "$1/r.rec" --plot "$1/p.svg" \
    --save-surface "$1/s.obj" > /dev/null || return 1
  "${program[@]}" compose --out "$1/starter" --force > /dev/null || return 1
  "${program[@]}" check "$1/s.obj" | sed 's/^[^:]*: //' > "$1/check.txt" || return 1
  cut -d, -f1-13 "$1/t.csv" > "$1/felt.csv" # without processor times
}

LC_ALL=C sample c || { echo "FAILED: the sample in the locale C"; exit 1; }
german=(env "LOCPATH=$PWD" LC_ALL=de_DE.UTF-8)
if [ "$("${german[@]}" printf '%.1f' 1)" != "1,0" ]; then
  echo "skipped: programs here do not take the locale that was made"
  exit 77
fi
program=("${german[@]}" "${program[@]}")
sample de || { echo "FAILED: the sample in the locale de_DE"; exit 1; }
for file in felt.csv r.rec s.obj starter/scene.toml check.txt; do
  cmp "c/$file" "de/$file" || { echo "FAILED: $file depends on the locale"; exit 1; }
done
grep -q '[0-9],[0-9]* *</text>' de/p.svg && { echo "FAILED: p.svg has a number with a comma"; exit 1; }
echo "the same bytes"
