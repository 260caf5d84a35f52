/* Numbers of long-range sums: influence of waves. */
#include "ewald/plan.h"

#include <math.h>

#include "ewald/loss.h"
#include "ewald/series.h"
#include "gamboge/status.h"

static int is_smooth(int64_t cells)
{
    static const int factor[] = {2, 3, 5, 7};
    for (int f = 0; f < 4; f++) {
        while (cells % factor[f] == 0) {
            cells /= factor[f];
        }
    }
    return cells == 1;
}

int32_t gbg_ewald_cells(double least)
{
    const int32_t most = 1 << 30;
    if (!(least <= most)) {
        return 0;
    }
    int64_t cells = least > 2 ? 2 * (int64_t)ceil(least / 2) : 2;
    while (!is_smooth(cells)) {
        cells += 2;
    }
    return (int32_t)cells;
}

/* Cells over those that waves up to the band need, along one axis. */
static double finer(const struct gbg_ewald_choice *choice, int a)
{
    return choice->cells[a] * (double)GBG_PI_LONG * choice->reach /
           (choice->band * choice->length[a]);
}

static int axis_is_right(const struct gbg_ewald_choice *choice, int a)
{
    /* cells are often chosen as the least that will do: not refused for a rounding */
    return choice->length[a] > 0 && choice->length[a] < INFINITY &&
           choice->reach <= choice->length[a] / 2 && choice->cells[a] >= choice->width &&
           choice->cells[a] > 0 && choice->cells[a] % 2 == 0 && is_smooth(choice->cells[a]) &&
           finer(choice, a) >= 1 - 1e-12;
}

static int is_right(const struct gbg_ewald_choice *choice)
{
    if ((choice->dimension != 2 && choice->dimension != 3) || !(choice->reach > 0) ||
        (choice->gradient != GBG_GRADIENT_WAVES && choice->gradient != GBG_GRADIENT_WINDOW) ||
        (choice->single != 0 && choice->single != 1)) {
        return 0;
    }
    for (int a = 0; a < choice->dimension; a++) {
        if (!axis_is_right(choice, a)) {
            return 0;
        }
    }
    return 1;
}

/* Prolate windows have the shape that suits the waves of this split. */
static int make_window(const struct gbg_ewald_choice *choice, int a, struct gbg_ewald_plan *plan)
{
    struct gbg_ewald_window *window = &plan->window[a];
    int width = choice->width;
    double spacing = choice->length[a] / choice->cells[a];
    if (choice->window != GBG_EWALD_PROLATE) {
        return gbg_ewald_window_make(choice->window, width, 1, window);
    }
    if (width < GBG_EWALD_NARROWEST || width > GBG_EWALD_WIDEST) {
        return GBG_E_ARGUMENT;
    }
    for (int b = 0; b < a; b++) {
        if (fabs(spacing * choice->cells[b] / choice->length[b] - 1) < 1e-3) {
            *window = plan->window[b];
            return GBG_OK;
        }
    }
    double shape = gbg_ewald_best_shape(&plan->split, width, choice->length[a], choice->cells[a],
                                        choice->gradient);
    return gbg_ewald_window_shaped(width, shape, window);
}

int gbg_ewald_plan_make(const struct gbg_ewald_choice *choice, struct gbg_ewald_plan *plan)
{
    *plan = (struct gbg_ewald_plan){.choice = *choice};
    if (!is_right(choice)) {
        return GBG_E_ARGUMENT;
    }
    int status = gbg_split_make(choice->dimension, choice->power, choice->split, choice->reach,
                                choice->band, &plan->split);
    for (int a = 0; status == GBG_OK && a < choice->dimension; a++) {
        status = make_window(choice, a, plan);
    }
    if (status == GBG_OK && choice->single) {
        gbg_split_shorten(&plan->split, GBG_SINGLE_ERROR);
    }
    return status;
}

