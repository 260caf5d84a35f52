/* L1, CPU: spreading and gathering in one precision: part of ewald_mesh.c, which says what the
 * names in capitals are. */

#define TABLES struct R(tables)
#define WINDOWS struct R(batch)
#define evaluate R(evaluate)
#define fetch_patch R(fetch_patch)
#define first_row R(first_row)
#define prepare R(prepare)
#define put R(put)
#define put_range R(put_range)
#define spread_block R(spread_block)
#define spread_colour R(spread_colour)
#define take R(take)
#define take_along R(take_along)
#define take_range R(take_range)
#define take_ranges R(take_ranges)
#define take_rows R(take_rows)

/* The windows' polynomials in this precision. */
struct R(tables) {
    int degree[3];
    _Alignas(64) REAL value[3][DEGREES][WIDEST];
    _Alignas(64) REAL slope[3][DEGREES][WIDEST];
};

/* Particles at a time: first nodes, places between nodes, and windows, along axis 0 with zeros
 * around them that nobody writes to. */
struct R(batch) {
    int32_t start[3][BATCH];
    _Alignas(64) REAL offset[3][BATCH];
    _Alignas(64) REAL along[BATCH][SPAN];
    _Alignas(64) REAL window[3][BATCH][WIDEST];
    _Alignas(64) REAL slope[3][BATCH][WIDEST];
};

/* The degree without terms that cannot be seen in this precision. */
static int R(useful_degree)(const struct gbg_ewald_window *window)
{
    double peak = 0.0;
    int degree = window->degree;
    for (int l = 0; l < window->width; l++) {
        peak = fabs(window->value[0][l]) > peak ? fabs(window->value[0][l]) : peak;
    }
    for (double dropped = 0.0; degree > 1; degree--) {
        double most = 0.0;
        for (int l = 0; l < window->width; l++) {
            double size = fabs(window->value[degree][l]) + fabs(window->slope[degree][l]);
            most = size > most ? size : most;
        }
        dropped += most;
        if (dropped > DROPPED * peak) {
            break;
        }
    }
    return degree;
}

static void R(make_tables)(const struct gbg_ewald_plan *plan, double wave_unit, TABLES *tables)
{
    for (int a = 0; a < plan->choice.dimension; a++) {
        const struct gbg_ewald_window *window = &plan->window[a];
        double spacings = plan->choice.cells[a] / (plan->choice.length[a] * wave_unit);
        tables->degree[a] = R(useful_degree)(window);
        for (int k = 0; k < DEGREES; k++) {
            for (int l = 0; l < WIDEST; l++) {
                int there = k <= window->degree && l < window->width;
                tables->value[a][k][l] = there ? (REAL)window->value[k][l] : 0;
                tables->slope[a][k][l] = there ? (REAL)(spacings * window->slope[k][l]) : 0;
            }
        }
    }
}

/* First nodes of particles begin..begin+count-1 along an axis, and their places between nodes. */
static void R(locate)(const struct gbg_ewald *sum, int a, int64_t begin, int count, WINDOWS *batch)
{
    const struct gbg_ewald_order *order = &sum->order;
    const int width = sum->plan.choice.width;
    const WIDE cells = (WIDE)sum->plan.choice.cells[a];
    const WIDE half = width % 2 ? (WIDE)1 << (BITS - 1) : 0;
    const int32_t shift = (width % 2 ? 0 : 1) - width / 2;
    for (int p = 0; p < count; p++) {
        WIDE place = FRACTION(order, a, begin + p) * cells + half;
        batch->start[a][p] = (int32_t)(place >> BITS) + shift;
        batch->offset[a][p] = OFFSET(place);
    }
    for (int p = count; p < BATCH; p++) {
        batch->offset[a][p] = 0;
    }
}

