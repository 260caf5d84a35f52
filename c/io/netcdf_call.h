/* Side room io: calls of netCDF's library: one at a time, the first failure kept. */
#ifndef GBG_IO_NETCDF_CALL_H
#define GBG_IO_NETCDF_CALL_H

#include <netcdf.h>

#include "core/context.h"
#include "core/file.h"

/* A series of calls on one file: after the first failure the others are not made. */
struct gbg_netcdf {
    int file; /* netCDF's id */
    int code; /* of the first failure, else NC_NOERR */
};

/* GBG_CALL(&series, nc_enddef(id)): under the lock, unless something failed before. */
#define GBG_CALL(series, call)                                                                     \
    do {                                                                                           \
        if ((series)->code == NC_NOERR) {                                                          \
            gbg_file_netcdf_lock();                                                                \
            (series)->code = (call);                                                               \
            gbg_file_netcdf_unlock();                                                              \
        }                                                                                          \
    } while (0)

/* GBG_OK, or the failure as "PATH: cannot WHAT: netCDF's words". */
int gbg_netcdf_status(struct gbg_context *context, const struct gbg_netcdf *series,
                      const char *what, const char *path);

/* Closes the file, also after a failure. */
void gbg_netcdf_close(struct gbg_netcdf *series);

/* Attributes of a variable, or of the file with NC_GLOBAL. */
void gbg_netcdf_text(struct gbg_netcdf *series, int variable, const char *name, const char *text);
void gbg_netcdf_integer(struct gbg_netcdf *series, const char *name, int value);
void gbg_netcdf_reals(struct gbg_netcdf *series, const char *name, int n, const double *values);

#endif
