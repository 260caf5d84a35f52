#!/bin/sh
# Does module gamboge_c (with the parts that have their own files) say what the C headers say? Compares
# every GBG_API function (name, result, names and kinds of arguments) and the value of every public
# constant; a module has to offer each.
# bindings.sh HEADER_DIR GENERATED_HEADER_DIR MODULE_DIR CC FC: exit status 1 and a list of
# differences when they differ.
set -eu
export LC_ALL=C
headers=$1 generated=$2 module=$3/gamboge_c.f90 parts="$3/gamboge_c_neighbours.f90 $3/gamboge_c_sums.f90"
constants=$3/gamboge_constants.f90 cc=$4 fc=$5
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bad=0

awk -f "$here/signatures_c.awk" "$headers"/*.h | sort > "$work/c.txt"
awk -f "$here/signatures_fortran.awk" "$module" $parts | sort > "$work/fortran.txt"
[ -s "$work/c.txt" ] || { echo "bindings: no GBG_API function found in $headers"; exit 1; }
# An array that may be NULL is a type(c_ptr) in Fortran ("any*"): it stands for any C pointer.
awk -v file="$module" '
    FNR == NR { fortran[$1] = $0; next }
    { seen[$1] = 1 }
    !($1 in fortran) { print "bindings: " $1 " is missing in " file; wrong = 1; next }
    {
        n = split($0, c, " "); m = split(fortran[$1], f, " ")
        same = n == m
        for (i = 2; same && i <= n; i++) {
            split(c[i], a, ":"); split(f[i], b, ":")
            same = a[1] == b[1] && (a[2] == b[2] || (b[2] == "any*" && a[2] ~ /\*$/))
        }
        if (!same) {
            print "bindings: " $1 " differs\n  C:       " $0 "\n  Fortran: " fortran[$1]
            wrong = 1
        }
    }
    END {
        for (name in fortran) if (!(name in seen)) {
            print "bindings: " name " is in " file " but in no header"; wrong = 1
        }
        exit wrong
    }' "$work/fortran.txt" "$work/c.txt" || bad=1

# A function that no object offers reaches nobody.
modules=$(ls "$3"/gamboge_*.f90 | grep -v -e /gamboge_c.f90 -e /gamboge_c_neighbours.f90 -e /gamboge_c_sums.f90 -e /gamboge_constants.f90)
for name in $(cut -d ' ' -f 1 "$work/c.txt"); do
    grep -qw "$name" $modules || { echo "bindings: $name is used by no module in $3"; bad=1; }
done

# Constants: the enumerators and the status list of the headers, compiled and printed by both.
awk -f "$here/constants.awk" "$headers"/*.h | sort -u > "$work/constants.txt"
{
    echo '#include <stdio.h>'
    echo '#include "gamboge/gamboge.h"'
    echo 'int main(void) {'
    awk '{ printf "printf(\"%s %%d\\n\", (int)%s);\n", tolower($1), $1 }' "$work/constants.txt"
    echo 'return 0; }'
} > "$work/constants.c"
{
    echo 'program constants'
    echo '   use gamboge_c'
    echo '   implicit none'
    awk '{ name = tolower($1)
           printf "   print \"(a,1x,i0)\", \"%s\", %s\n", name, name }' "$work/constants.txt"
    echo 'end program constants'
} > "$work/constants.f90"
$cc -I"$headers/.." -I"$generated" -I"$generated/gamboge" "$work/constants.c" -o "$work/constants_c"
"$work/constants_c" > "$work/values_c.txt"
if $fc -J"$work" "$constants" $parts "$module" "$work/constants.f90" -o "$work/constants_f" \
    2> "$work/fc.log"
then
    "$work/constants_f" > "$work/values_f.txt"
    diff "$work/values_c.txt" "$work/values_f.txt" > "$work/diff.txt" ||
        { echo "bindings: constants differ (< C, > Fortran)"; cat "$work/diff.txt"; bad=1; }
else
    echo "bindings: a constant of the headers is missing in $constants"
    grep -i 'error' "$work/fc.log"
    bad=1
fi
[ $bad = 0 ] && echo "bindings: $(wc -l < "$work/c.txt") functions and" \
    "$(wc -l < "$work/constants.txt") constants agree"
exit $bad
