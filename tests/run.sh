#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds everything and runs every test, or with --fast those that take two minutes together. Ends in ctest's own
# summary, with ctest's exit status.
# shellcheck source-path=SCRIPTDIR source=../cmake/setup.sh
source "$(dirname -- "${BASH_SOURCE[0]}")/../cmake/setup.sh"

hybrid_flags=(--fast)
hybrid_flag_help=('--fast        only the tests that take two minutes together; says how many were left out')
read_options 'Builds everything and runs every test.' "$@"
install_packages
build all

tests=$hybrid_root/build/release
labels=()
if given --fast; then
  labels=(-L fast)
  left_out=$(ctest --test-dir "$tests" -N -LE fast | sed -n 's/^Total Tests: //p')
  say "fast: $left_out tests are left out (label slow); bash tests/run.sh runs them all"
fi

# The last stage has no end, because ctest replaces this script.
stage "test (set-up took $SECONDS s)"
exec ctest --test-dir "$tests" --output-on-failure --parallel 2 "${labels[@]}"
