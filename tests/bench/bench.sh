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
"$program" bench carter2016 --n 1024 --only "our sum" --threads 1 --json "$folder/sums.json" >"$folder/sums.txt" ||
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

# the file of figures is a whole list whenever it is looked at, from the first line on
whole() {
    awk 'NR == 1 && $0 != "[" || /^ \{/ && ended || ended && $0 != "]" || closed {exit 1} /^ \{/ {n++; ended = !/,$/} /^\]$/ && ended {closed = 1}
        END {exit !(closed && n)}' "$1"
}
"$program" bench direct --n 2000 --threads 1 --json "$folder/grows.json" >"$folder/out" &
running=$!
looks=0 sizes=0 before=0
while kill -0 $running 2>/dev/null; do
    if [ -e "$folder/grows.json" ]; then
        cp "$folder/grows.json" "$folder/look"
        whole "$folder/look" || fail "not a whole list on the way: $(cat "$folder/look")"
        now=$(wc -l <"$folder/look")
        [ "$now" -eq "$before" ] || sizes=$((sizes + 1))
        before=$now looks=$((looks + 1))
    fi
done
wait $running || fail "direct: exit status $?"
[ "$sizes" -ge 3 ] || fail "the file grew $sizes times in $looks looks"
for file in "$folder"/*.partial; do
    [ ! -e "$file" ] || fail "a temporary file is left: $file"
done
"$program" bench direct --n 3000 --threads 1 --json "$folder/cut.json" >"$folder/out" &
running=$!
while [ ! -e "$folder/cut.json" ] && kill -0 $running 2>/dev/null; do :; done
kill -9 $running 2>/dev/null
wait $running 2>/dev/null
whole "$folder/cut.json" || fail "a run that was cut off: no whole list"

# time that is over bounds the timings of a line, of which there is one at least
"$program" bench carter2016 --n 65536 --only "our sum, his CPU" --threads 1 --seconds 1 --json "$folder/slow.json" >"$folder/out" ||
    fail "carter2016 for a second: exit status $?"
grep -q '"times": [1-4],' "$folder/slow.json" || fail "timings when time is over: $(cat "$folder/slow.json")"
grep -q '"times": [5-9]' "$folder/sums.json" || fail "timings when there is time: $(cat "$folder/sums.json")"

"$program" bench no-such-case >"$folder/out" 2>"$folder/err"
[ $? -eq 2 ] || fail "an unknown case is not bad use"
grep -q "nearest" "$folder/err" || fail "an unknown case: no nearest name"
echo kept >"$folder/kept.json"
"$program" bench noise --n 300 --backend cpu:isa=abacus --json "$folder/kept.json" \
    >"$folder/out" 2>"$folder/err"
[ $? -eq 2 ] || fail "an unknown instruction set is not bad use"
[ "$(cat "$folder/kept.json")" = kept ] || fail "a failed run replaced a file"
exit $failed
