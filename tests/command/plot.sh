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
PATH=$saved

# Tables: every column a curve but those of errors; points take the colour of their partner.
cat >t.csv <<'END'
# rounds a step
N, "C0", C0 error, C1, thesis C0, none
1000, 5, 0.5, 3, 5.5,
2000, 6, 1, -3, ,
END
expect 0 "3 curves of t.csv, 2 rows" plot t.csv --out t.svg --points thesis --title "it's" --ylabel rounds
for word in "it's" "thesis C0" rounds; do
    grep -qF -e "$word" t.svg || fault "the plot of the table lacks \"$word\""
done
grep -qF "C0 error" t.svg && fault "the errors of C0 are drawn as a curve"
[ "$(grep -c "rgb(  0, 114, 178)" t.svg)" -gt "$(grep -c "rgb(230, 159,   0)" t.svg)" ] || fault "the points have a colour of their own"
expect 0 "cannot show: 1" plot t.csv --out t.png --log xy --width 400
is_png t.png 400
expect 2 "is an option of tables" plot s.nc --out s.png --log x
expect 2 "x|y|xy" plot t.csv --out t.png --log z
wrong() {
    printf "%b" "$2" >wrong.csv
    untouched kept.png plot wrong.csv --out kept.png ${3:-}
    expect 2 "$1" plot wrong.csv --out w.png ${3:-}
}
wrong "no line with names" "# nothing\n\n"
wrong "at least two columns" "a\n1\n"
wrong "no row of numbers" "a,b\n"
wrong "line 3: 1 cells, but 2" "a,b\n1,2\n3\n"
wrong "line 2: 3 cells, but 2" "a,b\n1,2,3\n"
wrong "line 2, column \"b\": \"two\"" "a,b\n1,two\n"
wrong "no value that can be drawn" "a,b\n1,-2\n" "--log y"
exit $failed
