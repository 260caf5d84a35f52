#!/bin/sh
# Test: gamboge render draws frames as PNG and SVG, odd boxes included, and spoils nothing.
. "$(dirname "$0")/common.sh"
. "$(dirname "$0")/craft.sh"

craft two.nc double "10, 10, 10" "0, 7" "0.5, 0.5, 1" \
    "2, 2, 0, 3, 2, 0, 7, 7, 0, 2, 2, 0, 4, 2, 0, 9.9, 9.9, 0"
expect 0 "frame 1 of two.nc, 1200 x" render two.nc --out two.png
is_png two.png 1200
expect 0 "frame 0 of two.nc" render two.nc --frame 0 --width 400 --out small.png
is_png small.png 400
expect 0 "frame 1 of two.nc" render two.nc --out two.svg
grep -q "<svg" two.svg || fault "two.svg is no SVG"
expect 0 "frame 1 of two.nc" render two.nc --colour overlap --out flags.png
cmp -s two.png flags.png && fault "colours by overlap are those of the species"

# A disc at the corner of the box is drawn in all four corners: its colour and its rim, four times.
blue() {
    grep -c 'fill:rgb(0%,44.70' "$1"
}
craft corner.nc double "10, 10, 10" "0" "1" "9.9, 9.9, 0"
craft middle.nc double "10, 10, 10" "0" "1" "5, 5, 0"
expect 0 "frame 0" render corner.nc --out corner.svg
expect 0 "frame 0" render middle.nc --out middle.svg
more=$(($(blue corner.svg) - $(blue middle.svg)))
[ $more -eq 3 ] || fault "the disc at the corner is drawn $more times more than the one amidst"

dims=3 craft deep.nc double "5, 5, 5" "0" "0.5, 0.5" "0.1, 0.1, 0.1, 4.4, 4.4, 4.4"
expect 0 "1200 x" render deep.nc --out deep.png
craft strip.nc double "1000, 1, 1000" "0" "0.5, 0.5" "1, 0.5, 0, 999, 0.5, 0"
expect 0 "1200 x" render strip.nc --out strip.png
craft tower.nc double "1, 1000, 1000" "0" "0.5, 0.5" "0.5, 1, 0, 0.5, 999, 0"
expect 0 "1200 x" render tower.nc --out tower.png
craft points.nc double "5, 5, 5" "0" "0, 0" "1, 1, 0, 1, 1, 0"
expect 0 "1200 x" render points.nc --out points.png
craft giant.nc double "5, 5, 5" "0" "20" "1, 1, 0"
expect 0 "1200 x" render giant.nc --out giant.png
for picture in deep strip tower points giant; do
    is_png $picture.png 1200
done

expect 2 "there is no file" render none.nc --out p.png
expect 2 ".png or .svg" render two.nc --out p.jpg
expect 2 "the frames of two.nc are 0 to 1" render two.nc --frame 2 --out p.png
expect 2 "from -1" render two.nc --frame -2 --out p.png
expect 2 "type|overlap" render two.nc --colour red --out p.png
expect 2 "there is no folder" render two.nc --out nowhere/p.png
echo "text" >text.nc
untouched kept.png render text.nc --out kept.png
untouched kept.png render two.nc --frame 9 --out kept.png

# Panels: as many lines as trajectories, the picture as wide as asked for, a heading in the file.
expect 0 "frame 0 of deep.nc, 400 x" render two.nc --beside strip.nc,deep.nc,points.nc --columns 2 --width 800 \
    --out panels.png
[ "$(wc -l <said)" -eq 4 ] || fault "four panels, but said: $(cat said)"
is_png panels.png 800
expect 0 "took part in an overlap" render two.nc --colour overlap --title "a heading" --out heading.svg
grep -q "<svg" heading.svg || fault "heading.svg is no SVG"
expect 2 "there is no file none.nc" render two.nc --beside none.nc --out p.png
ln two.nc linked.png
expect 2 "is the input" render strip.nc --beside two.nc --out linked.png
expect 2 "from 1 to 64" render two.nc --beside strip.nc --columns 0 --out p.png
exit $failed
