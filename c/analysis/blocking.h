/* Analysis room: errors of time averages by blocking (Flyvbjerg and Petersen, J. Chem. Phys. 91,
 * 461 (1989)), for many series at once and without keeping them. */
#ifndef GBG_ANALYSIS_BLOCKING_H
#define GBG_ANALYSIS_BLOCKING_H

#include <stdint.h>

struct gbg_context;

enum { GBG_BLOCKING_LEVELS = 40 };

/* Level l holds means of 2^l successive values: their running mean, sum of squared deviations, and
 * the one that waits for its partner. */
struct gbg_blocking {
    int64_t series;
    int levels;     /* allocated */
    int64_t *count; /* values of each series */
    double *mean[GBG_BLOCKING_LEVELS], *squares[GBG_BLOCKING_LEVELS], *waiting[GBG_BLOCKING_LEVELS];
};

int gbg_blocking_make(struct gbg_context *context, int64_t series, struct gbg_blocking *blocking);
void gbg_blocking_free(struct gbg_blocking *blocking);
/* Memory for series of up to n values; must come before the n-th is added. */
int gbg_blocking_reserve(struct gbg_context *context, struct gbg_blocking *blocking, int64_t n);
void gbg_blocking_add(struct gbg_blocking *blocking, int64_t series, double value);
/* Standard error of the mean, and the number of independent values that it corresponds to. With s_B
 * the naive error from blocks of B values, the block is the shortest with B^3 > 2 n (s_B/s_1)^4
 * (Lee et al., Phys. Rev. E 83, 066706 (2011)) that leaves 8 blocks, else the longest that leaves
 * 4; the largest s_B up to there counts, times Student's factor for the number of blocks, so that
 * 68 % of the errors are within one: it is rather too large than too small for short series. NaN
 * with less than two values. */
double gbg_blocking_error(const struct gbg_blocking *blocking, int64_t series, double *independent);

#endif