/* Windows of a batch by Horner's rule, four particles at a time: LANES x vectors nodes each. */
ALWAYS void evaluate(REAL (*coefficient)[WIDEST], int degree, const REAL *offset, int count,
                     int vectors, REAL *out, int stride)
{
    for (int p = 0; p < count; p += 4) {
        for (int v = 0; v < vectors; v++) {
            REAL *to = out + p * stride + v * LANES;
            V z0 = V_(set)(offset[p]), z1 = V_(set)(offset[p + 1]);
            V z2 = V_(set)(offset[p + 2]), z3 = V_(set)(offset[p + 3]);
            V sum0 = V_(load)(&coefficient[degree][v * LANES]);
            V sum1 = sum0, sum2 = sum0, sum3 = sum0;
            for (int k = degree - 1; k >= 0; k--) {
                V next = V_(load)(&coefficient[k][v * LANES]);
                sum0 = V_(fma)(sum0, z0, next);
                sum1 = V_(fma)(sum1, z1, next);
                sum2 = V_(fma)(sum2, z2, next);
                sum3 = V_(fma)(sum3, z3, next);
            }
            V_(store)(to, sum0);
            V_(store)(to + stride, sum1);
            V_(store)(to + 2 * stride, sum2);
            V_(store)(to + 3 * stride, sum3);
        }
    }
}

ALWAYS void prepare(const struct gbg_ewald *sum, TABLES *tables, int64_t begin, int count,
                    int dimension, int vectors, WINDOWS *batch)
{
    for (int a = 0; a < dimension; a++) {
        R(locate)(sum, a, begin, count, batch);
        REAL *out = a == 0 ? &batch->along[0][LANES] : &batch->window[a][0][0];
        evaluate(tables->value[a], tables->degree[a], batch->offset[a], count, vectors, out,
                 a == 0 ? SPAN : WIDEST);
    }
}

/* One particle onto the patch: whole vectors at multiples of their length, so that what the next
 * particle reads is what this one wrote. */
ALWAYS void put(const WINDOWS *batch, int p, REAL source, REAL *corner, int64_t pitch,
                int64_t plane, int width, int dimension, int vectors)
{
    int column = batch->start[0][p] + GBG_PATCH_BEFORE, aside = column % LANES;
    const REAL *along = &batch->along[p][LANES - aside];
    REAL *place = corner + (column - aside);
    V x[3], strength = V_(set)(source);
    for (int v = 0; v <= vectors; v++) {
        x[v] = V_(mul)(strength, V_(load)(along + v * LANES));
    }
    for (int k = 0; k < (dimension == 3 ? width : 1); k++) {
        V xz[3];
        for (int v = 0; v <= vectors; v++) {
            xz[v] = dimension == 3 ? V_(mul)(V_(set)(batch->window[2][p][k]), x[v]) : x[v];
        }
        for (int j = 0; j < width; j++) {
            REAL *row = place + k * plane + j * pitch;
            V y = V_(set)(batch->window[1][p][j]);
            for (int v = 0; v <= vectors; v++) {
                V_(store)(row + v * LANES, V_(fma)(y, xz[v], V_(load)(row + v * LANES)));
            }
        }
    }
}

/* Where a particle's first row stands in the patch of its block. */
ALWAYS int64_t first_row(const WINDOWS *batch, const struct gbg_ewald_block *block, int p,
                         int64_t pitch, int64_t plane, int dimension)
{
    int64_t row = (batch->start[1][p] - block->first[1]) * pitch;
    return dimension == 3 ? row + (batch->start[2][p] - block->first[2]) * plane : row;
}

