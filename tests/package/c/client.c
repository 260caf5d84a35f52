/* A client of the package: a refusal with its message, then the version. */
#include <gamboge/gamboge.h>

#include <stdio.h>
#include <string.h>

/* Prints the sentence of a call that failed and returns 1. */
static int failed(const struct gbg_context *context, int status)
{
    if (status == GBG_OK) {
        return 0;
    }
    printf("%s: %s\n", gbg_status_name(status), gbg_message(context));
    return 1;
}

int main(void)
{
    struct gbg_context *context = NULL;
    if (gbg_context_create("abacus", &context) != GBG_E_NAME || !strstr(gbg_message(NULL), "abacus")) {
        puts("an unknown backend was not refused");
        return 1;
    }
    if (failed(NULL, gbg_context_create("cpu:threads=1", &context))) {
        return 1;
    }
    int bad = !gbg_has_component("openmp") && gbg_has_component("abacus");
    gbg_context_destroy(&context);
    printf("%s (headers %s): %s\n", gbg_version_text(), GBG_VERSION, bad ? "wrong" : "right");
    return bad;
}
