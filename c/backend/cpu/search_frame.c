/* L1: neighbour search: which cells, and when a float can decide about a pair. */
#include "backend/cpu/search_frame.h"

#include <math.h>

#include "core/context.h"

/* Edges are longer than asked for by this part, and by two units of a high word, so that no
 * rounding of a length can put a neighbour beyond the cells that are looked at. */
static const double EDGE_MARGIN = 1e-9;

enum { ZOOM_MOST = 32 };

/* Cells of edge >= the edge asked for, but not many more keys than particles in all. */
static void choose_wide(struct gbg_search_frame *frame)
{
    int dimension = frame->box.dimension;
    double wanted[3] = {1.0, 1.0, 1.0}, most = fmin(4.0 * (double)frame->n + 1024.0, 0x1p30);
    double product = frame->plan.method == GBG_SEARCH_OCTANT ? 1 << dimension : 1;
    for (int a = 0; a < dimension; a++) {
        double length = ldexp(frame->box.length[a], -frame->zoom[a]);
        double edge = frame->plan.edge * (1.0 + EDGE_MARGIN) + length * 0x1p-31;
        wanted[a] = fmax(1.0, floor(length / edge));
        product *= wanted[a];
    }
    frame->crowded = product > most;
    while (product > most) {
        int longest = 0;
        for (int a = 1; a < dimension; a++) {
            longest = wanted[a] > wanted[longest] ? a : longest;
        }
        product /= wanted[longest];
        wanted[longest] = ceil(wanted[longest] / 2.0);
        product *= wanted[longest];
    }
    for (int a = 0; a < 3; a++) {
        frame->cells[a] = (int)wanted[a];
    }
}

/* Cells of edge <= the edge asked for, so that each holds one particle at most. */
static int choose_narrow(struct gbg_context *context, struct gbg_search_frame *frame)
{
    double product = 1.0, most = 64.0 * (double)frame->n + 0x1p20;
    double wanted[3] = {1.0, 1.0, 1.0};
    for (int a = 0; a < frame->box.dimension; a++) {
        wanted[a] = ceil(frame->box.length[a] / frame->plan.edge * (1.0 + EDGE_MARGIN));
        product *= wanted[a];
    }
    if (!(product <= most) || product > 0x1p30) {
        return gbg_fail(context, GBG_E_ARGUMENT,
                        "gbg_neighbours_update: the method occupancy would need %.3g cells for "
                        "%lld particles, allowed up to %.3g: take grid",
                        product, (long long)frame->n, fmin(most, 0x1p30));
    }
    for (int a = 0; a < 3; a++) {
        frame->cells[a] = (int)wanted[a];
    }
    return GBG_OK;
}

static void choose_reach(struct gbg_search_frame *frame, double reach)
{
    double farthest = frame->plan.radius + 3.0 * frame->plan.skin;
    for (int a = 0; a < frame->box.dimension; a++) {
        double length = frame->box.length[a], part = ldexp(length, -frame->zoom[a]);
        double edge = part / frame->cells[a];
        frame->around[a] =
            frame->plan.method == GBG_SEARCH_OCTANT
                ? 1
                : (int)fmin(frame->cells[a], ceil(reach * (1.0 + 0.5 * EDGE_MARGIN) / edge));
        double period = length, apart = fmax(farthest, (frame->around[a] + 1) * edge) * 1.001;
        apart = frame->zoom[a] > 0 ? fmax(apart, part)
                                   : apart; /* the ends of the part are neighbours */
        int shift = 0;
        while (shift < 31 && period * 0.25 >= apart) {
            period *= 0.5;
            shift++;
        }
        frame->shift[a] = shift;
    }
}

void gbg_search_frame_start(struct gbg_search_frame *frame)
{
    for (int a = 0; a < 3; a++) {
        frame->origin[a] = 0;
        frame->zoom[a] = 0;
    }
    frame->crowded = 0;
}

int gbg_search_frame_choose(struct gbg_context *context, struct gbg_search_frame *frame,
                            double reach)
{
    int status = GBG_OK, method = frame->plan.method;
    frame->sub = method == GBG_SEARCH_OCTANT ? frame->box.dimension : 0;
    if (method == GBG_SEARCH_BRUTE) {
        frame->cells[0] = frame->cells[1] = frame->cells[2] = 1;
    } else if (method == GBG_SEARCH_OCCUPANCY) {
        status = choose_narrow(context, frame);
    } else {
        choose_wide(frame);
    }
    if (status != GBG_OK) {
        return status;
    }
    choose_reach(frame, reach);
    frame->n_keys = (int64_t)frame->cells[0] * frame->cells[1] * frame->cells[2] << frame->sub;
    return GBG_OK;
}

int gbg_search_frame_zoom(struct gbg_search_frame *frame, int a, uint64_t first, int64_t low,
                          int64_t high)
{
    uint64_t spread = (uint64_t)high - (uint64_t)low;
    int zoom = 0;
    while (zoom < ZOOM_MOST && spread < UINT64_C(1) << (63 - zoom)) {
        zoom++;
    }
    frame->origin[a] = zoom > 0 ? first + (uint64_t)low : 0;
    frame->zoom[a] = zoom;
    return zoom > 0;
}

/* The room between `sure` and `likely` covers the rounding of floats and of the coordinates, which
 * are cut to whole units. */
void gbg_search_frame_radius(struct gbg_search_frame *frame, double radius)
{
    double coarsest = 0.0;
    for (int a = 0; a < frame->box.dimension; a++) {
        double unit = ldexp(frame->box.length[a], -32 - frame->shift[a]) / radius;
        unit = fmin(unit, 1e15);
        frame->scale[a] = (float)unit;
        coarsest = fmax(coarsest, unit);
    }
    double slack = 1e-6 + 4.0 * coarsest * (1.0 + coarsest);
    frame->likely = (float)(1.0 + slack);
    frame->sure = (float)(1.0 - slack);
    frame->squared = radius * radius;
}

double gbg_search_frame_slack(const struct gbg_search_frame *frame)
{
    return 0.25 * frame->plan.skin * frame->plan.skin * (1.0 - 1e-9);
}

double gbg_search_frame_reach(const struct gbg_search_frame *frame)
{
    return (frame->plan.radius + frame->plan.skin) * (1.0 + 1e-12);
}

void gbg_search_frame_report(const struct gbg_search_frame *frame, struct gbg_search_report *report)
{
    for (int a = 0; a < 3; a++) {
        report->cells[a] = frame->cells[a];
    }
    report->edge = INFINITY;
    for (int a = 0; a < frame->box.dimension; a++) {
        double part = ldexp(frame->box.length[a], -frame->zoom[a]);
        report->edge = fmin(report->edge, part / frame->cells[a]);
    }
}
