/* Command: gamboge bench. */
#include "bench/bench.h"
#include "command/command.h"

int gbg_command_bench(const struct gbg_arguments *arguments)
{
    const struct gbg_bench_options options = {
        .name = arguments->operand,
        .backend = gbg_text_of(arguments, "backend", NULL),
        .json = gbg_text_of(arguments, "json", NULL),
        .n = gbg_integer_of(arguments, "n", 0),
        .threads = (int)gbg_integer_of(arguments, "threads", 0),
        .quick = gbg_given(arguments, "quick"),
        .only = gbg_text_of(arguments, "only", NULL),
        .seconds = gbg_real_of(arguments, "seconds", 0.0),
    };
    int status = options.json ? gbg_check_output(options.json, NULL) : GBG_EXIT_DONE;
    return status ? status : gbg_bench_main(&options);
}
