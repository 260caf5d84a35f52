/* Command: all pairs of a frame that are closer than a given distance, by code of its own: the
 * check must not share a mistake with the solver that it checks. */
#ifndef GBG_COMMAND_VERIFY_PAIRS_H
#define GBG_COMMAND_VERIFY_PAIRS_H

#include <stdint.h>

/* Called once for each pair, i < j; d: nearest image of r_j - r_i; distance: its length. */
typedef void (*gbg_pair_visitor)(void *user, int64_t i, int64_t j, const double d[3],
                                 double distance);

/* Visits every pair of the n points (any image of them) whose nearest images are at most `reach`
 * apart. Coordinates are finite. 0, or -1 without memory. */
int gbg_visit_pairs(int dimension, const double *length, int64_t n, double *const *r, double reach,
                    gbg_pair_visitor visit, void *user);

/* Nearest image of a difference on an axis of the given length. */
double gbg_nearest_image(double difference, double length);

#endif
