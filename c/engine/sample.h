/* L2: a sample of particles on which forces are compared with better ones. */
#ifndef GBG_ENGINE_SAMPLE_H
#define GBG_ENGINE_SAMPLE_H

#include <stdint.h>

struct gbg_context;

struct gbg_sample {
    struct gbg_context *context;
    int dimension;
    int64_t n, size;
    int32_t *index;                  /* `size` of n particles, ascending */
    double *force[3], *reference[3]; /* size each, filled by the user */
    double *term[3];                 /* the same, for a part of a reference */
    double *work;                    /* all of them, and room for a median */
};

/* One particle at random from each of `most` equal parts of n, or all of fewer; always the same.
 * Released also after a failure. */
int gbg_sample_make(struct gbg_context *context, int dimension, int64_t n, int64_t most,
                    struct gbg_sample *sample);
void gbg_sample_release(struct gbg_sample *sample);

/* RMS length of force - reference, RMS and median length of the reference. */
struct gbg_deviation {
    double difference, rms, median;
};
struct gbg_deviation gbg_sample_compare(const struct gbg_sample *sample);

/* Where all particles are, for a reference that is summed on the host: arrays of n. */
struct gbg_sources {
    int64_t n;
    int dimension;
    double length[3];
    double *position[3]; /* in [0, length] */
    double *alpha, *mobility;
    double *block; /* all of them */
};

/* Arrays to be filled in; released also after a failure. */
int gbg_sources_make(struct gbg_context *context, int dimension, const double *length, int64_t n,
                     struct gbg_sources *sources);
void gbg_sources_release(struct gbg_sources *sources);

/* Force by which a typical source moves a typical particle at the mean distance. */
double gbg_sources_typical(const struct gbg_sources *sources, double power);

/* Forces on the sample by the sum over all images, in double precision and without a mesh, into
 * out[axis][size]. */
int gbg_sources_reference(struct gbg_context *context, const struct gbg_sources *sources,
                          double power, const struct gbg_sample *sample, double *const *out);

#endif
