/* Analysis room: from density modes to shells, and from frames to averages. */
#include <math.h>

#include "analysis/analysis.h"

/* Neumaier's compensated sum. */
static inline void add_to(double *sum, double *carry, double value)
{
    double next = *sum + value;
    *carry += fabs(*sum) >= fabs(value) ? (*sum - next) + value : (value - next) + *sum;
    *sum = next;
}

/* What the modes of a frame need besides rho. */
struct frame_view {
    const struct gbg_analysis *analysis;
    double root_n;                   /* sqrt(N) */
    double weight[GBG_MOST_SPECIES]; /* 1/sqrt(N_a); NaN for an empty species */
    double storage_step;             /* rms displacement on one axis, 1/k = no effect */
};

struct mode_values {
    double real, imaginary; /* of all particles */
    double S, e;            /* |rho|^2/N, and the bound of |d rho|/N */
    int64_t m;
};

static struct mode_values mode_of(const struct frame_view *view, int64_t m)
{
    const struct gbg_density *density = view->analysis->density;
    struct mode_values mode = {.m = m};
    int64_t count = view->analysis->modes.count;
    for (int c = 0; c < density->channels; c++) {
        mode.real += density->rho[2 * (c * count + m)];
        mode.imaginary += density->rho[2 * (c * count + m) + 1];
    }
    mode.S = (mode.real * mode.real + mode.imaginary * mode.imaginary) / (double)view->analysis->n;
    mode.e = density->alias[m] + density->gain[m] * density->rounding;
    return mode;
}

/* Typical error of S squared: 2 S e^2 for a random phase, and e^4. */
static double typical_square(const struct frame_view *view, const struct mode_values *mode)
{
    const struct gbg_density *density = view->analysis->density;
    double alias = density->alias_root[mode->m];
    double rounding = density->gain[mode->m] * density->rounding_typical;
    double e2 = alias * alias + rounding * rounding;
    return 2 * mode->S * e2 + e2 * e2;
}

/* All columns of a shell for this frame. |S~ - S| <= 2 sqrt(S~) e + e^2 with e = sqrt(N) times the
 * relative bound, and the same for partials with the e of their species. */
struct shell_sums {
    double sum[GBG_COLUMN_PAIRS], carry[GBG_COLUMN_PAIRS], bias;
};

static void add_mode(const struct frame_view *view, int64_t m, struct shell_sums *shell)
{
    struct mode_values mode = mode_of(view, m);
    double e = view->root_n * mode.e, k = view->analysis->shells.k[m];
    double blur = k * view->storage_step, blur2 = blur * blur;
    double value[GBG_COLUMN_PAIRS] = {
        [GBG_COLUMN_K] = k,
        [GBG_COLUMN_S] = mode.S,
        [GBG_COLUMN_BOUND] = 2 * sqrt(mode.S) * e + e * e + 16 * GBG_UNIT_ROUNDOFF * mode.S,
        [GBG_COLUMN_TYPICAL] = typical_square(view, &mode),
        [GBG_COLUMN_STORAGE] = 2 * mode.S * blur2 + blur2 * blur2,
    };
    for (int c = 0; c < GBG_COLUMN_PAIRS; c++) {
        add_to(&shell->sum[c], &shell->carry[c], value[c]);
    }
    shell->bias += fabs(1 - mode.S) * blur2;
}

static void set_total(const struct frame_view *view, int64_t s)
{
    const struct gbg_analysis *analysis = view->analysis;
    const struct gbg_shells *shells = &analysis->shells;
    struct shell_sums shell = {.bias = 0};
    int64_t begin = shells->start[s], modes = shells->start[s + 1] - begin;
    for (int64_t i = 0; i < modes; i++) {
        add_mode(view, shells->mode[begin + i], &shell);
    }
    double value[GBG_COLUMN_PAIRS];
    for (int c = 0; c < GBG_COLUMN_PAIRS; c++) {
        value[c] = (shell.sum[c] + shell.carry[c]) / (double)modes;
    }
    value[GBG_COLUMN_MODES] = (double)modes;
    value[GBG_COLUMN_TYPICAL] = sqrt(value[GBG_COLUMN_TYPICAL] / (double)modes) +
                                2 * GBG_UNIT_ROUNDOFF * value[GBG_COLUMN_S];
    value[GBG_COLUMN_STORAGE] =
        sqrt(value[GBG_COLUMN_STORAGE] / (double)modes) + shell.bias / (double)modes;
    for (int c = 0; c < GBG_COLUMN_PAIRS; c++) {
        analysis->frame[c * shells->count + s] = value[c];
    }
}

static double size_of(const double *rho)
{
    return sqrt(rho[0] * rho[0] + rho[1] * rho[1]);
}

/* Re rho_a rho_b^* /sqrt(N_a N_b) of one mode, and its bound. */
static void pair_of_mode(const struct frame_view *view, int a, int b, int64_t m, double value[2])
{
    const struct gbg_analysis *analysis = view->analysis;
    const struct gbg_density *density = analysis->density;
    const double *first = density->rho + 2 * (a * analysis->modes.count + m);
    const double *second = density->rho + 2 * (b * analysis->modes.count + m);
    double wa = view->weight[a], wb = view->weight[b];
    value[0] = (first[0] * second[0] + first[1] * second[1]) * wa * wb;
    double e = density->alias[m] + density->gain[m] * density->rounding;
    double ea = e / wa, eb = e / wb; /* e sqrt(N_a) */
    double size_a = size_of(first) * wa, size_b = size_of(second) * wb;
    value[1] = ea * size_b + eb * size_a + ea * eb + 16 * GBG_UNIT_ROUNDOFF * size_a * size_b;
}

