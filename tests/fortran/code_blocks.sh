#!/bin/sh
# code_blocks.sh PAGE SOURCE...: every block of C, Fortran or CMake in the page is found, line after
# line, in one of the sources (which are compiled and run); indentation apart.
set -eu
awk '
    function bare(line) { sub(/^[ \t]+/, "", line); sub(/[ \t]+$/, "", line); return line }
    FILENAME != ARGV[1] { text[FILENAME, ++length_of[FILENAME]] = bare($0); next }
    /^```/ {
        if (inside) { inside = 0; next }
        fenced = !fenced
        if (fenced && $0 ~ /^```(c|fortran|cmake)$/) {
            inside = 1
            fenced = 0
            first[++blocks] = FNR
        }
        next
    }
    inside { block[blocks, ++lines_of[blocks]] = bare($0) }
    END {
        for (b = 1; b <= blocks; b++) {
            found = 0
            for (file in length_of)
                for (at = 0; !found && at + lines_of[b] <= length_of[file]; at++) {
                    for (i = 1; i <= lines_of[b]; i++)
                        if (text[file, at + i] != block[b, i]) break
                    found = i > lines_of[b]
                }
            if (!found) { print ARGV[1] ":" first[b] ": this code is in no source"; bad = 1 }
        }
        if (blocks == 0) { print ARGV[1] ": no code"; bad = 1 }
        exit bad
    }' "$@"
