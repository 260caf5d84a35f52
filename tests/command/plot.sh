#!/bin/sh
# Test: gamboge plot draws a structure factor, and spoils nothing when it cannot.
. "$(dirname "$0")/common.sh"

ncgen -4 -o s.nc - <<'END'
netcdf s {
dimensions: k = 4; pair = 3; bnd = 2; type = 2; strlen = 8;
variables:
  double k(k), S(k), S_stderr(k), S_numerr(k), S_partial(pair, k), S_partial_stderr(pair, k);
  int pair_types(pair, bnd), n_particles(type);
  char type_name(type, strlen);
  :frames_used = 3; :input_files = "it's a \"run\".nc";
data:
  k = 1, 2, 3, 4; S = 0.1, 0.5, 2, 1; S_stderr = 0.1, 0.1, NaN, 0.1; S_numerr = 0, 0, 1e-7, 0;
  S_partial = 1, 1, 1, 1, 0, 0, 0, 0, 1, 1, NaN, 1;
  S_partial_stderr = 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0;
  pair_types = 0, 0, 0, 1, 1, 1; n_particles = 10, 20; type_name = "red", "blue";
}
END
ncgen -4 -o other.nc - <<'END'
netcdf other { dimensions: k = 4; variables: double k(k); data: k = 1, 2, 3, 4; }
END
echo "no netCDF" >text.nc

expect 0 "4 shells, 3 partials" plot s.nc --out s.png
is_png s.png 1200
expect 0 "4 shells, 3 partials" plot s.nc --out small.png --width 300
is_png small.png 300
expect 0 "4 shells, 3 partials" plot s.nc --out s.SVG
for word in "it's a" "red-blue" "1e-07"; do
    grep -qF -e "$word" s.SVG || fault "the picture lacks \"$word\""
done
[ "$(ls ./*.partial* 2>/dev/null)" = "" ] || fault "temporary files are left"

expect 2 "there is no file" plot none.nc --out s.png
expect 2 "cannot be read" plot text.nc --out s.png
expect 2 "no structure factor" plot other.nc --out s.png
expect 2 ".png or .svg" plot s.nc --out s.jpg
expect 2 "there is no folder" plot s.nc --out nowhere/s.png
ln s.nc linked.png
expect 2 "is the input" plot s.nc --out linked.png
mkdir folder.png
expect 2 "not a plain file" plot s.nc --out folder.png
untouched kept.png plot text.nc --out kept.png
untouched kept.png plot other.nc --out kept.png

# Without gnuplot, and with one that fails.
mkdir bin
for tool in cat grep tail ls rm; do
    ln -s "$(command -v $tool)" bin/$tool
done
saved=$PATH
PATH=$PWD/bin
expect 1 "apt-get install gnuplot-nox" plot s.nc --out s.png
untouched kept.png plot s.nc --out kept.png
PATH=$saved
printf '#!/bin/sh\nexit 3\n' >bin/gnuplot
chmod +x bin/gnuplot
PATH=$PWD/bin:$PATH
expect 1 "gnuplot did not draw" plot s.nc --out s.png
untouched kept.png plot s.nc --out kept.png
exit $failed
