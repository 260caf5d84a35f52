/* Tests of plans of long-range sums: what is refused, cells, the influence of waves against its
 * definition, and forces by a mesh with plain loops against the same waves one by one: the error is
 * that which the plan says it will make. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include <complex.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "ewald/loss.h"
#include "ewald/plan.h"
#include "gamboge/status.h"

#define PI 3.14159265358979323846

static struct gbg_ewald_choice usual(int dimension)
{
    return (struct gbg_ewald_choice){.dimension = dimension,
                                     .length = {20, 20, 20},
                                     .power = 2,
                                     .reach = 4,
                                     .band = 8,
                                     .cells = {18, 18, 18},
                                     .width = 6};
}

static int make(struct gbg_ewald_choice choice)
{
    static struct gbg_ewald_plan plan;
    return gbg_ewald_plan_make(&choice, &plan);
}

#define REFUSED(member, value)                                                                     \
    do {                                                                                           \
        struct gbg_ewald_choice choice = usual(3);                                                 \
        choice.member = value;                                                                     \
        assert_int_equal(make(choice), GBG_E_ARGUMENT);                                            \
    } while (0)

static void bad_choices_are_refused(void **state)
{
    (void)state;
    assert_int_equal(make(usual(2)), GBG_OK);
    assert_int_equal(make(usual(3)), GBG_OK);
    REFUSED(dimension, 1);
    REFUSED(length[1], 7.9); /* shorter than two reaches */
    REFUSED(length[2], NAN);
    REFUSED(length[0], INFINITY);
    REFUSED(power, 0);
    REFUSED(split, 2);
    REFUSED(window, 2);
    REFUSED(gradient, 2);
    REFUSED(single, 2);
    REFUSED(reach, 10.1);
    REFUSED(reach, 0);
    REFUSED(reach, NAN);
    REFUSED(band, 1);
    REFUSED(band, 81);
    REFUSED(band, 12); /* waves that the cells do not resolve */
    REFUSED(cells[0], 17);
    REFUSED(cells[1], 22); /* 11 is no factor */
    REFUSED(cells[2], 4);
    REFUSED(cells[2], 0);
    REFUSED(cells[0], -18);
    REFUSED(width, 2);
    REFUSED(width, 17);
    struct gbg_ewald_choice narrow = usual(2); /* the third axis does not count in a plane */
    narrow.length[2] = narrow.cells[2] = 0;
    assert_int_equal(make(narrow), GBG_OK);
    narrow.width = 16;
    assert_int_equal(make(narrow), GBG_OK);
    narrow.cells[1] = 14;
    assert_int_equal(make(narrow), GBG_E_ARGUMENT); /* fewer cells than the window is wide */
}

static int smooth(int32_t cells)
{
    for (int factor = 2; factor <= 7; factor++) {
        while (cells % factor == 0) {
            cells /= factor;
        }
    }
    return cells == 1;
}

static void cells_are_the_next_good_number(void **state)
{
    (void)state;
    for (double least = 0.5; least < 3000; least += 0.75) {
        int32_t next = (int32_t)ceil(least);
        while (next % 2 != 0 || !smooth(next)) {
            next++;
        }
        assert_int_equal(gbg_ewald_cells(least), next);
    }
    assert_int_equal(gbg_ewald_cells(1e10), 0);
    assert_int_equal(gbg_ewald_cells(NAN), 0);
    assert_int_equal(gbg_ewald_cells(-5), 2);
}

/* ---- influence ---- */

enum { MOST = 64 };

static double numbers[3][3][MOST];
static const struct gbg_ewald_axis axes[3] = {{numbers[0][0], numbers[0][1], numbers[0][2]},
                                              {numbers[1][0], numbers[1][1], numbers[1][2]},
                                              {numbers[2][0], numbers[2][1], numbers[2][2]}};

static void fill_axes(const struct gbg_ewald_plan *plan)
{
    for (int a = 0; a < plan->choice.dimension; a++) {
        struct gbg_ewald_axis axis = axes[a];
        gbg_ewald_fill_axis(plan, a, &axis);
    }
}

enum { SIDE = 4, ALIASES = 2 * SIDE + 1 };

