/* Command: gamboge info. */
#include <unistd.h>

#include "command/command.h"

static const char *const components[][2] = {
    {"yaml", "scene files"},
    {"netcdf", "trajectories and results"},
    {"fftw", "structure factors on a mesh"},
    {"openmp", "threads"},
    {"cuda", "GPUs"},
};

int gbg_command_info(const struct gbg_arguments *arguments)
{
    (void)arguments;
    struct gbg_context *context = NULL;
    int status = gbg_open_context(NULL, 0, &context);
    if (status) {
        return status;
    }
    int threads;
    gbg_context_backend(context, NULL, NULL, &threads);
    printf("version       %s\n", gbg_version_text());
    printf("backend       %s\n", gbg_backend_text(context));
    printf("threads       %d (the machine has %ld processors)\n", threads,
           sysconf(_SC_NPROCESSORS_ONLN));
    for (size_t i = 0; i < sizeof components / sizeof components[0]; i++) {
        printf("%-13s %s (%s)\n", components[i][0],
               gbg_has_component(components[i][0]) ? "yes" : "no", components[i][1]);
    }
#ifdef GBG_WITH_CAIRO
    printf("%-13s yes (pictures)\n", "cairo");
#else
    printf("%-13s no (pictures)\n", "cairo");
#endif
    printf("limits        %d species, %d forces, 2 or 3 dimensions\n", GBG_MAX_SPECIES,
           GBG_MAX_FORCES);
    gbg_context_destroy(&context);
    return GBG_EXIT_DONE;
}
