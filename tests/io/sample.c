/* Test program: sample DIRECTORY writes trajectories there, each NAME.nc with what should be in it
 * in NAME.txt: a line "dimension particles frames", then for each frame time, lengths and
 * coordinates. */
#include "../unit/io_made.h"

enum { FRAMES = 4, N = 137 };

static void write_frame(FILE *text, const struct made *made, int64_t step)
{
    double height = made->dimension == 3 ? made_length[2] : made_length[0];
    fprintf(text, "%.17g %.17g %.17g %.17g\n", 0.01 * (double)step, made_length[0], made_length[1],
            height);
    for (int64_t i = 0; i < made->n; i++) {
        for (int a = 0; a < 3; a++) {
            fprintf(text, "%.17g ", a < made->dimension ? made_coordinate(step, i, a) : 0.0);
        }
        fputc('\n', text);
    }
}

static int write_sample(const char *directory, const char *name, const struct made *made)
{
    struct gbg_context *context;
    struct gbg_trajectory *trajectory;
    char path[512];
    if (gbg_context_create("cpu:threads=1", &context) != GBG_OK) {
        return 1;
    }
    struct gbg_engine *engine = made_engine(context, made);
    snprintf(path, sizeof path, "%s/%s.txt", directory, name);
    FILE *text = fopen(path, "w");
    if (!text) {
        return 1;
    }
    fprintf(text, "%d %d %d\n", made->dimension, N, FRAMES);
    snprintf(path, sizeof path, "%s/%s.nc", directory, name);
    int status = gbg_trajectory_create(engine, path, &trajectory);
    for (int64_t step = 10; status == GBG_OK && step < 10 + FRAMES; step++) {
        made_set(engine, step);
        write_frame(text, made, step);
        status = gbg_trajectory_append(trajectory, engine);
    }
    fprintf(stderr, "%s", status == GBG_OK ? "" : gbg_message(context));
    fclose(text);
    gbg_trajectory_destroy(&trajectory);
    gbg_engine_destroy(&engine);
    gbg_context_destroy(&context);
    return status != GBG_OK;
}

int main(int argc, char **argv)
{
    static const struct made plain = {2, N, "double", 0, 0, 0, 1},
                             all = {2, N, "double", 1, 1, 1, 1}, flat = {2, N, "float", 0, 1, 0, 1},
                             solid = {3, N, "double", 1, 0, 0, 1};
    if (argc != 2) {
        return 2;
    }
    return write_sample(argv[1], "plain", &plain) || write_sample(argv[1], "all", &all) ||
           write_sample(argv[1], "flat", &flat) || write_sample(argv[1], "solid", &solid);
}