/* Of each wave n of each axis and each of its aliases: window, slope, wave. */
static double table[3][MOST][ALIASES][3];

static void fill_table(const struct gbg_ewald_plan *plan)
{
    for (int a = 0; a < plan->choice.dimension; a++) {
        int32_t cells = plan->choice.cells[a];
        double turn = 2 * PI * cells / plan->choice.length[a];
        for (int32_t n = 0; n <= cells / 2; n++) {
            for (int m = 0; m < ALIASES; m++) {
                double f = (double)n / cells + m - SIDE;
                table[a][n][m][0] = gbg_ewald_window_transform(&plan->window[a], f);
                table[a][n][m][1] = gbg_ewald_window_slope(&plan->window[a], f) * turn;
                table[a][n][m][2] = f * turn;
            }
        }
    }
}

/* Hockney and Eastwood's optimum, term by term: waves n + m cells of all axes that alias to n; R
 * is i k far(k), D the gradient that is read, U the window. */
static double best_influence(const struct gbg_ewald_plan *plan, const int32_t *n)
{
    const struct gbg_ewald_choice *choice = &plan->choice;
    int d = choice->dimension, window_reads = choice->gradient == GBG_GRADIENT_WINDOW;
    double top = 0, square = 0, gradient = 0, volume = 1;
    for (int a = 0; a < d; a++) {
        volume *= choice->length[a];
    }
    for (int m = 0; m < (d == 2 ? 1 : ALIASES) * ALIASES * ALIASES; m++) {
        int shift[3] = {m % ALIASES, m / ALIASES % ALIASES, m / ALIASES / ALIASES};
        double all = 1, size = 0, along = 0, read = 0;
        for (int a = 0; a < d; a++) {
            const double *here = table[a][n[a]][shift[a]];
            all *= here[0];
            size += here[2] * here[2];
        }
        for (int a = 0; a < d; a++) {
            const double *here = table[a][n[a]][shift[a]];
            double one = window_reads ? here[1] : table[a][n[a]][SIDE][2] * here[0];
            for (int b = 0; b < d; b++) {
                one *= b == a ? 1 : table[b][n[b]][shift[b]][0];
            }
            along += here[2] * one;
            read += one * one;
        }
        top += along * all * gbg_split_far(&plan->split, sqrt(size)) / volume;
        square += all * all;
        gradient += read;
    }
    return top / (square * gradient);
}

static void check_influence(const struct gbg_ewald_choice *choice)
{
    static struct gbg_ewald_plan plan;
    double row[MOST], worst = 0, largest = 0;
    assert_int_equal(gbg_ewald_plan_make(choice, &plan), GBG_OK);
    fill_axes(&plan);
    fill_table(&plan);
    int32_t half[3] = {choice->cells[0] / 2, choice->cells[1] / 2,
                       choice->dimension == 3 ? choice->cells[2] / 2 : 0};
    for (int32_t n2 = 0; n2 <= half[2]; n2 += 2) {
        for (int32_t n1 = 0; n1 <= half[1]; n1++) {
            gbg_ewald_fill_row(&plan, axes, n1, n2, row);
            for (int32_t n0 = 0; n0 <= half[0]; n0++) {
                const int32_t n[3] = {n0, n1, n2};
                int edge = n0 == half[0] || n1 == half[1] || (half[2] > 0 && n2 == half[2]);
                if (edge || n0 + n1 + n2 == 0) {
                    assert_true(row[n0] == 0);
                    continue;
                }
                double exact = best_influence(&plan, n);
                worst = fmax(worst, fabs(row[n0] - exact));
                largest = fmax(largest, fabs(exact));
            }
        }
    }
    printf("%dD %s, gradient by %s, width %2d: influence against its definition %.1e\n",
           choice->dimension, choice->window == GBG_EWALD_PROLATE ? "prolate " : "B-spline",
           choice->gradient == GBG_GRADIENT_WAVES ? "waves" : "window", choice->width,
           worst / largest);
    /* a sum of few aliases is right to the square of the slope with which a prolate window ends */
    double step = plan.window[0].step * plan.window[0].shape * plan.window[0].shape / choice->width;
    assert_true(worst / largest <
                1e-9 + step * step + (choice->window == GBG_EWALD_BSPLINE ? 1e-8 : 0));
}

