/* Example: a code that keeps its own particles replaces its loop over pairs, which stops at the
 * nearest images, by the sum over all images: the lines of gbg_sum_ take the place of the loop. */
#include <gamboge/gamboge.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { PARTICLES = 1000, STEPS = 20 };
static const double side[2] = {40.0, 25.0}, dt = 1e-3;

static void must(int status, const struct gbg_context *context)
{
    if (status != GBG_OK) {
        fprintf(stderr, "%s: %s\n", gbg_status_name(status), gbg_message(context));
        exit(1);
    }
}

int main(void)
{
    static double x[PARTICLES], y[PARTICLES], fx[PARTICLES], fy[PARTICLES];
    static double alpha[PARTICLES], mobility[PARTICLES], potential[PARTICLES];
    struct gbg_context *context;
    struct gbg_sum *sum;
    double error, drift = 0.0, energy = 0.0, rms = 0.0;
    must(gbg_context_create("auto", &context), NULL);
    for (int i = 0; i < PARTICLES; i++) { /* a loose square lattice, shaken */
        x[i] = i % 40 + 0.25 * sin(12.9898 * (i + 1));
        y[i] = i / 40 + 0.25 * sin(78.233 * (i + 1));
        alpha[i] = i % 2 ? -1.0 : 1.0;
        mobility[i] = i % 2 ? -2.0 : 1.0;
    }

    must(gbg_sum_create(context, 2, side, 2.0, "lattice", 1e-6, PARTICLES, &sum), context);
    must(gbg_sum_set_option(sum, "hurry", "true"), context); /* few steps: no tuning */
    must(gbg_sum_set_sources(sum, alpha), context);
    for (int step = 0; step < STEPS; step++) {
        must(gbg_sum_set_positions(sum, x, y, NULL, 1), context);
        must(gbg_sum_run(sum), context);
        must(gbg_sum_get_forces(sum, mobility, fx, fy, NULL, 1), context);
        for (int i = 0; i < PARTICLES; i++) { /* your own dynamics */
            x[i] += fx[i] * dt;
            y[i] += fy[i] * dt;
        }
    }

    must(gbg_sum_get_potential(sum, potential), context);
    must(gbg_sum_get_error(sum, 0, &error, NULL), context);
    for (int i = 0; i < PARTICLES; i++) {
        rms += fx[i] * fx[i] + fy[i] * fy[i];
        drift += alpha[i] / mobility[i] * fx[i]; /* zero: forces of pairs */
        energy += 0.5 * alpha[i] * potential[i];
    }
    printf("rms_force %.6f\nenergy %.4f\n", sqrt(rms / PARTICLES), energy);
    printf("error_below_1e-6 %d\nmomentum_below_1e-8 %d\n", error < 1e-6,
           fabs(drift) / PARTICLES < 1e-8);
    gbg_sum_destroy(&sum);
    gbg_context_destroy(&context);
    return 0;
}
