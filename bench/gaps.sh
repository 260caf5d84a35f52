#!/bin/sh
# Mean gaps of neighbours in trajectories of discs of diameter 1: gaps.sh T.nc... (needs ncdump of netcdf-bin).
# A line for every frame: time, and pairs and mean of the gaps below 0.25 and below 0.02 (nan: no pair).
set -eu
[ $# -gt 0 ] || { echo "usage: gaps.sh TRAJECTORY.nc..." >&2; exit 2; }
command -v ncdump >/dev/null || { echo "gaps.sh: needs ncdump (Debian: netcdf-bin)" >&2; exit 2; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

for file in "$@"; do
    ncdump -p 9,17 -v coordinates,cell_lengths,radius,time "$file" >"$folder/text" || exit 1
    echo "$file"
    awk '
        function nearest(d, length_) { return d - length_ * int(d / length_ + (d < 0 ? -0.5 : 0.5)) }
        function mean(sum, n) { return n ? sprintf("%.3e", sum / n) : "nan" }
        /^ (coordinates|cell_lengths|radius|time) =/ { name = $1; sub(/.*=/, "") }
        name { n = split($0, word, /[ ,;]+/); for (i = 1; i <= n; i++) if (word[i] != "") value[name, count[name]++] = word[i] }
        /;/ { name = "" }
        END {
            particles = count["radius"]
            for (i = 0; i < particles; i++) if (value["radius", i] != 0.5) { print "not all diameters are 1"; exit 1 }
            for (frame = 0; frame < count["time"]; frame++) {
                pairs = near_pairs = sum = near_sum = 0
                width = value["cell_lengths", 3 * frame]; height = value["cell_lengths", 3 * frame + 1]
                for (i = 0; i < particles; i++) {
                    x[i] = value["coordinates", 3 * (frame * particles + i)]
                    y[i] = value["coordinates", 3 * (frame * particles + i) + 1]
                    for (j = 0; j < i; j++) {
                        dx = nearest(x[i] - x[j], width)
                        if (dx > 1.25 || dx < -1.25) continue
                        dy = nearest(y[i] - y[j], height)
                        gap = sqrt(dx * dx + dy * dy) - 1
                        if (gap < 0.25) { sum += gap; pairs++ }
                        if (gap < 0.02) { near_sum += gap; near_pairs++ }
                    }
                }
                printf "time %g: below 0.25 %d pairs, mean %s; below 0.02 %d, %s\n", value["time", frame], pairs,
                    mean(sum, pairs), near_pairs, mean(near_sum, near_pairs)
            }
        }' "$folder/text"
done
