/* Numbers of long-range sums: influence of many rows of waves at a time, and the mean of near
 * parts. */
#include "ewald/influence.h"

#include <math.h>

#include "ewald/series.h"

void gbg_ewald_fill_rows(const struct gbg_ewald_plan *plan, const struct gbg_ewald_axis axis[3],
                         int threads, int64_t first, int64_t count, double *rows)
{
    const int64_t waves = plan->choice.cells[0] / 2 + 1, rows_1 = plan->choice.cells[1] / 2 + 1;
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t r = 0; r < count; r++) {
        gbg_ewald_fill_row(plan, axis, (int32_t)((first + r) % rows_1),
                           (int32_t)((first + r) / rows_1), rows + r * waves);
    }
}

double gbg_ewald_near_integral(const struct gbg_ewald_plan *plan)
{
    enum { NODES = 64 };
    const struct gbg_split *split = &plan->split;
    double node[NODES], weight[NODES], smooth = 0.0, volume = 1.0, law;
    double d = split->dimension, s = split->power - 1.0, reach = split->reach;
    gbg_legendre_rule(NODES, node, weight);
    for (int i = 0; i < NODES; i++) {
        double u = 0.5 + 0.5 * node[i], z = 2.0 * u * u - 1.0, value = 0.0;
        for (int k = split->degree; k >= 0; k--) {
            value = value * z + split->potential[k];
        }
        smooth += 0.5 * weight[i] * value * pow(u, d - 1.0);
    }
    for (int a = 0; a < split->dimension; a++) {
        volume *= plan->choice.length[a];
    }
    if (s == 0.0) {
        law = 1.0 / (d * d);
    } else if (s == d) {
        law = (log(reach) - log(volume) / d) / s;
    } else {
        law = 1.0 / (s * (d - s));
    }
    double sphere = split->dimension == 2 ? 6.283185307179586477 : 12.566370614359172954;
    return sphere * pow(reach, d - s) * (law - smooth);
}
