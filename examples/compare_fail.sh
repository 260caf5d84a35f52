#!/bin/sh
# compare.sh must see a wrong number, a wrong text, a line too few or too many, and twins that differ.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
printf '# comment\nlength 2.5 1e-3\nlabel abc text\n' > expected.txt
# prints NAME LINE...: a program NAME that prints these lines.
prints() {
    name=$1
    shift
    { echo '#!/bin/sh'; for line in "$@"; do echo "echo '$line'"; done; } > "$name"
    chmod +x "$name"
}
refused() {
    what=$1
    shift
    if sh "$here/compare.sh" expected.txt "$@" > log.txt 2>&1; then
        echo "compare.sh did not see $what"
        exit 1
    fi
}
prints good 'length 2.5004' 'label abc'
prints same 'length 2.5004E+00' 'label abc'
prints near 'length 2.5005' 'label abc'
prints far 'length 2.6' 'label abc'
prints nan 'length nan' 'label abc'
prints short 'label abc'
prints long 'length 2.5' 'label abc' 'more 1'
sh "$here/compare.sh" expected.txt ./good ./same
refused "a number that is off" ./far
refused "a number that is none" ./nan
refused "a line too few" ./short
refused "a line too many" ./long
refused "twins that differ" ./good ./near
prints other 'length 2.5' 'label abd'
refused "a wrong text" ./other
