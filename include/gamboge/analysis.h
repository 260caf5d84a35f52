/* Public: analysis after (or during) a run: the structure factor with its errors. */
#ifndef GAMBOGE_ANALYSIS_H
#define GAMBOGE_ANALYSIS_H

#include <stddef.h>
#include <stdint.h>

#include "context.h"

#ifdef __cplusplus
extern "C" {
#endif

struct gbg_analysis;

/* A structure factor of dimension 2 or 3 in a periodic box with the given lengths, over n_species
 * species (1..10). S(k) = <|rho_k|^2>/N; partials S_ab = <Re rho_a rho_b*>/sqrt(N_a N_b)
 * (Ashcroft-Langreth); k = 0 is never part of a shell. */
GBG_API int gbg_analysis_create(struct gbg_context *context, int dimension, const double *lengths,
                                int n_species, struct gbg_analysis **analysis);
GBG_API int gbg_analysis_destroy(struct gbg_analysis **analysis);

/* Settings, before the first frame. Reals: "k_max" (1/length; default 8 pi over the mean particle
 * distance, less where the mesh would not fit into memory_limit), "tolerance" (bound of aliasing in
 * |d rho|/sqrt(N), default 1e-6; rounding adds what "S_numerr" says), "shell_width" (default 2 pi
 * over the largest box length), "memory_limit" (bytes for mesh and modes, default 2^32). Texts:
 * "method" (auto, mesh, direct), "partials" (no, yes). Unknown names are refused, with the nearest
 * one. */
GBG_API int gbg_analysis_set_real(struct gbg_analysis *analysis, const char *option, double value);
GBG_API int gbg_analysis_set_text(struct gbg_analysis *analysis, const char *option,
                                  const char *value);

/* Adds a frame. Coordinates as in gbg_scene_add_particles; species counted from base, NULL: all the
 * first; the numbers of particles of each species must be those of the first frame. lengths: NULL,
 * or the frame's own box. storage_error: absolute error of a stored coordinate, 0 for none
 * (float32 files have about 6e-8 |x|). Lower corner of the box at the origin or anywhere. */
GBG_API int gbg_analysis_add_frame(struct gbg_analysis *analysis, int64_t n, const double *x,
                                   const double *y, const double *z, ptrdiff_t step,
                                   const int32_t *species, int base, const double *lengths,
                                   double storage_error);

/* Number of shells and frames so far. */
GBG_API int gbg_analysis_size(const struct gbg_analysis *analysis, int64_t *shells,
                              int64_t *frames);
/* A quantity for each shell: "k" (mean of |k|), "k_low", "k_high", "n_modes" (half space), "S",
 * "S_stderr" (statistical, blocked over frames), "S_numerr" (hard bound), "S_numerr_typ"
 * (estimate), "S_storage_err". */
GBG_API int gbg_analysis_get(struct gbg_analysis *analysis, const char *quantity, int64_t capacity,
                             double *values);
/* Partial structure factor of species a, b (from 0) and its statistical error. */
GBG_API int gbg_analysis_get_partial(struct gbg_analysis *analysis, int a, int b, int64_t capacity,
                                     double *values, double *errors);
/* What was chosen: "mesh 512x512, Kaiser-Bessel w=8, sigma 2.0, bound 1.9e-07" or "direct". */
GBG_API int gbg_analysis_describe(struct gbg_analysis *analysis, int64_t capacity, char *text);

/* Name of a species for the file, and free-text attributes ("title", "input_files",
 * "input_sha256", "history"). */
GBG_API int gbg_analysis_set_species_name(struct gbg_analysis *analysis, int species,
                                          const char *name);
GBG_API int gbg_analysis_set_attribute(struct gbg_analysis *analysis, const char *name,
                                       const char *value);
/* CF netCDF-4 file, written to a temporary name, synced and renamed. */
GBG_API int gbg_analysis_write(struct gbg_analysis *analysis, const char *path);

#ifdef __cplusplus
}
#endif
#endif
