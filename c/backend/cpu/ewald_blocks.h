/* L1, CPU: blocks of particles whose nodes of the mesh are gathered in a patch, a piece of the mesh
 * with all of axis 0 and its surroundings, so that neither the ends of the mesh nor other threads
 * are in the way of a particle.
 *
 * Blocks are ranges of the cells of the order (ewald.h) along axes 1 and 2, and do not depend on
 * the number of threads. Patches of blocks that are not neighbours share no node; so blocks are
 * given colours, an axis: even and odd, and one more for the last of an odd number. Colour after
 * colour every node is summed in one order. */
#ifndef GBG_BACKEND_CPU_EWALD_BLOCKS_H
#define GBG_BACKEND_CPU_EWALD_BLOCKS_H

#include "backend/cpu/ewald.h"

/* Numbers before node 0 of a row of a patch, and room behind the last. */
enum { GBG_PATCH_BEFORE = 8, GBG_PATCH_BEHIND = 24, GBG_BLOCK_COLOURS = 3 };

struct gbg_ewald_block {
    int32_t begin[3], end[3]; /* cells of the order */
    int32_t first[3];         /* node of the patch's first row, may be negative */
    int32_t rows[3];
};

static inline int64_t gbg_patch_pitch(const struct gbg_ewald *sum)
{
    int64_t numbers = sum->plan.choice.cells[0] + GBG_PATCH_BEFORE + GBG_PATCH_BEHIND;
    return (numbers + 15) / 16 * 16;
}

/* Meshes that are read at a time. */
static inline int gbg_patch_meshes(const struct gbg_ewald_choice *choice)
{
    return choice->gradient == GBG_GRADIENT_WAVES ? choice->dimension : 1;
}

/* Rows of an axis that particles in cells begin..end-1 may touch: a particle's nodes are width in
 * a row from the node at or before it, or the nearest one, less width/2, on. */
static inline void gbg_block_rows(const struct gbg_ewald *sum, int a, struct gbg_ewald_block *block)
{
    const struct gbg_ewald_choice *choice = &sum->plan.choice;
    int64_t cells = sum->order.cells[a], nodes = choice->cells[a];
    int32_t low = (int32_t)(block->begin[a] * nodes / cells);
    int32_t high = (int32_t)(block->end[a] * nodes / cells);
    block->first[a] = low - choice->width / 2;
    block->rows[a] = high - low + choice->width + 1;
}

static inline struct gbg_ewald_block gbg_block_at(const struct gbg_ewald *sum, int32_t b1,
                                                  int32_t b2)
{
    const int32_t at[3] = {0, b1, b2};
    struct gbg_ewald_block block = {{0, 0, 0}, {sum->order.cells[0], 1, 1}, {0, 0, 0}, {1, 1, 1}};
    for (int a = 1; a < sum->plan.choice.dimension; a++) {
        int64_t cells = sum->order.cells[a];
        block.begin[a] = (int32_t)(at[a] * cells / sum->blocks[a]);
        block.end[a] = (int32_t)((at[a] + 1) * cells / sum->blocks[a]);
        gbg_block_rows(sum, a, &block);
    }
    return block;
}

/* Blocks of a colour along an axis of `blocks`, and the number of its k-th one. */
static inline int32_t gbg_colour_blocks(int32_t blocks, int colour)
{
    int last = blocks > 1 && blocks % 2 == 1;
    return colour == 2 ? last : (blocks - last + 1 - colour) / 2;
}

static inline int32_t gbg_colour_block(int32_t blocks, int colour, int32_t k)
{
    return colour == 2 ? blocks - 1 : 2 * k + colour;
}

/* Particles of a block whose cells stand at c2 of axis 2: one range. */
static inline void gbg_block_particles(const struct gbg_ewald *sum,
                                       const struct gbg_ewald_block *block, int32_t c2,
                                       int64_t *begin, int64_t *end)
{
    const struct gbg_ewald_order *order = &sum->order;
    int64_t row = (int64_t)c2 * order->cells[1];
    *begin = order->begin[(row + block->begin[1]) * order->cells[0]];
    *end = order->begin[(row + block->end[1]) * order->cells[0]];
}

#endif
