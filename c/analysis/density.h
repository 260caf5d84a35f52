/* Analysis room: density modes rho_n = sum_j exp(-i k_n.r_j) of a frame, with their error bounds.
 */
#ifndef GBG_ANALYSIS_DENSITY_H
#define GBG_ANALYSIS_DENSITY_H

#include "analysis/modes.h"
#include "core/view.h"

struct gbg_context;

enum gbg_density_method { GBG_DENSITY_AUTO, GBG_DENSITY_MESH, GBG_DENSITY_DIRECT };

/* What is wanted and what it would take. */
struct gbg_density_plan {
    int dimension, channels;
    int64_t n; /* particles in all channels */
    double tolerance;
    int method;
    int32_t cells[3]; /* of the mesh */
    double mesh_bytes, direct_bytes, mesh_seconds, direct_seconds;
};

/* With N the particles of a channel or of all, mode m of the last frame obeys
 *   |d rho| <= N (alias[m] + gain[m] rounding),
 * and is typically off by sqrt(N) sqrt(alias_root[m]^2 + (gain[m] rounding_typical)^2). */
struct gbg_density {
    struct gbg_context *context;
    int dimension, channels;
    int64_t n;
    const struct gbg_modes *modes;
    double *rho; /* [channel][mode][real, imaginary] */
    double *alias, *alias_root, *gain;
    double rounding, rounding_typical;
    struct gbg_density_mesh *mesh; /* one of the two */
    struct gbg_density_direct *direct;
};

/* Fills in cells and the estimates, and turns method AUTO into the cheaper one. */
void gbg_density_weigh(const struct gbg_modes *modes, struct gbg_density_plan *plan);
/* Only modes->reach and modes->count need to be set for weighing; making needs the list. */
int gbg_density_make(struct gbg_context *context, const struct gbg_modes *modes,
                     const struct gbg_density_plan *plan, struct gbg_density **density);
/* points: finite; as many in each channel as any frame before. channel of each particle, counted
 * from base; NULL: all in channel 0. The same bits for any number of threads. */
void gbg_density_run(struct gbg_density *density, const struct gbg_points *points,
                     const double *lengths, const int32_t *channel, int base);
void gbg_density_free(struct gbg_density *density);
/* Largest bound of |d rho|/sqrt(N) over the modes of the last frame. */
double gbg_density_bound(const struct gbg_density *density);
/* Width of the window; 0 for the direct sum. Cells of the mesh. */
int gbg_density_width(const struct gbg_density *density, int32_t *cells);

/* The two ways (mesh.c and direct.c); only density.c calls them. */
int gbg_density_mesh_make(struct gbg_density *density, const struct gbg_density_plan *plan);
void gbg_density_mesh_run(struct gbg_density *density, const struct gbg_points *points,
                          const double *lengths, const int32_t *channel, int base);
void gbg_density_mesh_free(struct gbg_density_mesh *mesh);
int gbg_density_mesh_width(const struct gbg_density_mesh *mesh, int32_t *cells);
int gbg_density_direct_make(struct gbg_density *density);
void gbg_density_direct_run(struct gbg_density *density, const struct gbg_points *points,
                            const double *lengths, const int32_t *channel, int base);
void gbg_density_direct_free(struct gbg_density_direct *direct);

/* Bytes of the direct sum's tables for these modes. */
double gbg_density_direct_bytes(const struct gbg_modes *modes);

#define GBG_UNIT_ROUNDOFF 0x1p-53

#endif
