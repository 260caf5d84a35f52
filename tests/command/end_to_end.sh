#!/bin/sh
# Test: from a scene file to pictures: run, verify, sk, plot, render, as README shows them.
. "$(dirname "$0")/common.sh"

expect 0 "overlaps left  0" run "$root/examples/scenes/carter_c3_long.yaml" --out c3.nc --steps 20
expect 0 "verdict        good" verify c3.nc
expect 0 "written        s.nc" sk c3.nc --out s.nc --types
ncdump -h s.nc >said
grep -q "input_sha256 = \"$(sha256sum c3.nc | cut -d ' ' -f 1)\"" said || fault "$(cat said)"
expect 0 "3 partials" plot s.nc --out s.png
is_png s.png 1200
expect 0 "1200 x" render c3.nc --out c3.png
is_png c3.png 1200

expect 0 "direct" sk c3.nc --out direct.nc --method direct --kmax 4 --last 0
expect 2 "auto|mesh|direct" sk c3.nc --out s.nc --method fast
expect 2 "is the input" sk c3.nc --out c3.nc
expect 2 "there is no file" sk none.nc --out s.nc
expect 2 "the frames of c3.nc are" sk c3.nc --out s.nc --first 99
untouched kept.nc sk none.nc --out kept.nc
untouched kept.nc sk c3.nc --out kept.nc --first 99
exit $failed
