#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds everything and runs every test. Ends in ctest's own summary, with ctest's exit status.
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/../cmake/setup.sh"

read_options 'Builds everything and runs every test.' "$@"
install_packages
build all

# The last stage is begun but not ended: ctest has the last word.
stage "test (set-up took $SECONDS s)"
exec ctest --test-dir "$hybrid_root/build/release" --output-on-failure --parallel 2
