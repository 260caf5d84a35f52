/* Benchmark: the searches of Green (2010) and of Perea and Cordero (2017) on a GPU. */
#include "bench/cases/neighbours_device.h"

#include <math.h>

#include "backend/backend.h"
#include "bench/bench.h"
#include "core/context.h"

enum { DESIGNS = 2, TIMES = 7 };

static const struct {
    const char *what[2];
    int octant;
    double edge; /* radii */
} designs[DESIGNS] = {
    {{"2D device, Green 9 cells", "3D device, Green 27 cells"}, 0, 1.0},
    {{"2D device, octant 4 cells", "3D device, octant 8 cells"}, 1, 2.0},
};

struct site {
    const struct gbg_kernels *kernels;
    struct gbg_device *device;
    struct gbg_search *search;
};

/* The first of the searches is not counted. Pairs at the very edge may be lost in single precision.
 */
static int time_design(struct gbg_bench *bench, const struct site *site, int design, double radius,
                       const struct gbg_search_report *report, struct gbg_bench_result *line)
{
    double seconds[TIMES], total = 0.0;
    int64_t rows = 0;
    for (int k = 0; k < TIMES + 1; k++) {
        double once = 0.0;
        int status =
            site->kernels->search_published(site->device, site->search, designs[design].octant,
                                            designs[design].edge * radius, &once, &rows);
        if (status != GBG_OK) {
            return gbg_bench_leave_out(bench, line->what, line->n, status);
        }
        if (k > 0) {
            seconds[k - 1] = once;
            total += once;
        }
    }
    line->seconds.wall = line->seconds.core = gbg_bench_median(seconds, TIMES);
    line->seconds.mean = total / TIMES;
    line->seconds.times = TIMES;
    line->error_rms = fabs((double)(rows - report->rows)) / fmax((double)report->rows, 1.0);
    line->allowed = 1e-3;
    gbg_bench_extra(line, "neighbours", (double)rows / (double)line->n);
    gbg_bench_extra(line, "device ms", 1e3 * line->seconds.wall);
    return gbg_bench_report(bench, line);
}

static int time_all(struct gbg_bench *bench, const struct site *site, int dimension, double radius,
                    const struct gbg_points *points)
{
    const struct gbg_search_plan plan = {GBG_SEARCH_GRID, radius, 0.0, radius};
    struct gbg_search_report report;
    int status = site->kernels->search_update(site->device, site->search, &plan, points, &report);
    for (int k = 0; k < DESIGNS && status == GBG_OK; k++) {
        struct gbg_bench_result line = {.what = designs[k].what[dimension - 2],
                                        .precision = "single",
                                        .unit = "particles",
                                        .n = points->n,
                                        .work = (double)points->n,
                                        .error_median = NAN};
        if (gbg_bench_wanted(bench, line.what)) {
            status = time_design(bench, site, k, radius, &report, &line);
        }
    }
    return status;
}

int gbg_bench_device_wanted(struct gbg_bench *bench, int dimension)
{
    int wanted = 0;
    for (int k = 0; k < DESIGNS; k++) {
        wanted |= gbg_bench_wanted(bench, designs[k].what[dimension - 2]);
    }
    return wanted;
}

int gbg_bench_published_on_device(struct gbg_bench *bench, int dimension, const double *length,
                                  double radius, int64_t n, double *const *position)
{
    const struct gbg_backend *backend = gbg_backend_find(bench->context->backend);
    struct gbg_box box = gbg_box_make(dimension, length, NULL);
    struct gbg_points points = {n, {position[0], position[1], position[2]}, 1};
    struct site site = {0};
    int status = backend->create(bench->context, &site.device);
    if (status != GBG_OK) {
        return status;
    }
    site.kernels = backend->kernels(site.device);
    if (site.kernels->search_published) {
        status = site.kernels->search_create(site.device, &box, &site.search);
        status = status ? status : time_all(bench, &site, dimension, radius, &points);
        site.kernels->search_destroy(site.device, site.search);
    }
    backend->destroy(site.device);
    return status;
}