static double wave(const struct gbg_ewald_plan *plan, int a, int32_t n)
{
    return 2 * (double)GBG_PI_LONG * n / plan->choice.length[a];
}

void gbg_ewald_fill_axis(const struct gbg_ewald_plan *plan, int a, struct gbg_ewald_axis *axis)
{
    int32_t cells = plan->choice.cells[a];
    double first = wave(plan, a, cells);
    for (int32_t n = 0; n <= cells / 2; n++) {
        double f = (double)n / cells, value = gbg_ewald_window_transform(&plan->window[a], f);
        gbg_ewald_window_alias(&plan->window[a], f, &axis->power[n], &axis->slope[n]);
        axis->square[n] = value * value;
        axis->slope[n] *= first * first;
    }
}

/* What the slope of a window is short of, of the window's own wave: the steps at its ends. */
static double slope_share(const struct gbg_ewald_plan *plan, int a, int32_t n, double square)
{
    const struct gbg_ewald_window *window = &plan->window[a];
    if (n == 0 || window->kind != GBG_EWALD_PROLATE) {
        return 1;
    }
    double f = (double)n / plan->choice.cells[a], phase = (double)GBG_PI_LONG * f;
    return 1 - window->step * sin(phase * window->width) / (phase * sqrt(square));
}

/* Sum over axes of slope_a times power of the others. */
static double slopes(int dimension, const double power[3], const double slope[3])
{
    double first = slope[0] * power[1] + slope[1] * power[0];
    return dimension == 2 ? first : first * power[2] + slope[2] * power[0] * power[1];
}

void gbg_ewald_fill_row(const struct gbg_ewald_plan *plan, const struct gbg_ewald_axis axis[3],
                        int32_t n1, int32_t n2, double *row)
{
    const struct gbg_ewald_choice *choice = &plan->choice;
    int d = choice->dimension, by_waves = choice->gradient == GBG_GRADIENT_WAVES;
    int32_t last = choice->cells[0] / 2, n[3] = {0, n1, d == 3 ? n2 : 0};
    double power[3] = {1, 1, 1}, slope[3] = {0}, square = 1, volume = choice->length[0], wave2 = 0,
           read2 = 0;
    for (int a = 1; a < d; a++) {
        power[a] = axis[a].power[n[a]];
        slope[a] = axis[a].slope[n[a]];
        square *= n[a] < choice->cells[a] / 2 ? axis[a].square[n[a]] : 0;
        volume *= choice->length[a];
        wave2 += wave(plan, a, n[a]) * wave(plan, a, n[a]);
        read2 += wave(plan, a, n[a]) * wave(plan, a, n[a]) *
                 (by_waves ? 1 : slope_share(plan, a, n[a], axis[a].square[n[a]]));
    }
    double others = power[1] * power[2];
    double end = square > 0 ? choice->band / choice->reach : 0;
    for (int32_t m = 0; m <= last; m++) {
        double k0 = wave(plan, 0, m), k2 = wave2 + k0 * k0;
        if (!(k2 > 0 && k2 < end * end) || m == last) {
            row[m] = 0;
            continue;
        }
        power[0] = axis[0].power[m];
        slope[0] = axis[0].slope[m];
        double all = power[0] * others;
        double factor = 1 / (all * all);
        if (!by_waves) {
            double read = read2 + k0 * k0 * slope_share(plan, 0, m, axis[0].square[m]);
            factor = read / (all * slopes(d, power, slope));
        }
        row[m] =
            gbg_split_far(&plan->split, sqrt(k2)) / volume * square * axis[0].square[m] * factor;
    }
}

double gbg_ewald_plan_loss(const struct gbg_ewald_plan *plan)
{
    const struct gbg_ewald_choice *choice = &plan->choice;
    return hypot(gbg_split_loss(&plan->split),
                 gbg_ewald_mesh_loss(&plan->split, plan->window, choice->length, choice->cells,
                                     choice->gradient));
}
