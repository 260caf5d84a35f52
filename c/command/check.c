/* Command: gamboge check. */
#include <stdlib.h>
#include <string.h>

#include "command/session.h"

static void print_vector(int dimension, const double *values, const char *between)
{
    for (int a = 0; a < dimension; a++) {
        printf("%s%.10g", a ? between : "", values[a]);
    }
}

static void print_box(const struct gbg_session *session)
{
    int dimension;
    double lengths[3], origin[3];
    gbg_engine_size(session->engine, NULL, &dimension);
    gbg_engine_box(session->engine, lengths, origin);
    printf("box            ");
    print_vector(dimension, lengths, " x ");
    printf(", periodic, lower corner at ");
    print_vector(dimension, origin, ", ");
    printf("\n");
}

/* Fraction of the box that the cores of this species fill. */
static double packing_of(int dimension, const double *lengths, double diameter, int64_t count)
{
    double volume = 1;
    for (int a = 0; a < dimension; a++) {
        volume *= lengths[a];
    }
    return (double)count * gbg_core_size(dimension, diameter) / volume;
}

/* Particles of each species, from the engine, because a start file brings its own numbers. */
static void count_species(const struct gbg_session *session, int64_t *counts)
{
    int64_t n = 0;
    gbg_engine_size(session->engine, &n, NULL);
    int32_t *species = calloc((size_t)n + 1, sizeof *species);
    if (species && gbg_engine_species(session->engine, n, species, 0) == GBG_OK) {
        for (int64_t i = 0; i < n; i++) {
            counts[species[i]]++;
        }
    }
    free(species);
}

static void print_species(const struct gbg_session *session)
{
    int n_species = 0, dimension;
    int64_t n, counts[GBG_MAX_SPECIES] = {0};
    double lengths[3], packing = 0;
    gbg_scene_size(session->scene, &n_species, NULL);
    gbg_engine_size(session->engine, &n, &dimension);
    gbg_engine_box(session->engine, lengths, NULL);
    count_species(session, counts);
    printf("particles      %s\n", gbg_count_text(n));
    printf("  species      %12s %10s %10s %10s %10s\n", "number", "diameter", "alpha", "mobility",
           "packing");
    for (int s = 0; s < n_species; s++) {
        char name[GBG_TEXT_MOST];
        double diameter, alpha, mobility;
        gbg_scene_get_species(session->scene, s, sizeof name, name, &diameter, &alpha, &mobility,
                              NULL);
        double part = packing_of(dimension, lengths, diameter, counts[s]);
        packing += part;
        printf("  %-12s %12s %10g %10g %10g %10.5f\n", name, gbg_count_text(counts[s]), diameter,
               alpha, mobility, part);
    }
    printf("  together     %56.5f\n", packing);
}

static void print_forces(const struct gbg_session *session)
{
    int n_forces = 0;
    gbg_scene_size(session->scene, NULL, &n_forces);
    printf("forces         %s\n",
           n_forces ? "F_i = mobility_i sum_k alpha_k r_ik/|r_ik|^(power+1)" : "none");
    for (int f = 0; f < n_forces; f++) {
        double power, cutoff, tolerance;
        const char *sum;
        gbg_scene_get_force(session->scene, f, &power, &sum, &cutoff, &tolerance);
        printf("  power %-6g sum %s", power, sum);
        if (cutoff > 0) {
            printf(" %g", cutoff);
        }
        if (tolerance > 0) {
            printf(", tolerance %g", tolerance);
        }
        printf("\n");
    }
}

static void print_rules(const struct gbg_session *session)
{
    printf("exclusion      rule %s", gbg_session_text(session, "excluded_volume.rule"));
    printf(", neighbours %s\n", gbg_session_text(session, "excluded_volume.neighbours"));
    printf("dynamics       %s, dt %g, temperature %g", gbg_session_text(session, "dynamics.kind"),
           gbg_session_real(session, "dynamics.dt", 0),
           gbg_session_real(session, "dynamics.temperature", 0));
    const char *limit_by = gbg_session_text(session, "dynamics.noise.limit_by");
    if (*limit_by && strcmp(limit_by, "none") != 0) {
        printf(", noise: %s at %g deviations", limit_by,
               gbg_session_real(session, "dynamics.noise.limit", 0));
    }
    printf("\nrun            %s steps, seed %lld\n",
           gbg_count_text(gbg_session_integer(session, "run.steps", 0)),
           (long long)gbg_session_integer(session, "run.seed", 0));
}

static void print_output(const struct gbg_session *session, const char *kind)
{
    char option[GBG_TEXT_MOST];
    snprintf(option, sizeof option, "output.%s.file", kind);
    const char *file = gbg_session_text(session, option);
    if (*file) {
        snprintf(option, sizeof option, "output.%s.every", kind);
        printf("%-14s %s, every %s steps\n", kind, file,
               gbg_count_text(gbg_session_integer(session, option, 0)));
    } else {
        printf("%-14s none\n", kind);
    }
}

static void print_plan(const struct gbg_session *session, double bytes)
{
    int lines = 0;
    gbg_engine_plan_size(session->engine, &lines);
    printf("plan           kernel | what | bytes a particle that this step needs\n");
    for (int i = 0; i < lines; i++) {
        char text[GBG_TEXT_MOST];
        if (gbg_engine_plan_line(session->engine, i, sizeof text, text) == GBG_OK) {
            printf("  %s\n", text);
        }
    }
    printf("memory         %.4g bytes a particle in all\n", bytes);
}

/* What the scene does not carry, because nothing in it asks for it. */
static void print_absent(const struct gbg_session *session)
{
    int n_species = 0, n_forces = 0, cut = 0;
    gbg_scene_size(session->scene, &n_species, &n_forces);
    for (int f = 0; f < n_forces; f++) {
        double cutoff = 0;
        gbg_scene_get_force(session->scene, f, NULL, NULL, &cutoff, NULL);
        cut |= cutoff > 0;
    }
    const int cores = strcmp(gbg_session_text(session, "excluded_volume.rule"), "none") != 0;
    const struct {
        const char *name;
        int carried;
    } parts[] = {
        {"species", n_species > 1},
        {"forces", n_forces > 0},
        {"neighbour lists", cut || cores},
        {"positions before the step", cores},
        {"image counts", gbg_session_integer(session, "output.trajectory.unwrapped", 0) != 0},
        {"overlap flags", gbg_session_integer(session, "output.trajectory.overlap", 0) != 0}};
    const char *separator = "";
    printf("not needed     ");
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
        if (!parts[k].carried) {
            printf("%s%s", separator, parts[k].name);
            separator = ", ";
        }
    }
    printf("%s\n", *separator ? "" : "-");
}

static int check(const struct gbg_arguments *arguments, struct gbg_session *session)
{
    int status = gbg_session_open(arguments, session);
    status = status ? status : gbg_session_start(session);
    if (status) {
        return status;
    }
    double bytes = 0; /* before anything is read out, which takes buffers */
    gbg_engine_real(session->engine, "bytes_per_particle", &bytes);
    printf("scene          %s\n", arguments->operand);
    printf("backend        %s\n", gbg_backend_text(session->context));
    print_box(session);
    print_species(session);
    print_forces(session);
    print_rules(session);
    print_output(session, "trajectory");
    print_output(session, "restart");
    print_plan(session, bytes);
    print_absent(session);
    return GBG_EXIT_DONE;
}

int gbg_command_check(const struct gbg_arguments *arguments)
{
    struct gbg_session session;
    int status = check(arguments, &session);
    gbg_session_close(&session);
    return status;
}
