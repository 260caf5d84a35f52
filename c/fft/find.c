/* Transforms: finds the library that makes them, once it is asked for. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE /* dladdr */
#endif
#include "fft/fft.h"

#include <stddef.h>

#ifdef GBG_FFT_LIBRARY
#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#endif

/* There where it was linked into the same binary, as in programs of static libraries. */
extern const struct gbg_fft gbg_fft_fftw __attribute__((weak, visibility("hidden")));

#ifdef GBG_FFT_LIBRARY
enum { PATH_BYTES = 4096, WHY_BYTES = 1024 };

static pthread_mutex_t opening = PTHREAD_MUTEX_INITIALIZER;
static const struct gbg_fft *opened;
static _Thread_local char sentence[WHY_BYTES];

/* The library beside the one that this is part of, or, without one there, by its name alone: the
 * loader looks where it always does. */
static void *open_library(void)
{
    char path[PATH_BYTES];
    Dl_info here;
    if (dladdr((const void *)gbg_fft_find, &here) != 0 && strchr(here.dli_fname, '/')) {
        int folder = (int)(strrchr(here.dli_fname, '/') - here.dli_fname);
        int length =
            snprintf(path, sizeof path, "%.*s/%s", folder, here.dli_fname, GBG_FFT_LIBRARY);
        void *library = length < PATH_BYTES ? dlopen(path, RTLD_NOW | RTLD_LOCAL) : NULL;
        if (library) {
            return library;
        }
    }
    return dlopen(GBG_FFT_LIBRARY, RTLD_NOW | RTLD_LOCAL);
}

static const struct gbg_fft *find_library(const char **why)
{
    pthread_mutex_lock(&opening);
    if (!opened) {
        void *library = open_library();
        opened = library ? dlsym(library, "gbg_fft_fftw") : NULL;
        if (!opened) {
            const char *fault = dlerror();
            snprintf(sentence, sizeof sentence,
                     "%s cannot be opened (install it beside libgamboge, and FFTW: Debian packages "
                     "libfftw3-double3 and libfftw3-single3): %s",
                     GBG_FFT_LIBRARY, fault ? fault : "no reason given");
            *why = sentence;
        }
    }
    const struct gbg_fft *found = opened;
    pthread_mutex_unlock(&opening);
    return found;
}
#endif

const struct gbg_fft *gbg_fft_find(const char **why)
{
    *why = "";
    if (&gbg_fft_fftw) {
        return &gbg_fft_fftw;
    }
#if defined(GBG_FFT_LIBRARY)
    return find_library(why);
#elif defined(GBG_WITH_FFTW)
    *why = "the program was linked without libgamboge_fft (CMake: gamboge::fft, pkg-config: "
           "gamboge-fft)";
    return NULL;
#else
    *why = "this build has no FFTW: install libfftw3-dev and configure with -DGBG_WITH_FFTW=ON";
    return NULL;
#endif
}
