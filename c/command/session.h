/* Command: a scene file read, the options of the command line put over it, and its engine. */
#ifndef GBG_COMMAND_SESSION_H
#define GBG_COMMAND_SESSION_H

#include "command/command.h"

struct gbg_session {
    struct gbg_context *context;
    struct gbg_scene *scene;
    struct gbg_engine *engine;
};

/* Opens context and scene (operand, --backend, --threads). GBG_EXIT_DONE, or GBG_EXIT_USE after a
 * complaint. gbg_session_close belongs after it in either case. */
int gbg_session_open(const struct gbg_arguments *arguments, struct gbg_session *session);
/* Makes the engine; overrides must be in the scene by then. */
int gbg_session_start(struct gbg_session *session);
void gbg_session_close(struct gbg_session *session);

/* Options of the scene; the fallback when the scene has none of that name. */
double gbg_session_real(const struct gbg_session *session, const char *option, double fallback);
int64_t gbg_session_integer(const struct gbg_session *session, const char *option,
                            int64_t fallback);
/* Static storage, good until the next call; "" when there is none. */
const char *gbg_session_text(const struct gbg_session *session, const char *option);

/* One line: the measured error of the forces, as far as it can be stated. */
void gbg_session_print_error(const struct gbg_session *session);

#endif
