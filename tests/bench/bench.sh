#!/bin/sh
# Test of gamboge bench: bench.sh PROGRAM. Small cases run, report speed and error, and fail loudly.
set -u
program=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failed=0

fail() {
    echo "$1"
    failed=1
}

"$program" bench >"$folder/list" || fail "the list of cases: exit status $?"
for case in direct noise; do
    grep -q "^$case " "$folder/list" || fail "the list lacks $case"
    "$program" bench $case --n 300 --threads 2 --json "$folder/$case.json" >"$folder/$case.txt" ||
        fail "case $case: exit status $?"
    grep -q "2 threads" "$folder/$case.txt" || fail "case $case does not say how many threads"
    for key in seconds per_second error_over_rms instructions commit machine load; do
        grep -q "\"$key\": " "$folder/$case.json" || fail "$case.json lacks $key"
    done
done
[ "$(grep -c '"case": "direct"' "$folder/direct.json")" -ge 5 ] || fail "direct.json is short"

# each timing of this case comes after the same pairs as a double loop gave
"$program" bench neighbours --quick --threads 1 >"$folder/neighbours.txt" ||
    fail "case neighbours: exit status $?"

"$program" bench no-such-case >"$folder/out" 2>"$folder/err"
[ $? -eq 2 ] || fail "an unknown case is not bad use"
grep -q "nearest" "$folder/err" || fail "an unknown case: no nearest name"
echo kept >"$folder/kept.json"
"$program" bench noise --n 300 --backend cpu:isa=abacus --json "$folder/kept.json" \
    >"$folder/out" 2>"$folder/err"
[ $? -eq 2 ] || fail "an unknown instruction set is not bad use"
[ "$(cat "$folder/kept.json")" = kept ] || fail "a failed run replaced a file"
exit $failed
