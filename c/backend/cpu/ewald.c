/* L1, CPU: sums over all images by a mesh: their memory, and the order of their parts. */
#include "backend/cpu/ewald.h"

#include <math.h>
#include <string.h>

#include "backend/cpu/cpu.h"
#include "backend/cpu/ewald_blocks.h"
#include "core/memory.h"
#include "ewald/influence.h"

/* PATCH_BYTES: what a patch should not exceed, so that it stays in the cache of its core. */
enum { THICKNESS = 16, PATCH_BYTES = 1 << 19 };

static size_t number_size(const struct gbg_ewald_choice *choice)
{
    return choice->single ? sizeof(float) : sizeof(double);
}

static int meshes(const struct gbg_ewald_choice *choice)
{
    return choice->gradient == GBG_GRADIENT_WAVES ? 1 + choice->dimension : 1;
}

/* Waves n >= 0 of axes 1 and 2: rows of the influence. */
static int64_t influence_rows(const struct gbg_ewald_choice *choice)
{
    int64_t rows = choice->cells[1] / 2 + 1;
    return choice->dimension == 3 ? rows * (choice->cells[2] / 2 + 1) : rows;
}

static int reserve(struct gbg_device *device, struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    const size_t size = number_size(choice);
    int64_t numbers = gbg_fft_numbers(choice->dimension, choice->cells);
    int status = gbg_cpu_scratch(device, &sum->influence,
                                 influence_rows(choice) * (choice->cells[0] / 2 + 1), size,
                                 "influence of waves");
    for (int m = 0; status == GBG_OK && m < meshes(choice); m++) {
        status = gbg_cpu_scratch(device, &sum->mesh[m], numbers, size, "mesh");
    }
    return status;
}

static int reserve_axes(struct gbg_device *device, const struct gbg_ewald_choice *choice,
                        void **memory, struct gbg_ewald_axis axis[3])
{
    int64_t numbers = 0, waves[3] = {0, 0, 0};
    for (int a = 0; a < choice->dimension; a++) {
        waves[a] = choice->cells[a] / 2 + 1;
        numbers += 3 * waves[a];
    }
    int status = gbg_cpu_scratch(device, memory, numbers, sizeof(double), "factors of waves");
    double *next = *memory;
    for (int a = 0; status == GBG_OK && a < choice->dimension; a++) {
        axis[a].square = next;
        axis[a].power = next + waves[a];
        axis[a].slope = next + 2 * waves[a];
        next += 3 * waves[a];
    }
    return status;
}

/* The power of two at or below a positive number; 1 for others. */
static double unit_of(double x)
{
    int exponent;
    if (!(x > 0.0 && x < INFINITY)) {
        return 1.0;
    }
    frexp(x, &exponent);
    return ldexp(1.0, exponent - 1);
}

/* Units that keep single precision in its range whatever the units of the scene. */
static void choose_units(const struct gbg_ewald_axis axis[3], double *row, struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    double largest = 0.0;
    sum->wave_unit = unit_of(choice->band / choice->reach);
    for (int32_t n1 = 0; n1 < 2; n1++) {
        gbg_ewald_fill_row(&sum->plan, axis, n1, 0, row);
        for (int32_t n = 0; n <= choice->cells[0] / 2; n++) {
            largest = fmax(largest, fabs(row[n]));
        }
    }
    sum->potential_unit = unit_of(largest);
    sum->field_unit = sum->potential_unit * sum->wave_unit;
}

static void store_row(const struct gbg_ewald *sum, const double *row, int64_t r)
{
    const int64_t waves = sum->plan.choice.cells[0] / 2 + 1;
    const double factor = 1.0 / sum->potential_unit;
    for (int64_t n = 0; n < waves; n++) {
        if (sum->plan.choice.single) {
            ((float *)sum->influence)[r * waves + n] = (float)(factor * row[n]);
        } else {
            ((double *)sum->influence)[r * waves + n] = factor * row[n];
        }
    }
}

