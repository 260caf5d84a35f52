/* A driver of GPUs that has none, in the place of the real one: what the CUDA runtime asks of it at
 * the start. The environment says which: GBG_DRIVER_VERSION (13000: CUDA 13.0), GBG_DRIVER_ERROR
 * (100: no device). */
#include <stdlib.h>
#include <string.h>

static int number(const char *name)
{
    const char *text = getenv(name);
    return text ? atoi(text) : 0;
}

int cuDriverGetVersion(int *version)
{
    *version = number("GBG_DRIVER_VERSION");
    return 0;
}

int cuInit(unsigned flags)
{
    (void)flags;
    return number("GBG_DRIVER_ERROR");
}

/* Every other function of the driver. */
static int refuse(void)
{
    return number("GBG_DRIVER_ERROR");
}

int cuGetProcAddress_v2(const char *symbol, void **function, int version, unsigned long long flags,
                        int *found)
{
    (void)version;
    (void)flags;
    *function = (void *)refuse;
    if (strcmp(symbol, "cuInit") == 0) {
        *function = (void *)cuInit;
    } else if (strcmp(symbol, "cuDriverGetVersion") == 0) {
        *function = (void *)cuDriverGetVersion;
    } else if (strcmp(symbol, "cuGetProcAddress") == 0) {
        *function = (void *)cuGetProcAddress_v2;
    }
    if (found) {
        *found = 0;
    }
    return 0;
}

int cuGetProcAddress(const char *symbol, void **function, int version, unsigned long long flags)
{
    return cuGetProcAddress_v2(symbol, function, version, flags, NULL);
}
