/* L1: cells of sorted particles whose particles may be within the reach. */
#ifndef GBG_BACKEND_CPU_EWALD_CELLS_H
#define GBG_BACKEND_CPU_EWALD_CELLS_H

#include "backend/cpu/ewald.h"

enum { GBG_NEAR_ROWS_MAX = 9 };

/* Rows of cells around a row, and the columns around one: candidates of the particles of a cell are
 * those of these columns one after the other, in each row after row. */
struct gbg_near_rows {
    int64_t first[GBG_NEAR_ROWS_MAX]; /* number of the row's first cell */
    int own, count;                   /* which is the particles' own */
    int32_t columns;                  /* of a cell */
};

/* Cells c - around .. of an axis, or all if they are few; returns their number. */
static inline int32_t gbg_near_span(const struct gbg_ewald_order *order, int a, int32_t c,
                                    int32_t *first)
{
    int all = order->cells[a] < 2 * order->around[a] + 1;
    *first = all ? 0 : c - order->around[a];
    return all ? order->cells[a] : 2 * order->around[a] + 1;
}

static inline int32_t gbg_near_wrap(int32_t c, int32_t cells)
{
    return c < 0 ? c + cells : c >= cells ? c - cells : c;
}

/* Around row number `row`. */
static inline void gbg_near_find_rows(const struct gbg_ewald_order *order, int64_t row,
                                      struct gbg_near_rows *rows)
{
    const int32_t *cells = order->cells;
    int32_t y, z, column;
    int32_t n_y = gbg_near_span(order, 1, (int32_t)(row % cells[1]), &y);
    int32_t n_z = gbg_near_span(order, 2, (int32_t)(row / cells[1]), &z);
    rows->columns = gbg_near_span(order, 0, 0, &column);
    rows->count = 0;
    for (int32_t k = 0; k < n_z; k++) {
        for (int32_t j = 0; j < n_y; j++) {
            int64_t number =
                (int64_t)gbg_near_wrap(z + k, cells[2]) * cells[1] + gbg_near_wrap(y + j, cells[1]);
            rows->own = number == row ? rows->count : rows->own;
            rows->first[rows->count++] = number * cells[0];
        }
    }
}

#endif
