/* L1, CPU, per instruction set: near pairs of sums by a mesh in one precision. Included twice, with
 * NEAR(name), WORD, REAL, LANES, V(name), WORDS(name) and what else ewald_near.c defines for it.
 *
 * Particles around a run of cells are copied column by column of cells, so that those around one
 * cell are a contiguous run. Of these, each particle of the cell keeps the differences and sources
 * of those within the reach; pairs that were kept, of many particles one after the other, are
 * evaluated in full vectors and then added up particle by particle. No result depends on how
 * particles share strips, batches or vectors: a sum goes over pairs of one particle alone. */

struct NEAR(strip) {
    WORD x[3][GBG_NEAR_STRIP + GBG_NEAR_SPARE];
    REAL source[GBG_NEAR_STRIP + GBG_NEAR_SPARE];
    int32_t start[GBG_NEAR_COLUMNS + 2 * GBG_EWALD_PARTS + 1]; /* of columns */
    int32_t own[GBG_NEAR_COLUMNS + 2 * GBG_EWALD_PARTS];       /* of the row itself in them */
    int32_t used;
};

struct NEAR(batch) {
    REAL r[3][GBG_NEAR_BATCH + GBG_NEAR_SPARE];
    REAL source[GBG_NEAR_BATCH + GBG_NEAR_SPARE];
    struct gbg_near_segment segment[GBG_NEAR_SEGMENTS];
    int segments, used, selves; /* selves: pairs of a particle with itself */
};

/* Pairs of the batch become their forces, in units; returns how many were nearer than words tell,
 * and were left out. */
typedef int (*NEAR(evaluate))(const struct gbg_near_sum *sum, struct NEAR(batch) * batch);

/* What a thread works with. */
struct NEAR(work) {
    const struct gbg_near_sum *sum;
    NEAR(evaluate) evaluate;
    REAL limit;  /* square of the reach */
    int uniform; /* 1: all sources are alike */
    struct gbg_near_rows rows;
    struct NEAR(strip) strip;
    struct NEAR(batch) batch;
};

/* From particles of the strip to the one at `own`, in units, and the squared length. */
GBG_ALWAYS VECTOR NEAR(differences)(const struct gbg_near_sum *sum, const WORD own[3],
                                    const WORD *const x[3], int64_t p, int dimension, int scaled,
                                    VECTOR r[3])
{
    VECTOR squared = V(set)(0);
    for (int a = 0; a < dimension; a++) {
        r[a] = FROM_WORDS(WORDS(sub)(WORDS(set)(own[a]), WORDS(load)(x[a] + p)));
        r[a] = scaled ? V(mul)(r[a], V(set)((REAL)sum->ratio[a])) : r[a];
        squared = a == 0 ? V(mul)(r[a], r[a]) : V(fma)(r[a], r[a], squared);
    }
    return squared;
}

/* Keeps those of LANES pairs of a particle with the strip from p on that are within the reach and
 * in `among`; returns how many. */
GBG_ALWAYS int NEAR(keep_some)(struct NEAR(work) * work, const WORD own[3], int64_t p, int at,
                               uint32_t among, int dimension, int scaled)
{
    const struct NEAR(strip) *strip = &work->strip;
    struct NEAR(batch) *batch = &work->batch;
    const WORD *const x[3] = {strip->x[0], strip->x[1], strip->x[2]};
    VECTOR r[3], squared = NEAR(differences)(work->sum, own, x, p, dimension, scaled, r);
    uint32_t bits = BITS(V(lt)(squared, V(set)(work->limit))) & among;
    for (int a = 0; a < dimension; a++) {
        SQUEEZE(batch->r[a] + at, bits, r[a]);
    }
    if (!work->uniform) {
        SQUEEZE(batch->source + at, bits, V(load)(strip->source + p));
    }
    return __builtin_popcount(bits);
}

/* The same for n pairs. */
GBG_ALWAYS int NEAR(keep)(struct NEAR(work) * work, const WORD own[3], int64_t p, int64_t n,
                          int dimension, int scaled)
{
    const uint32_t all = (UINT32_C(1) << LANES) - 1;
    int at = work->batch.used;
    int64_t end = p + n;
    for (; p + LANES <= end; p += LANES) {
        at += NEAR(keep_some)(work, own, p, at, all, dimension, scaled);
    }
    if (p < end) {
        uint32_t rest = (UINT32_C(1) << (end - p)) - 1;
        at += NEAR(keep_some)(work, own, p, at, rest, dimension, scaled);
    }
    return at - work->batch.used;
}