ALWAYS void put_range(const struct gbg_ewald *sum, TABLES *tables,
                      const struct gbg_ewald_block *block, int64_t begin, int64_t end,
                      WINDOWS *batch, REAL *patch, int dimension, int vectors)
{
    const int64_t pitch = gbg_patch_pitch(sum), plane = pitch * block->rows[1];
    const REAL *source = SOURCE(&sum->order);
    const int width = sum->plan.choice.width;
    for (int64_t i = begin; i < end; i += BATCH) {
        int count = end - i < BATCH ? (int)(end - i) : BATCH;
        prepare(sum, tables, i, count, dimension, vectors, batch);
        for (int p = 0; p < count; p++) {
            REAL *corner = patch + first_row(batch, block, p, pitch, plane, dimension);
            int aside = (batch->start[0][p] + GBG_PATCH_BEFORE) % LANES;
            if (vectors == 2 && aside + width <= 2 * LANES) {
                put(batch, p, source[i + p], corner, pitch, plane, width, dimension, 1);
            } else {
                put(batch, p, source[i + p], corner, pitch, plane, width, dimension, vectors);
            }
        }
    }
}

/* Node r of an axis that goes on on both sides. */
static int64_t R(wrapped)(int64_t r, int64_t cells)
{
    r %= cells;
    return r < 0 ? r + cells : r;
}

/* The row of the mesh that row r of a patch is a part of. */
static REAL *R(mesh_row)(const struct gbg_ewald *sum, void *mesh,
                         const struct gbg_ewald_block *block, int64_t r)
{
    const int32_t *cells = sum->plan.choice.cells;
    int64_t y = R(wrapped)(block->first[1] + r % block->rows[1], cells[1]), z = 0;
    if (sum->plan.choice.dimension == 3) {
        z = R(wrapped)(block->first[2] + r / block->rows[1], cells[2]);
    }
    return (REAL *)mesh + (z * cells[1] + y) * gbg_fft_pitch(cells);
}

/* Adds a patch to the mesh. */
static void R(add_patch)(const struct gbg_ewald *sum, const struct gbg_ewald_block *block,
                         const REAL *patch)
{
    const int64_t cells = sum->plan.choice.cells[0], width = sum->plan.choice.width;
    const int64_t rows = (int64_t)block->rows[1] * block->rows[2], pitch = gbg_patch_pitch(sum);
    for (int64_t r = 0; r < rows; r++) {
        REAL *to = R(mesh_row)(sum, sum->mesh[0], block, r);
        const REAL *from = patch + r * pitch + GBG_PATCH_BEFORE;
#pragma omp simd
        for (int64_t x = 0; x < cells; x++) {
            to[x] += from[x];
        }
        for (int64_t x = -(width / 2); x < 0; x++) {
            to[R(wrapped)(x, cells)] += from[x];
        }
        for (int64_t x = cells; x < cells + width - width / 2; x++) {
            to[R(wrapped)(x, cells)] += from[x];
        }
    }
}

static void spread_block(const struct gbg_ewald *sum, TABLES *tables,
                         const struct gbg_ewald_block *block, WINDOWS *batch, REAL *patch)
{
    const int deep = sum->plan.choice.dimension == 3, wide = sum->plan.choice.width > LANES;
    const int64_t rows = (int64_t)block->rows[1] * block->rows[2];
    int64_t begin, end, done = 0;
    for (int32_t c2 = block->begin[2]; c2 < block->end[2]; c2++) {
        gbg_block_particles(sum, block, c2, &begin, &end);
        if (begin == end) {
            continue;
        }
        if (done == 0) {
            memset(patch, 0, (size_t)(rows * gbg_patch_pitch(sum)) * sizeof(REAL));
        }
        done += end - begin;
        if (deep && wide) {
            put_range(sum, tables, block, begin, end, batch, patch, 3, 2);
        } else if (deep) {
            put_range(sum, tables, block, begin, end, batch, patch, 3, 1);
        } else if (wide) {
            put_range(sum, tables, block, begin, end, batch, patch, 2, 2);
        } else {
            put_range(sum, tables, block, begin, end, batch, patch, 2, 1);
        }
    }
    if (done) {
        R(add_patch)(sum, block, patch);
    }
}

