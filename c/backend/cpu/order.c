/* L1, CPU: where particles stand in memory: near each other if they are near in space, or in the
 * order of their ids. No result depends on it; the time to fetch neighbours does. */
#include "backend/cpu/order.h"

#include <string.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/list.h"
#include "backend/cpu/list_lengths.h"
#include "core/memory.h"

enum { DIGIT_BITS = 11, DIGITS = 1 << DIGIT_BITS };

/* Sorting memory: keys and indices twice; moving an array needs 8 bytes a particle, which then lie
 * over the keys. */
struct work {
    uint32_t *key[2];
    int32_t *index[2];
    void *spare; /* over the keys */
};

static int take_work(struct gbg_device *device, int64_t n, struct work *work)
{
    void *memory;
    int status = gbg_cpu_workspace(device, 16 * (size_t)n + 64, &memory);
    if (status == GBG_OK) {
        uint32_t *words = memory;
        *work = (struct work){
            {words, words + n}, {(int32_t *)(words + 2 * n), (int32_t *)(words + 3 * n)}, words};
    }
    return status;
}

static void make_keys(struct gbg_device *device, const struct gbg_state *state, struct work *work)
{
    struct gbg_halvings halvings = gbg_order_halvings(&state->box);
#pragma omp parallel for num_threads(device->threads) schedule(static)
    for (int64_t i = 0; i < state->owned; i++) {
        work->key[0][i] = gbg_order_key(state, &halvings, i);
        work->index[0][i] = (int32_t)i;
    }
    (void)device;
}

/* Sorts by one digit; equal digits keep their order. */
static void sort_digit(struct work *work, int64_t n, int shift)
{
    int64_t start[DIGITS] = {0};
    for (int64_t i = 0; i < n; i++) {
        start[work->key[0][i] >> shift & (DIGITS - 1)]++;
    }
    for (int64_t d = 0, sum = 0; d < DIGITS; d++) {
        int64_t count = start[d];
        start[d] = sum;
        sum += count;
    }
    for (int64_t i = 0; i < n; i++) {
        int64_t to = start[work->key[0][i] >> shift & (DIGITS - 1)]++;
        work->key[1][to] = work->key[0][i];
        work->index[1][to] = work->index[0][i];
    }
    uint32_t *key = work->key[0];
    int32_t *index = work->index[0];
    work->key[0] = work->key[1];
    work->index[0] = work->index[1];
    work->key[1] = key;
    work->index[1] = index;
}

/* array[k] = what stood at order[k]. */
static void move_array(struct gbg_device *device, int64_t n, const int32_t *order, void *array,
                       size_t size, void *spare)
{
    if (!array) {
        return;
    }
#pragma omp parallel num_threads(device->threads)
    {
#pragma omp for schedule(static)
        for (int64_t k = 0; k < n; k++) {
            if (size == 8) {
                ((uint64_t *)spare)[k] = ((const uint64_t *)array)[order[k]];
            } else if (size == 4) {
                ((uint32_t *)spare)[k] = ((const uint32_t *)array)[order[k]];
            } else {
                ((unsigned char *)spare)[k] = ((const unsigned char *)array)[order[k]];
            }
        }
#pragma omp single
        memcpy(array, spare, (size_t)n * size);
    }
    (void)device;
}

static void move_all(struct gbg_device *device, struct gbg_state *state, const int32_t *order,
                     void *spare)
{
    int64_t n = state->owned;
    for (int a = 0; a < state->box.dimension; a++) {
        move_array(device, n, order, state->high[a], 4, spare);
        move_array(device, n, order, state->low[a], 4, spare);
        move_array(device, n, order, state->image[a], 4, spare);
    }
    move_array(device, n, order, state->id, 8, spare);
    move_array(device, n, order, state->rank, 4, spare);
    move_array(device, n, order, state->species, 1, spare);
    move_array(device, n, order, state->source, 4, spare);
    move_array(device, n, order, state->overlapped, 1, spare);
}

/* Ranks, and ids if they were the indices until now: present from the first time on. */
static int reserve_names(struct gbg_device *device, struct gbg_state *state)
{
    int64_t n = state->owned;
    void *id = NULL, *rank = NULL;
    int status = GBG_OK;
    if (!state->id) {
        status = gbg_allocate_zero(device->context, &id, n, sizeof *state->id, "ids");
    }
    if (status == GBG_OK && !state->rank) {
        status = gbg_allocate_zero(device->context, &rank, n, sizeof *state->rank, "ranks of ids");
    }
    if (status != GBG_OK) {
        gbg_release(id);
        return status;
    }
    for (int64_t i = 0; id && i < n; i++) {
        ((uint64_t *)id)[i] = (uint64_t)i;
    }
    for (int64_t i = 0; rank && i < n; i++) {
        ((int32_t *)rank)[i] = (int32_t)i;
    }
    state->id = id ? id : state->id;
    state->rank = rank ? rank : state->rank;
    return GBG_OK;
}

int gbg_arrange(struct gbg_device *device, struct gbg_state *state, int by_place)
{
    struct work work;
    if (!by_place && !state->rank) {
        return GBG_OK; /* they have always stood in that order */
    }
    int status = take_work(device, state->owned, &work);
    status = status ? status : reserve_names(device, state);
    if (status != GBG_OK) {
        return status;
    }
    if (by_place) {
        make_keys(device, state, &work);
        for (int shift = 0; shift < GBG_KEY_BITS; shift += DIGIT_BITS) {
            sort_digit(&work, state->owned, shift);
        }
    } else {
        for (int64_t i = 0; i < state->owned; i++) {
            work.index[0][state->rank[i]] = (int32_t)i;
        }
    }
    move_all(device, state, work.index[0], work.spare);
    state->epoch++;
    return GBG_OK;
}

struct sieve {
    uint64_t bits[GBG_SIEVE_PLACES / 64];
};

static int first_time(struct sieve *sieve, uint32_t number)
{
    uint32_t place = gbg_sieve_place(number);
    uint64_t bit = UINT64_C(1) << (place & 63), seen = sieve->bits[place >> 6] & bit;
    sieve->bits[place >> 6] |= bit;
    return !seen;
}

static const int32_t *index_of(const struct gbg_list *list, int64_t slice)
{
    int c = 0;
    while (slice >= list->chunk[c].end_slice) {
        c++;
    }
    return list->chunk[c].index + list->offset[slice];
}

double gbg_list_scatter(const struct gbg_list *list)
{
    enum { NEAREST_CACHE = 65536 };
    int64_t neighbours = 0, lines = 0;
    if (list->n * list->dimension * (int64_t)sizeof *list->local[0] <= NEAREST_CACHE) {
        return 0.0;
    }
    for (int64_t slice = 0; slice < list->slices; slice += GBG_SCATTER_STRIDE) {
        struct sieve seen = {{0}}, seen_lines = {{0}};
        const int32_t *index = index_of(list, slice);
        for (int64_t k = 0; k < (int64_t)list->width[slice] * GBG_SLICE; k++) {
            if (first_time(&seen, (uint32_t)index[k])) {
                neighbours++;
                lines += first_time(&seen_lines, (uint32_t)index[k] / GBG_SCATTER_LINE);
            }
        }
    }
    return neighbours > 0 ? (double)lines / (double)neighbours : 0.0;
}
