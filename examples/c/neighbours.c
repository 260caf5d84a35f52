/* Example: a code that keeps its own particles asks for pairs: soft springs between drifting discs.
 */
#include <gamboge/gamboge.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { DISCS = 500, STEPS = 50 };
static const double side[2] = {20.0, 20.0}, reach = 1.5, skin = 0.3;

static void must(int status, const struct gbg_context *context)
{
    if (status != GBG_OK) {
        fprintf(stderr, "%s: %s\n", gbg_status_name(status), gbg_message(context));
        exit(1);
    }
}

/* Receives some thousand pairs at a time, always in the same order. */
static void add_springs(void *user, int64_t n, const int32_t *first, const int32_t *second,
                        const double *separation)
{
    double *energy = user;
    (void)first;
    (void)second;
    for (int64_t k = 0; k < n; k++) {
        double r = sqrt(separation[2 * k] * separation[2 * k] +
                        separation[2 * k + 1] * separation[2 * k + 1]);
        *energy += 0.5 * (1.0 - r / reach) * (1.0 - r / reach);
    }
}

int main(void)
{
    static double x[2 * DISCS]; /* x(2,n) as Fortran calls it */
    static int64_t offset[DISCS + 1];
    struct gbg_context *context;
    struct gbg_neighbours *neighbours;
    int searched, searches = 0;
    int64_t pairs;
    double energy = 0.0;
    must(gbg_context_create("auto", &context), NULL);
    for (int i = 0; i < DISCS; i++) {
        x[2 * i] = side[0] * fmod(0.7548776662466927 * (i + 1), 1.0);
        x[2 * i + 1] = side[1] * fmod(0.5698402909980532 * (i + 1), 1.0);
    }

    must(gbg_neighbours_create(context, 2, side, reach, "verlet", skin, &neighbours), context);
    for (int step = 0; step < STEPS; step++) {
        for (int i = 0; i < DISCS; i++) { /* your own dynamics */
            x[2 * i] += 0.04 * (fmod(0.6180339887498949 * (i + 1), 1.0) - 0.5);
        }
        must(gbg_neighbours_update(neighbours, DISCS, x, x + 1, NULL, 2, &searched), context);
        must(gbg_neighbours_visit(neighbours, 0, add_springs, &energy), context);
        searches += searched;
    }

    /* The same pairs as rows: neighbours of i are neighbour[offset[i]] .. [offset[i + 1] - 1]. */
    must(gbg_neighbours_count(neighbours, NULL, &pairs), context);
    int32_t *neighbour = malloc((size_t)(2 * pairs) * sizeof *neighbour);
    must(gbg_neighbours_csr(neighbours, 0, DISCS + 1, offset, 2 * pairs, neighbour), context);

    int64_t most = 0;
    for (int i = 0; i < DISCS; i++) {
        most = offset[i + 1] - offset[i] > most ? offset[i + 1] - offset[i] : most;
    }
    printf("pairs %lld\nmost_neighbours %lld\nsearches %d\nmean_energy %.9f\n", (long long)pairs,
           (long long)most, searches, energy / STEPS);
    free(neighbour);
    gbg_neighbours_destroy(&neighbours);
    gbg_context_destroy(&context);
    return 0;
}
