#!/bin/sh
# The programs in README.md compile with pkg-config and print the forces they promise:
# snippets.sh README LIBDIR CC [FC].
set -eu
readme=$1
PKG_CONFIG_PATH=$2/pkgconfig
export PKG_CONFIG_PATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# run LANGUAGE FILE COMPILER MODULE: the fenced block of that language, built and run.
run() {
    sed -n "/^\`\`\`$1\$/,/^\`\`\`\$/p" "$readme" | sed '1d;$d' >"$work/$2"
    test -s "$work/$2"
    # shellcheck disable=SC2046
    (cd "$work" && "$3" "$2" -o program $(pkg-config --cflags --libs "$4") -Wl,-rpath,"$libdir" &&
        ./program | awk '{print $1 + 0, $2 + 0}' >said)
    if ! diff "$work/expected" "$work/said"; then
        echo "the $1 program of $readme printed something else (right of >)"
        exit 1
    fi
}

libdir=$2
printf '%s\n' '-0.5 0' '0.1875 0' '0.625 0' >"$work/expected"
run c program.c "$3" gamboge
if [ $# -gt 3 ]; then
    run fortran program.f90 "$4" gamboge-fortran
fi