/* All blocks of a colour; called by every thread of a team. */
static void spread_colour(const struct gbg_ewald *sum, TABLES *tables, int colour_1, int colour_2,
                          WINDOWS *batch, REAL *patch)
{
    const int32_t *blocks = sum->blocks;
    const int32_t n1 = gbg_colour_blocks(blocks[1], colour_1);
    const int32_t n = n1 * gbg_colour_blocks(blocks[2], colour_2);
#pragma omp for schedule(dynamic)
    for (int32_t k = 0; k < n; k++) {
        struct gbg_ewald_block block =
            gbg_block_at(sum, gbg_colour_block(blocks[1], colour_1, k % n1),
                         gbg_colour_block(blocks[2], colour_2, k / n1));
        spread_block(sum, tables, &block, batch, patch);
    }
}

static void R(clear)(const struct gbg_ewald *sum, int threads)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    const int64_t pitch = gbg_fft_pitch(choice->cells);
    const int64_t rows = gbg_fft_numbers(choice->dimension, choice->cells) / pitch;
    REAL *mesh = sum->mesh[0];
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t r = 0; r < rows; r++) {
        memset(mesh + r * pitch, 0, (size_t)pitch * sizeof(REAL));
    }
}

static void R(spread)(struct gbg_device *device, struct gbg_ewald *sum)
{
    const int threads = device->threads < sum->threads ? device->threads : sum->threads;
    TABLES tables;
    R(make_tables)(&sum->plan, sum->wave_unit, &tables);
    R(clear)(sum, threads);
#pragma omp parallel num_threads(threads)
    {
        WINDOWS batch;
        REAL *patch = (REAL *)sum->patches +
                      thread_number() * gbg_patch_meshes(&sum->plan.choice) * sum->patch;
        memset(&batch, 0, sizeof batch);
        for (int colour = 0; colour < GBG_BLOCK_COLOURS * GBG_BLOCK_COLOURS; colour++) {
            spread_colour(sum, &tables, colour % GBG_BLOCK_COLOURS, colour / GBG_BLOCK_COLOURS,
                          &batch, patch);
        }
    }
}

/* Copies what a block's particles read of a mesh. */
static void fetch_patch(const struct gbg_ewald *sum, void *mesh,
                        const struct gbg_ewald_block *block, REAL *patch)
{
    const int64_t cells = sum->plan.choice.cells[0], width = sum->plan.choice.width;
    const int64_t rows = (int64_t)block->rows[1] * block->rows[2], pitch = gbg_patch_pitch(sum);
    for (int64_t r = 0; r < rows; r++) {
        const REAL *from = R(mesh_row)(sum, mesh, block, r);
        REAL *to = patch + r * pitch + GBG_PATCH_BEFORE;
        memcpy(to, from, (size_t)cells * sizeof(REAL));
        memset(to + cells, 0, (size_t)(pitch - GBG_PATCH_BEFORE - cells) * sizeof(REAL));
        for (int64_t x = -(width / 2); x < 0; x++) {
            to[x] = from[R(wrapped)(x, cells)];
        }
        for (int64_t x = cells; x < cells + width - width / 2; x++) {
            to[x] = from[R(wrapped)(x, cells)];
        }
    }
}

/* Sums along axes 1 and 2 of a patch's rows, times windows (or, for one of them, slopes). */
ALWAYS void take_rows(const REAL *place, const REAL *y, const REAL *z, int64_t pitch, int64_t plane,
                      int width, int dimension, int vectors, V sum[2])
{
    for (int v = 0; v < vectors; v++) {
        sum[v] = V_(set)(0);
    }
    for (int k = 0; k < (dimension == 3 ? width : 1); k++) {
        V inner[2];
        for (int v = 0; v < vectors; v++) {
            inner[v] = dimension == 3 ? V_(set)(0) : sum[v];
        }
        for (int j = 0; j < width; j++) {
            const REAL *row = place + k * plane + j * pitch;
            V weight = V_(set)(y[j]);
            for (int v = 0; v < vectors; v++) {
                inner[v] = V_(fma)(weight, V_(load)(row + v * LANES), inner[v]);
            }
        }
        for (int v = 0; v < vectors; v++) {
            sum[v] = dimension == 3 ? V_(fma)(V_(set)(z[k]), inner[v], sum[v]) : inner[v];
        }
    }
}

