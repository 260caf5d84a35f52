#!/bin/sh
# Test of the binary interface: abi.sh ROOT LIBRARY... The shared libraries export what the public
# headers mark with GBG_API, and the functions of c/core that libraries and program share (the
# patterns of tests/abi/shared_internal.txt: no promise to users); none has an executable stack.
set -u
root=$1
shift
export LC_ALL=C
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0

# Functions after GBG_API: the gbg_ name before the opening bracket.
cat "$root"/include/gamboge/*.h | sed -n 's/^GBG_API [^(]*[ *]\(gbg_[a-z0-9_]*\)(.*/\1/p' |
    sort -u >"$work/public"
nm -D --defined-only "$@" | awk 'NF == 3 {sub(/@.*/, "", $3); print $3}' | sort -u >"$work/exported"
[ -s "$work/public" ] && [ -s "$work/exported" ] || { echo "nothing to compare"; exit 2; }

# report WORDS FILE: each name in the file is a fault.
report() {
    [ -s "$2" ] || return
    sed "s|\$|: $1|" "$2"
    failed=1
}

comm -23 "$work/exported" "$work/public" | grep -vxEf "$root/tests/abi/shared_internal.txt" \
    >"$work/extra"
report "exported, but neither in a public header nor in shared_internal.txt" "$work/extra"

comm -13 "$work/exported" "$work/public" >"$work/lacking"
report "in a public header, but not exported" "$work/lacking"

for library in "$@"; do
    if readelf -lW "$library" | grep GNU_STACK | grep -q RWE; then
        echo "$library: asks for an executable stack"
        failed=1
    fi
done
exit $failed
