#!/bin/sh
# Test of bench/gaps.sh on a made-up trajectory: gaps.sh ROOT. Gaps 0.1 and 0.01, one of them over the edge; other diameters are refused.
set -u
root=$1
command -v ncgen >/dev/null && command -v ncdump >/dev/null || exit 77
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# trajectory RADIUS: t.nc of two frames of three discs in a box of 10 by 8
trajectory() {
    ncgen -o "$folder/t.nc" <<END
netcdf t {
dimensions: frame = UNLIMITED; atom = 3; spatial = 3; cell_spatial = 3;
variables: double time(frame); float radius(atom); double coordinates(frame, atom, spatial);
 double cell_lengths(frame, cell_spatial);
data: time = 0, 0.5; radius = 0.5, 0.5, $1; cell_lengths = 10, 8, 0, 10, 8, 0;
 coordinates = 9.9, 4, 0, 0.91, 4, 0, 0.91, 5.1, 0,
  1, 0.1, 0, 1, 7.0, 0, 5, 4, 0;
}
END
}
trajectory 0.5
expected='time 0: below 0.25 2 pairs, mean 5.500e-02; below 0.02 1, 1.000e-02
time 0.5: below 0.25 1 pairs, mean 1.000e-01; below 0.02 0, nan'
seen=$(sh "$root/bench/gaps.sh" "$folder/t.nc" | tail -n 2)
[ "$seen" = "$expected" ] || { printf 'expected\n%s\nseen\n%s\n' "$expected" "$seen"; exit 1; }
trajectory 0.7
if sh "$root/bench/gaps.sh" "$folder/t.nc" >/dev/null 2>&1; then
    echo "a disc of diameter 1.4 was taken for one of 1"
    exit 1
fi
if sh "$root/bench/gaps.sh" "$folder/none.nc" >/dev/null 2>&1; then
    echo "a file that is not there: exit status 0"
    exit 1
fi
