/* Tests of the physics: contexts, and gates that state value, error and allowance. */
#ifndef GBG_TESTS_GATES_H
#define GBG_TESTS_GATES_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bench/estimators/estimators.h"

static inline struct gbg_context *opened_context(void)
{
    struct gbg_context *context;
    assert_int_equal(gbg_context_create("cpu:threads=1", &context), GBG_OK);
    return context;
}

/* Ends the test as failed if a call of the library did. */
static inline void done(struct gbg_context *context, int status)
{
    if (status != GBG_OK) {
        fail_msg("%s", gbg_message(context));
    }
}

/* A value must lie within `allowed` of the reference, up to two standard errors; a sample too small
 * to see a deviation of that size (error above half of it) fails too. */
static inline int gate(const char *what, struct gbg_estimate value, double reference,
                       double allowed)
{
    double off = value.mean - reference;
    int strong = value.error <= 0.5 * allowed, right = fabs(off) <= allowed + 2.0 * value.error;
    print_message("%-34s %.6g +- %.1e, expected %.6g, off by %+.2e of allowed %.1e%s\n", what,
                  value.mean, value.error, reference, off, allowed,
                  !strong  ? "  SAMPLE TOO SMALL"
                  : !right ? "  TOO FAR"
                           : "");
    return strong && right;
}

#endif
