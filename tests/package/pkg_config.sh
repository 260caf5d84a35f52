#!/bin/sh
# Compiles and runs a client by pkg-config alone: pkg_config.sh COMPILER SOURCE MODULE LIBDIR.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
PKG_CONFIG_PATH=$4/pkgconfig
export PKG_CONFIG_PATH
# shellcheck disable=SC2046
"$1" "$2" -o client $(pkg-config --cflags --libs "$3") -Wl,-rpath,"$4"
./client
