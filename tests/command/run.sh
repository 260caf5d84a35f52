#!/bin/sh
# Test: gamboge check, run and forces: what they print and write, restarts, signals, bad use.
. "$(dirname "$0")/common.sh"
. "$(dirname "$0")/scenes.sh"

active plain.yaml "run: {steps: 40, seed: 7}"
active files.yaml "run: {steps: 40, seed: 7}" \
    "output: {trajectory: {file: t.nc, every: 4, overlap: true}, restart: {file: r.restart, every: 10}}"

expect 0 "bytes a particle" check files.yaml
for word in "64" "alpha" "power 6" "sum cutoff 2.5" "rule bounce" "dt 0.01" "40 steps" \
    "t.nc, every 4 steps" "r.restart, every 10 steps"; do
    grep -qF -e "$word" said || fault "check does not say \"$word\": $(cat said)"
done
expect 0 "trajectory     none" check plain.yaml

# The whole run: summary, files, frames at the start and every fourth step.
hash_of() {
    sed -n 's/^state  *//p' said
}
expect 0 "overlaps left  0" run files.yaml --hash
for word in "40 steps of 64 particles" "ns per particle-step" "overlap rounds" "rms(dF)/rms(F)"; do
    grep -qF -e "$word" said || fault "run does not say \"$word\": $(cat said)"
