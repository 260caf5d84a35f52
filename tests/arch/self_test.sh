#!/bin/sh
# Test of the architecture test: it passes a clean tree and finds each fault planted in it.
set -u
here=$(cd "$(dirname "$0")" && pwd)
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
failed=0

# plant PATH LINE...: a file with a proper first line and these lines.
plant() {
    file=$root/$1
    mkdir -p "$(dirname "$file")"
    shift
    printf '%s\n' "/* L0: planted. */" "$@" >"$file"
}

# expect RULE PATH LINE...: the planted file must be found, with the words of the rule.
expect() {
    rule=$1
    shift
    plant "$@"
    if said=$(sh "$here/arch.sh" "$root"); then
        echo "not found: $rule ($1)"
        failed=1
    elif ! printf '%s\n' "$said" | grep -F "$1" | grep -qF "$rule"; then
        echo "found for another reason: $rule ($1): $said"
        failed=1
    fi
    rm "$root/$1"
}

plant c/core/clean.c '#include <stdio.h>' '#include "core/text.h"' '#include "gamboge/status.h"' \
    '/* a comment may name printf( and exit(' '   and nc_open( over two lines */' \
    'static const char *const word = "abort() \" stdout";' \
    'int f(void) __attribute__((format(printf, 1, 2)));' \
    'int n = snprintf(0, 0, "x"); // printf("")'
plant c/io/clean.c '#include <netcdf.h>' '#include "scene/scene.h"' '#include "engine/view.h"' \
    'int s = nc_open("a", 0, 0);'
plant c/command/clean.c '#include "gamboge/engine.h"' 'int s = printf("x");'
plant c/api/clean.c '#include "engine/engine.h"' '#include "io/restart.h"'
plant c/core/inline.h '#define GBG_INLINE static __host__ __device__'
plant c/backend/cpu/simd.h '#include "cuda/simd_cuda.h"'
plant cuda/clean.cu '#include "cuda/cuda.h"' '#include "backend/cpu/noise.h"' '#include <cub/cub.cuh>' \
    'static __global__ void f(int *x) {}' 'cudaError_t s = cudaFree(0);' 'void g() { f<<<1, 1>>>(0); }'
if ! said=$(sh "$here/arch.sh" "$root"); then
    echo "a clean tree is refused: $said"
    failed=1
fi

expect "may not include" c/core/bad.c '#include "scene/scene.h"'
expect "may not include" c/core/bad.c '#  include "engine/view.h"'
expect "may not include" c/scene/build.c '#include "engine/engine.h"'
expect "may not include" c/backend/cpu/bad.c '#include "scene/scene.h"'
expect "may not include" c/engine/bad.h '#include "api/call.h"'
expect "may not include" c/io/bad.c '#include "engine/engine.h"'
expect "may not include" c/io/bad.c '#include "analysis/mesh.h"'
expect "may not include" c/analysis/bad.c '#include "io/file.h"'
expect "may not include" c/command/bad.c '#include "engine/view.h"'
expect "may not include" include/gamboge/bad.h '#include "core/box.h"'
expect "may not include" bench/bad.c '#include "engine/engine.h"'
expect "may not include" examples/c/bad.c '#include "core/box.h"'
expect "may not include" c/core/bad.c '#include "../scene/scene.h"'
expect "may not include" cuda/bad.cu '#include "engine/engine.h"'
expect "may not include" c/backend/cpu/bad.c '#include "cuda/cuda.h"'
expect "may not include" c/engine/bad.c '#include "cuda/simd_cuda.h"'
expect "never prints" cuda/bad.cu 'static __global__ void f() { printf("x"); }'
expect "belong to" c/backend/cpu/bad.c 'int s = cudaMalloc(0, 0);'
expect "belong to" c/engine/bad.h 'static __global__ void f(void);'
expect "belong to" c/api/bad.c 'int s = gbg_cuda_live();'
expect "never prints" c/engine/bad.c 'void f(void) { printf("x"); }'
expect "never prints" c/api/bad.c 'void f(void) { fputs("x", 0); }'
expect "never prints" c/core/bad.c 'void f(void) { exit (1); }'
expect "never prints" c/backend/cpu/bad.c 'void f(int x) { assert(x); }'
expect "never prints" c/io/bad.c 'void *f(void) { return stderr; }'
expect "never prints" c/io/bad.c '/* a comment' ' that ends here */ void f(void) { abort(); }'
expect "belong to" c/engine/bad.c 'int s = nc_close(1);'
expect "belong to" c/io/bad.c 'int s = fftw_init_threads();'
expect "belong to" c/command/bad.c 'int s = yaml_parser_initialize(0);'
expect "belong to" c/analysis/bad.c 'int s = cairo_status(0);'
expect "Python" tests/bad.py
mkdir -p "$root/c/core"
seq 1 700 | sed 's|.*|/* & */|' >"$root/c/core/long.c"
sh "$here/arch.sh" "$root" | grep -F 'c/core/long.c:601' | grep -qF 'more than 600' || {
    echo "not found: a long file"
    failed=1
}
rm "$root/c/core/long.c"
for name in c/core/bare.c fortran/bare.f90 tests/bare.sh cmake/bare.cmake; do
    mkdir -p "$root/$(dirname $name)"
    echo 'set(x 1)' >"$root/$name"
    sh "$here/arch.sh" "$root" | grep -F "$name:1" | grep -qF 'first line' || {
        echo "not found: no first line in $name"
        failed=1
    }
    rm "$root/$name"
done
exit $failed
