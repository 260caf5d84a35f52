#!/bin/sh
# Test that MDAnalysis opens our trajectories, without a warning, and finds in them what we wrote:
# mdanalysis.sh SAMPLE. The interpreter is Debian's, for which the package python3-mdanalysis is made.
set -eu
python=/usr/bin/python3
if ! $python -c 'import MDAnalysis' 2>/dev/null; then
    echo "MDAnalysis was not found for $python: install python3-mdanalysis"
    [ -z "${GBG_TESTS_MAY_SKIP:-}" ] || exit 77
    exit 1
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$1" "$work"
cat >"$work/check.py" <<'END'
import sys
import warnings

# Importing MDAnalysis warns of a module of Python's that it uses itself (xdrlib); that is not about
# our files. Every warning after the import is an error.
with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import numpy
    import MDAnalysis
    from MDAnalysis.coordinates.TRJ import NCDFReader
    from MDAnalysis.lib.distances import capped_distance
warnings.simplefilter("error")


def check(name):
    with open(name + ".txt") as text:
        dimension, n, frames = (int(word) for word in text.readline().split())
        universe = MDAnalysis.Universe.empty(n, trajectory=True)
        universe.load_new(name + ".nc")
        assert isinstance(universe.trajectory, NCDFReader)
        assert universe.trajectory.n_frames == frames
        for step in universe.trajectory:
            time, *lengths = (float(word) for word in text.readline().split())
            places = numpy.array([text.readline().split() for _ in range(n)], dtype=float)
            assert abs(step.time - time) < 1e-12
            assert numpy.all(step.dimensions == numpy.array(lengths + [90] * 3, dtype="f4"))
            # it keeps 32-bit coordinates
            assert numpy.all(abs(step.positions - places) <= 2e-7 * (abs(places) + 1300))
            neighbours(step, dimension, lengths, places)


def neighbours(step, dimension, lengths, places):
    """Each of its searches finds the pairs of a plain double loop, in two dimensions too."""
    cutoff = 60.0 if dimension == 2 else 200.0
    away = places[:, None, :] - places[None, :, :]
    away -= numpy.round(away / lengths) * lengths
    distance = numpy.sqrt((away ** 2).sum(axis=2))
    assert not numpy.any(abs(distance - cutoff) < 1e-3)
    expected = {(i, j) for i, j in zip(*numpy.nonzero(distance < cutoff)) if i < j}
    assert len(expected) > 5
    for method in ("bruteforce", "nsgrid", "pkdtree"):
        pairs = capped_distance(step.positions, step.positions, cutoff, box=step.dimensions,
                                method=method, return_distances=False)
        assert {(i, j) for i, j in pairs if i < j} == expected, method


for path in sys.argv[1:]:
    check(path)
print("MDAnalysis", MDAnalysis.__version__, "read", len(sys.argv) - 1, "trajectories")
END
$python "$work/check.py" "$work/plain" "$work/all" "$work/flat" "$work/solid"
