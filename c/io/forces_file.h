/* Side room io: the forces on all particles as a netCDF file. */
#ifndef GBG_IO_FORCES_FILE_H
#define GBG_IO_FORCES_FILE_H

#include <stdint.h>

struct gbg_engine;
struct gbg_engine_view;

/* A measured error of the forces, for the file's attributes. */
struct gbg_force_error {
    int64_t samples; /* 0: not measured */
    double over_rms, over_median;
};

/* forces(atom,dim), positions(atom,dim), species(atom) from 1, id(atom), in the order of ids. */
int gbg_forces_write(struct gbg_engine *engine, const struct gbg_engine_view *view,
                     const struct gbg_force_error *error, const char *path);

#endif