static void influence_is_the_best(void **state)
{
    (void)state;
    for (int dimension = 2; dimension <= 3; dimension++) {
        for (int kind = 0; kind < 4; kind++) {
            for (int width = 4; width <= 16; width += 4) {
                struct gbg_ewald_choice choice = usual(dimension);
                choice.window = kind / 2;
                choice.gradient = kind % 2;
                choice.width = width;
                choice.length[1] = 22;
                choice.cells[1] = 24;
                check_influence(&choice);
            }
        }
    }
}

/* ---- forces by a mesh of plain loops ---- */

enum { PARTICLES = 300 };

struct mesh_sum {
    const struct gbg_ewald_plan *plan;
    double position[PARTICLES][3];
    double complex *mesh[4]; /* potential, field by waves */
    int64_t size;
};

static double draw(uint64_t *seed)
{
    *seed = *seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)((*seed >> 12) + 1) / 4503599627370498.0;
}

/* First node of a particle's window along an axis, its weights, or for slope their slopes by place
 * in the box. */
static int32_t weights(const struct mesh_sum *sum, int i, int a, int slope, double *weight)
{
    const struct gbg_ewald_window *window = &sum->plan->window[a];
    double spacing = sum->plan->choice.length[a] / sum->plan->choice.cells[a];
    double place = sum->position[i][a] / spacing;
    double first = window->width % 2 == 0 ? floor(place) : floor(place + 0.5);
    double z = window->width % 2 == 0 ? 2 * (place - first) - 1 : 2 * (place - first);
    for (int l = 0; l < window->width; l++) {
        weight[l] = 0;
        for (int k = window->degree; k >= 0; k--) {
            weight[l] = weight[l] * z + (slope ? window->slope : window->value)[k][l];
        }
        weight[l] *= slope ? -1 / spacing : 1; /* the window runs against the particle */
    }
    return (int32_t)first - (window->width - 1) / 2;
}

/* Adds or reads: what = -1 adds strength 1 to the mesh, 0.. reads with the slope along that axis,
 * 3 without. */
static double touch(const struct mesh_sum *sum, int i, int what, double complex *mesh)
{
    const struct gbg_ewald_choice *choice = &sum->plan->choice;
    double weight[3][GBG_EWALD_WIDEST] = {{0}}, total = 0;
    int32_t first[3] = {0};
    int width = choice->width, third = choice->dimension == 3 ? width : 1;
    weight[2][0] = 1;
    for (int a = 0; a < choice->dimension; a++) {
        first[a] = weights(sum, i, a, what == a, weight[a]);
    }
    for (int m = 0; m < width * width * third; m++) {
        int l[3] = {m % width, m / width % width, m / width / width};
        int64_t node = 0;
        double all = 1;
        for (int a = choice->dimension - 1; a >= 0; a--) {
            int32_t cells = choice->cells[a];
            node = node * cells + ((first[a] + l[a]) % cells + cells) % cells;
            all *= weight[a][l[a]];
        }
        if (what < 0) {
            mesh[node] += all;
        }
        total += all * creal(mesh[node]);
    }
    return total;
}

/* Plain sums along one axis after the other. */
static void transform(const struct gbg_ewald_choice *choice, int sign, double complex *mesh)
{
    int64_t stride = 1, size = 1;
    for (int a = 0; a < choice->dimension; a++) {
        size *= choice->cells[a];
    }
    for (int a = 0; a < choice->dimension; stride *= choice->cells[a], a++) {
        int32_t cells = choice->cells[a];
        for (int64_t line = 0; line < size / cells; line++) {
            double complex *first = mesh + line / stride * stride * cells + line % stride;
            double complex old[MOST], turn[MOST];
            for (int32_t n = 0; n < cells; n++) {
                old[n] = first[n * stride];
                turn[n] = cexp(sign * 2 * PI * I * n / cells);
            }
            for (int32_t n = 0; n < cells; n++) {
                first[n * stride] = 0;
                for (int32_t m = 0; m < cells; m++) {
                    first[n * stride] += old[m] * turn[n * m % cells];
                }
            }
        }
    }
}