static int fill_influence(struct gbg_device *device, struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    const int64_t rows = influence_rows(choice), waves = choice->cells[0] / 2 + 1;
    const int64_t rows_1 = choice->cells[1] / 2 + 1;
    struct gbg_ewald_axis axis[3] = {{0}};
    void *memory = NULL, *row = NULL;
    int status = reserve_axes(device, choice, &memory, axis);
    if (status == GBG_OK) {
        status =
            gbg_cpu_scratch(device, &row, device->threads * waves, sizeof(double), "rows of waves");
    }
    for (int a = 0; status == GBG_OK && a < choice->dimension; a++) {
        gbg_ewald_fill_axis(&sum->plan, a, &axis[a]);
    }
    if (status == GBG_OK) {
        choose_units(axis, row, sum);
#pragma omp parallel for num_threads(device->threads) schedule(static)
        for (int t = 0; t < device->threads; t++) {
            double *mine = (double *)row + t * waves;
            for (int64_t r = rows * t / device->threads; r < rows * (t + 1) / device->threads;
                 r++) {
                gbg_ewald_fill_row(&sum->plan, axis, (int32_t)(r % rows_1), (int32_t)(r / rows_1),
                                   mine);
                store_row(sum, mine, r);
            }
        }
    }
    gbg_release(memory);
    gbg_release(row);
    return status;
}

/* Blocks along axis a that are at least `thick` nodes wide, and more than a window is. */
static int32_t divide(const struct gbg_ewald *sum, int a, int64_t thick)
{
    int64_t cells = sum->order.cells[a], nodes = sum->plan.choice.cells[a], each = 1;
    thick = thick > sum->plan.choice.width + 1 ? thick : sum->plan.choice.width + 1;
    while (each < cells && each * nodes / cells < thick) {
        each++;
    }
    return (int32_t)(cells / each);
}

/* Numbers of the largest patch. */
static int64_t largest_patch(const struct gbg_ewald *sum)
{
    int64_t most = 0;
    for (int32_t b2 = 0; b2 < sum->blocks[2]; b2++) {
        for (int32_t b1 = 0; b1 < sum->blocks[1]; b1++) {
            struct gbg_ewald_block block = gbg_block_at(sum, b1, b2);
            int64_t rows = (int64_t)block.rows[1] * block.rows[2];
            most = rows > most ? rows : most;
        }
    }
    return most * gbg_patch_pitch(sum);
}

/* Divides the cells of the order into blocks: as thick as the cache allows, and at least 16 on an
 * axis of many nodes, so that there is work for many threads. */
static void choose_blocks(struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    int64_t thick = THICKNESS;
    do {
        for (int a = 0; a < 3; a++) {
            int64_t share = a < choice->dimension ? choice->cells[a] / 16 : 0;
            int used = a > 0 && a < choice->dimension;
            sum->blocks[a] = used ? divide(sum, a, share < thick ? share : thick) : 1;
        }
        sum->patch = (largest_patch(sum) + 15) / 16 * 16;
        thick -= 4;
    } while (thick > choice->width && sum->patch * (int64_t)number_size(choice) > PATCH_BYTES);
}

/* Blocks and patches for the particles as they are sorted now. */
static int reserve_patches(struct gbg_device *device, struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    if (memcmp(sum->divided, sum->order.cells, sizeof sum->divided) == 0) {
        return GBG_OK;
    }
    choose_blocks(sum);
    int64_t bytes =
        sum->threads * gbg_patch_meshes(choice) * sum->patch * (int64_t)number_size(choice);
    int status = GBG_OK;
    if (bytes > sum->patch_bytes) {
        gbg_release(sum->patches);
        sum->patches = NULL;
        sum->patch_bytes = 0;
        status = gbg_cpu_scratch(device, &sum->patches, bytes, 1, "patches of the mesh");
        sum->patch_bytes = status == GBG_OK ? bytes : 0;
    }
    memcpy(sum->divided, status == GBG_OK ? sum->order.cells : (int32_t[3]){0, 0, 0},
           sizeof sum->divided);
    return status;
}

static int fill(struct gbg_device *device, const struct gbg_state *state, int hurry,
                struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    const char *why;
    sum->fft = gbg_fft_find(&why);
    if (!sum->fft) {
        return gbg_fail(device->context, GBG_E_UNBUILT, "long-range sum by a mesh: %s", why);
    }
    int status = gbg_ewald_order_reserve(device, state, &sum->plan, &sum->order);
    status = status ? status : reserve(device, sum);
    status = status ? status : reserve_patches(device, sum);
    status = status ? status : fill_influence(device, sum);
    return status ? status
                  : sum->fft->make(device->context, choice->dimension, choice->cells,
                                   choice->single, sum->threads, hurry, &sum->transform);
}

int gbg_ewald_create(struct gbg_device *device, const struct gbg_state *state,
                     const struct gbg_ewald_plan *plan, int hurry, struct gbg_ewald **sum)
{
    void *body;
    *sum = NULL;
    int status = gbg_allocate_zero(device->context, &body, 1, sizeof **sum, "long-range sum");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_ewald *made = body;
    made->plan = *plan;
    made->threads = device->threads;
    status = fill(device, state, hurry, made);
    if (status != GBG_OK) {
        gbg_ewald_destroy(device, made);
        return status;
    }
    *sum = made;
    return GBG_OK;
}

