#!/bin/bash
# README's test command: installs what is missing, builds, runs the tests; ctest's summary comes last.
# With nvcc the CUDA backend is built too; tests of a GPU are skipped, with a reason, where none is.
set -euo pipefail
cd "$(dirname "$0")/.."
. tests/setup.sh
# shellcheck disable=SC2086
install_packages $demo_packages $test_packages
# waiting threads sleep: tests run side by side and some ask for more threads than there are cores
export OMP_WAIT_POLICY="${OMP_WAIT_POLICY:-passive}"
cmake --workflow --preset check