/* Sum along axis 0 of what take_rows gave. */
ALWAYS REAL take_along(const REAL *x, const V sum[2], int vectors)
{
    V product = V_(mul)(V_(load)(x), sum[0]);
    if (vectors == 2) {
        product = V_(fma)(V_(load)(x + LANES), sum[1], product);
    }
    return V_(sum)(product);
}

/* What a particle reads: `values` numbers. */
ALWAYS void take(const WINDOWS *batch, int p, const REAL *corner, int64_t patch, int64_t pitch,
                 int64_t plane, int width, enum reading reading, int dimension, int vectors,
                 REAL *out)
{
    const REAL *place = corner + batch->start[0][p] + GBG_PATCH_BEFORE;
    const REAL *x = &batch->along[p][LANES], *y = batch->window[1][p], *z = batch->window[2][p];
    V sum[2];
    if (reading == SLOPES) {
        take_rows(place, y, z, pitch, plane, width, dimension, vectors, sum);
        out[0] = take_along(batch->slope[0][p], sum, vectors);
        take_rows(place, batch->slope[1][p], z, pitch, plane, width, dimension, vectors, sum);
        out[1] = take_along(x, sum, vectors);
        if (dimension == 3) {
            take_rows(place, y, batch->slope[2][p], pitch, plane, width, 3, vectors, sum);
            out[2] = take_along(x, sum, vectors);
        }
        return;
    }
    for (int f = 0; f < (reading == VALUE ? 1 : dimension); f++) {
        take_rows(place + f * patch, y, z, pitch, plane, width, dimension, vectors, sum);
        out[f] = take_along(x, sum, vectors);
    }
}

ALWAYS void take_range(const struct gbg_ewald *sum, TABLES *tables,
                       const struct gbg_ewald_block *block, int64_t begin, int64_t end,
                       WINDOWS *batch, const REAL *patch, enum reading reading, int dimension,
                       int vectors)
{
    const int64_t pitch = gbg_patch_pitch(sum), plane = pitch * block->rows[1];
    const int values = reading == VALUE ? 1 : dimension, width = sum->plan.choice.width;
    const double scale = reading == VALUE ? sum->potential_unit : sum->field_unit;
    for (int64_t i = begin; i < end; i += BATCH) {
        int count = end - i < BATCH ? (int)(end - i) : BATCH;
        prepare(sum, tables, i, count, dimension, vectors, batch);
        for (int a = 0; reading == SLOPES && a < dimension; a++) {
            evaluate(tables->slope[a], tables->degree[a], batch->offset[a], count, vectors,
                     batch->slope[a][0], WIDEST);
        }
        for (int p = 0; p < count; p++) {
            const REAL *corner = patch + first_row(batch, block, p, pitch, plane, dimension);
            REAL out[3];
            take(batch, p, corner, sum->patch, pitch, plane, width, reading, dimension, vectors,
                 out);
            for (int a = 0; a < values; a++) {
                double *field = &sum->order.field[a][i + p];
                *field += scale * (double)out[a];
            }
        }
    }
}

ALWAYS void take_ranges(const struct gbg_ewald *sum, TABLES *tables,
                        const struct gbg_ewald_block *block, WINDOWS *batch, const REAL *patch,
                        enum reading reading, int dimension, int vectors)
{
    for (int32_t c2 = block->begin[2]; c2 < block->end[2]; c2++) {
        int64_t begin, end;
        gbg_block_particles(sum, block, c2, &begin, &end);
        take_range(sum, tables, block, begin, end, batch, patch, reading, dimension, vectors);
    }
}

