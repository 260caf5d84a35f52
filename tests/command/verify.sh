#!/bin/sh
# Test: gamboge verify finds what is planted in a trajectory, and nothing in a clean one.
. "$(dirname "$0")/common.sh"
. "$(dirname "$0")/craft.sh"

# Touching discs, one pair across the border; frames one step apart.
craft good.nc double "10, 10, 10" "0, 1" "0.5, 0.5, 0.5, 0.5" \
    "2, 2, 0, 3, 2, 0, 0.25, 7, 0, 9.25, 7, 0, 2, 2, 0, 3.1, 2, 0, 0.3, 7, 0, 9.3, 7, 0"
expect 0 "verdict        good" verify good.nc
grep -q "closest pair   1 of contact" said || fault "touching discs are not at contact: $(cat said)"
grep -q "passed through 0$" said || fault "neighbouring frames are not decided"
expect 0 "1 frame, 4 particles" verify good.nc --first 1

# Overlaps by a millionth: within the box, and across its border with an origin.
craft overlap.nc double "10, 10, 10" "0, 1" "0.5, 0.5, 0.5" \
    "2, 2, 0, 3, 2, 0, 7, 7, 0, 2, 2, 0, 2.999999, 2, 0, 7, 7, 0"
expect 1 "overlaps       1" verify overlap.nc
grep -q "frame 1: particles 0 and 1 overlap: distance 0.99999" said || fault "place: $(cat said)"
expect 0 "overlaps       0" verify overlap.nc --last 0
origin="-5, -5, 0" craft border.nc double "10, 10, 10" "0" "0.5, 1" "-4.9, 0, 0, 3.600001, 0, 0"
expect 1 "overlaps       1" verify border.nc
origin="-5, -5, 0" craft border.nc double "10, 10, 10" "0" "0.5, 1" "-4.9, 0, 0, 3.6, 0, 0"
expect 0 "overlaps       0" verify border.nc

# In float the same overlap of a millionth of a diameter is lost below the storage in a large box,
# and one above it is found.
craft float.nc float "100, 100, 100" "0" "0.5, 0.5" "90, 2, 0, 90.99999, 2, 0"
expect 0 "stored as float" verify float.nc
craft float.nc float "100, 100, 100" "0" "0.5, 0.5" "90, 2, 0, 90.999, 2, 0"
expect 1 "overlaps       1" verify float.nc

# Many discs, so that cells are used: one overlap among 40 x 40, at the corner across both borders.
lattice() {
    awk -v last="$1" 'BEGIN {
        for (i = 0; i < 40; i++) for (j = 0; j < 40; j++) {
            shift = i == 39 && j == 39 ? last : 0
            printf("%s%.17g, %.17g, 0", (i + j ? ", " : ""), i * 1.1 + shift, j * 1.1 + shift)
        } }'
}
radii=$(awk 'BEGIN {for (i = 0; i < 1600; i++) printf("%s0.5", (i ? ", " : ""))}')
craft lattice.nc double "44, 44, 44" "0" "$radii" "$(lattice 0)"
expect 0 "overlaps       0" verify lattice.nc
craft lattice.nc double "44, 44, 44" "0" "$radii" "$(lattice 0.4)"
expect 1 "particles 0 and 1599 overlap" verify lattice.nc

# A pair that has changed places in one step, and the same frames further apart.
craft swap.nc double "20, 20, 20" "4, 5" "0.5, 0.5" \
    "5, 5, 0, 6.2, 5, 0, 6.2, 5, 0, 5, 5, 0"
expect 1 "passed through 1" verify swap.nc
grep -q "frame 1: particles 0 and 1 passed through each other" said || fault "place: $(cat said)"
craft apart.nc double "20, 20, 20" "0, 100" "0.5, 0.5" \
    "5, 5, 0, 6.2, 5, 0, 6.2, 5, 0, 5, 5, 0"
expect 0 "cannot be decided between 1 of 1 pairs of frames, up to 100 steps" verify apart.nc
# Two that move far, past each other at a distance, or together, have not.
craft past.nc double "20, 20, 20" "4, 5" "0.5, 0.5" \
    "5, 5, 0, 6.2, 5, 0, 5, 5, 0, 5.6, 6.2, 0"
expect 0 "passed through 0" verify past.nc
craft both.nc double "20, 20, 20" "4, 5" "0.5, 0.5" "5, 5, 0, 6.2, 5, 0, 7, 5, 0, 8.2, 5, 0"
expect 0 "passed through 0" verify both.nc

# Bad coordinates.
craft nan.nc double "10, 10, 10" "0" "0.5, 0.5, 0.5" "2, 2, 0, NaN, 2, 0, 3, 2, 0"
expect 1 "bad frames     1" verify nan.nc
craft outside.nc double "10, 10, 10" "0" "0.5, 0.5" "2, 2, 0, 3, 10.001, 0"
expect 1 "outside box    1" verify outside.nc

# Small boxes: a core larger than the box, two cells an axis, three dimensions.
craft self.nc double "0.9, 10, 10" "0" "0.5" "0.1, 2, 0"
expect 1 "its own image" verify self.nc
craft narrow.nc double "1000, 1, 1000" "0" "0.5, 0.5" "1, 0.1, 0, 1.5, 0.6, 0"
expect 1 "overlaps       1" verify narrow.nc
dims=3 craft deep.nc double "5, 5, 5" "0" "0.5, 0.5" "0.1, 0.1, 0.1, 4.6, 4.6, 4.6"
expect 1 "3 dimensions" verify deep.nc
dims=3 craft deep.nc double "5, 5, 5" "0" "0.5, 0.5" "0.1, 0.1, 0.1, 4.4, 4.4, 4.4"
expect 0 "overlaps       0" verify deep.nc
craft points.nc double "5, 5, 5" "0" "0, 0" "1, 1, 0, 1, 1, 0"
expect 0 "no hard cores" verify points.nc

extra=':excluded_volume = "none";' craft drawn.nc double "5, 5, 5" "0" "0.5, 0.5" "1, 1, 0, 1, 1, 0"
expect 0 "no hard cores" verify drawn.nc
extra=':excluded_volume = "bounce";' craft hard.nc double "5, 5, 5" "0" "0.5, 0.5" "1, 1, 0, 1, 1, 0"
expect 1 "distance 0, contact 1" verify hard.nc

expect 2 "there is no file" verify none.nc
expect 2 "the frames of good.nc are 0 to 1" verify good.nc --first 2
expect 2 "the frames of good.nc are 0 to 1" verify good.nc --last 2
echo "text" >text.nc
expect 2 "text.nc" verify text.nc
exit $failed
