#!/bin/sh
# Installs a build to a prefix that is moved afterwards: install.sh CMAKE BUILD_DIR PREFIX.
set -eu
rm -rf "$3" "$3.staged"
"$1" --install "$2" --prefix "$3.staged" >/dev/null
mv "$3.staged" "$3"