/* Multiplies by the influence, and for each axis by -i k too. */
static void multiply(struct mesh_sum *sum)
{
    const struct gbg_ewald_choice *choice = &sum->plan->choice;
    double row[MOST];
    int32_t third = choice->dimension == 3 ? choice->cells[2] : 1;
    for (int32_t m = 0; m < choice->cells[1] * third; m++) {
        int32_t n[3] = {0, m % choice->cells[1], m / choice->cells[1]};
        int32_t up[3];
        for (int a = 1; a < 3; a++) {
            int32_t cells = a == 2 && choice->dimension == 2 ? 1 : choice->cells[a];
            up[a] = n[a] <= cells / 2 ? n[a] : cells - n[a];
        }
        gbg_ewald_fill_row(sum->plan, axes, up[1], up[2], row);
        for (n[0] = 0; n[0] < choice->cells[0]; n[0]++) {
            int64_t node = n[0] + (int64_t)choice->cells[0] * m;
            up[0] = n[0] <= choice->cells[0] / 2 ? n[0] : choice->cells[0] - n[0];
            sum->mesh[3][node] *= row[up[0]];
            for (int a = 0; a < choice->dimension; a++) {
                double k =
                    2 * PI / choice->length[a] * (n[a] == up[a] ? n[a] : n[a] - choice->cells[a]);
                sum->mesh[a][node] = -I * k * sum->mesh[3][node];
            }
        }
    }
}

static void forces_by_mesh(struct mesh_sum *sum, double (*force)[3])
{
    const struct gbg_ewald_choice *choice = &sum->plan->choice;
    for (int i = 0; i < PARTICLES; i++) {
        touch(sum, i, -1, sum->mesh[3]);
    }
    transform(choice, -1, sum->mesh[3]);
    fill_axes(sum->plan);
    multiply(sum);
    transform(choice, 1, sum->mesh[3]);
    for (int a = 0; a < choice->dimension; a++) {
        transform(choice, 1, sum->mesh[a]);
        for (int i = 0; i < PARTICLES; i++) {
            force[i][a] = choice->gradient == GBG_GRADIENT_WAVES ? touch(sum, i, 3, sum->mesh[a])
                                                                 : -touch(sum, i, a, sum->mesh[3]);
        }
    }
}

static void forces_by_waves(const struct mesh_sum *sum, double (*force)[3])
{
    const struct gbg_ewald_choice *choice = &sum->plan->choice;
    int half[3], d = choice->dimension;
    double volume = 1;
    for (int a = 0; a < 3; a++) {
        half[a] = a < d ? choice->cells[a] / 2 : 0;
        volume *= a < d ? choice->length[a] : 1;
    }
    int64_t count = 1;
    for (int a = 0; a < d; a++) {
        count *= 2 * half[a] + 1;
    }
    for (int64_t m = 0; m < count; m++) {
        int64_t rest = m;
        double k[3] = {0}, size = 0, sums[2] = {0}, angle[PARTICLES];
        for (int a = 0; a < d; rest /= 2 * half[a] + 1, a++) {
            k[a] = 2 * PI / choice->length[a] * (double)(rest % (2 * half[a] + 1) - half[a]);
            size += k[a] * k[a];
        }
        double far = gbg_split_far(&sum->plan->split, sqrt(size)) / volume;
        for (int i = 0; i < PARTICLES && far != 0; i++) {
            const double *at = sum->position[i];
            angle[i] = k[0] * at[0] + k[1] * at[1] + k[2] * at[2];
            sums[0] += cos(angle[i]);
            sums[1] += sin(angle[i]);
        }
        for (int i = 0; i < PARTICLES && far != 0; i++) {
            double value = far * (sin(angle[i]) * sums[0] - cos(angle[i]) * sums[1]);
            for (int a = 0; a < d; a++) {
                force[i][a] += value * k[a];
            }
        }
    }
}

