#!/bin/bash
# README's test command: installs what is missing, builds, runs the tests; ctest's summary comes last.
set -euo pipefail
cd "$(dirname "$0")/.."
. tests/setup.sh
# shellcheck disable=SC2086
install_packages $demo_packages $test_packages
cmake --workflow --preset check
