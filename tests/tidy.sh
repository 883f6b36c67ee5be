#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs clang-tidy over the sources, in the batches of the build (CMAKE_UNITY_BUILD). A batch reads the headers that its
# sources share only once. Exit status 0 means that nothing was found.
#
#     bash tests/tidy.sh                        # all sources
#     bash tests/tidy.sh hybrid/tick tests/voxel/chain/test_wave.cpp    # only batches with sources whose paths begin so
#     JOBS=1 bash tests/tidy.sh                 # one process (1.5 GB each); default: one for each core
set -euo pipefail
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."
root=$PWD
readonly root build=build/lint

# Configures without precompiled headers, because clang cannot read those of g++.
cmake --preset debug -B "$build" -D CMAKE_DISABLE_PRECOMPILE_HEADERS=ON -D CMAKE_UNITY_BUILD=ON \
  -D CMAKE_UNITY_BUILD_BATCH_SIZE=16 >"$root/$build.log" 2>&1 || { cat "$root/$build.log" >&2; exit 2; }

# The sources of a batch, or of a file that is compiled by itself: paths from the root.
sources_of() {
  case $1 in
    */Unity/unity_*) sed -n 's/^#include "\(.*\)"$/\1/p' "$1" ;;
    *) printf '%s\n' "$1" ;;
  esac | sed "s|^$root/||"
}

# The .clang-tidy for the folder of the first source. By itself, clang-tidy would look beside the batch's own file.
settings_of() {
  local folder
  folder=$(dirname -- "$1")
  while [[ ! -e $folder/.clang-tidy ]]; do folder=$(dirname -- "$folder"); done
  printf '%s\n' "$folder/.clang-tidy"
}

lint() {
  local file=$1 sources flags=() first found
  sources=$(sources_of "$file")
  first=${sources%%$'\n'*}
  # A batch consists of included sources.
  if [[ $file == */Unity/* ]]; then flags+=(--checks=-bugprone-suspicious-include); fi
  # ITK's headers accept only GNU compilers.
  # shellcheck disable=SC2086
  if grep -qsE 'itk[A-Z]\w*\.h|write_volume\.h' $sources; then
    flags+=(--extra-arg=-U__clang__ --extra-arg=-fgnuc-version=10.2.0)
  fi
  if found=$(clang-tidy --quiet -p "$build" --config-file="$(settings_of "$first")" \
    --header-filter='/(polygon|voxel|device|hybrid|interface|tests)/.*\.(h|cpp|c)$' \
    --extra-arg=-Wno-unknown-warning-option --extra-arg=-Wno-subobject-linkage "${flags[@]}" "$file" 2>"$build.$$.err"); then
    rm -f "$build.$$.err"
    printf 'clean: %s and %d more\n' "$first" $(($(wc -l <<<"$sources") - 1))
  else
    printf 'FOUND in the batch of %s:\n%s\n%s\n' "$first" "$found" "$(grep -v 'warnings\? generated' "$build.$$.err")"
    rm -f "$build.$$.err"
    return 1
  fi
}
export -f sources_of settings_of lint
export root build

# All files of the build that hold sources under the given paths.
chosen() {
  local file source path
  while read -r file; do
    for source in $(sources_of "$file"); do
      if [[ $source == build/* ]]; then continue; fi
      for path in "${@:-}"; do
        if [[ $source == "$path"* ]]; then
          printf '%s\n' "$file"
          continue 3
        fi
      done
    done
  done < <(sed -n 's/^ *"file": "\(.*\)",\?$/\1/p' "$build/compile_commands.json" | sort -u)
}

files=$(chosen "$@")
if [[ -z $files ]]; then
  printf 'error: no source has a path that begins with: %s\n' "$*" >&2
  exit 2
fi
printf '%d batches\n' "$(wc -l <<<"$files")"
# shellcheck disable=SC2016
xargs -P "${JOBS:-$(nproc)}" -I{} bash -c 'lint "$1"' lint {} <<<"$files"
