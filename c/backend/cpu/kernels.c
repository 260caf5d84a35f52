/* L1: the table of kernels of one instruction set. */
#include "backend/cpu/contacts.h"
#include "backend/cpu/cpu.h"
#include "backend/cpu/direct.h"
#include "backend/cpu/events.h"
#include "backend/cpu/ewald.h"
#include "backend/cpu/list.h"
#include "backend/cpu/order.h"
#include "backend/cpu/search.h"
#include "backend/cpu/variant.h"

const struct gbg_cpu_variant GBG_ISA_NAME(gbg_cpu_variant) = {
    .name = GBG_SIMD_NAME,
    .screen = GBG_ISA_NAME(gbg_cpu_screen),
    .search = &GBG_ISA_NAME(gbg_search_kernels),
    .ewald = &GBG_ISA_NAME(gbg_ewald_kernels),
    .find = GBG_ISA_NAME(gbg_cpu_find),
    .lay_row = GBG_ISA_NAME(gbg_cpu_lay_row),
    .follow = GBG_ISA_NAME(gbg_cpu_follow),
    .certify_moves = GBG_ISA_NAME(gbg_cpu_certify_moves),
    .certify_screen = GBG_ISA_NAME(gbg_cpu_certify_screen),
    .event_moves = GBG_ISA_NAME(gbg_cpu_event_moves),
    .event_screen = GBG_ISA_NAME(gbg_cpu_event_screen),
    .kernels =
        {
            .normals = GBG_ISA_NAME(gbg_cpu_normals),
            .integrate = GBG_ISA_NAME(gbg_cpu_integrate),
            .cutoff_mixed = GBG_ISA_NAME(gbg_cpu_cutoff_mixed),
            .cutoff_double = GBG_ISA_NAME(gbg_cpu_cutoff_double),
            .direct_mixed = GBG_ISA_NAME(gbg_cpu_direct_mixed),
            .direct_double = GBG_ISA_NAME(gbg_cpu_direct_double),
            .direct_strict = GBG_ISA_NAME(gbg_cpu_direct_strict),
            .direct_reserve = gbg_cpu_direct_reserve,
            .direct_targets = gbg_cpu_direct_targets,
            .ewald_create = gbg_ewald_create,
            .ewald_destroy = gbg_ewald_destroy,
            .ewald_force = gbg_ewald_force,
            .ewald_potential = gbg_ewald_potential,
            .ewald_bytes = gbg_ewald_bytes,
            .list_create = gbg_list_create,
            .list_destroy = gbg_list_destroy,
            .list_update = gbg_list_update,
            .list_builds = gbg_list_builds,
            .list_bytes = gbg_list_bytes,
            .list_scatter = gbg_list_scatter,
            .arrange = gbg_arrange,
            .keep = gbg_keep,
            .put_back = gbg_put_back,
            .contacts = gbg_contacts,
            .bridge = GBG_ISA_NAME(gbg_cpu_bridge),
            .events = gbg_events,
            .events_clear = gbg_events_clear,
            .overlaps = gbg_overlaps,
            .certify = gbg_certify,
            .roll_back = gbg_roll_back,
            .search_create = gbg_search_create,
            .search_destroy = gbg_search_destroy,
            .search_update = gbg_search_update,
            .search_rows = gbg_search_csr,
            .search_pairs = gbg_search_pairs,
            .search_block = gbg_search_block,
        },
};
