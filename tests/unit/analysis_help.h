/* Helpers of the tests of c/analysis: random points, exact sums in quadruple precision. */
#ifndef GBG_TESTS_ANALYSIS_HELP_H
#define GBG_TESTS_ANALYSIS_HELP_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "analysis/analysis.h"
#include "core/random.h"
#include "gamboge/analysis.h"

enum { HELP_MOST = 1 << 16 };

static const double two_pi = 6.283185307179586477;

struct points {
    int64_t n;
    double x[3][HELP_MOST];
    int32_t species[HELP_MOST];
};

/* Uniform number of a counter. */
static inline double uniform(uint64_t seed, uint64_t i)
{
    struct gbg_philox p = gbg_philox(gbg_philox_counter(i, seed, 0), 1, 2);
    return gbg_uniform(p.word[0], p.word[1]);
}

/* Normal number of a counter (Box and Muller). */
static inline double normal(uint64_t seed, uint64_t i)
{
    struct gbg_philox p = gbg_philox(gbg_philox_counter(i, seed, 0), 3, 4);
    double radius = sqrt(-2 * log(gbg_uniform(p.word[0], p.word[1])));
    return radius * cos(6.283185307179586 * gbg_uniform(p.word[2], p.word[3]));
}

static inline void fill_uniform(struct points *points, int64_t n, uint64_t seed,
                                const double *lengths)
{
    points->n = n;
    for (int64_t i = 0; i < n; i++) {
        for (int a = 0; a < 3; a++) {
            points->x[a][i] = lengths[a] * uniform(seed, (uint64_t)(3 * i + a));
        }
        points->species[i] = (int32_t)(i % 3);
    }
}

static inline struct gbg_context *context_of(const char *backend)
{
    struct gbg_context *context = NULL;
    if (gbg_context_create(backend, &context) != GBG_OK) {
        fail_msg("%s", gbg_message(NULL));
    }
    return context;
}

#define MUST(context, call)                                                                        \
    do {                                                                                           \
        if ((call) != GBG_OK) {                                                                    \
            fail_msg("%s", gbg_message(context));                                                  \
        }                                                                                          \
    } while (0)

/* The call must fail with this status and a sentence that contains `words`. */
#define MUST_FAIL(context, status, words, call)                                                    \
    do {                                                                                           \
        assert_int_equal(call, status);                                                            \
        if (!strstr(gbg_message(context), words)) {                                                \
            fail_msg("\"%s\" lacks \"%s\"", gbg_message(context), words);                          \
        }                                                                                          \
    } while (0)

static inline int add_points(struct gbg_analysis *analysis, const struct points *points,
                             const int32_t *species, const double *lengths)
{
    return gbg_analysis_add_frame(analysis, points->n, points->x[0], points->x[1], points->x[2], 1,
                                  species, 0, lengths, 0);
}

#endif
