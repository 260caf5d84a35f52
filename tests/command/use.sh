#!/bin/sh
# Test: use of the program as such: help, names, options, exit status.
. "$(dirname "$0")/common.sh"

expect 0 "gamboge plot" help
expect 0 "--out P.png" help plot
expect 0 "--out P.png" plot --help
expect 0 "gamboge 0." --version
expect 0 "limits" info
expect 0 "direct" bench
expect 2 "there is no folder" bench noise --json nowhere/f.json
expect 2 "nearest is plot" plto
expect 2 "nearest is info" help infos
expect 2 "nearest is --width" plot s.nc --out s.png --widht 300
expect 2 "needs S.nc" plot --out s.png
expect 2 "needs --out" plot s.nc
expect 2 "needs a value" plot s.nc --out
expect 2 "needs a value" plot s.nc --out --width 300
expect 2 "one word too many" plot s.nc t.nc --out s.png
expect 2 "from 200 to 16000" plot s.nc --out s.png --width -3
expect 2 "from 200 to 16000" plot s.nc --out s.png --width=1e3
expect 2 "from 200 to 16000" plot s.nc --out s.png --width 99999999999999999999
expect 2 "nearest is --help" info -hlep
"$gamboge" >said 2>&1
[ $? -eq 2 ] || fault "no command at all is not bad use"

# A full disc must not look like success.
if [ -w /dev/full ]; then
    "$gamboge" info >/dev/full 2>said
    [ $? -eq 1 ] || fault "output to a full disc is success"
fi
exit $failed
