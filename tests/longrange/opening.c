/* Test of the shared library: opening LIBGAMBOGE [absent]. A sum by a mesh finds the transforms
 * beside libgamboge, or, absent, says what to install. The plan is made by this program's own
 * objects, all else by the shared library, which is opened here so that it may stand anywhere. */
#include "mesh_state.h"

#include <dlfcn.h>
#include <stdio.h>

typedef int (*create_function)(const char *text, struct gbg_context **context);
typedef const char *(*message_function)(const struct gbg_context *context);
typedef const struct gbg_backend *(*find_function)(const char *name);

static const struct recipe recipe = {
    "opening", GBG_SPLIT_PROLATE, GBG_EWALD_PROLATE, 1, {6, 8}, 9.0, 1.25};

int main(int argc, char **argv)
{
    const double length[3] = {10.0, 10.0, 1.0};
    struct gbg_context *context;
    struct gbg_device *device;
    struct gbg_ewald *sum = NULL;
    struct particle_set s = {0};
    int absent = argc > 2;
    void *library = argc > 1 ? dlopen(argv[1], RTLD_NOW | RTLD_LOCAL) : NULL;
    if (!library || !set_make(&s, SET_RANDOM, 2, length, 100, 0, 1)) {
        printf("%s\n", library ? "no memory" : dlerror());
        return 1;
    }
    create_function create = (create_function)dlsym(library, "gbg_context_create");
    message_function message = (message_function)dlsym(library, "gbg_message");
    find_function find = (find_function)dlsym(library, "gbg_backend_find");
    struct particles p = particles_of(&s, 0);
    struct gbg_ewald_plan plan = plan_of(&recipe, &s, 2.0, 0);
    if (create("cpu:threads=1", &context) != GBG_OK ||
        find("cpu")->create(context, &device) != GBG_OK) {
        return 1;
    }
    const struct gbg_kernels *kernels = find("cpu")->kernels(device);
    int status = kernels->ewald_create(device, &p.state, &plan, 1, &sum);
    printf("status %d: %s\n", status, message(context));
    if (absent) {
        return status == GBG_E_UNBUILT && strstr(message(context), "libgamboge_fft") ? 0 : 1;
    }
    return status == GBG_OK && kernels->ewald_force(device, &p.state, sum, 0) == GBG_OK ? 0 : 1;
}
