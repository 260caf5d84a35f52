/* Analysis room: density modes by spreading on a real mesh, transform and division by the window.
 */
#include <math.h>
#include <string.h>

#include "analysis/density.h"
#include "analysis/tiles.h"
#include "analysis/transform.h"
#include "core/context.h"
#include "core/memory.h"

struct gbg_density_mesh {
    struct gbg_tiles tiles;
    struct gbg_transform *transform;
    double *mesh;
    int32_t cells[3];
    int64_t rows, pitch;
    double scale; /* gain times this is 1/(transform of the window) */
};

/* Relative errors on one axis, for |n| = 0..reach. */
struct axis_table {
    double *alias, *root, *gain;
};

static int allocate_table(struct gbg_context *context, int64_t count, struct axis_table *table)
{
    void *block;
    int status = gbg_allocate(context, &block, 3 * count, sizeof(double), "aliasing bounds");
    table->alias = block;
    if (status == GBG_OK) {
        table->root = table->alias + count;
        table->gain = table->alias + 2 * count;
    }
    return status;
}

static void fill_table(const struct gbg_window *window, int32_t reach, int32_t cells,
                       struct axis_table *table)
{
    for (int32_t n = 0; n <= reach; n++) {
        double f = (double)n / cells;
        gbg_window_alias(window, f, &table->alias[n], &table->root[n]);
        table->gain[n] = window->transform_zero / gbg_window_transform(window, f);
    }
}

/* From the axes to the modes: alias = prod(1 + A) - 1, without cancellation. */
static void combine(struct gbg_density *density, const struct axis_table *table)
{
    const struct gbg_modes *modes = density->modes;
    for (int64_t m = 0; m < modes->count; m++) {
        double alias = 0, square = 0, gain = 1;
        for (int a = 0; a < density->dimension; a++) {
            int32_t n = modes->n[a][m] < 0 ? -modes->n[a][m] : modes->n[a][m];
            double one = table[a].alias[n], two = table[a].root[n] * table[a].root[n];
            alias += one + alias * one;
            square += two + square * two;
            gain *= table[a].gain[n];
        }
        density->alias[m] = alias;
        density->alias_root[m] = sqrt(square);
        density->gain[m] = gain;
    }
}

static double largest_of(const double *value, int64_t n)
{
    double largest = 0;
    for (int64_t i = 0; i < n; i++) {
        largest = value[i] > largest ? value[i] : largest;
    }
    return largest;
}

/* The narrowest window whose aliasing stays below the target on all modes, or the widest. */
static int choose_width(struct gbg_density *density, const struct gbg_density_plan *plan,
                        struct axis_table *table)
{
    /* Below 1e-14 rounding decides. */
    double target = fmax(plan->tolerance / sqrt((double)plan->n), 1e-14);
    for (int width = GBG_WINDOW_NARROWEST;; width = GBG_WINDOW_NEXT(width)) {
        struct gbg_window window;
        gbg_window_make(width, &window);
        double edge = 0, sum, root;
        for (int a = 0; a < plan->dimension; a++) {
            double f = (double)density->modes->reach[a] / plan->cells[a];
            gbg_window_alias(&window, f, &sum, &root);
            edge = fmax(edge, sum);
        }
        if (edge > target && width < GBG_WINDOW_WIDEST) {
            continue;
        }
        for (int a = 0; a < plan->dimension; a++) {
            fill_table(&window, density->modes->reach[a], plan->cells[a], &table[a]);
        }
        combine(density, table);
        if (largest_of(density->alias, density->modes->count) <= target ||
            width == GBG_WINDOW_WIDEST) {
            return width;
        }
    }
}

static int allocate_errors(struct gbg_density *density)
{
    double **list[] = {&density->alias, &density->alias_root, &density->gain};
    for (int i = 0; i < 3; i++) {
        void *array;
        int status = gbg_allocate(density->context, &array, density->modes->count, sizeof(double),
                                  "error bounds of modes");
        *list[i] = array;
        if (status != GBG_OK) {
            return status;
        }
    }
    return GBG_OK;
}

static int plan_window(struct gbg_density *density, const struct gbg_density_plan *plan, int *width)
{
    struct axis_table table[3] = {{0}};
    int status = allocate_errors(density);
    for (int a = 0; a < plan->dimension && status == GBG_OK; a++) {
        status = allocate_table(density->context, density->modes->reach[a] + 1, &table[a]);
    }
    if (status == GBG_OK) {
        *width = choose_width(density, plan, table);
    }
    for (int a = 0; a < plan->dimension; a++) {
        gbg_release(table[a].alias);
    }
    return status;
}

