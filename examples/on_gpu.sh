#!/bin/sh
# on_gpu.sh EXPECTED PROGRAM [TWIN]: an example with "cuda:0" in the place of its backend prints what
# is stored, as on the CPU (compare.sh). 77, with the reason, where there is no such GPU: then each
# has to say so and to end with 1.
set -u
said=$(mktemp)
trap 'rm -f "$said"' EXIT
skipped=0
for program in "$2" "${3:-$2}"; do
    "$program" >"$said" 2>&1
    status=$?
    if grep "backend cuda: no GPU" "$said" || grep "backend cuda is not part of this build" "$said"; then
        skipped=77
        [ $status -eq 1 ] && continue
        echo "$program: exit status $status"
        exit 1
    fi
done
[ $skipped -eq 77 ] && exit 77
exec sh "$(dirname "$0")/compare.sh" "$@"
