#!/bin/sh
# How near the hot kernels come to the roofs of the card, from its hardware counters: a kernel a row.
set -u

usage() {
    cat <<'END'
usage: roofline.sh [OPTION...] PROGRAM...       PROGRAM...: the program gamboge, with what stands before it
  --out DIR      keeps the tables of ncu and what it said there (default: a folder that is removed)
  --n N          particles (default 1048576)
  --seconds S    limit of each of the ten runs (default 60); what it has measured by then is lost
  --count K      launches measured a run (default 24); those that returned at once, behind the end of a batch of steps, are left out
  --scenes RE    only runs whose whole names match, as in "S10( bounce)?" (default .*)
  --backend B    default cuda:0
Needs ncu and the right to read hardware counters. Clocks are left as they are, caches too: a kernel finds in L2 what the one before
left there. Percentages of the SM (issue slots, xu = special functions, alu, fma, fp64, L1) are of its active cycles, those of L2
and HBM of the whole time.
END
}

here=$(cd "$(dirname "$0")" && pwd)
out='' n=1048576 seconds=60 count=24 scenes='.*' backend=cuda:0
# shellcheck disable=SC2034
script=roofline.sh options='out n seconds count scenes backend'
. "$here/options.sh"
[ $# -gt 0 ] || complain "no program is given (--help)"
command -v ncu >/dev/null || complain "there is no ncu here"
if [ -z "$out" ]; then
    out=$(mktemp -d)
    trap 'rm -rf "$out"' EXIT
fi
mkdir -p "$out" || complain "cannot make $out"

metrics=gpu__time_duration.sum,dram__bytes.sum,launch__registers_per_thread
metrics=$metrics,sm__throughput.avg.pct_of_peak_sustained_elapsed,lts__throughput.avg.pct_of_peak_sustained_elapsed
metrics=$metrics,dram__throughput.avg.pct_of_peak_sustained_elapsed,l1tex__throughput.avg.pct_of_peak_sustained_active
metrics=$metrics,sm__inst_issued.avg.pct_of_peak_sustained_active,sm__warps_active.avg.pct_of_peak_sustained_active
for pipe in xu alu fma fp64; do
    metrics=$metrics,sm__inst_executed_pipe_$pipe.avg.pct_of_peak_sustained_active
done
for reason in barrier branch_resolving dispatch_stall drain imc_miss lg_throttle long_scoreboard math_pipe_throttle membar \
    mio_throttle misc no_instruction short_scoreboard sleeping tex_throttle wait; do
    metrics=$metrics,smsp__average_warps_issue_stalled_${reason}_per_issue_active.ratio
done

failed=0 first=1
: >"$out/roofline.txt"

# measure NAME SKIP COUNT KERNELS CASE ONLY PROGRAM...: so many launches of kernels whose names match KERNELS, after SKIP of them.
measure() {
    name=$1 skip=$2 launches=$3 kernels=$4 case=$5 only=$6
    shift 6
    printf '%s\n' "$name" | grep -qxE -e "$scenes" || return 0
    file=$out/$(echo "$name" | tr ' ,' '__')
    timeout -k 5 "$seconds" ncu --clock-control none --cache-control none --csv --print-units base --target-processes all \
        --kernel-name "regex:$kernels" --launch-skip "$skip" --launch-count "$launches" --kill yes --metrics "$metrics" \
        "$@" bench "$case" --n "$n" --only "$only" --backend "$backend" >"$file.csv" 2>"$file.err"
    if ! awk -v scene="$name" -v head=$first -f "$here/roofline.awk" "$file.csv" >"$file.txt"; then
        echo "$name: no kernel was measured: $(grep -h -e '==ERROR==' -e gamboge "$file.csv" "$file.err" | tail -n 1)" >&2
        failed=1
    fi
    if [ "$first" = 0 ] || [ -s "$file.txt" ]; then
        tee -a "$out/roofline.txt" <"$file.txt"
        first=0
    fi
}

# Steps in the steady state: some hundred launches after the start. --kill yes ends the program when enough are measured.
measure "S10" 380 "$count" . short-range "S10, no hard" "$@"
measure "S10 bounce" 750 "$((3 * count))" . short-range "S10, hard" "$@"
measure "S10 bridge" 3000 "$count" . short-range "S10, rule bridge" "$@"
measure "C3 bounce" 750 "$((3 * count))" . short-range "C3 short, hard" "$@"
measure "C4 bounce" 750 "$((3 * count))" . short-range "C4 short, hard" "$@"
measure "C3 bridge" 3000 "$count" . short-range "C3 short, rule bridge" "$@"
# Lists are built in few of the steps; the first ones at the start.
measure "S10 list" 0 "$count" 'find_cells|lay_out|find_rows|sort_rows|sift_rows|count_wide|fill_wide|sort_wide|invert|remember' short-range "S10, no hard" "$@"
# Sums over all pairs: the symmetric one, which takes seconds under the profiler, a launch at a time.
measure "all pairs" 0 8 all_pairs carter2016 "our sum" "$@"
measure "all pairs, the rest" 0 "$count" 'make_keys|gather|collect' carter2016 "our sum" "$@"
measure "neighbours 2D" 0 "$count" . neighbours "2D auto" "$@"
exit $failed
