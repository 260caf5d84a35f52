/* Side room io: calls of netCDF's library. */
#include "io/netcdf_call.h"

#include <string.h>

/* Positive codes are errno values, which netCDF hands through. */
int gbg_netcdf_status(struct gbg_context *context, const struct gbg_netcdf *series,
                      const char *what, const char *path)
{
    char text[GBG_ERROR_TEXT];
    if (series->code == NC_NOERR) {
        return GBG_OK;
    }
    const char *words =
        series->code > 0 ? gbg_file_error(series->code, text) : nc_strerror(series->code);
    int status = series->code == NC_ENOMEM ? GBG_E_MEMORY : GBG_E_FILE;
    return gbg_fail(context, status, "%s: cannot %s: %s", path, what, words);
}

void gbg_netcdf_text(struct gbg_netcdf *series, int variable, const char *name, const char *text)
{
    GBG_CALL(series, nc_put_att_text(series->file, variable, name, strlen(text), text));
}

void gbg_netcdf_integer(struct gbg_netcdf *series, const char *name, int value)
{
    GBG_CALL(series, nc_put_att_int(series->file, NC_GLOBAL, name, NC_INT, 1, &value));
}

void gbg_netcdf_reals(struct gbg_netcdf *series, const char *name, int n, const double *values)
{
    GBG_CALL(series,
             nc_put_att_double(series->file, NC_GLOBAL, name, NC_DOUBLE, (size_t)n, values));
}

void gbg_netcdf_close(struct gbg_netcdf *series)
{
    gbg_file_netcdf_lock();
    int code = nc_close(series->file);
    gbg_file_netcdf_unlock();
    series->code = series->code == NC_NOERR ? code : series->code;
}
