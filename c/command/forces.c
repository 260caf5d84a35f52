/* Command: gamboge forces. */
#include "command/session.h"

static int write_forces(const struct gbg_arguments *arguments, struct gbg_session *session)
{
    const char *out = gbg_text_of(arguments, "out", NULL);
    int status = gbg_check_output(out, arguments->operand);
    status = status ? status : gbg_session_open(arguments, session);
    status = status ? status : gbg_session_start(session);
    if (status) {
        return status;
    }
    if (gbg_engine_write_forces(session->engine, out) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_FAILED, session->context);
    }
    int64_t n;
    gbg_engine_size(session->engine, &n, NULL);
    printf("%s: forces on %s particles\n", out, gbg_count_text(n));
    gbg_session_print_error(session);
    return GBG_EXIT_DONE;
}

int gbg_command_forces(const struct gbg_arguments *arguments)
{
    struct gbg_session session = {0};
    int status = write_forces(arguments, &session);
    gbg_session_close(&session);
    return status;
}
