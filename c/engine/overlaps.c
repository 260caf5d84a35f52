/* L2: finding and removing overlaps in a caller's arrays. */
#include "engine/overlaps.h"

#include "core/context.h"
#include "core/memory.h"

static const double contact_tolerance = 1e-12;

static double largest(const double *diameter, int64_t n)
{
    double most = 0.0;
    for (int64_t i = 0; i < n; i++) {
        most = diameter[i] > most ? diameter[i] : most;
    }
    return most;
}

static int set_diameters(struct gbg_bare *bare, const double *diameter)
{
    bare->state.diameter[0] = largest(diameter, bare->state.owned);
    return gbg_bare_array(bare, (void **)&bare->state.own_diameter, diameter, 8, "diameters");
}

int gbg_caller_find_overlaps(struct gbg_bare *bare, const double *diameter, double tolerance,
                             int64_t capacity, int32_t *first, int32_t *second, int64_t *count)
{
    struct gbg_pair lowest;
    int status = set_diameters(bare, diameter);
    if (status == GBG_OK) {
        status = bare->kernels->overlaps(bare->device, &bare->state, tolerance, capacity, first,
                                         second, &lowest, count);
    }
    bare->backend->release(bare->device, bare->state.own_diameter);
    return status;
}

/* Adds the moves of one axis, so that an unwrapped coordinate stays in its box image. */
static int add_moves(struct gbg_bare *bare, int axis, const unsigned char *moved,
                     uint64_t *fraction, double *base, ptrdiff_t step)
{
    const struct gbg_box *box = &bare->state.box;
    int status = gbg_bare_fractions(bare, axis, fraction);
    for (int64_t i = 0; status == GBG_OK && i < bare->state.owned; i++) {
        if (moved[i]) {
            uint64_t before = gbg_box_encode(box, axis, base[i * step], NULL);
            base[i * step] += gbg_box_difference(box, axis, fraction[i], before);
        }
    }
    return status;
}

static int remove_rounds(struct gbg_bare *bare, struct gbg_list *list,
                         struct gbg_contacts *contacts)
{
    int status = bare->kernels->list_update(bare->device, &bare->state, list, 0.0);
    if (status == GBG_OK) {
        status = bare->kernels->contacts(bare->device, &bare->state, list, contacts);
    }
    if (status == GBG_OK && contacts->left > 0) {
        status = gbg_fail(bare->context, GBG_E_STEP,
                          "gbg_overlaps_remove: %lld pairs still overlap after %lld rounds; the "
                          "arrays are unchanged",
                          (long long)contacts->left, (long long)contacts->rounds);
    }
    return status;
}

static int write_back(struct gbg_bare *bare, double *const base[3], ptrdiff_t step)
{
    int64_t n = bare->state.owned;
    unsigned char *moved = NULL;
    uint64_t *fraction = NULL;
    int status = gbg_allocate(bare->context, (void **)&moved, n, 1, "moved particles");
    if (status == GBG_OK) {
        status = gbg_allocate(bare->context, (void **)&fraction, n, 8, "coordinates");
    }
    if (status == GBG_OK) {
        status = bare->backend->download(bare->device, moved, bare->state.overlapped, (size_t)n);
    }
    for (int a = 0; status == GBG_OK && a < bare->state.box.dimension; a++) {
        status = add_moves(bare, a, moved, fraction, base[a], step);
    }
    gbg_release(moved);
    gbg_release(fraction);
    return status;
}

int gbg_caller_remove_overlaps(struct gbg_bare *bare, const double *diameter, int bounce,
                               int64_t max_rounds, double *const base[3], ptrdiff_t step,
                               int64_t *rounds)
{
    struct gbg_contacts contacts = {.parting = bounce ? GBG_PARTING_BOUNCE : GBG_PARTING_CONTACT,
                                    .max_rounds = max_rounds,
                                    .tolerance = contact_tolerance,
                                    .cap = 0.25};
    struct gbg_list *list = NULL;
    double reach = largest(diameter, bare->state.owned);
    *rounds = 0;
    if (reach == 0.0) {
        return GBG_OK;
    }
    int status = set_diameters(bare, diameter);
    if (status == GBG_OK) {
        status = gbg_bare_array(bare, (void **)&bare->state.overlapped, NULL, 1, "overlap flags");
    }
    if (status == GBG_OK) {
        status = bare->kernels->list_create(bare->device, &bare->state, reach, 1.4 * reach, &list);
    }
    if (status == GBG_OK) {
        status = remove_rounds(bare, list, &contacts);
    }
    if (status == GBG_OK) {
        status = write_back(bare, base, step);
        *rounds = contacts.rounds;
    }
    bare->kernels->list_destroy(bare->device, list);
    bare->backend->release(bare->device, bare->state.own_diameter);
    bare->backend->release(bare->device, bare->state.overlapped);
    return status;
}
