/* Transforms of a real mesh. The library that makes them (FFTW, GPL) is one of its own, loaded when
 * a scene first needs it. */
#ifndef GBG_FFT_FFT_H
#define GBG_FFT_FFT_H

#include <stdint.h>

struct gbg_context;
struct gbg_fft_plan;

/* Rows of the mesh are 2 (cells[0]/2 + 1) numbers apart, axis 0 contiguous; a mesh is transformed
 * in place and needs gbg_fft_numbers() floats (single 1) or doubles, aligned to 64 bytes. Complex
 * number n_0 of row (n_1, n_2) stands where real numbers 2 n_0, 2 n_0 + 1 stood. Plain sums,
 * unscaled both ways: backward(forward(m)) = m times the number of cells. Same bits for any number
 * of threads. */
struct gbg_fft {
    /* hurry: 1 for runs too short for trying which plan is the fastest; 0: it is tried once a user
     * and kept (XDG_CACHE_HOME/gamboge, else ~/.cache/gamboge). */
    int (*make)(struct gbg_context *context, int dimension, const int32_t *cells, int single,
                int threads, int hurry, struct gbg_fft_plan **plan);
    void (*forward)(const struct gbg_fft_plan *plan, void *mesh);
    void (*backward)(const struct gbg_fft_plan *plan, void *mesh);
    void (*release)(struct gbg_fft_plan *plan);
};

static inline int64_t gbg_fft_pitch(const int32_t *cells)
{
    return 2 * ((int64_t)cells[0] / 2 + 1);
}

static inline int64_t gbg_fft_numbers(int dimension, const int32_t *cells)
{
    return gbg_fft_pitch(cells) * cells[1] * (dimension == 3 ? cells[2] : 1);
}

/* The table, or NULL with *why a sentence: the build has none, or its library is not found. */
const struct gbg_fft *gbg_fft_find(const char **why);

#endif