typedef void (*R(taker))(const struct gbg_ewald *sum, TABLES *tables,
                         const struct gbg_ewald_block *block, WINDOWS *batch, const REAL *patch);

#define TAKER(reading, dimension, vectors)                                                         \
    static void R(take_##reading##_##dimension##_##vectors)(                                       \
        const struct gbg_ewald *sum, TABLES *tables, const struct gbg_ewald_block *block,          \
        WINDOWS *batch, const REAL *patch)                                                         \
    {                                                                                              \
        take_ranges(sum, tables, block, batch, patch, reading, dimension, vectors);                \
    }
TAKER(FIELDS, 2, 1)
TAKER(FIELDS, 2, 2)
TAKER(FIELDS, 3, 1)
TAKER(FIELDS, 3, 2)
TAKER(SLOPES, 2, 1)
TAKER(SLOPES, 2, 2)
TAKER(SLOPES, 3, 1)
TAKER(SLOPES, 3, 2)
TAKER(VALUE, 2, 1)
TAKER(VALUE, 2, 2)
TAKER(VALUE, 3, 1)
TAKER(VALUE, 3, 2)
#undef TAKER

static R(taker) R(choose_taker)(const struct gbg_ewald *sum, enum reading reading)
{
    static const R(taker) all[3][2][2] = {
        {{R(take_FIELDS_2_1), R(take_FIELDS_2_2)}, {R(take_FIELDS_3_1), R(take_FIELDS_3_2)}},
        {{R(take_SLOPES_2_1), R(take_SLOPES_2_2)}, {R(take_SLOPES_3_1), R(take_SLOPES_3_2)}},
        {{R(take_VALUE_2_1), R(take_VALUE_2_2)}, {R(take_VALUE_3_1), R(take_VALUE_3_2)}}};
    return all[reading][sum->plan.choice.dimension - 2][sum->plan.choice.width > LANES];
}

/* 1 if there is anybody in a block. */
static int R(is_inhabited)(const struct gbg_ewald *sum, const struct gbg_ewald_block *block)
{
    for (int32_t c2 = block->begin[2]; c2 < block->end[2]; c2++) {
        int64_t begin, end;
        gbg_block_particles(sum, block, c2, &begin, &end);
        if (end > begin) {
            return 1;
        }
    }
    return 0;
}

static void R(gather)(struct gbg_device *device, struct gbg_ewald *sum, enum reading reading)
{
    const int threads = device->threads < sum->threads ? device->threads : sum->threads;
    const int meshes = reading == FIELDS ? sum->plan.choice.dimension : 1;
    const int64_t blocks = (int64_t)sum->blocks[1] * sum->blocks[2];
    R(taker) taker = R(choose_taker)(sum, reading);
    TABLES tables;
    R(make_tables)(&sum->plan, sum->wave_unit, &tables);
#pragma omp parallel num_threads(threads)
    {
        WINDOWS batch;
        REAL *patch = (REAL *)sum->patches +
                      thread_number() * gbg_patch_meshes(&sum->plan.choice) * sum->patch;
        memset(&batch, 0, sizeof batch);
#pragma omp for schedule(dynamic)
        for (int64_t b = 0; b < blocks; b++) {
            struct gbg_ewald_block block =
                gbg_block_at(sum, (int32_t)(b % sum->blocks[1]), (int32_t)(b / sum->blocks[1]));
            if (!R(is_inhabited)(sum, &block)) {
                continue;
            }
            for (int m = 0; m < meshes; m++) {
                fetch_patch(sum, sum->mesh[reading == FIELDS ? m + 1 : 0], &block,
                            patch + m * sum->patch);
            }
            taker(sum, &tables, &block, &batch, patch);
        }
    }
}

#undef TABLES
#undef WINDOWS
#undef evaluate
#undef fetch_patch
#undef first_row
#undef prepare
#undef put
#undef put_range
#undef spread_block
#undef spread_colour
#undef take
#undef take_along
#undef take_range
#undef take_ranges
#undef take_rows
