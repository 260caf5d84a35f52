#!/bin/sh
# The preset minimal, from configuring to its fast tests: minimal.sh CMAKE CTEST BUILD_DIR CC WERROR.
set -eu
"$1" --preset minimal -B "$3" -DCMAKE_C_COMPILER="$4" -DGBG_WERROR="$5" >/dev/null
"$1" --build "$3"
"$2" --test-dir "$3" -L fast --output-on-failure
