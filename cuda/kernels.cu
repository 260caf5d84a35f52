/* L1, CUDA: the table of kernels. */
#include "cuda/kernels.h"

#include "cuda/list.h"

/* A kernel as the table calls it: on its GPU, whatever the thread used before, and not at all after
 * a failure. */
template <typename Type, Type kernel> struct call;
template <typename... Rest, int (*kernel)(struct gbg_device *, Rest...)>
struct call<int (*)(struct gbg_device *, Rest...), kernel> {
    static int on(struct gbg_device *device, Rest... rest)
    {
        int status = gbg_cuda_use(device);
        return status ? status : kernel(device, rest...);
    }
};
/* What releases does so after a failure too. */
template <typename... Rest, void (*kernel)(struct gbg_device *, Rest...)>
struct call<void (*)(struct gbg_device *, Rest...), kernel> {
    static void on(struct gbg_device *device, Rest... rest)
    {
        gbg_cuda_use(device);
        kernel(device, rest...);
    }
};
#define ON(kernel) call<decltype(&kernel), &kernel>::on

const struct gbg_kernels gbg_cuda_kernels = {
    .normals = ON(gbg_cuda_normals),
    .integrate = ON(gbg_cuda_integrate),
    .direct_mixed = ON(gbg_cuda_direct_mixed),
    .direct_double = ON(gbg_cuda_direct_double),
    .direct_strict = ON(gbg_cuda_direct_strict),
    .direct_reserve = ON(gbg_cuda_direct_reserve),
    .direct_targets = ON(gbg_cuda_direct_targets),
    .ewald_create = ON(gbg_cuda_ewald_create),
    .ewald_destroy = ON(gbg_cuda_ewald_destroy),
    .ewald_force = ON(gbg_cuda_ewald_force),
    .ewald_potential = ON(gbg_cuda_ewald_potential),
    .ewald_bytes = gbg_cuda_ewald_bytes,
    .list_create = ON(gbg_cuda_list_create),
    .list_destroy = ON(gbg_cuda_list_destroy),
    .list_update = ON(gbg_cuda_list_update),
    .skin_drifts = 20.0,
    .list_builds = gbg_cuda_list_builds,
    .list_bytes = gbg_cuda_list_bytes,
    .list_is_kept = gbg_cuda_list_is_kept,
    .list_scatter = gbg_cuda_list_scatter,
    .arrange = ON(gbg_cuda_arrange),
    .cutoff_mixed = ON(gbg_cuda_cutoff_mixed),
    .cutoff_double = ON(gbg_cuda_cutoff_double),
    .keep = ON(gbg_cuda_keep),
    .put_back = ON(gbg_cuda_put_back),
    .contacts = ON(gbg_cuda_contacts),
    .events = ON(gbg_cuda_events),
    .bridge = ON(gbg_cuda_bridge),
    .events_clear = ON(gbg_cuda_events_clear),
    .overlaps = ON(gbg_cuda_overlaps),
    .certify = ON(gbg_cuda_certify),
    .roll_back = ON(gbg_cuda_roll_back),
    .steps = ON(gbg_cuda_steps),
    .search_create = ON(gbg_cuda_search_create),
    .search_destroy = ON(gbg_cuda_search_destroy),
    .search_update = ON(gbg_cuda_search_update),
    .search_rows = ON(gbg_cuda_search_rows),
    .search_pairs = ON(gbg_cuda_search_pairs),
    .search_block = ON(gbg_cuda_search_block),
    .direct_published = ON(gbg_cuda_direct_published),
    .search_published = ON(gbg_cuda_search_published),
};
