#!/bin/sh
# Test of bench/h200.sh on the CPU in tiny sizes: h200.sh ROOT BUILD. Every case leaves its figures, failures are told.
set -u
root=$1
build=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failed=0

fail() {
    echo "$1"
    failed=1
}

sh "$root/bench/h200.sh" --backend cpu:threads=1 --n 1024 --parts "hashes short-range direct sizes noise" "$folder/out" "$build" >"$folder/said" 2>&1 ||
    fail "exit status $?: $(cat "$folder/said")"
for case in short-range direct sizes noise; do
    grep -q "\"case\": \"$case\"" "$folder/out/$case.json" || fail "no figures of $case"
    grep -q "^case $case, " "$folder/out/log.txt" || fail "no table of $case"
    awk 'NR == 1 && $0 != "[" || /^ \{/ && ended || /\}$/ && ended {exit 1} /^ \{.*\}$/ {ended = 1} END {exit !ended}' "$folder/out/$case.json" ||
        fail "$case.json is no list"
done
[ "$(grep -c '^C[0-4] short, b[a-z]*, N = 1024, 100 steps: [0-9a-f]\{64\} the same on both' "$folder/out/hashes.txt")" -eq 10 ] ||
    fail "states after steps: $(cat "$folder/out/hashes.txt")"

# programs by name: one that passes, one that skips, one that fails, the others not there
mkdir "$folder/bin"
# shellcheck disable=SC2016
printf '#!/bin/sh\nname=$1\nshift\nexec "%s/bin/$name" "$@"\n' "$folder" >"$folder/run"
printf '#!/bin/sh\necho "[  PASSED  ] 12 test(s)." >&2\n' >"$folder/bin/backend_step"
printf '#!/bin/sh\necho "no GPU was found"\nexit 77\n' >"$folder/bin/backend_lists"
printf '#!/bin/sh\necho "[  FAILED  ] 1 test(s), listed below:"\nexit 1\n' >"$folder/bin/backend_forces"
# one whose states are others on another backend
# shellcheck disable=SC2016
printf '#!/bin/sh\necho "state          $(echo "$4" | sha256sum | cut -c1-64)"\n' >"$folder/bin/gamboge"
chmod +x "$folder/run" "$folder/bin"/*
sh "$root/bench/h200.sh" --parts tests "$folder/tests" "$folder/run" >"$folder/said" 2>&1 && fail "failing tests: exit status 0"
for words in 'backend_step: \[  PASSED  \] 12 test' 'backend_lists: skipped: no GPU was found' \
    'backend_forces: \[  FAILED  \] 1 test.*FAILED (exit status 1)' 'backend_bridge: not there'; do
    grep -q "^$words" "$folder/said" || fail "not said: $words"
done
sh "$root/bench/h200.sh" --parts hashes "$folder/hashes" "$folder/run" >"$folder/said" 2>&1 && fail "states that differ: exit status 0"
[ "$(grep -c DIFFERS "$folder/hashes/hashes.txt")" -eq 10 ] || fail "states that differ: $(cat "$folder/hashes/hashes.txt")"
grep -q '^==== backend_step: exit status 0' "$folder/tests/tests.txt" || fail "no log of the tests"
sh "$root/bench/h200.sh" --total 3 --parts noise "$folder/late" "$build" >"$folder/said" 2>&1 && fail "no time: exit status 0"
grep -q 'noise : left out, no time' "$folder/said" || fail "no word of what is left out: $(cat "$folder/said")"
# what a run that was cut off left is joined by the next one; a misspelt option is bad use
mkdir -p "$folder/cut/unjoined"
for part in 001 002; do
    printf '[\n {"case": "noise", "n": %d}\n]\n' $part >"$folder/cut/unjoined/noise.$part.json"
done
sh "$root/bench/h200.sh" --parts tests "$folder/cut" "$folder/run" >"$folder/said" 2>&1
[ "$(grep -c '"case": "noise"' "$folder/cut/noise.json")" -eq 2 ] || fail "lines of a run that was cut off are lost"
[ ! -e "$folder/cut/unjoined" ] || fail "unjoined is left"
for words in "--totals 3" "--total" "-x"; do
    # shellcheck disable=SC2086
    sh "$root/bench/h200.sh" $words >"$folder/said" 2>&1
    [ $? -eq 2 ] || fail "not bad use: $words"
done
sh "$root/bench/h200.sh" "--parts total" 3 x y >"$folder/said" 2>&1
[ $? -eq 2 ] || fail "an option of two words"
exit $failed
