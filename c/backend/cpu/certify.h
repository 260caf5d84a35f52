/* L1, CPU: the certificate of a step: that the list was complete, no overlap, nobody passed. */
#ifndef GBG_BACKEND_CPU_CERTIFY_H
#define GBG_BACKEND_CPU_CERTIFY_H

#include "backend/backend.h"

/* What the vector part works on. The coordinates are the certificate's own, made from the 64-bit
 * ones: the solver keeps others up to date while it moves particles. */
struct gbg_certify_work {
    const struct gbg_state *state;
    const struct gbg_list *list;
    uint32_t *local[3]; /* 32 bits of each coordinate, as the list's shift takes them */
    float *half;        /* half diameters with room for rounding; NULL: `limit` for all pairs */
    float limit;        /* squared distance with that room */
};

/* Fills in the local coordinates of particles first .. end-1, first a multiple of GBG_SLICE;
 * largest[0]: largest squared move since the step began, largest[1]: since the list was built,
 * both from the high words alone, so each difference is off by up to 2^-32 of the box. */
typedef void (*gbg_cpu_certify_moves)(const struct gbg_certify_work *work, int64_t first,
                                      int64_t end, float largest[2]);
/* Particles of a slice with a neighbour of higher index that may be too close; their number. */
typedef int64_t (*gbg_cpu_certify_screen)(const struct gbg_certify_work *work, int64_t slice,
                                          const int32_t *index, int32_t *found);

/* Room of the 32-bit coordinates: a difference is off by less than a unit on each axis, and a unit
 * is at most 16 reach 2^-32 (list.h). Floats are good to 1e-6, the half diameters get 1e-5. */
GBG_INLINE float gbg_certify_room(double reach, double half)
{
    return half > 0.0 ? (float)(half * (1.0 + 1e-5) + 1e-8 * reach) : 0.0f;
}

/* 1 if nobody is farther from where a list was built than half its skin: then it holds every pair
 * closer than its reach. */
GBG_INLINE int gbg_certify_complete(double reach, double radius, double moved, double error)
{
    double slack = 0.5 * (radius - reach);
    return moved * (1.0 + 1e-6) + error <= slack;
}

int gbg_certify(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                struct gbg_certificate *certificate);

#endif
