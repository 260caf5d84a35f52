/* Transforms by FFTW in single precision. */
#define GBG_REAL float
#define GBG_FFTW(name) fftwf_##name
#define GBG_TABLE gbg_fft_single
#include "fft/transforms.h"
