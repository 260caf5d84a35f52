/* L3: the state of a random insertion, and the voxels that finish it when free places are rare. */
#ifndef GBG_SCENE_INSERTION_H
#define GBG_SCENE_INSERTION_H

#include "scene/scene.h"

/* Cells at least one diameter wide over the box, with the particles of one species in linked lists:
 * a core that is not larger can only hit one in the 3^dimension cells around it. */
struct gbg_cells {
    double diameter;
    int64_t size[3];
    int32_t *head; /* -1: none; NULL: the species has no cores */
};

/* Boxes of one size, together all places where a particle of the present species may still fit. */
struct gbg_voxels {
    int level;        /* halvings since they were made */
    int64_t failures; /* draws without success since the last halving */
    int64_t patience; /* failures after which they are halved again */
    int64_t size[3];  /* along the axes of the box */
    int64_t n;
    int64_t *number; /* NULL: not in use */
};

struct gbg_insertion {
    struct gbg_scene *scene;
    struct gbg_particles *particles;
    int order[GBG_MAX_SPECIES]; /* species, largest first */
    int rank;                   /* in that order, of the species being inserted */
    struct gbg_cells cells[GBG_MAX_SPECIES];
    int32_t *next; /* in the list of a cell */
    double slack;  /* kept from contact, so that rounding never makes an overlap */
    struct gbg_voxels voxels;
};

/* 1 if one core lies so near that no centre of the present species fits anywhere in the box around
 * r with these half edges; for half edges 0: if a core at r would overlap. */
int gbg_insertion_blocks(const struct gbg_insertion *work, const double *r, const double *half);

/* Makes the voxels of the present species, those left out that are blocked. */
int gbg_voxels_make(struct gbg_insertion *work);
/* Halves every edge, again without those that are blocked. */
int gbg_voxels_halve(struct gbg_insertion *work);
/* A point in voxel `index` of the list, from uniform numbers, one an axis. */
void gbg_voxels_point(const struct gbg_insertion *work, int64_t index, const double *uniform,
                      double *r);
/* Takes voxel `index` off the list if it is blocked. */
void gbg_voxels_review(struct gbg_insertion *work, int64_t index);
void gbg_voxels_release(struct gbg_insertion *work);

#endif
