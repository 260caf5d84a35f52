/* Transforms by FFTW in double precision. */
#define GBG_REAL double
#define GBG_FFTW(name) fftw_##name
#define GBG_TABLE gbg_fft_double
#include "fft/transforms.h"
