#!/bin/sh
# Test of bench/roofline.sh and its table with a made-up ncu: roofline.sh ROOT. Means, units, quoted names, the roof, the stall.
set -u
root=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
failed=0

fail() {
    echo "$1"
    failed=1
}

# line ID KERNEL METRIC UNIT VALUE
line() {
    printf '"%s","77","gamboge","127.0.0.1","%s","1","13","(128, 1, 1)","(8192, 1, 1)","0","9.0","Command line profiler metrics","%s","%s","%s"\n' \
        "$1" "$2" "$3" "$4" "$5"
}
stall=smsp__average_warps_issue_stalled
near='void (anonymous namespace)::mixed<(int)2, (bool)1>(gbg_state, ""list"", float)'
{
    echo '==PROF== Connected to process 77'
    echo 'case short-range, backend cuda (sm_90)'
    echo '"ID","Process ID","Process Name","Host Name","Kernel Name","Context","Stream","Block Size","Grid Size","Device","CC","Section Name","Metric Name","Metric Unit","Metric Value"'
    for id in 0 2; do
        line $id "$near" gpu__time_duration.sum ns "$((30000 + 1000 * id)).00"
        line $id "$near" dram__bytes.sum byte '16,000,000'
        line $id "$near" launch__registers_per_thread register/thread 40
        line $id "$near" sm__inst_issued.avg.pct_of_peak_sustained_active % 61.5
        line $id "$near" lts__throughput.avg.pct_of_peak_sustained_elapsed % 30
        line $id "$near" sm__warps_active.avg.pct_of_peak_sustained_active % 55.25
        line $id "$near" ${stall}_long_scoreboard_per_issue_active.ratio inst 4.25
        line $id "$near" ${stall}_selected_per_issue_active.ratio inst 9
        line $id "$near" ${stall}_wait_per_issue_active.ratio inst 1.5
    done
    line 1 'all_pairs(symmetric, long)' gpu__time_duration.sum usecond '1,250.5'
    line 1 'all_pairs(symmetric, long)' sm__inst_issued.avg.pct_of_peak_sustained_active % 71
    line 1 'all_pairs(symmetric, long)' sm__inst_executed_pipe_fma.avg.pct_of_peak_sustained_active % 88.25
    line 1 'all_pairs(symmetric, long)' dram__throughput.avg.pct_of_peak_sustained_elapsed % n/a
    line 1 'all_pairs(symmetric, long)' ${stall}_wait_per_issue_active.ratio inst 1.5
} >"$folder/sample.csv"

awk -v scene=S10 -v head=1 -f "$root/bench/roofline.awk" "$folder/sample.csv" >"$folder/table" || fail "the sample: exit status $?"
[ "$(wc -l <"$folder/table")" -eq 3 ] || fail "not a head and two kernels"
# shellcheck disable=SC2046
set -- $(grep ' mixed ' "$folder/table")
[ "$*" = 'S10 mixed 2 31.00 16 40 55 61.5 - - - - - 30.0 - - issue 62% long scoreboard (4.2)' ] || fail "row of mixed: $*"
# shellcheck disable=SC2046
set -- $(grep ' all_pairs ' "$folder/table")
[ "$*" = 'S10 all_pairs 1 1250.50 - - - 71.0 - - 88.2 - - - - - fma 88%' ] || fail "row of all_pairs: $*"
echo 'nothing here' | awk -f "$root/bench/roofline.awk" && fail "no kernel is not an error"

# the script: with this ncu, with one that fails, with none
mkdir "$folder/bin" "$folder/empty"
printf '#!/bin/sh\necho "$*" >>%s/calls\ncat %s/sample.csv\n' "$folder" "$folder" >"$folder/bin/ncu"
chmod +x "$folder/bin/ncu"
PATH=$folder/bin:$PATH sh "$root/bench/roofline.sh" --out "$folder/out" --n 4096 --seconds 9 bundle/run gamboge >"$folder/said" ||
    fail "roofline.sh: exit status $?"
grep -q -- '--clock-control none .* bundle/run gamboge bench short-range --n 4096 --only S10, no hard' "$folder/calls" ||
    fail "ncu was called otherwise: $(head -n 1 "$folder/calls")"
[ "$(grep -c '^scene ' "$folder/said")" -eq 1 ] || fail "one head is wanted"
[ "$(grep -c ' mixed ' "$folder/said")" -eq "$(wc -l <"$folder/calls")" ] || fail "a run is missing"
cmp -s "$folder/said" "$folder/out/roofline.txt" || fail "the table was not kept"
printf '#!/bin/sh\necho "==ERROR== no counters"\nexit 1\n' >"$folder/bin/ncu"
PATH=$folder/bin:$PATH sh "$root/bench/roofline.sh" gamboge >"$folder/said" 2>"$folder/complaint" && fail "no counters: exit status 0"
grep -q 'S10 bounce: no kernel was measured: ==ERROR== no counters' "$folder/complaint" || fail "$(cat "$folder/complaint")"
exit $failed
