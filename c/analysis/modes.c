/* Analysis room: lists the wave vectors of the half space. */
#include "analysis/modes.h"

#include <math.h>
#include <string.h>

#include "core/context.h"
#include "core/memory.h"

static const double two_pi = 6.283185307179586477;
/* A k_max that a caller computed as 2 pi n / L shall contain n. */
static const double slack = 1e-12;

int32_t gbg_modes_reach(double length, double k_max)
{
    double reach = floor(k_max * length / two_pi * (1 + slack));
    return reach <= 0x1p30 ? (int32_t)reach : -1;
}

/* Largest n of the innermost axis when the other axes leave k_max^2 - used. */
static int64_t row_reach(double length, double k_max, double used)
{
    double left = k_max * k_max * (1 + 2 * slack) - used;
    return left < 0 ? -1 : (int64_t)floor(sqrt(left) * length / two_pi * (1 + slack));
}

/* Calls for each row (n1, n2): the first n0 of the half space and the largest. */
struct row {
    int32_t n1, n2;
    int64_t first, last;
};

static int next_row(const struct gbg_modes *modes, const double *lengths, double k_max,
                    struct row *row)
{
    if (++row->n1 > modes->reach[1]) {
        row->n1 = -modes->reach[1];
        if (++row->n2 > modes->reach[2]) {
            return 0;
        }
    }
    double k1 = two_pi * row->n1 / lengths[1];
    double k2 = modes->dimension == 3 ? two_pi * row->n2 / lengths[2] : 0.0;
    int upper = row->n1 > 0 || (row->n1 == 0 && row->n2 > 0);
    row->first = upper ? 0 : 1;
    row->last = row_reach(lengths[0], k_max, k1 * k1 + k2 * k2);
    row->last = row->last < modes->reach[0] ? row->last : modes->reach[0];
    return 1;
}

static struct row before_first_row(const struct gbg_modes *modes)
{
    return (struct row){.n1 = -modes->reach[1] - 1, .n2 = -modes->reach[2]};
}

static void set_reach(struct gbg_modes *modes, int dimension, const double *lengths, double k_max)
{
    modes->dimension = dimension;
    for (int a = 0; a < dimension; a++) {
        modes->reach[a] = gbg_modes_reach(lengths[a], k_max);
    }
}

static int64_t count_rows(const struct gbg_modes *modes, const double *lengths, double k_max)
{
    int64_t count = 0;
    struct row row = before_first_row(modes);
    while (next_row(modes, lengths, k_max, &row)) {
        count += row.last >= row.first ? row.last - row.first + 1 : 0;
    }
    return count;
}

int64_t gbg_modes_count(int dimension, const double *lengths, double k_max)
{
    struct gbg_modes modes = {0};
    set_reach(&modes, dimension, lengths, k_max);
    return count_rows(&modes, lengths, k_max);
}

static void list_rows(struct gbg_modes *modes, const double *lengths, double k_max)
{
    int64_t m = 0;
    struct row row = before_first_row(modes);
    while (next_row(modes, lengths, k_max, &row)) {
        for (int64_t n0 = row.first; n0 <= row.last; n0++, m++) {
            modes->n[0][m] = (int32_t)n0;
            modes->n[1][m] = row.n1;
            if (modes->dimension == 3) {
                modes->n[2][m] = row.n2;
            }
        }
    }
}

int gbg_modes_make(struct gbg_context *context, int dimension, const double *lengths, double k_max,
                   struct gbg_modes *modes)
{
    memset(modes, 0, sizeof *modes);
    set_reach(modes, dimension, lengths, k_max);
    modes->count = count_rows(modes, lengths, k_max);
    for (int a = 0; a < dimension; a++) {
        void *list;
        int status = gbg_allocate(context, &list, modes->count, sizeof(int32_t), "wave vectors");
        if (status != GBG_OK) {
            gbg_modes_free(modes);
            return status;
        }
        modes->n[a] = list;
    }
    list_rows(modes, lengths, k_max);
    return GBG_OK;
}

void gbg_modes_free(struct gbg_modes *modes)
{
    for (int a = 0; a < 3; a++) {
        gbg_release(modes->n[a]);
    }
    memset(modes, 0, sizeof *modes);
}