GBG_ALWAYS int NEAR(evaluate_law)(const struct gbg_near_sum *sum, struct NEAR(batch) * batch,
                                  int dimension, int power)
{
    const VECTOR inverse = V(set)((REAL)sum->inverse), slope = V(set)((REAL)sum->slope);
    const VECTOR finest = V(set)((REAL)FINEST), less = V(set)(-1);
    const REAL *minus = COEFFICIENTS(sum);
    int nearer = 0, degree = sum->degree;
    for (int k = 0; k < batch->used; k += GBG_NEAR_BLOCK * LANES) {
        VECTOR squared[GBG_NEAR_BLOCK], u[GBG_NEAR_BLOCK], z[GBG_NEAR_BLOCK], p[GBG_NEAR_BLOCK];
#pragma GCC unroll 4
        for (int v = 0; v < GBG_NEAR_BLOCK; v++) {
            squared[v] = V(set)(0);
            for (int a = 0; a < dimension; a++) {
                VECTOR r = V(load)(batch->r[a] + k + v * LANES);
                squared[v] = a == 0 ? V(mul)(r, r) : V(fma)(r, r, squared[v]);
            }
            u[v] = V(mul)(squared[v], inverse);
            z[v] = V(fma)(slope, u[v], less);
            p[v] = V(set)(minus[degree]);
        }
        for (int d = degree - 1; d >= 0; d--) {
            VECTOR next = V(set)(minus[d]);
#pragma GCC unroll 4
            for (int v = 0; v < GBG_NEAR_BLOCK; v++) {
                p[v] = V(fma)(p[v], z[v], next);
            }
        }
#pragma GCC unroll 4
        for (int v = 0; v < GBG_NEAR_BLOCK; v++) {
            int at = k + v * LANES;
            MASK far = V(lt)(finest, squared[v]);
            VECTOR w = power ? WEIGHT(u[v], p[v], power) : WEIGHT_GENERAL(u[v], p[v], sum);
            w = V(keep)(far, V(mul)(w, V(load)(batch->source + at)));
            nearer += LANES - __builtin_popcount(BITS(far));
            for (int a = 0; a < dimension; a++) {
                V(store)(batch->r[a] + at, V(mul)(w, V(load)(batch->r[a] + at)));
            }
        }
    }
    return nearer;
}

/* Lanes of the sums over some segments from `first` on, halved once. */
GBG_ALWAYS void NEAR(add_some)(const struct NEAR(batch) * batch, int first, int end,
                               double half[][3][GBG_NEAR_LANES / 2], int dimension)
{
    enum { HALF = GBG_NEAR_LANES / VD_LANES / 2 };
    for (int s = first; s < end; s++) {
        const struct gbg_near_segment *segment = &batch->segment[s];
        vd sum[3][2 * HALF];
        const REAL *value[3] = {batch->r[0] + segment->at, batch->r[1] + segment->at,
                                batch->r[2] + segment->at};
        ADD_LANES(value, segment->count, dimension, sum);
        for (int a = 0; a < dimension; a++) {
            for (int l = 0; l < HALF; l++) {
                vd_store(half[s - first][a] + l * VD_LANES, vd_add(sum[a][l], sum[a][l + HALF]));
            }
        }
    }
}

/* Fields of the particles of a batch, from the forces of its pairs: sums over lanes are made in a
 * fixed tree. */
GBG_ALWAYS void NEAR(add_up)(const struct gbg_near_sum *sum, const struct NEAR(batch) * batch,
                             int dimension)
{
    enum { SOME = 16 };
    double half[SOME][3][GBG_NEAR_LANES / 2];
    for (int first = 0; first < batch->segments; first += SOME) {
        int end = first + SOME < batch->segments ? first + SOME : batch->segments;
        NEAR(add_some)(batch, first, end, half, dimension);
        for (int s = first; s < end; s++) {
            const struct gbg_near_segment *segment = &batch->segment[s];
            for (int a = 0; a < dimension; a++) {
                const double *l = half[s - first][a];
                double all = ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]));
                double *field = sum->order->field[a] + segment->k;
                *field = segment->from > 0 ? *field + all * sum->factor : all * sum->factor;
            }
        }
    }
}