/* Squares of the error and of the force themselves, for particles at random. */
static void add_errors(const struct gbg_ewald_plan *plan, uint64_t *seed, double *error,
                       double *size)
{
    const struct gbg_ewald_choice *choice = &plan->choice;
    static struct mesh_sum sum;
    double by_mesh[PARTICLES][3] = {{0}}, by_waves[PARTICLES][3] = {{0}};
    memset(&sum, 0, sizeof sum);
    sum.plan = plan;
    sum.size = 1;
    for (int a = 0; a < choice->dimension; a++) {
        sum.size *= choice->cells[a];
        for (int i = 0; i < PARTICLES; i++) {
            sum.position[i][a] = draw(seed) * choice->length[a];
        }
    }
    for (int m = 0; m < 4; m++) {
        sum.mesh[m] = calloc((size_t)sum.size, sizeof *sum.mesh[m]);
        assert_non_null(sum.mesh[m]);
    }
    forces_by_mesh(&sum, by_mesh);
    forces_by_waves(&sum, by_waves);
    for (int m = 0; m < PARTICLES * choice->dimension; m++) {
        int i = m / choice->dimension, a = m % choice->dimension;
        *error += (by_mesh[i][a] - by_waves[i][a]) * (by_mesh[i][a] - by_waves[i][a]);
        *size += by_waves[i][a] * by_waves[i][a];
    }
    for (int m = 0; m < 4; m++) {
        free(sum.mesh[m]);
    }
}

/* Several sets of particles: windows that are read by their slopes make half of their error with
 * the eight longest waves of the box. */
static void check_forces(const struct gbg_ewald_choice *choice)
{
    enum { SETS = 4 };
    static struct gbg_ewald_plan plan;
    double volume = 1, error = 0, size = 0;
    uint64_t seed = 11;
    assert_int_equal(gbg_ewald_plan_make(choice, &plan), GBG_OK);
    for (int set = 0; set < SETS; set++) {
        add_errors(&plan, &seed, &error, &size);
    }
    for (int a = 0; a < choice->dimension; a++) {
        volume *= choice->length[a];
    }
    double guess =
        sqrt(PARTICLES / volume) * gbg_ewald_mesh_loss(&plan.split, plan.window, choice->length,
                                                       choice->cells, choice->gradient);
    error = sqrt(error / PARTICLES / SETS);
    size = sqrt(size / PARTICLES / SETS);
    printf("%dD power %.0f %s, gradient by %s, width %2d: error of the mesh %.2e of the far force, "
           "estimate over it %.2f\n",
           choice->dimension, choice->power,
           choice->window == GBG_EWALD_PROLATE ? "prolate " : "B-spline",
           choice->gradient == GBG_GRADIENT_WAVES ? "waves " : "window", choice->width,
           error / size, guess / error);
    double factor = choice->gradient == GBG_GRADIENT_WAVES ? 1.25 : 1.8;
    assert_true(error / size < 1e-13 || (guess / error > 1 / factor && guess / error < factor));
}

/* Windows that are read by their slopes pull a particle at itself, which is no part of the
 * estimate: there particles lie densely, elsewhere waves do. */
static struct gbg_ewald_choice case_of(int dimension, int kind, int width, double power)
{
    struct gbg_ewald_choice choice = usual(dimension);
    choice.window = kind / 2;
    choice.gradient = kind % 2;
    choice.width = width;
    choice.power = power;
    for (int a = 0; a < dimension; a++) {
        int32_t cells = dimension == 3 ? 10 : choice.gradient == GBG_GRADIENT_WINDOW ? 18 : 36;
        choice.length[a] = cells / 0.9 - 2 * (a == 1);
        choice.cells[a] = cells;
    }
    return choice;
}

static void meshes_make_the_error_that_is_expected(void **state)
{
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        for (int width = 3; width <= 13; width += width < 6 ? 1 : 3) {
            struct gbg_ewald_choice choice = case_of(2, kind, width, 2);
            check_forces(&choice);
        }
        struct gbg_ewald_choice cube = case_of(3, kind, 6, 2), steep = case_of(2, kind, 6, 5);
        check_forces(&cube);
        check_forces(&steep);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_choices_are_refused),
        cmocka_unit_test(cells_are_the_next_good_number),
        cmocka_unit_test(influence_is_the_best),
        cmocka_unit_test(meshes_make_the_error_that_is_expected),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
