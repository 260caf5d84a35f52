#!/bin/sh
# Draws results of `gamboge bench contact-rules --json F`: contact_rules_plot.sh F PICTURE.png
# Errors of the contact rules against the step, and against the time that a core needs.
set -eu
[ $# -eq 2 ] || { echo "usage: contact_rules_plot.sh RESULTS.json PICTURE.png" >&2; exit 2; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# select WHAT QUANTITY RULE: "dt, |relative error|, its standard error, core us a particle and unit
# of time" a line; the harness writes one object a line
select_lines() {
    awk -v what="$1" -v quantity="$2" -v rule="$3" '
        function text(key,    at) {
            at = index($0, "\"" key "\": \"")
            return at ? substr($0, at + length(key) + 5, index(substr($0, at + length(key) + 5), "\"") - 1) : ""
        }
        function number(key,    at) {
            at = index($0, "\"" key "\": ")
            return at ? substr($0, at + length(key) + 4) + 0 : 0
        }
        text("what") == what && text("quantity") == quantity && text("rule") == rule {
            error = number("value") / number("reference") - 1
            uncertain = number("standard_error") / number("reference")
            printf "%g %g %g %g\n", number("dt"), error < 0 ? -error : error, uncertain,
                1e6 / number("per_core_second") / number("dt")
        }' "$results" | sort -g
}

results=$1
for rule in event bridge bounce contact; do
    select_lines "C2, A-B" "isolated mean gap" $rule >"$folder/c2_$rule"
    select_lines "C4, A-B" "isolated mean gap" $rule >"$folder/c4_$rule"
    select_lines "discs 0.52" "ratio C" $rule >"$folder/fluid_$rule"
    select_lines "discs 0.698" "ratio C" $rule >"$folder/dense_$rule"
done

# curves X FIRST FIRST-TITLE SECOND SECOND-TITLE: a plot of both files of each rule
curves() {
    line="plot"
    colour=1
    for rule in event bridge bounce contact; do
        for set in 2 4; do
            eval "name=\$$set"
            eval "title=\$$((set + 1))"
            if [ -s "$folder/${name}_$rule" ]; then
                line="$line '$folder/${name}_$rule' using $1:2:3 with yerrorlines lc $colour"
                line="$line pt $((set + 3)) dt $((set / 2)) title '$rule, $title',"
            fi
        done
        colour=$((colour + 1))
    done
    echo "${line%,}"
}

{
    echo "set terminal pngcairo size 1500,1050 font 'sans,13' background '#ffffff'"
    echo "set output '$2'"
    echo "set encoding utf8; set border 3; set tics nomirror out; set grid lc rgb '#e4e4e4' lt 1"
    echo "set logscale xy; set format y '10^{%T}'; set format x '10^{%T}'; set key outside right top"
    echo "set ylabel '|relative error|'; set multiplot layout 2,2"
    echo "set title 'Mean gap of an isolated bound pair, T = 0.01'; set xlabel 'dt'"
    curves 1 c2 C2 c4 C4
    echo "set xlabel 'core time, µs a particle and unit of time'"
    curves 4 c2 C2 c4 C4
    echo "set title 'Hard discs: |C - 1|, contact value against virial'; set xlabel 'dt = s^2, T = 1'"
    curves 1 fluid 0.52 dense 0.698
    echo "set xlabel 'core time, µs a particle and unit of time'"
    curves 4 fluid 0.52 dense 0.698
    echo "unset multiplot"
} | gnuplot