done
whole=$(hash_of)
[ ${#whole} -eq 64 ] || fault "no hash of the state: $(cat said)"
expect 0 "11 frames, 64 particles" verify t.nc
cp t.nc whole.nc
[ -f r.restart ] || fault "no restart file"

# The same numbers without files, in two threads, and with the poisoned backend.
expect 0 "state" run plain.yaml --hash
[ "$(hash_of)" = "$whole" ] || fault "files change the state"
expect 0 "state" run plain.yaml --hash --threads 2
[ "$(hash_of)" = "$whole" ] || fault "two threads change the state"
expect 0 "state" run plain.yaml --hash --backend poison
[ "$(hash_of)" = "$whole" ] || fault "the poisoned backend changes the state"
# Its frames are written while the run goes on: the same file, byte for byte.
rm -f t.nc r.restart*
expect 0 "state" run files.yaml --hash --backend poison
cmp t.nc whole.nc || fault "frames that are written later are others"
expect 0 "state" run plain.yaml --hash --seed 8
[ "$(hash_of)" != "$whole" ] || fault "the seed does not change the state"
expect 0 "" run plain.yaml --quiet
[ -s said ] && fault "--quiet prints: $(cat said)"

# A GPU: one sentence that says what is lacking, or the same numbers.
if "$gamboge" info | grep -q "^cuda *no"; then
    expect 1 "-DGBG_WITH_CUDA=ON" run plain.yaml --backend cuda:0
elif "$gamboge" info | grep -q "^backend *cuda:"; then
    expect 0 "backend        cuda:0, " run plain.yaml --hash --backend cuda:0
    [ "$(hash_of)" = "$whole" ] || fault "the GPU changes the state"
    expect 0 "backend        cpu, " run plain.yaml --hash --backend cpu
    [ "$(hash_of)" = "$whole" ] || fault "the CPU has another state than the GPU"
else
    for name in cuda cuda:0 cuda:7; do
        expect 1 "backend cuda: no GPU" run plain.yaml --backend $name
        [ "$(wc -l <said)" -eq 1 ] || fault "more than one line: $(cat said)"
    done
    expect 0 "auto takes cpu: no GPU" run plain.yaml --hash
    [ "$(hash_of)" = "$whole" ] || fault "looking for a GPU changes the state"
    expect 0 "auto takes cpu: no GPU" check plain.yaml
fi

# The summary as JSON agrees with what is printed, and every rule can be written down.
expect 0 "state" run plain.yaml --hash --json j.json
for word in "\"steps\": 40," "\"particles\": 64," "\"rule\": \"bounce\"" "\"overlaps_left\": 0," "\"state\": \"$whole\""; do
    grep -qF -e "$word" j.json || fault "the summary lacks $word: $(cat j.json)"
done
rounds=$(sed -n "s/^overlap rounds \(.*\) a step/\1/p" said)
awk -v said="$rounds" -F "[:,]" "/contact_rounds/ {exit !((\$2 / 40 - said)^2 < 1e-4)}" j.json ||
    fault "$rounds rounds a step are printed, but: $(grep rounds j.json)"
expect 2 "another output of the run" run files.yaml --json t.nc
expect 2 "there is no folder" run plain.yaml --json nowhere/j.json
for rule in bounce contact carter; do
    sed "s/rule: bounce/rule: $rule/" files.yaml >rule.yaml
    rm -f t.nc r.restart*
    expect 0 "overlaps left  0" run rule.yaml --steps 8 --json j.json
    ncdump -h t.nc | grep -q "excluded_volume = \"$rule\"" || fault "the trajectory does not name the rule $rule"
done
rm -f rule.yaml j.json

# Half a run, then the rest from its restart file: same state, same trajectory.
rm -f t.nc r.restart*
expect 0 "20 steps" run files.yaml --steps 20
expect 0 "state" run files.yaml --restart r.restart --hash
[ "$(hash_of)" = "$whole" ] || fault "a restart changes the state"
ncdump t.nc | grep -v -e history -e '^netcdf' >continued.cdl
ncdump whole.nc | grep -v -e history -e '^netcdf' >whole.cdl
cmp continued.cdl whole.cdl || fault "a restart changes the trajectory"
expect 2 "is at step 40 already" run files.yaml --restart r.restart
expect 2 "none.restart" run files.yaml --restart none.restart
active other.yaml "run: {steps: 80, seed: 9}"
expect 2 "r.restart" run other.yaml --restart r.restart
head -c 100 r.restart >damaged.restart
expect 2 "damaged.restart" run files.yaml --restart damaged.restart --steps 80

# A run that is stopped: restart file, finished frames, and the rest of the run.
rm -f t.nc r.restart*
"$gamboge" run files.yaml --steps 100000000 >said 2>&1 &
process=$!
waited=0
while [ ! -f r.restart ] && [ $waited -lt 100 ]; do
    sleep 0.1
    waited=$((waited + 1))
done
kill -TERM $process
wait $process
[ $? -eq 1 ] || fault "a stopped run does not exit with 1"
grep -q "^gamboge: stopped by signal 15 after step" said || fault "no word on the signal: $(cat said)"
expect 0 "verdict        good" verify t.nc

# An existing trajectory stays as it was when the run fails, and its frames are elsewhere.
rm -f t.nc* r.restart*
echo "precious" >t.nc
active hot.yaml "run: {steps: 40, seed: 7}" "output: {trajectory: {file: t.nc, every: 1}}"
sed -i 's/temperature: 0.01/temperature: 1e5/' hot.yaml
expect 1 "dt" run hot.yaml
[ "$(cat t.nc)" = precious ] || fault "a failing run replaced t.nc"
grep -q "t.nc is as it was; the frames of this run are in t.nc.partial" said || fault "$(cat said)"
expect 0 "frames" verify t.nc.partial
expect 0 "overlaps left  0" run files.yaml
[ -e t.nc.partial ] && fault "t.nc.partial is left after a good run"
expect 0 "11 frames" verify t.nc

# Forces.
expect 0 "rms(dF)/rms(F)" forces plain.yaml --out f.nc
ncdump -h f.nc >said
for word in "forces(atom, dim)" "positions(atom, dim)" "species(atom)"; do
    grep -qF -e "$word" said || fault "f.nc lacks $word"
done

# Bad use and bad scenes: nothing is made, nothing spoilt.
expect 2 "none.yaml" check none.yaml
expect 2 "none.yaml" run none.yaml
active unknown.yaml "runs: {steps: 4}"
expect 2 "unknown.yaml" check unknown.yaml
active wrong.yaml "run: {steps: -4}"
expect 2 "wrong.yaml:" run wrong.yaml
expect 2 "there is no folder" run plain.yaml --out nowhere/t.nc
expect 2 "from 1 to 1024" run plain.yaml --threads 0
expect 2 "threads=N" run plain.yaml --backend cuda:x
expect 1 "backend cuda" run plain.yaml --backend cuda:1000
expect 2 "is the input" run plain.yaml --out plain.yaml
expect 2 "is the input" forces plain.yaml --out plain.yaml
expect 2 "needs --out" forces plain.yaml
untouched kept.nc run wrong.yaml --out kept.nc
untouched kept.nc forces wrong.yaml --out kept.nc
grep -q "lattice" plain.yaml || fault "the scene was overwritten"
exit $failed