static void set_pair(const struct frame_view *view, int a, int b, int64_t s)
{
    const struct gbg_analysis *analysis = view->analysis;
    const struct gbg_shells *shells = &analysis->shells;
    double sum[2] = {0, 0}, carry[2] = {0, 0};
    for (int64_t i = shells->start[s]; i < shells->start[s + 1]; i++) {
        double value[2];
        pair_of_mode(view, a, b, shells->mode[i], value);
        add_to(&sum[0], &carry[0], value[0]);
        add_to(&sum[1], &carry[1], value[1]);
    }
    double modes = (double)(shells->start[s + 1] - shells->start[s]);
    int column = GBG_COLUMN_PAIRS + 2 * gbg_analysis_pair(analysis->n_species, a, b);
    analysis->frame[column * shells->count + s] = (sum[0] + carry[0]) / modes;
    analysis->frame[(column + 1) * shells->count + s] = (sum[1] + carry[1]) / modes;
}

static struct frame_view look(const struct gbg_analysis *analysis,
                              const struct gbg_analysis_frame *frame)
{
    struct frame_view view = {.analysis = analysis, .root_n = sqrt((double)analysis->n)};
    for (int a = 0; a < analysis->n_species; a++) {
        view.weight[a] = analysis->n_of[a] ? 1 / sqrt((double)analysis->n_of[a]) : NAN;
    }
    /* Uniform in +-storage_error. */
    view.storage_step = frame->storage_error / sqrt(3.0);
    return view;
}

static void set_shells(const struct gbg_analysis *analysis, const struct gbg_analysis_frame *frame)
{
    struct frame_view view = look(analysis, frame);
    int64_t shells = analysis->shells.count;
#pragma omp parallel for num_threads(analysis->context->threads) schedule(dynamic, 16)
    for (int64_t s = 0; s < shells; s++) {
        set_total(&view, s);
        for (int a = 0; a < analysis->n_species && analysis->pairs; a++) {
            for (int b = a; b < analysis->n_species; b++) {
                set_pair(&view, a, b, s);
            }
        }
    }
}

static void add_shell(struct gbg_analysis *analysis, int64_t s)
{
    int64_t shells = analysis->shells.count;
    analysis->frames_of[s]++;
    for (int c = 0; c < analysis->columns; c++) {
        int64_t at = c * shells + s;
        add_to(&analysis->sum[at], &analysis->carry[at], analysis->frame[at]);
    }
    gbg_blocking_add(&analysis->blocking, s, analysis->frame[GBG_COLUMN_S * shells + s]);
    for (int p = 0; p < analysis->pairs; p++) {
        double value = analysis->frame[(GBG_COLUMN_PAIRS + 2 * p) * shells + s];
        gbg_blocking_add(&analysis->blocking, (1 + p) * shells + s, value);
    }
}

int gbg_analysis_accumulate(struct gbg_analysis *analysis, const struct gbg_analysis_frame *frame)
{
    int status = gbg_blocking_reserve(analysis->context, &analysis->blocking, analysis->frames + 1);
    if (status != GBG_OK) {
        return status;
    }
    gbg_shells_assign(&analysis->shells, &analysis->modes, frame->lengths);
    gbg_density_run(analysis->density, &frame->points, frame->lengths,
                    analysis->settings.partials ? frame->species : NULL, frame->base);
    set_shells(analysis, frame);
    double bound = gbg_density_bound(analysis->density);
    if (analysis->frames == 0 && bound > analysis->settings.tolerance) {
        gbg_log(analysis->context, GBG_LOG_WARNING,
                "structure factor: with rounding the bound of the density modes is %.1e, above the "
                "tolerance %.1e",
                bound, analysis->settings.tolerance);
    }
    analysis->largest_bound = fmax(analysis->largest_bound, bound);
    for (int64_t s = 0; s < analysis->shells.count; s++) {
        if (analysis->shells.start[s + 1] > analysis->shells.start[s]) {
            add_shell(analysis, s);
        }
    }
    analysis->frames++;
    return GBG_OK;
}

double gbg_analysis_mean(const struct gbg_analysis *analysis, int column, int64_t shell)
{
    int64_t at = column * analysis->shells.count + shell, frames = analysis->frames_of[shell];
    return frames ? (analysis->sum[at] + analysis->carry[at]) / (double)frames : NAN;
}

double gbg_analysis_error(const struct gbg_analysis *analysis, int series, int64_t shell,
                          double *independent)
{
    int64_t frames = analysis->frames_of[shell], shells = analysis->shells.count;
    if (frames >= GBG_FEW_FRAMES) {
        return gbg_blocking_error(&analysis->blocking, series * shells + shell, independent);
    }
    /* Modes of a fluid are complex Gaussian: Var |rho|^2/N = S^2; for partials
     * (S_ab^2 + S_aa S_bb)/2. Frames are taken as independent. */
    *independent = (double)frames;
    double modes = gbg_analysis_mean(analysis, GBG_COLUMN_MODES, shell) * (double)frames;
    if (series == 0) {
        return gbg_analysis_mean(analysis, GBG_COLUMN_S, shell) / sqrt(modes);
    }
    int a = 0, b = series - 1, species = analysis->n_species;
    while (b >= species - a) {
        b -= species - a++;
    }
    b += a;
    double value[3];
    int pairs[3][2] = {{a, a}, {b, b}, {a, b}};
    for (int i = 0; i < 3; i++) {
        int pair = gbg_analysis_pair(species, pairs[i][0], pairs[i][1]);
        value[i] = gbg_analysis_mean(analysis, GBG_COLUMN_PAIRS + 2 * pair, shell);
    }
    return sqrt((value[2] * value[2] + value[0] * value[1]) / 2 / modes);
}
