/* Transforms by FFTW: a plan's body, and what its two precisions and the cache do for it. */
#ifndef GBG_FFT_BODY_H
#define GBG_FFT_BODY_H

#include <stddef.h>

#include "fft/fft.h"

/* Lines along axis 1 or 2 that are transformed together. */
enum { GBG_FFT_LINES = 8 };

/* Plans of FFTW are untyped here, because they have two types, one for each precision. */
struct gbg_fft_plan {
    int dimension, single, threads;
    int32_t cells[3];
    int64_t pitch, rows; /* complex numbers of a row; rows of the mesh */
    int64_t work_size;   /* complex numbers of a thread's work */
    void *work;          /* threads work_size */
    void *row[2];        /* forward and backward: one complex line out of place */
    void *lines[3][2];   /* GBG_FFT_LINES lines, interleaved, in place; from axis 1 on */
};

/* What a precision brings (transforms.h). */
struct gbg_fft_precision {
    size_t size;                                            /* bytes of a complex number */
    int (*plan)(struct gbg_fft_plan *plan, unsigned flags); /* 0, or 1: not all can be had */
    void (*forget)(struct gbg_fft_plan *plan);
    void (*forward)(const struct gbg_fft_plan *plan, void *mesh);
    void (*backward)(const struct gbg_fft_plan *plan, void *mesh);
    char *(*wisdom)(void); /* all of FFTW's, a string to be freed; NULL: no memory */
    int (*learn)(const char *wisdom);
    void (*unlearn)(void);
};

extern const struct gbg_fft_precision gbg_fft_single, gbg_fft_double;

/* Plans with what FFTW found to be the fastest in this process or an earlier one of the user, or
 * tries it now and keeps it. The planner's lock is held. */
struct gbg_context;
int gbg_fft_plan_wisely(const struct gbg_context *context,
                        const struct gbg_fft_precision *precision, struct gbg_fft_plan *plan);
/* Plans by rule alone, whatever wisdom there is. */
int gbg_fft_plan_quickly(const struct gbg_fft_precision *precision, struct gbg_fft_plan *plan);

#endif
