#!/bin/bash
# Carter's thesis (2016) remade: the pictures 5.2 to 5.4 of who took part in an overlap at three time
# steps, and the tables 6.2 and 6.5 of rounds of overlap correction, his figures beside ours.
set -euo pipefail

usage() {
    cat <<'END'
usage: carter2016.sh [OPTION...] [RESULT_DIR]     default RESULT_DIR: results/carter2016
  --quick          tiny sizes, a few seconds: to see that everything works
  --full           all sizes of the thesis in short range (to 2^20) and up to 2^17 in long range, pictures of 4096 particles
                   in long range too, and of every rule: hours
  --part P         tables or pictures only
  --range R        short or long range only (default: both)
  --build DIR      takes the program from this build; without it, the tree is built as by demo.sh
  --rules "R..."   contact rules (default: carter bounce event bridge, those this version has)
  --vacancies V    share of empty lattice sites of the start (default 0.02: the thesis gives none)
The default takes some minutes on two cores.
END
}

complain() {
    echo "carter2016.sh: $*" >&2
    exit 2
}

root=$(realpath "$(dirname "$0")/..")
size=default build='' rules='carter bounce event bridge' vacancies=0.02 results='' part=all range=''
while [ $# -gt 0 ]; do
    case $1 in
    --quick | --full) size=${1#--} ;;
    --build | --part | --range | --rules | --vacancies)
        [ $# -gt 1 ] || complain "$1 needs a value"
        name=${1#--}
        printf -v "$name" '%s' "$2"
        shift
        ;;
    --help | -h)
        usage
        exit
        ;;
    -*) complain "there is no option $1 (--help lists them)" ;;
    *)
        [ -z "$results" ] || complain "\"$1\" is one word too many (--help)"
        results=$1
        ;;
    esac
    shift
done
results=$(realpath -m "${results:-results/carter2016}")
case $vacancies in
0 | 0.[0-9] | 0.[0-8][0-9] | 0.[0-8][0-9][0-9]) ;;
*) complain "--vacancies $vacancies: a number from 0 to 0.9 is needed" ;;
esac

case $part in
all | tables | pictures) ;;
*) complain "--part $part: tables or pictures is needed" ;;
esac
case $range in
'' | short | long) ;;
*) complain "--range $range: short or long is needed" ;;
esac

# Sizes of the three runs: particles and steps of the pictures, steps of the second set of pictures,
# powers of two of the tables in short and long range, steps of the tables.
picture_n_short=4096 picture_n_long=1024 picture_steps=10000 same_steps=1000 table_steps=100 picture_width=1800
short_powers='10 11 12 13 14 15 16' long_powers='10 11 12 13 14'
case $size in
quick)
    picture_n_short=256 picture_n_long=128 picture_steps=60 same_steps=20 table_steps=20 picture_width=900
    short_powers='8 10' long_powers='7 8'
    ;;
full)
    short_powers='10 11 12 13 14 15 16 17 18 19 20' long_powers='10 11 12 13 14 15 16 17'
    picture_n_long=4096
    ;;
esac
ranges='short long'
if [ -n "$range" ]; then
    ranges=$range
fi
time_steps='0.01 0.001 0.0001'

# A folder of ours carries a mark; any other that holds something stays as it is.
mark="$results/.carter2016"
if [ -e "$results" ] && [ ! -d "$results" ]; then
    complain "$results is not a folder"
fi
if [ -d "$results" ] && [ ! -e "$mark" ] && [ -n "$(ls -A "$results")" ]; then
    complain "$results holds files that are not of this script: give another folder"
fi

if [ -z "$build" ]; then
    # shellcheck disable=SC1091
    . "$root/tests/setup.sh"
    # shellcheck disable=SC2086,SC2154
    install_packages $demo_packages
    (cd "$root" && cmake --preset default -DGBG_BUILD_TESTS=OFF && cmake --build --preset default)
    build=$root/build/default
fi
[ -x "$build/bin/gamboge" ] || complain "there is no program $build/bin/gamboge"
program=$(realpath "$build")/bin/gamboge
mkdir -p "$results" || complain "cannot make $results"
touch "$mark" || complain "cannot write into $results"
cd "$results"
rm -rf runs locality_*.png same_*.png rounds_*.{csv,png} share_*.{csv,png} index.html
mkdir -p runs
. "$root/examples/carter2016/functions.sh"

pictures='' started=$SECONDS
say "results go to $results"
settle_rules
[ "$part" = pictures ] || make_tables
[ "$part" = tables ] || make_pictures
make_page
say "done: all tables and pictures are on $results/index.html"
all_ran
