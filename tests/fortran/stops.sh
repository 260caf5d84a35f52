#!/bin/sh
# stops.sh PROGRAM: a failure without stat ends the program with its message and a status, nothing
# else; so does the assignment of an object.
set -u
bad=0
expect() {
    out=$("$1" "$2" 2>&1)
    status=$?
    case $out in *"$3"*) ;; *) echo "$2: no \"$3\" in: $out"; bad=1 ;; esac
    case $out in *"still running"*) echo "$2: did not stop"; bad=1 ;; esac
    [ $status = 1 ] || { echo "$2: status $status"; bad=1; }
}
expect "$1" option 'gamboge: gbg_scene_set_real: no option "dynamics.dz"'
expect "$1" errmsg 'gamboge: gbg_scene_set_real: no option "dynamics.dz"'
expect "$1" shape 'gamboge: gbg_scene_t%add_particles: the array has shape (1,4)'
expect "$1" copy 'gamboge: a gbg_scene_t cannot be assigned'
"$1" nothing > /dev/null || { echo "a run without a failure fails"; bad=1; }
exit $bad
