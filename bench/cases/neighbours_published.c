/* Benchmark: the searches of Perea and Cordero (2017) and Green (2010) in plain C.
 *
 * Two things differ from the print, because with them the answer is wrong (docs/physics.md): the
 * index of a cell is the bijective one, and a particle in the lower half of its cell looks down. */
#include "bench/cases/neighbours_published.h"

#include <math.h>
#include <string.h>

#include "core/context.h"
#include "core/memory.h"

int gbg_published_create(struct gbg_context *context, int64_t n, const double *length,
                         const int *cells, double radius, double *const *position, int64_t capacity,
                         struct gbg_published **search)
{
    struct gbg_published *made;
    int64_t all = (int64_t)cells[0] * cells[1] * cells[2];
    int status = gbg_allocate_zero(context, (void **)&made, 1, sizeof *made, "published search");
    if (status != GBG_OK) {
        return status;
    }
    *search = made;
    made->n = n;
    memcpy(made->length, length, sizeof made->length);
    memcpy(made->cells, cells, sizeof made->cells);
    made->radius = radius;
    made->position = position;
    made->capacity = capacity;
    status = gbg_allocate(context, (void **)&made->start, all + 2, 8, "cells");
    status = status ? status : gbg_allocate(context, (void **)&made->row, n + 1, 8, "rows");
    status = status ? status : gbg_allocate(context, (void **)&made->cell, n, 4, "cells");
    status = status ? status : gbg_allocate(context, (void **)&made->member, n, 4, "members");
    for (int a = 0; a < 3; a++) {
        status = status ? status : gbg_allocate(context, (void **)&made->sorted[a], n, 8, "points");
    }
    status =
        status ? status : gbg_allocate(context, (void **)&made->neighbour, capacity, 4, "rows");
    return status;
}

void gbg_published_destroy(struct gbg_published *search)
{
    if (search) {
        gbg_release(search->start);
        gbg_release(search->row);
        gbg_release(search->cell);
        gbg_release(search->member);
        for (int a = 0; a < 3; a++) {
            gbg_release(search->sorted[a]);
        }
        gbg_release(search->neighbour);
        gbg_release(search);
    }
}

static void sort(struct gbg_published *s)
{
    int64_t all = (int64_t)s->cells[0] * s->cells[1] * s->cells[2];
    double density[3];
    for (int a = 0; a < 3; a++) {
        density[a] = s->cells[a] / s->length[a];
    }
    memset(s->start, 0, (size_t)(all + 2) * sizeof *s->start);
    for (int64_t i = 0; i < s->n; i++) {
        int32_t cell = 0;
        for (int a = 2; a >= 0; a--) {
            cell = cell * s->cells[a] + (int32_t)(s->position[a][i] * density[a]);
        }
        s->cell[i] = cell;
        s->start[cell + 2]++;
    }
    for (int64_t c = 0; c < all; c++) {
        s->start[c + 2] += s->start[c + 1];
    }
    for (int64_t i = 0; i < s->n; i++) {
        int64_t slot = s->start[s->cell[i] + 1]++;
        s->member[slot] = (int32_t)i;
        for (int a = 0; a < 3; a++) {
            s->sorted[a][slot] = s->position[a][i];
        }
    }
}

/* Neighbours of the particle in `slot` among those of a cell, which stands `shift` away. */
static void look(struct gbg_published *s, int64_t slot, int64_t cell, const double shift[3])
{
    double limit = s->radius * s->radius, x = s->sorted[0][slot] - shift[0];
    double y = s->sorted[1][slot] - shift[1], z = s->sorted[2][slot] - shift[2];
    for (int64_t k = s->start[cell]; k < s->start[cell + 1]; k++) {
        double dx = x - s->sorted[0][k], dy = y - s->sorted[1][k], dz = z - s->sorted[2][k];
        if (dx * dx + dy * dy + dz * dz <= limit && k != slot && s->found < s->capacity) {
            s->neighbour[s->found++] = s->member[k];
        }
    }
    s->looked += s->start[cell + 1] - s->start[cell];
}

void gbg_published_search(struct gbg_published *s, int stage)
{
    double density[3];
    for (int a = 0; a < 3; a++) {
        density[a] = s->cells[a] / s->length[a];
    }
    sort(s);
    s->found = s->looked = 0;
    for (int64_t slot = 0; slot < s->n; slot++) {
        int c[3], low[3], high[3];
        s->row[s->member[slot]] = s->found;
        s->looked--; /* itself */
        for (int a = 0; a < 3; a++) {
            double at = s->sorted[a][slot] * density[a];
            c[a] = (int)at;
            int lower = at - c[a] < 0.5, used = a < stage || stage == GBG_PUBLISHED_ALL;
            low[a] = used && (lower || stage == GBG_PUBLISHED_ALL) ? -1 : 0;
            high[a] = used && (!lower || stage == GBG_PUBLISHED_ALL) ? 1 : 0;
        }
        for (int dz = low[2]; dz <= high[2]; dz++) {
            for (int dy = low[1]; dy <= high[1]; dy++) {
                for (int dx = low[0]; dx <= high[0]; dx++) {
                    int d[3] = {c[0] + dx, c[1] + dy, c[2] + dz};
                    double shift[3] = {0.0, 0.0, 0.0};
                    for (int a = 0; a < 3; a++) {
                        if (d[a] < 0 || d[a] >= s->cells[a]) {
                            shift[a] = d[a] < 0 ? -s->length[a] : s->length[a];
                            d[a] -= d[a] < 0 ? -s->cells[a] : s->cells[a];
                        }
                    }
                    look(s, slot,
                         d[0] + (int64_t)s->cells[0] * (d[1] + (int64_t)s->cells[1] * d[2]), shift);
                }
            }
        }
    }
    s->row[s->n] = s->found;
}
