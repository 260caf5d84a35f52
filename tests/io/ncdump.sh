#!/bin/sh
# Test that ncdump opens our trajectories without a word of complaint: ncdump.sh SAMPLE.
set -eu
if ! command -v ncdump >/dev/null; then
    echo "ncdump was not found: install netcdf-bin"
    [ -z "${GBG_TESTS_MAY_SKIP:-}" ] || exit 77
    exit 1
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$1" "$work"
for name in plain all flat solid; do
    kind=$(ncdump -k "$work/$name.nc")
    [ "$kind" = "64-bit offset" ] || { echo "$name.nc is of kind $kind"; exit 1; }
    ncdump "$work/$name.nc" >"$work/out" 2>"$work/err"
    [ ! -s "$work/err" ] || { cat "$work/err"; exit 1; }
    for line in 'frame = UNLIMITED ; // (4 currently)' 'atom = 137 ;' 'spatial = 3 ;' \
        ':Conventions = "AMBER" ;' ':ConventionVersion = "1.0" ;' ' spatial = "xyz" ;' \
        ' cell_spatial = "abc" ;' 'coordinates(frame, atom, spatial) ;' \
        ' step_number = 10, 11, 12, 13 ;'; do
        grep -qF -- "$line" "$work/out" || { echo "$name.nc lacks: $line"; exit 1; }
    done
done
