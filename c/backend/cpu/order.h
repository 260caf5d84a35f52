/* L1, CPU: where particles stand in memory. */
#ifndef GBG_BACKEND_CPU_ORDER_H
#define GBG_BACKEND_CPU_ORDER_H

#include "backend/backend.h"

enum { GBG_KEY_BITS = 32 };

/* The axes in the order in which they are halved: always the longest edge, so that a key names a
 * box that is as cubic as can be. */
struct gbg_halvings {
    unsigned char axis[GBG_KEY_BITS];
};

GBG_INLINE struct gbg_halvings gbg_order_halvings(const struct gbg_box *box)
{
    struct gbg_halvings halvings;
    double edge[3] = {0.0, 0.0, 0.0};
    for (int a = 0; a < box->dimension; a++) {
        edge[a] = box->length[a];
    }
    for (int k = 0; k < GBG_KEY_BITS; k++) {
        int longest = 0;
        for (int a = 1; a < box->dimension; a++) {
            longest = edge[a] > edge[longest] ? a : longest;
        }
        halvings.axis[k] = (unsigned char)longest;
        edge[longest] *= 0.5;
    }
    return halvings;
}

/* Which of the halves a particle is in, the largest first: its place along a space-filling curve.
 */
GBG_INLINE uint32_t gbg_order_key(const struct gbg_state *state,
                                  const struct gbg_halvings *halvings, int64_t i)
{
    uint32_t word[3] = {0, 0, 0}, key = 0;
    for (int a = 0; a < state->box.dimension; a++) {
        word[a] = state->high[a][i];
    }
    for (int k = 0; k < GBG_KEY_BITS; k++) {
        key = key << 1 | word[halvings->axis[k]] >> 31;
        word[halvings->axis[k]] <<= 1;
    }
    return key;
}

int gbg_arrange(struct gbg_device *device, struct gbg_state *state, int by_place);
double gbg_list_scatter(const struct gbg_list *list);

#endif
