#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# install.sh BUILD FOLDER [PYTHON]: installs the build below the folder. Builds and runs programs against the
# installed files alone: through CMake, through pkg-config, and from Python if PYTHON is given. The tree is moved after
# its installation, because no file in it may name its first place.
set -euo pipefail
build=$1 folder=$2 python=${3-} here=$(cd -- "$(dirname -- "$0")" && pwd)
rm -rf -- "$folder"
mkdir -p -- "$folder"
cmake --install "$build" --prefix "$folder/first" >"$folder/install.log"
mv -- "$folder/first" "$folder/prefix"
prefix=$folder/prefix
cd -- "$folder"

example=$(find "$prefix/share/doc" -name press.c)
scene=$prefix/share/hybrid/scenes/cube.toml
libdir=$(dirname -- "$(find "$prefix" -name libhybrid.so)")

cmake -S "$here/outside" -B by-cmake -DCMAKE_PREFIX_PATH="$prefix" -DPRESS="$example" >cmake.log
cmake --build by-cmake >>cmake.log
by-cmake/press "$scene" >by-cmake.txt
"$prefix/bin/hybrid" replay press.rec | grep 'equal: 1000 ticks'

export PKG_CONFIG_PATH=$libdir/pkgconfig
# shellcheck disable=SC2046 # options are words
cc -std=c11 -Wall -Wextra -Werror "$example" $(pkg-config --cflags --libs hybrid) -o by-pkg-config
LD_LIBRARY_PATH=$libdir ./by-pkg-config "$scene" >by-pkg-config.txt
cmp by-cmake.txt by-pkg-config.txt
echo "pkg-config says version $(pkg-config --modversion hybrid)"

if [[ -n $python ]]; then
  PYTHONPATH=$prefix/lib/python3/dist-packages "$python" "$(dirname -- "$example")/press.py" "$scene" press.svg
fi
echo 'installed, found and used'
