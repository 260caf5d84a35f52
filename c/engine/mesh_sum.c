/* L2: sums over all images by a mesh: chosen by the tolerance, made, refined. */
#include "engine/mesh_sum.h"

#include <stdio.h>

#include "core/context.h"
#include "core/memory.h"
#include "engine/sample.h"

/* Of the user's tolerance, what the model is asked for. */
static const double finer[GBG_MESH_REFINEMENTS + 1] = {1.0, 1.0 / 3.0, 0.1, 1.0 / 30.0, 0.01};

void gbg_mesh_sum_begin(int dimension, const double *length, double power, int64_t n,
                        double tolerance, struct gbg_mesh_sum *sum)
{
    *sum = (struct gbg_mesh_sum){.tolerance = tolerance, .measured = -1.0};
    sum->wish = (struct gbg_ewald_wish){.dimension = dimension,
                                        .power = power,
                                        .n = n,
                                        .tolerance = tolerance,
                                        .split = -1,
                                        .window = -1,
                                        .gradient = -1,
                                        .single = -1};
    for (int a = 0; a < dimension; a++) {
        sum->wish.length[a] = length[a];
    }
}

/* The finest tolerance of which the model knows a mesh, in steps of a third of a decade. */
static double finest(const struct gbg_ewald_wish *wish)
{
    struct gbg_ewald_wish tried = *wish;
    struct gbg_ewald_choice ignored;
    double predicted, cost;
    tried.tolerance = gbg_ewald_finest(wish);
    while (tried.tolerance < 0.1 &&
           gbg_ewald_choose(&tried, &ignored, &predicted, &cost) != GBG_OK) {
        tried.tolerance *= 2.1544346900318837;
    }
    return tried.tolerance;
}

int gbg_mesh_sum_choose(struct gbg_context *context, struct gbg_mesh_sum *sum)
{
    int status = gbg_ewald_choose(&sum->wish, &sum->choice, &sum->predicted, &sum->cost);
    if (status == GBG_OK) {
        return GBG_OK;
    }
    double least = finest(&sum->wish);
    if (least >= 0.1) {
        return gbg_fail(context, status,
                        "there is no mesh for a sum over all images of power %g in this box",
                        sum->wish.power);
    }
    return gbg_fail(context, status,
                    "tolerance: %.3g given; the finest that a sum over all images reaches here is "
                    "%.2g%s",
                    sum->tolerance, least, sum->wish.single == 1 ? " in single precision" : "");
}

static int make_body(const struct gbg_mesh_place *place, struct gbg_mesh_sum *sum)
{
    void *memory = NULL;
    int status = gbg_allocate(place->context, &memory, 1, sizeof(struct gbg_ewald_plan),
                              "tables of a long-range sum");
    struct gbg_ewald_plan *plan = memory;
    if (status == GBG_OK && gbg_ewald_plan_make(&sum->choice, plan) != GBG_OK) {
        status =
            gbg_fail(place->context, GBG_E_ARGUMENT,
                     "there are no tables for reach %g, band %g and width %d of a sum over "
                     "all images of power %g",
                     sum->choice.reach, sum->choice.band, sum->choice.width, sum->choice.power);
    }
    if (status == GBG_OK) {
        status = place->kernels->ewald_create(place->device, place->state, plan, place->hurry,
                                              &sum->body);
    }
    gbg_release(plan);
    return status;
}

int gbg_mesh_sum_make(const struct gbg_mesh_place *place, struct gbg_mesh_sum *sum)
{
    if (!place->kernels->ewald_create) {
        return gbg_fail(place->context, GBG_E_UNBUILT, "backend %s has no sum over all images",
                        place->backend->name);
    }
    int status = gbg_mesh_sum_choose(place->context, sum);
    return status ? status : make_body(place, sum);
}

void gbg_mesh_sum_free(const struct gbg_mesh_place *place, struct gbg_mesh_sum *sum)
{
    if (sum->body) {
        place->kernels->ewald_destroy(place->device, sum->body);
        sum->body = NULL;
    }
}

int gbg_mesh_sum_refine(const struct gbg_mesh_place *place, int times, struct gbg_mesh_sum *sum)
{
    struct gbg_mesh_sum made = *sum;
    made.body = NULL;
    made.refined = times;
    made.wish.tolerance = sum->tolerance * finer[times];
    int status = gbg_mesh_sum_make(place, &made);
    if (status == GBG_OK) {
        gbg_mesh_sum_free(place, sum);
        *sum = made;
    }
    return status;
}

/* Forces smaller than this share of a neighbour's cancel by symmetry, as on a lattice: an error
 * relative to them would say nothing. */
static const double vanishing = 0.01;

void gbg_mesh_sum_judge(struct gbg_mesh_sum *sum, const struct gbg_sample *sample, double rms,
                        double typical)
{
    struct gbg_deviation error = gbg_sample_compare(sample);
    sum->symmetric = rms < vanishing * typical;
    double size = sum->symmetric ? typical : rms;
    sum->measured = error.difference == 0.0 ? 0.0 : error.difference / size;
}

static int missed(struct gbg_context *context, const struct gbg_mesh_sum *sum, int64_t samples)
{
    return gbg_fail(context, GBG_E_ARGUMENT,
                    "tolerance: %.3g asked for, but the error measured on %lld particles is %.2g "
                    "after %d refinements, and none finer can be had; give a looser tolerance%s, "
                    "or check: false to go on with this error",
                    sum->tolerance, (long long)samples, sum->measured, sum->refined,
                    sum->wish.single == 0 ? "" : " or double precision");
}

int gbg_mesh_sum_settle(const struct gbg_mesh_place *place, int64_t samples,
                        gbg_mesh_measure measure, void *user, struct gbg_mesh_sum *sum)
{
    int status = measure(user, sum);
    while (status == GBG_OK && !(sum->measured <= sum->tolerance)) {
        double before = sum->measured;
        int times = sum->refined + 1;
        status =
            times > GBG_MESH_REFINEMENTS ? GBG_E_ARGUMENT : gbg_mesh_sum_refine(place, times, sum);
        if (status == GBG_E_ARGUMENT) {
            return missed(place->context, sum, samples);
        }
        status = status ? status : measure(user, sum);
        if (status == GBG_OK) {
            gbg_log(place->context, GBG_LOG_INFO,
                    "%s missed its tolerance %.3g: error %.2g, now %.2g with reach %.3g and mesh "
                    "%dx%d",
                    place->name, sum->tolerance, before, sum->measured, sum->choice.reach,
                    (int)sum->choice.cells[0], (int)sum->choice.cells[1]);
        }
    }
    return status;
}

void gbg_mesh_sum_describe(const struct gbg_mesh_sum *sum, size_t capacity, char *text)
{
    const struct gbg_ewald_choice *choice = &sum->choice;
    char third[16] = "";
    if (choice->dimension == 3) {
        snprintf(third, sizeof third, "x%d", (int)choice->cells[2]);
    }
    snprintf(
        text, capacity,
        "r/r^%g, all images%s%s%s: reach %.3g, mesh %dx%d%s, width %d, %s, error %.1e, %.3g ns "
        "a particle",
        choice->power + 1.0, choice->split == GBG_SPLIT_GAUSSIAN ? ", Gaussian" : "",
        choice->window == GBG_EWALD_BSPLINE ? ", B-spline" : "",
        choice->gradient == GBG_GRADIENT_WINDOW ? ", slope" : "", choice->reach,
        (int)choice->cells[0], (int)choice->cells[1], third, choice->width,
        choice->single ? "float" : "double", sum->predicted, sum->cost);
}
