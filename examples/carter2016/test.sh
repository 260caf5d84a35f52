#!/bin/bash
# Test: carter2016.sh in tiny sizes makes its tables and pictures, and leaves foreign folders alone.
# test.sh BUILD_DIR FOLDER
set -u
script=$(realpath "$(dirname "$0")/../carter2016.sh")
build=$(realpath "$1")
rm -rf "$2"
mkdir -p "$2"
cd "$2" || exit 2
failed=0

fault() {
    echo "FAULT: $*"
    failed=1
}

refused() { # refused WORDS ARGUMENT...
    local words=$1
    shift
    bash "$script" --build "$build" "$@" >said 2>&1
    [ $? -eq 2 ] || fault "carter2016.sh $*: not refused"
    grep -qF -e "$words" said || fault "carter2016.sh $*: said \"$(cat said)\", without \"$words\""
}

mkdir foreign
echo precious >foreign/rounds_short_carter.csv
refused "not of this script" foreign
[ "$(cat foreign/rounds_short_carter.csv)" = precious ] || fault "a foreign file was changed"
[ "$(ls -A foreign)" = rounds_short_carter.csv ] || fault "something was put into a foreign folder"
refused "is not a folder" said
refused "no option --quik" --quik out
refused "--range middle" --range middle out
refused "--vacancies 2" --vacancies 2 out
refused "one word too many" out out2
refused "none of the rules" --quick --rules "bouncy" out

bash "$script" --quick --rules "carter bounce" --build "$build" out >said 2>&1 || fault "it failed: $(tail -n 3 said)"
grep -q "^     1024 .*6\.48 " said || fault "the table lacks the thesis's 6.48: $(cat said)"
grep -q ",6.48,3.25,5.7,8.69,0.99\$" out/rounds_short_carter.csv || fault "table 6.5 is not in its file"
for name in rounds_short_carter rounds_long_bounce share_short_carter share_same_long_bounce rounds_same_short_carter; do
    if [ ! -s "out/$name.csv" ] || [ ! -s "out/$name.png" ]; then
        fault "$name is missing"
    fi
    [ "$(grep -v '^#' out/$name.csv | awk -F, 'NR > 1 {for (c = 2; c < 7; c++) if ($c == "") print}' | wc -l)" -eq 0 ] ||
        fault "$name has empty cells: $(cat out/$name.csv)"
    grep -q "$name.png" out/index.html || fault "the page lacks $name"
done
for name in locality_short_carter_dt0.0001 locality_long_carter_dt0.01 same_short_bounce; do
    [ -s "out/$name.png" ] || fault "$name is missing"
done

# The table holds what the program itself prints, and smaller steps have fewer overlaps.
printed=$("$build/bin/gamboge" run out/runs/C3_short_carter_1024.yaml --steps 20 | sed -n 's/^overlap rounds \(.*\) a step/\1/p')
grep '^1024,' out/rounds_short_carter.csv | cut -d, -f5 | awk -v said="$printed" '{exit !(($1 - said)^2 < 1e-4 && said > 1)}' ||
    fault "C3: $printed rounds are printed, but: $(grep '^1024,' out/rounds_short_carter.csv)"
awk -F, 'NR == 2 {most = $5} NR == 4 {least = $5} END {exit !(most > least + 0.3)}' out/share_same_short_carter.csv ||
    fault "C3: smaller steps have not fewer overlaps: $(cat out/share_same_short_carter.csv)"

# Another run into the same folder is welcome, and a file that is not the script's stays.
echo mine >out/notes.txt
bash "$script" --quick --rules carter --part tables --range short --build "$build" out >said 2>&1 || fault "again: $(tail -n 3 said)"
[ "$(cat out/notes.txt)" = mine ] || fault "a file in the folder of results was removed"
[ ! -e out/same_short_bounce.png ] || fault "pictures of an older run are left"
exit $failed