/* Evaluates the batch and adds it to the fields. */
static void NEAR(flush)(struct NEAR(work) * work)
{
    enum { AT_ONCE = GBG_NEAR_BLOCK * LANES };
    struct NEAR(batch) *batch = &work->batch;
    const struct gbg_near_sum *sum = work->sum;
    int padded = (batch->used + AT_ONCE - 1) / AT_ONCE * AT_ONCE;
    for (int k = batch->used; k < padded; k += LANES) {
        for (int a = 0; a < sum->dimension; a++) {
            V(store)(batch->r[a] + k, V(set)(0));
        }
    }
    int nearer = work->evaluate(sum, batch);
    if (sum->dimension == 2) {
        NEAR(add_up)(sum, batch, 2);
    } else {
        NEAR(add_up)(sum, batch, 3);
    }
    if (nearer != batch->selves + padded - batch->used) {
        MEND(sum, batch->segments, batch->segment);
    }
    batch->segments = batch->used = batch->selves = 0;
}

/* Particles first..end-1 of a cell meet n of the strip from p on, which are their candidates from
 * number `from` on; their own begin at number `self`. */
GBG_ALWAYS void NEAR(meet)(struct NEAR(work) * work, int64_t first, int64_t end, int32_t p,
                           int32_t n, int64_t from, int64_t self, int dimension, int scaled)
{
    struct NEAR(batch) *batch = &work->batch;
    for (int64_t k = first; k < end; k++) {
        WORD own[3];
        for (int a = 0; a < dimension; a++) {
            own[a] = WORD_OF(work->sum->order, a, k);
        }
        for (int32_t j = 0; j < n; j += GBG_NEAR_PIECE) {
            int32_t count = n - j < GBG_NEAR_PIECE ? n - j : GBG_NEAR_PIECE;
            int64_t place = self + (k - first) - from - j;
            if (batch->used + count > GBG_NEAR_BATCH || batch->segments == GBG_NEAR_SEGMENTS) {
                NEAR(flush)(work);
            }
            int kept = NEAR(keep)(work, own, p + j, count, dimension, scaled);
            batch->segment[batch->segments++] =
                (struct gbg_near_segment){(int32_t)k, batch->used, kept, (int32_t)from + j, count};
            batch->used += kept;
            batch->selves += place >= 0 && place < count;
        }
    }
}

/* Particles begin..end-1 in sorted order go to the end of the strip. */
GBG_ALWAYS void NEAR(copy)(struct NEAR(work) * work, int64_t begin, int64_t end, int dimension)
{
    struct NEAR(strip) *strip = &work->strip;
    const struct gbg_ewald_order *order = work->sum->order;
    for (int64_t k = begin; k < end; k += COPY) {
        int32_t to = strip->used + (int32_t)(k - begin);
        for (int a = 0; a < dimension; a++) {
            COPY_WORDS(strip->x[a] + to, order, a, k);
        }
        if (!work->uniform) {
            memcpy(strip->source + to, SOURCES(order) + k, COPY * sizeof(REAL));
        }
    }
    strip->used += (int32_t)(end - begin);
}

/* Adds column number `to` to the strip; 0: it does not fit. */
GBG_ALWAYS int NEAR(copy_column)(struct NEAR(work) * work, int32_t column, int to, int dimension)
{
    struct NEAR(strip) *strip = &work->strip;
    const int64_t *begin = work->sum->order->begin + column;
    for (int r = 0; r < work->rows.count; r++) {
        int64_t cell = work->rows.first[r];
        if (begin[cell + 1] - begin[cell] > GBG_NEAR_STRIP - strip->used) {
            return 0;
        }
        if (r == work->rows.own) {
            strip->own[to] = strip->used;
        }
        NEAR(copy)(work, begin[cell], begin[cell + 1], dimension);
    }
    strip->start[to + 1] = strip->used;
    return 1;
}

