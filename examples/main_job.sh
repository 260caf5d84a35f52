#!/bin/bash
# The main job: the five suspensions of Carter (2016), long and short range, simulated, checked,
# analysed and drawn. main_job.sh BUILD_DIR RESULT_DIR; a few minutes on two cores.
set -euo pipefail
if [ $# -ne 2 ]; then
    echo "usage: main_job.sh BUILD_DIR RESULT_DIR" >&2
    exit 2
fi
program=$(realpath "$1")/bin/gamboge
scenes=$(realpath "$(dirname "$0")/scenes")
mkdir -p "$2"
cd "$2"

# Fewer steps than the scenes ask for, to be done within minutes; long range costs all pairs. C4 in
# short range is dilute and keeps the lattice of its start for long: after 5000 steps it still stands
# out in S(k); it is also the fastest.
# GBG_DEMO_STEPS, if set, is the number of steps of all.
steps_of() {
    case $1 in
    *_long) echo "${GBG_DEMO_STEPS:-2000}" ;;
    *_c4_short) echo "${GBG_DEMO_STEPS:-20000}" ;;
    *) echo "${GBG_DEMO_STEPS:-5000}" ;;
    esac
}

# One scene, from its file to its pictures; one thread, since scenes run side by side. The first
# quarter of the frames (one every 100 steps) still shows the lattice of the start: left out of S(k).
work() {
    steps=$(steps_of "$1")
    "$program" run "$scenes/$1.yaml" --out "$1.nc" --steps "$steps" --threads 1 &&
        "$program" verify "$1.nc" &&
        "$program" sk "$1.nc" --out "$1.sk.nc" --types --first $((steps / 400)) --threads 1 &&
        "$program" plot "$1.sk.nc" --out "$1.sk.png" &&
        "$program" render "$1.nc" --out "$1.png" &&
        "$program" render "$1.nc" --colour overlap --out "$1.overlap.png"
}

started=$SECONDS
attempt() {
    if work "$1" >"$1.log" 2>&1; then
        printf '%4d s  %-16s %s, %s\n' $((SECONDS - started)) "$1" \
            "$(sed -n 's/^done  *//p' "$1.log")" \
            "$(sed -n 's/^overlaps left  *0$/no overlap left/p' "$1.log")"
    else
        echo "$1 failed: $(tail -n 1 "$1.log")" >&2
        return 1
    fi
}

# A page with all pictures.
page() {
    echo '<!doctype html><meta charset="utf-8"><title>gamboge: the five suspensions of Carter (2016)</title>'
    echo '<style>body{font:16px sans-serif}img{width:30vw}td{vertical-align:top}</style><table>'
    for scene in "$@"; do
        echo "<tr><td colspan=3><h2>$scene</h2><tr>"
        for kind in png overlap.png sk.png; do
            echo "<td><a href=\"$scene.$kind\"><img src=\"$scene.$kind\" alt=\"$scene.$kind\"></a>"
        done
    done
    echo '</table>'
}

# The slowest first, so that the cores end together.
names=()
for range in long short; do
    for number in 3 2 0 1 4; do
        names+=("carter_c${number}_$range")
    done
done
cores=$(nproc)
echo "running ${#names[@]} scenes, $cores at a time: simulate, verify, structure factor, pictures"
failed=0
for name in "${names[@]}"; do
    while [ "$(jobs -rp | wc -l)" -ge "$cores" ]; do
        wait -n || failed=1
    done
    attempt "$name" &
done
while [ "$(jobs -p | wc -l)" -gt 0 ]; do
    wait -n || failed=1
done
if [ "$failed" -ne 0 ]; then
    echo "the main job failed; each scene's log is in $PWD" >&2
    exit 1
fi
mapfile -t names < <(printf '%s\n' "${names[@]}" | sort)
page "${names[@]}" >index.html
cat <<END
for each scene in $PWD:
  NAME.nc           trajectory (AMBER netCDF)        NAME.png          last frame, by species
  NAME.sk.nc        structure factor with errors     NAME.overlap.png  who took part in an overlap
  NAME.log          what the program said            NAME.sk.png       S(k) and its partials
all pictures on one page: index.html
END
