#!/bin/bash
# README's first command: installs what is missing, builds, runs the main job, says where the
# results are. demo.sh [RESULT_DIR]: default results/.
set -euo pipefail
results=$(realpath -m "${1:-"$(dirname "$0")/../results"}")
cd "$(dirname "$0")/.."
. tests/setup.sh
# shellcheck disable=SC2086
install_packages $demo_packages
cmake --preset default -DGBG_BUILD_TESTS=OFF
cmake --build --preset default
bash examples/main_job.sh build/default "$results"
echo "results are in $results"
