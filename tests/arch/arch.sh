#!/bin/sh
# Test of the architecture: arch.sh ROOT fails and names file, line and rule for each breach.
set -u
here=$(cd "$(dirname "$0")" && pwd)
cd "$1" || exit 2
failed=0
list=$(find . \( -path ./.git -o -path './build*' -o -path ./results \) -prune -o -type f -print |
    sed 's|^\./||' | LC_ALL=C sort)

sources=$(printf '%s\n' "$list" | grep -E '\.(c|cu|h|h\.in|f90|f|sh|awk|cmake)$')
[ -n "$sources" ] || { echo "no sources under $1"; exit 2; }
# shellcheck disable=SC2086
LC_ALL=C awk -f "$here/arch.awk" $sources || failed=1

python=$(printf '%s\n' "$list" | grep -E '\.py$')
if [ -n "$python" ]; then
    echo "Python has no place here: $python"
    failed=1
fi
exit $failed
