#!/bin/sh
# Draws results of `gamboge bench long-range --json F`: long_range_plot.sh F PICTURE.png [N]
# Time of a sum against its measured error: a curve a method, a panel a set of particles. N: particles (default: the most there are).
set -eu
[ $# -ge 2 ] && [ $# -le 3 ] || { echo "usage: long_range_plot.sh RESULTS.json PICTURE.png [N]" >&2; exit 2; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
results=$1 picture=$2

# "set|method|n|error over RMS|ns of a core a particle" a line; the harness writes one object a line
awk '
    function text(key,    at, rest) {
        at = index($0, "\"" key "\": \"")
        rest = substr($0, at + length(key) + 5)
        return at ? substr(rest, 1, index(rest, "\"") - 1) : ""
    }
    function number(key,    at) {
        at = index($0, "\"" key "\": ")
        return at ? substr($0, at + length(key) + 4) + 0 : 0
    }
    text("case") == "long-range" {
        what = text("what")
        comma = index(what, ", ")
        printf "%s|%s|%d|%g|%g\n", substr(what, 1, comma - 1), substr(what, comma + 2), number("n"), number("error_over_rms"),
            1e9 / number("per_core_second")
    }' "$results" >"$folder/all"
[ -s "$folder/all" ] || { echo "long_range_plot.sh: $results holds no line of the case long-range" >&2; exit 1; }
n=${3:-$(cut -d '|' -f 3 "$folder/all" | sort -n | tail -n 1)}
cut -d '|' -f 1 "$folder/all" | awk '!seen[$0]++' >"$folder/sets"
cut -d '|' -f 2 "$folder/all" | awk '!seen[$0]++' >"$folder/methods"
rows=$((($(wc -l <"$folder/sets") + 1) / 2))

{
    echo "set terminal pngcairo size 1500,$((rows * 520)) font 'sans,13' background '#ffffff'"
    echo "set output '$picture'"
    echo "set encoding utf8; set border 3; set tics nomirror out; set grid lc rgb '#e4e4e4' lt 1"
    echo "set logscale xy; set format x '10^{%T}'; set key outside right top; set datafile separator '|'"
    echo "set xlabel 'measured error, RMS over RMS'; set ylabel 'ns of a core a particle'"
    echo "set xrange [1e-13:1e-1] reverse; set multiplot layout $rows,2"
    while read -r set; do
        echo "set title '$set, N = $n'"
        line=plot
        while read -r method; do
            awk -F '|' -v set="$set" -v method="$method" -v n="$n" '$1 == set && $2 == method && $3 == n' "$folder/all" |
                sort -t '|' -k 4,4g >"$folder/curve"
            if [ -s "$folder/curve" ]; then
                name=$folder/$(echo "$set $method" | cksum | cut -d ' ' -f 1)
                mv "$folder/curve" "$name"
                line="$line '$name' using 4:5 with linespoints pt 7 ps 0.7 title '$method',"
            fi
        done <"$folder/methods"
        [ "$line" = plot ] || echo "${line%,}"
    done <"$folder/sets"
    echo "unset multiplot"
} | gnuplot
