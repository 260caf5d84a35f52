/* Public: the engine: state, plan and run. */
#ifndef GAMBOGE_ENGINE_H
#define GAMBOGE_ENGINE_H

#include <stddef.h>
#include <stdint.h>

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

struct gbg_engine;

/* Plans the scene and allocates everything that running needs. The scene may be changed or
 * destroyed afterwards. A start with overlapping hard cores is refused with both ids. */
GBG_API int gbg_engine_create(struct gbg_scene *scene, struct gbg_engine **engine);
GBG_API int gbg_engine_destroy(struct gbg_engine **engine);

/* Advances by `steps` steps (>= 0). GBG_E_STEP: a step could not be made; the state is that after
 * the last good step, and the message estimates the largest dt that would do. */
GBG_API int gbg_engine_run(struct gbg_engine *engine, int64_t steps);

/* Number of particles and dimension. */
GBG_API int gbg_engine_size(const struct gbg_engine *engine, int64_t *n, int *dimension);
GBG_API int gbg_engine_box(const struct gbg_engine *engine, double *lengths, double *origin);

/* Coordinates of all n particles in the order in which they were added. wrapped: 1 inside the box,
 * 0 unwrapped (needs the scene option output.trajectory.unwrapped). z NULL in two dimensions. */
GBG_API int gbg_engine_positions(struct gbg_engine *engine, int wrapped, int64_t n, double *x,
                                 double *y, double *z, ptrdiff_t step);
/* Replaces the coordinates (same order); where hard cores overlap they are refused, or parted first
 * if the scene has excluded_volume.start relax. What is refused leaves the old coordinates. */
GBG_API int gbg_engine_set_positions(struct gbg_engine *engine, int64_t n, const double *x,
                                     const double *y, const double *z, ptrdiff_t step);
/* Forces on all particles at the present positions, in the order in which they were added. */
GBG_API int gbg_engine_forces(struct gbg_engine *engine, int64_t n, double *x, double *y, double *z,
                              ptrdiff_t step);
/* Measured error of those forces on `samples` particles: RMS(dF)/RMS(F) and RMS(dF)/median|F|,
 * against direct sums in double precision, of sums over all images against one without a mesh.
 * samples <= 0: 1000. */
GBG_API int gbg_engine_force_error(struct gbg_engine *engine, int64_t samples, double *rms_over_rms,
                                   double *rms_over_median);
/* The sum over all images of force `force` of the scene (from 0): relative RMS error asked for, by
 * the parameter model, and as it was measured on 1000 particles when the run started or the density
 * contrast had changed since (-1: not yet, or the force has check false); how often it was refined
 * to keep to its tolerance. Any output may be NULL. GBG_E_ARGUMENT for another kind of sum. */
GBG_API int gbg_engine_get_sum(const struct gbg_engine *engine, int force, double *tolerance,
                               double *predicted, double *measured, int *refined);
/* Species counted from base (0 or 1) and permanent ids, same order. */
GBG_API int gbg_engine_species(struct gbg_engine *engine, int64_t n, int32_t *species, int base);
GBG_API int gbg_engine_ids(struct gbg_engine *engine, int64_t n, int64_t *ids);
/* 1 for each particle that took part in an overlap during the last step, else 0; needs the scene
 * option output.trajectory.overlap. */
GBG_API int gbg_engine_overlapped(struct gbg_engine *engine, int64_t n, int32_t *flags);

/* Counters and quantities by name. Integers: "step", "particles", "species", "threads",
 * "list_builds", "contact_rounds" (sum over steps), "contact_pairs" (pushes, sum over steps),
 * "repeated" (steps whose contacts were corrected once more, because pushes of several contacts had
 * carried a pair through each other or because rounds ran out) and "reverted" (particles put back to
 * where they were before the step because they overlapped or had passed through another after all
 * corrections; both sums over steps), "events_left" (rule event, sum over steps: particles that had as
 * many collisions in a step as the rule allows, went on straight and were parted in rounds),
 * "unsettled" (rule bridge with forces over all pairs, sum over steps: solves that came to their limit
 * of rounds before all pushes had settled) and "unsettled_pairs" (pushes of the rounds that parted
 * what those left overlapping: few beside contact_pairs where the solves were good enough),
 * "overlaps_left" (pairs that overlap now, counted afresh over
 * all cells). Reals: "time", "dt", "seconds" (spent in the steps of run), "check_seconds" (spent
 * there in measuring sums over all images), "largest_move" (free move, last step),
 * "packing", "bytes_per_particle", "reverted_fraction" (reverted over the moves that this engine
 * made), "contact_virial": sum over steps and contact pushes of the distance of the pair half way
 * through the push times the displacement of one of its two particles; the pressure of n particles
 * follows as Z = 1 + 2 contact_virial/(dimension n T time), Foss and Brady's displacement stress. */
GBG_API int gbg_engine_integer(struct gbg_engine *engine, const char *name, int64_t *value);
GBG_API int gbg_engine_real(const struct gbg_engine *engine, const char *name, double *value);

/* The plan, a line a step: "kernel | what | bytes a particle"; text gets at most capacity bytes. */
GBG_API int gbg_engine_plan_size(const struct gbg_engine *engine, int *lines);
GBG_API int gbg_engine_plan_line(const struct gbg_engine *engine, int line, int64_t capacity,
                                 char *text);

/* Restart file: checksummed, written to a temporary name, synced and renamed; the file that was
 * there before is kept as PATH.previous. load needs an engine made from the same scene and
 * continues bit for bit; a file that is damaged or of another scene is refused. */
GBG_API int gbg_engine_save(struct gbg_engine *engine, const char *path);
GBG_API int gbg_engine_load(struct gbg_engine *engine, const char *path);
/* SHA-256 of step, ids and fixed-point positions in the order of ids, as 64 hexadecimal digits;
 * text needs 65 bytes. */
GBG_API int gbg_engine_hash(struct gbg_engine *engine, int64_t capacity, char *text);

#ifdef __cplusplus
}
#endif
#endif
