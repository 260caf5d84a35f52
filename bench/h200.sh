#!/bin/sh
# All that bench/results holds of a machine with a GPU: figures as JSON, tables, the log of the tests against the CPU.
set -u

usage() {
    cat <<'END'
usage: h200.sh [OPTION...] FOLDER PROGRAMS
  FOLDER         receives CASE.json for every case, log.txt (the tables) and tests.txt, hashes.txt; of a run that is cut off, the lines of
                 the case it was at are in unjoined/
  PROGRAMS       a build directory, or a command that runs a program by its name: PROGRAMS gamboge ..., PROGRAMS backend_step
  --parts "P..." of: tests hashes short-range carter2016 direct sizes noise neighbours huge (default: all but
                 hashes, which takes three minutes, and huge, which is sizes at 2^30 and needs 35 GB of memory on the host)
  --total S      seconds for all parts (default 530); what does not fit any more is left out and named
  --backend B    default cuda:0
  --n N          one size for every case: to try the script
END
}

parts='tests short-range carter2016 direct sizes noise neighbours' total=530 backend=cuda:0 n=''
# shellcheck disable=SC2034
script=h200.sh options='parts total backend n'
. "$(dirname "$0")/options.sh"
[ $# -eq 2 ] || complain "a folder and the programs are needed (--help)"
folder=$1 programs=$2
mkdir -p "$folder" || complain "cannot make $folder"
work=$(mktemp -d) unjoined=$folder/unjoined # the latter outlives a run that is cut off
trap 'rm -rf "$work" "$unjoined"' EXIT
began=$(date +%s)
failed=0
log=$folder/log.txt
scenes=$(dirname "$0")/../examples/scenes
: >"$log"

say() {
    printf '%s\n' "$*" | tee -a "$log"
}

left() {
    echo $((total - $(date +%s) + began))
}

# start SECONDS NAME ARGUMENT...: a program with a limit of time.
start() {
    limit=$1 name=$2
    shift 2
    if [ -d "$programs" ]; then
        if [ -x "$programs/bin/$name" ]; then
            timeout -k 5 "$limit" "$programs/bin/$name" "$@"
        else
            timeout -k 5 "$limit" "$programs/tests/backend/$name" "$@"
        fi
    else
        # shellcheck disable=SC2086
        timeout -k 5 "$limit" $programs "$name" "$@"
    fi
}

# Lines of all JSON files of a case as one file, which is whole at every moment.
join() {
    cat "$unjoined/$1".*.json 2>/dev/null | awk '/^ *\{/ {sub(/,$/, ""); line[++n] = $0}
        END {print "["; for (k = 1; k <= n; k++) print line[k] (k < n ? "," : ""); print "]"}' >"$unjoined/joined"
    mv "$unjoined/joined" "$folder/$1.json"
}

# What a run that was cut off has left here.
for file in "$unjoined"/*.json; do
    [ -e "$file" ] || continue
    name=${file##*/}
    join "${name%%.*}"
done
rm -rf "$unjoined"
mkdir "$unjoined" || complain "cannot make $unjoined"

# bench SECONDS CASE ARGUMENT...: the case may begin lines and timings for so long, and is ended when it takes half as much again.
# What it has measured by then is kept.
runs=0
bench() {
    seconds=$1 case=$2
    shift 2
    rest=$(left)
    [ "$seconds" -le "$rest" ] || seconds=$rest
    if [ "$seconds" -lt 5 ]; then
        say "== $case $*: left out, no time"
        failed=1
        return
    fi
    runs=$((runs + 1))
    ending=$((seconds + seconds / 2))
    [ "$ending" -le "$rest" ] || ending=$rest
    say "== $case $* ($(left) s are left)"
    echo 1 >"$work/status"
    {
        start "$ending" gamboge bench "$case" --backend "$backend" --seconds "$seconds" --json "$unjoined/$case.$(printf %03d $runs).json" \
            ${n:+--n} ${n:+"$n"} "$@" 2>&1
        echo $? >"$work/status"
    } | tee -a "$log"
    status=$(cat "$work/status")
    if [ "$status" -ne 0 ]; then
        say "== $case $*: exit status $status"
        failed=1
    fi
    join "$case"
}

# Each program of the tests: its exit status (77: skipped) and what it says of itself.
tests() {
    : >"$folder/tests.txt"
    for test in step forces lists search certify checks contacts bridge events steps order frames restart probe robust lost unlisted; do
        rest=$(left)
        [ "$rest" -gt 5 ] || rest=5
        [ "$rest" -lt 60 ] || rest=60
        start "$rest" "backend_$test" >"$work/out" 2>&1
        status=$?
        { echo "==== backend_$test: exit status $status"; cat "$work/out"; } >>"$folder/tests.txt"
        words=$(grep -a -E '^\[ +(PASSED|FAILED) +\] +[0-9]+ test' "$work/out" | tr '\n' ' ')
        case $status in
        0) ;;
        77) words="skipped: $(tail -n 1 "$work/out")" ;;
        126 | 127) words="not there"; failed=1 ;;
        *) words="$words FAILED (exit status $status)"; failed=1 ;;
        esac
        say "backend_$test: $words"
    done
}

# hash BACKEND: SHA-256 of the state after $steps steps of the scene at hand.
hash() {
    start 60 gamboge run "$work/scene.yaml" --backend "$1" --steps "$steps" --hash --out "$work/t.nc" 2>"$work/said" |
        sed -n 's/^state  *//p'
}

# The same states on the CPU and on the GPU: C0 to C4 in short range.
hashes() {
    steps=10000
    [ -z "$n" ] || steps=100
    : >"$folder/hashes.txt"
    for scene in 0 1 2 3 4; do
        for rule in bounce bridge; do
            sed -e "s/rule: auto/rule: $rule/" -e "s/count: 4096/count: ${n:-4096}/" "$scenes/carter_c${scene}_short.yaml" >"$work/scene.yaml"
            cpu=$(hash cpu) gpu=$(hash "$backend")
            if [ -n "$cpu" ] && [ "$cpu" = "$gpu" ]; then
                words='the same on both'
            else
                words="DIFFERS: ${gpu:-$(cat "$work/said")}"
                failed=1
            fi
            echo "C$scene short, $rule, N = ${n:-4096}, $steps steps: ${cpu:-no hash} $words" >>"$folder/hashes.txt"
        done
    done
    tee -a "$log" <"$folder/hashes.txt"
}

for part in $parts; do
    case $part in
    tests) tests ;;
    hashes) hashes ;;
    short-range) bench 60 short-range ;;
    carter2016) bench 200 carter2016 ;;
    direct)
        bench 30 direct
        [ -n "$n" ] || bench 40 direct --n 1048576
        ;;
    sizes)
        for size in 4194304 16777216 67108864; do
            if [ -n "$n" ]; then
                bench 30 sizes
                break
            fi
            bench 40 sizes --n $size
        done
        ;;
    huge) bench 400 sizes --n 1073741824 --only "no hard" ;;
    noise) bench 10 noise ;;
    neighbours)
        if [ -n "$n" ]; then
            bench 30 neighbours
        else
            bench 60 neighbours --n 1048576
            for words in auto device; do
                bench 20 neighbours --n 16777216 --only $words
                bench 20 neighbours --n 67108864 --only "2D $words"
            done
        fi
        ;;
    *) complain "there is no part $part (--help lists them)" ;;
    esac
done
say "== $(($(date +%s) - began)) s in all"
exit $failed
