#!/bin/sh
# Test: gamboge run on a GPU: the files and numbers of the CPU, restarts from one to the other, kills.
# Skipped, with the reason, where there is no GPU.
. "$(dirname "$0")/common.sh"
. "$(dirname "$0")/scenes.sh"

if ! "$gamboge" info | grep -q "^backend *cuda:"; then
    "$gamboge" info | grep -e "^backend" -e "^cuda"
    echo "skipped: no GPU"
    exit 77
fi
active files.yaml "run: {steps: 60, seed: 7}" \
    "output: {trajectory: {file: t.nc, every: 3, overlap: true, unwrapped: true}, restart: {file: r.restart, every: 20}}"
active float.yaml "run: {steps: 60, seed: 7}" \
    "output: {trajectory: {file: t.nc, every: 1, precision: float}}"

hash_of() {
    sed -n 's/^state  *//p' said
}
fresh() {
    rm -f t.nc* r.restart*
}

# Whole runs: the same state and the same file.
for scene in files.yaml float.yaml; do
    fresh
    expect 0 "state" run $scene --hash --backend cpu
    whole=$(hash_of)
    [ ${#whole} -eq 64 ] || fault "no hash of the state: $(cat said)"
    mv t.nc whole.nc
    fresh
    expect 0 "backend        cuda:0, " run $scene --hash --backend cuda:0
    [ "$(hash_of)" = "$whole" ] || fault "$scene: the GPU has another state"
    cmp t.nc whole.nc || fault "$scene: the GPU writes another file"
    expect 0 "verdict        good" verify t.nc
done

# Half on one, half on the other.
fresh
expect 0 "state" run files.yaml --hash --backend cpu
whole=$(hash_of)
mv t.nc whole.nc
for pair in "cpu cuda:0" "cuda:0 cpu" "cuda:0 cuda:0"; do
    fresh
    expect 0 "40 steps" run files.yaml --steps 40 --backend "${pair% *}"
    expect 0 "state" run files.yaml --restart r.restart --hash --backend "${pair#* }"
    [ "$(hash_of)" = "$whole" ] || fault "$pair: a restart changes the state"
    cmp t.nc whole.nc || fault "$pair: a restart changes the trajectory"
done

# Killed at any instant: whole frames, none missing up to the restart file, and the rest of the run.
active long.yaml "run: {steps: 40000, seed: 7}" \
    "output: {trajectory: {file: t.nc, every: 40}, restart: {file: r.restart, every: 1000}}"
fresh
expect 0 "state" run long.yaml --hash --backend cpu
whole=$(hash_of)
mv t.nc whole.nc
killed=0
for delay in 0.0 0.05 0.1 0.2 0.4; do
    fresh
    "$gamboge" run long.yaml --backend cuda:0 >said 2>&1 &
    process=$!
    while [ ! -f r.restart ] && kill -0 $process 2>/dev/null; do
        sleep 0.01
    done
    sleep $delay
    kill -KILL $process 2>/dev/null
    wait $process
    [ $? -eq 137 ] || continue # it had ended
    killed=$((killed + 1))
    expect 0 "" verify t.nc
    expect 0 "state" run long.yaml --restart r.restart --hash --backend cuda:0
    [ "$(hash_of)" = "$whole" ] || fault "killed after $delay s: another state"
    cmp t.nc whole.nc || fault "killed after $delay s: another file"
done
[ $killed -gt 0 ] || fault "every run ended before it was killed"

# What the machine lacks is no bad use.
expect 1 "no GPU 1000" run files.yaml --backend cuda:1000
[ "$(wc -l <said)" -eq 1 ] || fault "more than one line: $(cat said)"
expect 0 "no GPU 1000" run float.yaml --backend auto:1000
exit $failed
