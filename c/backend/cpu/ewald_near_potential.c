/* L1, CPU: potentials of near pairs of sums by a mesh, in double precision. */
#include <math.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/ewald.h"
#include "backend/cpu/ewald_cells.h"
#include "backend/cpu/grid.h"

struct potential {
    const struct gbg_state *state;
    const struct gbg_ewald_order *order;
    const struct gbg_split *split;
    int dimension;
};

/* In units of reach^(1 - power). Of a coincident pair the singular law is left out, as with a
 * particle and itself: what remains takes the far part's away. */
static double pair(const struct potential *p, const uint64_t own[3], int64_t k)
{
    const struct gbg_split *split = p->split;
    double squared = 0.0, s = split->power - 1.0, sum = split->potential[split->degree];
    int64_t i = p->order->index[k];
    for (int a = 0; a < p->dimension; a++) {
        uint64_t other = gbg_join(p->state->high[a][i], p->state->low[a][i]);
        double r = gbg_box_difference(&p->state->box, a, own[a], other) / split->reach;
        squared += r * r;
    }
    if (squared >= 1.0) {
        return 0.0;
    }
    for (int d = split->degree - 1; d >= 0; d--) {
        sum = sum * (2.0 * squared - 1.0) + split->potential[d];
    }
    if (squared == 0.0) {
        return -sum;
    }
    return (s == 0.0 ? -0.5 * log(squared) : pow(squared, -0.5 * s) / s) - sum;
}

/* Of particle k, over the cells around column `column`. */
static double all_pairs(const struct potential *p, const struct gbg_near_rows *rows, int32_t column,
                        int64_t k)
{
    const struct gbg_ewald_order *order = p->order;
    uint64_t own[3] = {0, 0, 0};
    int32_t first;
    double sum = 0.0;
    for (int a = 0; a < p->dimension; a++) {
        int64_t i = order->index[k];
        own[a] = gbg_join(p->state->high[a][i], p->state->low[a][i]);
    }
    gbg_near_span(order, 0, column, &first);
    for (int64_t c = 0; c < (int64_t)rows->columns * rows->count; c++) {
        int32_t at = gbg_near_wrap(first + (int32_t)(c / rows->count), order->cells[0]);
        const int64_t *begin = order->begin + rows->first[c % rows->count] + at;
        for (int64_t other = begin[0]; other < begin[1]; other++) {
            double source =
                order->source ? (double)order->source[other] : order->source_double[other];
            sum += other == k ? 0.0 : source * pair(p, own, other);
        }
    }
    return sum;
}

void gbg_ewald_near_potential(struct gbg_device *device, const struct gbg_state *state,
                              struct gbg_ewald *ewald, double *potential)
{
    const struct gbg_ewald_order *order = &ewald->order;
    const struct gbg_split *split = &ewald->plan.split;
    const struct potential p = {state, order, split, ewald->plan.choice.dimension};
    const double unit = pow(split->reach, 1.0 - split->power);
#pragma omp parallel for num_threads(device->threads) schedule(dynamic)
    for (int64_t row = 0; row < (int64_t)order->cells[1] * order->cells[2]; row++) {
        struct gbg_near_rows rows = {.own = 0};
        gbg_near_find_rows(order, row, &rows);
        for (int32_t column = 0; column < order->cells[0]; column++) {
            const int64_t *begin = order->begin + row * order->cells[0] + column;
            for (int64_t k = begin[0]; k < begin[1]; k++) {
                potential[k] = unit * all_pairs(&p, &rows, column, k);
            }
        }
    }
    (void)device;
}
