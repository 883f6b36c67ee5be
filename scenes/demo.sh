#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# On a bare Debian 12: builds the program, runs a session with a head, and draws a plot of the force and a picture.
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/../cmake/setup.sh"

read_options 'Builds the program, touches scenes/head.toml, and draws what was felt into out/.' "$@"
install_packages
build hybrid_program

stage 'touch scenes/head.toml'
cd -- "$hybrid_root"
mkdir -p out
build/release/hybrid run scenes/head.toml --plot out/head.svg --picture out/head.png --trace out/head.csv \
  --json out/head.json
stage
say ''
say "what the hand felt: $hybrid_root/out/head.svg"
say "the scene:          $hybrid_root/out/head.png"
say "every tick:         $hybrid_root/out/head.csv"
say "the report:         $hybrid_root/out/head.json"
say "Done in $SECONDS s."