void gbg_ewald_destroy(struct gbg_device *device, struct gbg_ewald *sum)
{
    (void)device;
    if (!sum) {
        return;
    }
    if (sum->transform) {
        sum->fft->release(sum->transform);
    }
    gbg_ewald_order_release(&sum->order);
    for (int m = 0; m < 4; m++) {
        gbg_release(sum->mesh[m]);
    }
    gbg_release(sum->influence);
    gbg_release(sum->patches);
    gbg_release(sum);
}

static void transform_back(struct gbg_ewald *sum, int fields)
{
    for (int a = 0; a < (fields ? sum->plan.choice.dimension : 1); a++) {
        sum->fft->backward(sum->transform, sum->mesh[fields ? a + 1 : 0]);
    }
}

/* Waves of the sources, to the potential or, with `fields`, the field on meshes. */
static void solve(struct gbg_device *device, struct gbg_ewald *sum, int fields)
{
    device->variant->ewald->spread(device, sum);
    sum->fft->forward(sum->transform, sum->mesh[0]);
    device->variant->ewald->multiply(device, sum, fields);
    transform_back(sum, fields);
}

static int sort(struct gbg_device *device, struct gbg_state *state, struct gbg_ewald *sum)
{
    int status = gbg_ewald_sort(device, state, sum);
    return status ? status : reserve_patches(device, sum);
}

int gbg_ewald_force(struct gbg_device *device, struct gbg_state *state, struct gbg_ewald *sum,
                    int add)
{
    const struct gbg_ewald_kernels *kernels = device->variant->ewald;
    const struct gbg_ewald_order *order = &sum->order;
    const int dimension = sum->plan.choice.dimension;
    int status = sort(device, state, sum);
    if (status != GBG_OK) {
        return status;
    }
    kernels->near(device, state, sum);
    solve(device, sum, sum->plan.choice.gradient == GBG_GRADIENT_WAVES);
    kernels->gather(device, sum);
#pragma omp parallel for num_threads(device->threads) schedule(static)
    for (int64_t k = 0; k < order->n; k++) {
        int32_t i = order->index[k];
        double factor = state->mobility[state->species ? state->species[i] : 0] * order->largest;
        for (int a = 0; a < dimension; a++) {
            double force = factor * order->field[a][k];
            state->force[a][i] = add ? state->force[a][i] + force : force;
        }
    }
    return GBG_OK;
}

/* What a source adds everywhere, so that the mean over the box vanishes, and what the mesh adds at
 * a source's own place: in units of the largest |alpha|. */
static double mean_of_near(const struct gbg_ewald *sum)
{
    const struct gbg_ewald_order *order = &sum->order;
    double total = 0.0, volume = 1.0;
    for (int64_t k = 0; k < order->n; k++) {
        total += sum->plan.choice.single ? (double)order->source[k] : order->source_double[k];
    }
    for (int a = 0; a < sum->plan.choice.dimension; a++) {
        volume *= sum->plan.choice.length[a];
    }
    return total * gbg_ewald_near_integral(&sum->plan) / volume;
}

int gbg_ewald_potential(struct gbg_device *device, struct gbg_state *state, struct gbg_ewald *sum,
                        double *potential)
{
    const struct gbg_ewald_kernels *kernels = device->variant->ewald;
    const struct gbg_ewald_order *order = &sum->order;
    int status = sort(device, state, sum);
    if (status != GBG_OK) {
        return status;
    }
    gbg_ewald_near_potential(device, state, sum, order->field[0]);
    solve(device, sum, 0);
    kernels->gather_potential(device, sum);
    double mean = mean_of_near(sum);
#pragma omp parallel for num_threads(device->threads) schedule(static)
    for (int64_t k = 0; k < order->n; k++) {
        double own = sum->plan.choice.single ? (double)order->source[k] : order->source_double[k];
        potential[order->index[k]] =
            order->largest * (order->field[0][k] - mean - own * sum->plan.split.self);
    }
    return GBG_OK;
}

double gbg_ewald_bytes(const struct gbg_ewald *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    double numbers = meshes(choice) * (double)gbg_fft_numbers(choice->dimension, choice->cells) +
                     (double)influence_rows(choice) * (choice->cells[0] / 2 + 1);
    return numbers * (double)number_size(choice) + (double)sum->patch_bytes +
           gbg_ewald_order_bytes(&sum->order);
}