int gbg_density_mesh_make(struct gbg_density *density, const struct gbg_density_plan *plan)
{
    void *body, *values;
    struct gbg_context *context = density->context;
    int status = gbg_allocate_zero(context, &body, 1, sizeof *density->mesh, "mesh");
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_density_mesh *mesh = density->mesh = body;
    memcpy(mesh->cells, plan->cells, sizeof mesh->cells);
    mesh->pitch = gbg_transform_pitch(plan->cells[0]);
    mesh->rows = 1;
    for (int a = 1; a < plan->dimension; a++) {
        mesh->rows *= plan->cells[a];
    }
    int width = 0;
    status = plan_window(density, plan, &width);
    if (status == GBG_OK) {
        status = gbg_tiles_make(context, plan->dimension, plan->cells, width, plan->channels,
                                plan->n, &mesh->tiles);
    }
    if (status == GBG_OK) {
        status = gbg_allocate(context, &values, mesh->rows * mesh->pitch, sizeof(double), "mesh");
        mesh->mesh = values;
    }
    if (status == GBG_OK) {
        mesh->scale = pow(mesh->tiles.window.transform_zero, -plan->dimension);
        status = gbg_transform_make(context, plan->dimension, plan->cells, density->modes->reach,
                                    mesh->mesh, &mesh->transform);
    }
    return status;
}

void gbg_density_mesh_free(struct gbg_density_mesh *mesh)
{
    if (mesh) {
        gbg_transform_free(mesh->transform);
        gbg_tiles_free(&mesh->tiles);
        gbg_release(mesh->mesh);
        gbg_release(mesh);
    }
}

int gbg_density_mesh_width(const struct gbg_density_mesh *mesh, int32_t *cells)
{
    memcpy(cells, mesh->cells, sizeof mesh->cells);
    return mesh->tiles.window.width;
}

static void clear(const struct gbg_density_mesh *mesh, int threads)
{
    size_t row = (size_t)mesh->pitch * sizeof(double);
    (void)threads;
#pragma omp parallel for num_threads(threads) schedule(static)
    for (int64_t r = 0; r < mesh->rows; r++) {
        memset(mesh->mesh + r * mesh->pitch, 0, row);
    }
}

static void pick(const struct gbg_density *density, double *rho)
{
    const struct gbg_density_mesh *mesh = density->mesh;
    const struct gbg_modes *modes = density->modes;
#pragma omp parallel for num_threads(density->context->threads) schedule(static)
    for (int64_t m = 0; m < modes->count; m++) {
        int64_t row = 0;
        for (int a = density->dimension - 1; a > 0; a--) {
            int32_t n = modes->n[a][m];
            row = row * mesh->cells[a] + (n < 0 ? n + mesh->cells[a] : n);
        }
        const double *value = mesh->mesh + row * mesh->pitch + 2 * modes->n[0][m];
        double inverse = density->gain[m] * mesh->scale;
        rho[2 * m] = value[0] * inverse;
        rho[2 * m + 1] = value[1] * inverse;
    }
}

/* Rounding relative to the sum of all weights. Nodes: no more particles meet in a tile than the
 * fullest holds, 2^d tiles meet in a node. Places are good to 4 u of a spacing, which is 2 pi u of
 * phase an axis at a quarter of the mesh frequency. Transform: 5 u for each factor of two. */
static void set_rounding(struct gbg_density *density)
{
    const struct gbg_tiles *tiles = &density->mesh->tiles;
    double d = density->dimension, levels = 0, nodes = 1;
    for (int a = 0; a < density->dimension; a++) {
        levels += log2(density->mesh->cells[a]);
        nodes *= density->mesh->cells[a];
    }
    const struct gbg_window *window = &tiles->window;
    double spread = (double)tiles->fullest + (1 << density->dimension) + 9 * d + 8;
    density->rounding =
        GBG_UNIT_ROUNDOFF * (spread + 5 * levels) +
        d * (window->polynomial_error + GBG_UNIT_ROUNDOFF) * window->width / window->transform_zero;
    density->rounding_typical =
        GBG_UNIT_ROUNDOFF * sqrt((1 + (double)density->n / nodes) * (levels + window->width));
}

void gbg_density_mesh_run(struct gbg_density *density, const struct gbg_points *points,
                          const double *lengths, const int32_t *channel, int base)
{
    struct gbg_density_mesh *mesh = density->mesh;
    gbg_tiles_sort(&mesh->tiles, points, lengths, channel, base);
    for (int c = 0; c < density->channels; c++) {
        clear(mesh, density->context->threads);
        gbg_tiles_spread(&mesh->tiles, c, mesh->mesh, mesh->pitch);
        gbg_transform_run(mesh->transform);
        pick(density, density->rho + 2 * c * density->modes->count);
    }
    set_rounding(density);
}
