# Functions of the tests of the program, to be sourced: SCRIPT PROGRAM FOLDER ROOT.
set -u
gamboge=$1
rm -rf "$2"
mkdir -p "$2"
root=$3
cd "$2" || exit 2
failed=0

fault() {
    echo "FAULT: $*"
    failed=1
}

# expect STATUS WORDS COMMAND...: the program's exit status, and words (or "") that it must say.
expect() {
    status=$1
    words=$2
    shift 2
    "$gamboge" "$@" >said 2>&1
    got=$?
    [ "$got" -eq "$status" ] || fault "gamboge $*: exit status $got, not $status: $(cat said)"
    [ -z "$words" ] || grep -qF -e "$words" said || fault "gamboge $*: said \"$(cat said)\", without \"$words\""
    if [ "$status" -ne 0 ] && ! tail -n 1 said | grep -q '^gamboge: '; then
        fault "gamboge $*: the message does not start with the program's name: $(cat said)"
    fi
}

# untouched FILE COMMAND...: what a file holds stays when the command fails.
untouched() {
    kept=$1
    shift
    echo "precious" >"$kept"
    "$gamboge" "$@" >said 2>&1 && fault "gamboge $*: no failure"
    [ "$(cat "$kept")" = precious ] || fault "gamboge $*: $kept is no longer what it was"
    rm -f "$kept"
    # shellcheck disable=SC2144
    if ls ./*.partial* >/dev/null 2>&1; then
        fault "gamboge $*: left $(ls ./*.partial*)"
        rm -f ./*.partial*
    fi
}

# is_png FILE WIDTH: a PNG of that width, by its signature and header.
is_png() {
    magic=$(od -An -tx1 -N8 "$1" 2>&1 | tr -d ' ')
    wide=$(od -An -tu1 -j18 -N2 "$1" 2>&1 | awk '{print 256 * $1 + $2}')
    [ "$magic" = 89504e470d0a1a0a ] || fault "$1 is not a PNG"
    [ "$wide" = "$2" ] || fault "$1 is $wide pixels wide, not $2"
}
