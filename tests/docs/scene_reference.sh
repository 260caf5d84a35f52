#!/bin/sh
# scene_reference.sh [--check] BUILD: makes the tables of docs/scene_reference.md again with the
# program of the build folder; with --check only compares.
set -eu
check=
[ "$1" = --check ] && { check=yes; shift; }
document=$(cd "$(dirname "$0")/../.." && pwd)/docs/scene_reference.md
fresh=$(mktemp)
trap 'rm -f "$fresh"' EXIT
"$1/tests/docs/scene_reference" "$document" >"$fresh"
if [ "$check" ]; then
    diff "$document" "$fresh" || { echo "run tests/docs/scene_reference.sh BUILD"; exit 1; }
else
    cat "$fresh" >"$document"
fi
