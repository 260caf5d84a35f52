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

# thesis figures are those of the file, ours stand beside them with their error
"$program" bench carter2016 --n 1024 --only "C4 short, bounce" --threads 1 --json "$folder/carter.json" \
    >"$folder/carter.txt" || fail "case carter2016: exit status $?"
grep -q "^6.4, 6.5  C4 short, bounce  *1024  *0.0608 " "$folder/carter.txt" || fail "carter2016: not the thesis's time"
for pair in "thesis_ms\": 0.0608," "thesis_rounds\": 0.99," "thesis_scaled_ms\": 0.0036407"; do
    grep -q "\"$pair" "$folder/carter.json" || fail "carter.json lacks $pair"
done
[ "$(grep -c '"case"' "$folder/carter.json")" -eq 1 ] || fail "--only lets other lines through"
"$program" bench carter2016 --n 1024 --only "our sum" --threads 1 >"$folder/sums.txt" ||
    fail "carter2016, sums: exit status $?"
grep -q "^6.6 *our sum, his shuffle  *1024  *0.69 " "$folder/sums.txt" || fail "carter2016: not the thesis's time of the sum"
"$program" bench carter2016 --n 1000 --only "C4 short, bounce" --threads 1 >"$folder/none.txt" ||
    fail "carter2016 at another N: exit status $?"
grep -q "^6.4, 6.5  C4 short, bounce  *1000  *-  *- " "$folder/none.txt" || fail "a figure that the thesis has not"

"$program" bench sizes --quick --only certified --threads 1 >"$folder/sizes.txt" || fail "case sizes: exit status $?"
for words in "bytes a particle" "reverted 0"; do
    grep -q "$words" "$folder/sizes.txt" || fail "sizes lacks $words"
done
"$program" bench sizes --quick --only abacus >"$folder/out" 2>"$folder/err"
[ $? -eq 2 ] || fail "--only that fits nothing is not bad use"

"$program" bench no-such-case >"$folder/out" 2>"$folder/err"
[ $? -eq 2 ] || fail "an unknown case is not bad use"
grep -q "nearest" "$folder/err" || fail "an unknown case: no nearest name"
echo kept >"$folder/kept.json"
"$program" bench noise --n 300 --backend cpu:isa=abacus --json "$folder/kept.json" \
    >"$folder/out" 2>"$folder/err"
[ $? -eq 2 ] || fail "an unknown instruction set is not bad use"
[ "$(cat "$folder/kept.json")" = kept ] || fail "a failed run replaced a file"
exit $failed