/* A cell with more candidates than a strip holds: whole strips of them one after the other. */
static void NEAR(meet_many)(struct NEAR(work) * work, int32_t column, int scaled)
{
    const struct gbg_ewald_order *order = work->sum->order;
    const int64_t *begin = order->begin;
    int64_t own = work->rows.first[work->rows.own] + column, from = 0, self = INT64_MAX / 2;
    int32_t first, dimension = work->sum->dimension;
    gbg_near_span(order, 0, column, &first);
    work->strip.used = 0;
    for (int64_t c = 0; c < (int64_t)work->rows.columns * work->rows.count; c++) {
        int32_t at = gbg_near_wrap(first + (int32_t)(c / work->rows.count), order->cells[0]);
        int64_t cell = work->rows.first[c % work->rows.count] + at;
        self = cell == own ? from + work->strip.used : self;
        for (int64_t k = begin[cell]; k < begin[cell + 1];) {
            int64_t room = GBG_NEAR_STRIP - work->strip.used, take = begin[cell + 1] - k;
            take = take < room ? take : room;
            NEAR(copy)(work, k, k + take, dimension);
            k += take;
            if (work->strip.used == GBG_NEAR_STRIP) {
                NEAR(meet)
                (work, begin[own], begin[own + 1], 0, GBG_NEAR_STRIP, from, self, dimension,
                 scaled);
                from += GBG_NEAR_STRIP;
                work->strip.used = 0;
            }
        }
    }
    NEAR(meet)
    (work, begin[own], begin[own + 1], 0, work->strip.used, from, self, dimension, scaled);
}

/* As many cells of the row from `column` on, before `end`, as a strip holds the candidates of;
 * returns the next one. */
GBG_ALWAYS int32_t NEAR(meet_some)(struct NEAR(work) * work, int32_t column, int32_t end,
                                   int dimension, int scaled)
{
    struct NEAR(strip) *strip = &work->strip;
    const struct gbg_ewald_order *order = work->sum->order;
    const int64_t *begin = order->begin + work->rows.first[work->rows.own];
    int32_t first, columns = work->rows.columns;
    gbg_near_span(order, 0, column, &first);
    int all = columns == order->cells[0] && first == 0, copied = 0;
    int32_t wanted = all ? columns : end - column + columns - 1;
    strip->used = 0;
    strip->start[0] = 0;
    while (copied < wanted &&
           NEAR(copy_column)(work, gbg_near_wrap(first + copied, order->cells[0]), copied,
                             dimension)) {
        copied++;
    }
    if (copied < columns) {
        NEAR(meet_many)(work, column, scaled);
        return column + 1;
    }
    int32_t last = all ? end : column + copied - columns + 1;
    for (int32_t c = column; c < last; c++) {
        int32_t skipped = all ? 0 : c - column, own = c - first;
        int32_t p = strip->start[skipped], n = strip->start[skipped + columns] - p;
        NEAR(meet)(work, begin[c], begin[c + 1], p, n, 0, strip->own[own] - p, dimension, scaled);
    }
    return last;
}

/* GBG_NEAR_COLUMNS cells of a row. */
GBG_ALWAYS void NEAR(task)(struct NEAR(work) * work, int64_t task, int dimension, int scaled)
{
    const struct gbg_ewald_order *order = work->sum->order;
    int64_t a_row = gbg_near_tasks(order->cells[0]), row = task / a_row;
    int32_t column = (int32_t)(task % a_row) * GBG_NEAR_COLUMNS;
    int32_t end = order->cells[0] - column;
    end = column + (end < GBG_NEAR_COLUMNS ? end : GBG_NEAR_COLUMNS);
    const int64_t *begin = order->begin + row * order->cells[0];
    if (begin[column] == begin[end]) {
        return;
    }
    gbg_near_find_rows(order, row, &work->rows);
    while (column < end) {
        column = NEAR(meet_some)(work, column, end, dimension, scaled);
    }
    NEAR(flush)(work);
}

static void NEAR(start)(struct NEAR(work) * work, const struct gbg_near_sum *sum,
                        NEAR(evaluate) evaluate)
{
    work->sum = sum;
    work->evaluate = evaluate;
    work->limit = (REAL)sum->limit;
    work->uniform = sum->uniform;
    work->batch.segments = work->batch.used = work->batch.selves = 0;
    for (int k = 0; sum->uniform && k < GBG_NEAR_BATCH + GBG_NEAR_SPARE; k++) {
        work->batch.source[k] = SOURCES(sum->order)[0];
    }
}
