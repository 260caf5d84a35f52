# Trajectories made by hand, to be sourced: no code of gamboge takes part in the writing.

# craft FILE TYPE BOX STEPS RADII COORDINATES: an AMBER trajectory with coordinates of TYPE (double,
# float), a box "x, y, z", the step of each frame "0, 1", the radius of each particle "0.5, 0.5", and
# x, y, z of each particle of each frame. dims (default 2): dimensionality; extra: more attributes.
craft() {
    atoms=$(echo "$5" | tr ',' '\n' | wc -l)
    frames=$(echo "$4" | tr ',' '\n' | wc -l)
    boxes=$3
    angles="90, 90, 90"
    origins=${origin:-"0, 0, 0"}
    types=1
    i=1
    while [ $i -lt "$frames" ]; do
        boxes="$boxes, $3"
        angles="$angles, 90, 90, 90"
        origins="$origins, ${origin:-0, 0, 0}"
        i=$((i + 1))
    done
    i=1
    while [ $i -lt "$atoms" ]; do
        types="$types, $((i % 2 + 1))"
        i=$((i + 1))
    done
    flags=$(echo "$6" | awk -F, '{
        for (i = 1; i <= NF / 3; i++) printf("%s%d", (i > 1 ? ", " : ""), i % 2)
    }')
    ncgen -k "64-bit offset" -o "$1" - <<END
netcdf t {
dimensions:
  frame = UNLIMITED; atom = $atoms; spatial = 3; cell_spatial = 3; cell_angular = 3; label = 5;
variables:
  char spatial(spatial), cell_spatial(cell_spatial), cell_angular(cell_angular, label);
  int atom_types(atom), step(frame);
  double radius(atom), time(frame), cell_origin(frame, cell_spatial);
  double cell_lengths(frame, cell_spatial), cell_angles(frame, cell_angular);
  $2 coordinates(frame, atom, spatial);
  int overlap(frame, atom);
  time:units = "picosecond"; cell_lengths:units = "angstrom"; cell_angles:units = "degree";
  coordinates:units = "angstrom"; radius:units = "angstrom"; cell_origin:units = "angstrom";
  :Conventions = "AMBER"; :ConventionVersion = "1.0"; :program = "hand"; :programVersion = "1";
  :dimensionality = ${dims:-2}; ${extra:-}
data:
  spatial = "xyz"; cell_spatial = "abc"; cell_angular = "alpha", "beta ", "gamma";
  atom_types = $types; radius = $5; time = $4; step = $4;
  cell_origin = $origins; cell_lengths = $boxes; cell_angles = $angles;
  coordinates = $6;
  overlap = $flags;
}
END
}
