#!/bin/sh
# Test: sums over all images in the program: what check and run say of them, restarts, files, refusals.
. "$(dirname "$0")/common.sh"
. "$(dirname "$0")/scenes.sh"

# lattice FILE FORCE [LINE...]: the active discs with another force.
lattice() {
    whereto=$1 force=$2
    shift 2
    active scene.tmp "$@"
    sed "s/^  - {law.*/  - $force/" scene.tmp >"$whereto"
}
hash_of() {
    sed -n 's/^state  *//p' said
}

lattice all.yaml "{power: 2}" "run: {steps: 120, seed: 7}" \
    "output: {trajectory: {file: t.nc, every: 40}, restart: {file: r.restart, every: 90}}"
expect 0 "sum lattice, tolerance 0.0001" check all.yaml
grep -q "ewald | r/r^3, all images: reach [0-9.]*, mesh [0-9]*x[0-9]*, width [0-9]*, float, error [0-9.e-]*, [0-9.e+]* ns a particle" \
    said || fault "check does not say what the sum is made of: $(cat said)"
expect 0 "overlaps left  0" run all.yaml --hash --json all.json
grep -q "^forces.0.      tolerance 0.0001, measured [0-9.e-]*, by the model [0-9.e-]*" said ||
    fault "the summary has no measured error: $(cat said)"
whole=$(hash_of)
for key in force_tolerance force_error_predicted force_error_measured force_refined check_seconds; do
    grep -q "\"$key\": " all.json || fault "no $key in $(cat all.json)"
done
awk -F'[][]' '/force_error_measured/ { found = 1; bad = !($2 > 0 && $2 <= 1e-4) } END { exit bad || !found }' all.json ||
    fault "the measured error misses the tolerance: $(cat all.json)"
for key in force_tolerance force_error_measured; do
    grep -qa "$key" t.nc || fault "the trajectory has no attribute $key"
done

# Other threads, and from the file of step 90: the same state.
cp r.restart.previous from.restart 2>/dev/null || fault "no restart file of step 90"
expect 0 "state" run all.yaml --hash --threads 1
[ "$(hash_of)" = "$whole" ] || fault "one thread changes the state"
rm -f t.nc r.restart*
expect 0 "30 steps of 64 particles" run all.yaml --hash --restart from.restart
[ "$(hash_of)" = "$whole" ] || fault "a restart changes the state"

# Scenes without such a sum say nothing of it.
active short.yaml "run: {steps: 4, seed: 7}" "output: {trajectory: {file: s.nc, every: 4}}"
expect 0 "overlaps left  0" run short.yaml --json short.json
grep -qa "force_tolerance" s.nc && fault "a scene without a sum over all images has its attributes"
grep -q "force_tolerance" short.json && fault "the summary names what is not there: $(cat short.json)"

# Refusals.
lattice loose.yaml "{power: 2, tolerance: 0.5}"
expect 2 "loose.yaml:9: forces[0].tolerance: 0.5 given, allowed (0, 0.1] with sum lattice" check loose.yaml
lattice fine.yaml "{power: 2, tolerance: 1e-14}"
expect 2 "forces[0].tolerance: 1e-14 given; the finest that a sum over all images reaches here is" check fine.yaml
lattice steep.yaml "{power: 7}"
expect 2 "steep.yaml:9: forces[0].power: 7 given, allowed 1 to 6 with sum lattice in 2 dimensions" check steep.yaml
lattice strict.yaml "{power: 2}" "precision: {mode: strict}"
expect 2 "strict given, but forces[0] has sum lattice" check strict.yaml
exit $failed
