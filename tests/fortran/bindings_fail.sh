#!/bin/sh
# bindings.sh must see a lost function, a lost argument, a wrong kind, a wrong and a lost constant,
# and a function that no object offers.
# Arguments as for bindings.sh.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
headers=$1 generated=$2 modules=$3 cc=$4 fc=$5

# spoil DEFECT FILE SED_COMMAND WORDS: a copy of the modules with one defect, which has to be found
# and reported with these words.
spoil() {
    cp "$modules"/*.f90 "$work"
    sed "$3" "$modules/$2" > "$work/$2"
    cmp -s "$modules/$2" "$work/$2" && { echo "nothing was spoilt: $1"; exit 1; }
    if sh "$here/bindings.sh" "$headers" "$generated" "$work" "$cc" "$fc" > "$work/log.txt" 2>&1
    then
        echo "bindings.sh did not see: $1"
        exit 1
    fi
    grep -q "$4" "$work/log.txt" || { echo "no word on: $1"; cat "$work/log.txt"; exit 1; }
}
spoil "a lost function" gamboge_c.f90 \
    '/function gbg_engine_run/,/end function gbg_engine_run/d' 'gbg_engine_run is missing'
spoil "a lost argument" gamboge_c.f90 \
    's/gbg_engine_hash(engine, capacity, text)/gbg_engine_hash(engine, text)/' \
    'gbg_engine_hash differs'
spoil "a wrong kind" gamboge_c.f90 \
    's/integer(c_int64_t), value :: steps/integer(c_int), value :: steps/' 'gbg_engine_run differs'
spoil "a wrong constant" gamboge_constants.f90 's/gbg_e_step = 9/gbg_e_step = 8/' \
    'constants differ'
spoil "a lost constant" gamboge_constants.f90 '/gbg_max_forces = /d' \
    'constant of the headers is missing'
spoil "a function that no object offers" gamboge_engine.f90 's/gbg_engine_save/gbg_engine_run/g' \
    'gbg_engine_save is used by no module'
echo "bindings.sh saw all six defects"
