#!/bin/sh
# compare.sh EXPECTED PROGRAM [TWIN]: runs an example, which prints lines "name value", and compares
# each value with the stored one. EXPECTED has lines "name value tolerance [loose]": the tolerance is
# a number (absolute) or "text" (the same letters). Processors without AVX2 round in other places,
# and motion with many contacts is chaotic: there `loose` counts, if it is given; "-" asks nothing.
# The twin in the other language has to print the same values, to the last digit printed.
set -eu
expected=$1
fused=0
grep -q avx2 /proc/cpuinfo 2> /dev/null && fused=1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
shift
for program in "$@"; do
    "$program" > "$work/out.txt"
    awk -v program="$program" -v fused=$fused '
        FNR == 1 { file++ }
        /^#/ || NF == 0 { next }
        file == 1 {
            wanted[$1] = $2
            tolerance[$1] = NF > 3 && !fused ? $4 : $3
            order[++n] = $1
            next
        }
        { has[$1] = $2; if (!($1 in wanted)) { print program ": " $1 " is not expected"; bad = 1 } }
        END {
            for (i = 1; i <= n; i++) {
                name = order[i]
                off = has[name] - wanted[name]
                if (off < 0) off = -off
                if (!(name in has)) { print program ": no " name; bad = 1 }
                else if (tolerance[name] == "-") continue
                else if (tolerance[name] == "text" ? has[name] "" != wanted[name] "" \
                         : has[name] !~ /^[-+]?[0-9.]+([eE][-+]?[0-9]+)?$/ || \
                           off > tolerance[name] + 0) {
                    print program ": " name " is " has[name] ", stored " wanted[name] \
                        ", tolerance " tolerance[name]; bad = 1
                }
            }
            if (n == 0) bad = 1
            exit bad
        }' "$expected" "$work/out.txt" ||
        { echo "(if a change is meant to change results: sh examples/update.sh BUILD_DIR)"; exit 1; }
    # Numbers in one form, so that 1e-3 and 0.1E-02 are the same.
    awk '{ v = $2 ~ /^[-+]?[0-9.]+([eE][-+]?[0-9]+)?$/ && length($2) < 30 ? sprintf("%.15g", $2) : $2
           print $1, v }' "$work/out.txt" > "$work/$(basename "$program").txt"
done
if [ $# = 2 ]; then
    diff "$work/$(basename "$1").txt" "$work/$(basename "$2").txt" ||
        { echo "the twins differ (< $1, > $2)"; exit 1; }
fi
