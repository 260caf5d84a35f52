#!/bin/sh
# Test of the shared libraries: opening.sh PROGRAM LIBGAMBOGE. The program runs with libgamboge where it
# is, then with a copy of it that stands alone.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$1" "$2"
cp "$2" "$work/libgamboge.so"
cd "$work"
"$1" "$work/libgamboge.so" absent
