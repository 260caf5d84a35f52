#!/bin/sh
# update.sh BUILD_DIR: stores what the C examples of a build print, tolerances kept. For a change
# that is meant to change results; say in its commit why.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
for expected in "$here"/expected/*.txt; do
    name=$(basename "$expected" .txt)
    "$1/examples/example_${name}_c" > "$expected.printed"
    awk 'FNR == 1 { file++ }
         file == 1 { value[$1] = $2; next }
         $1 in value { $2 = value[$1] }
         { print }' "$expected.printed" "$expected" > "$expected.new"
    rm "$expected.printed"
    mv "$expected.new" "$expected"
done
