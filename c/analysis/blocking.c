/* Analysis room: blocking of time series. */
#include "analysis/blocking.h"

#include <math.h>
#include <string.h>

#include "core/context.h"
#include "core/memory.h"

int gbg_blocking_make(struct gbg_context *context, int64_t series, struct gbg_blocking *blocking)
{
    void *count;
    memset(blocking, 0, sizeof *blocking);
    blocking->series = series;
    int status = gbg_allocate_zero(context, &count, series, sizeof(int64_t), "series");
    blocking->count = count;
    return status;
}

void gbg_blocking_free(struct gbg_blocking *blocking)
{
    for (int l = 0; l < blocking->levels; l++) {
        gbg_release(blocking->mean[l]);
    }
    gbg_release(blocking->count);
    memset(blocking, 0, sizeof *blocking);
}

int gbg_blocking_reserve(struct gbg_context *context, struct gbg_blocking *blocking, int64_t n)
{
    while (blocking->levels < GBG_BLOCKING_LEVELS && n >> blocking->levels > 0) {
        void *block;
        int status = gbg_allocate_zero(context, &block, 3 * blocking->series, sizeof(double),
                                       "blocks of a time series");
        if (status != GBG_OK) {
            return status;
        }
        int l = blocking->levels++;
        blocking->mean[l] = block;
        blocking->squares[l] = blocking->mean[l] + blocking->series;
        blocking->waiting[l] = blocking->mean[l] + 2 * blocking->series;
    }
    return GBG_OK;
}

void gbg_blocking_add(struct gbg_blocking *blocking, int64_t series, double value)
{
    int64_t n = ++blocking->count[series];
    for (int l = 0; l < blocking->levels && n > 0; l++, n >>= 1) {
        double *mean = &blocking->mean[l][series];
        double from_old = value - *mean;
        *mean += from_old / (double)n;
        blocking->squares[l][series] += from_old * (value - *mean);
        if (n % 2) {
            blocking->waiting[l][series] = value;
            return;
        }
        value = 0.5 * (blocking->waiting[l][series] + value);
    }
}

/* Variance of the mean from the blocks of a level. */
static double variance_of_mean(const struct gbg_blocking *blocking, int64_t series, int level)
{
    double n = (double)(blocking->count[series] >> level);
    return blocking->squares[level][series] / (n * (n - 1));
}

/* Largest variance of the mean over the levels with at least `blocks` blocks, from *level on and up
 * to the first that is long enough; 1 if there was one. *level: the last level looked at. */
static int scan(const struct gbg_blocking *blocking, int64_t series, int64_t blocks, int *level,
                double *largest)
{
    int64_t n = blocking->count[series];
    double naive = variance_of_mean(blocking, series, 0);
    for (int l = *level; l == 0 || n >> l >= blocks; l++) {
        double here = variance_of_mean(blocking, series, l);
        *level = l;
        *largest = here > *largest ? here : *largest;
        double ratio = naive > 0 ? *largest / naive : 1;
        if (ldexp(1, 3 * l) > 2 * (double)n * ratio * ratio) {
            return 1;
        }
    }
    return 0;
}

/* Ratio of the 68.3 % quantiles of Student's distribution and of the normal one, to 1 % for 3
 * degrees of freedom or more. */
static double student(double freedom)
{
    return 1 + (0.5 + 0.25 / freedom) / freedom;
}

double gbg_blocking_error(const struct gbg_blocking *blocking, int64_t series, double *independent)
{
    int64_t n = blocking->count[series];
    *independent = (double)n;
    if (n < 2) {
        return NAN;
    }
    double largest = 0;
    int level = 0;
    if (!scan(blocking, series, 8, &level, &largest)) {
        scan(blocking, series, 4, &level, &largest);
    }
    if (largest > 0) {
        *independent = (double)n * variance_of_mean(blocking, series, 0) / largest;
    }
    return sqrt(largest) * student((double)(n >> level) - 1);
}
