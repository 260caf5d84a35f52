/* Command: the program gamboge: its commands and their options, and the dispatch to them. */
#include <stdlib.h>
#include <string.h>

#include "command/command.h"
#include "core/text.h"

#define ANY_INTEGER 9007199254740992.0
#define END_OF_OPTIONS                                                                             \
    {                                                                                              \
        0                                                                                          \
    }
#define BACKEND                                                                                    \
    {                                                                                              \
        "backend", "NAME", "cpu, poison, cuda:N or auto (default)", GBG_TEXT, 0, 0, 0              \
    }
#define THREADS                                                                                    \
    {                                                                                              \
        "threads", "N", "threads (default: the machine's)", GBG_INTEGER, 1, 1024, 0                \
    }
#define FIRST                                                                                      \
    {                                                                                              \
        "first", "I", "first frame, from 0 (default 0)", GBG_INTEGER, 0, ANY_INTEGER, 0            \
    }
#define LAST                                                                                       \
    {                                                                                              \
        "last", "I", "last frame (default: that of the file)", GBG_INTEGER, 0, ANY_INTEGER, 0      \
    }
#define STRIDE                                                                                     \
    {                                                                                              \
        "stride", "N", "every N-th frame (default 1)", GBG_INTEGER, 1, ANY_INTEGER, 0              \
    }

const struct gbg_command gbg_commands[] = {
    {"check",
     "SCENE",
     "validates a scene and prints what it resolves to and the plan",
     gbg_command_check,
     {BACKEND, THREADS, END_OF_OPTIONS}},
    {"run",
     "SCENE",
     "simulates a scene",
     gbg_command_run,
     {BACKEND,
      THREADS,
      {"steps", "N", "step at which the run ends (default: the scene's)", GBG_INTEGER, 0,
       ANY_INTEGER, 0},
      {"out", "T.nc", "trajectory (default: the scene's)", GBG_TEXT, 0, 0, 0},
      {"restart", "R", "goes on from a restart file, and with its trajectory", GBG_TEXT, 0, 0, 0},
      {"seed", "S", "seed of the noise (default: the scene's)", GBG_INTEGER, 0, 4294967295.0, 0},
      {"hash", NULL, "prints the SHA-256 of the final state", GBG_FLAG, 0, 0, 0},
      {"quiet", NULL, "prints errors only", GBG_FLAG, 0, 0, 0},
      END_OF_OPTIONS}},
    {"verify",
     "T.nc",
     "checks every frame by code that is not the solver's: exit status 1 if any "
     "particles overlap or passed through each other, or a coordinate is bad",
     gbg_command_verify,
     {FIRST,
      LAST,
      STRIDE,
      {"most", "N", "violations to print (default 5)", GBG_INTEGER, 0, 1e9, 0},
      END_OF_OPTIONS}},
    {"forces",
     "SCENE",
     "writes the forces on the start of a scene",
     gbg_command_forces,
     {BACKEND,
      THREADS,
      {"out", "F.nc", "netCDF file of forces, positions and species", GBG_TEXT, 0, 0, 1},
      END_OF_OPTIONS}},
    {"render",
     "T.nc",
     "draws a frame, discs to scale, as PNG or SVG",
     gbg_command_render,
     {{"out", "P.png", "picture; the suffix .png or .svg decides", GBG_TEXT, 0, 0, 1},
      {"frame", "I", "frame, from 0; -1 the last (default)", GBG_INTEGER, -1, ANY_INTEGER, 0},
      {"colour", "type|overlap", "by species (default) or by having taken part in an overlap",
       GBG_CHOICE, 0, 0, 0},
      {"width", "PX", "width in pixels (default 1200)", GBG_INTEGER, 200, 16000, 0},
      END_OF_OPTIONS}},
    {"plot",
     "S.nc",
     "draws S(k) with its error bars (needs gnuplot)",
     gbg_command_plot,
     {{"out", "P.png", "picture; the suffix .png or .svg decides", GBG_TEXT, 0, 0, 1},
      {"width", "PX", "width in pixels (default 1200)", GBG_INTEGER, 200, 16000, 0},
      END_OF_OPTIONS}},
    {"info",
     NULL,
     "version, components, backend and limits of this build",
     gbg_command_info,
     {END_OF_OPTIONS}},
    {0},
};

static const struct gbg_command *find_command(const char *name)
{
    for (const struct gbg_command *command = gbg_commands; command->name; command++) {
        if (strcmp(command->name, name) == 0) {
            return command;
        }
    }
    const char *names[32] = {"help"};
    int n = 1;
    for (const struct gbg_command *command = gbg_commands; command->name; command++) {
        names[n++] = command->name;
    }
    gbg_complain(GBG_EXIT_USE,
                 "there is no command \"%s\"; the nearest is %s (gamboge help lists "
                 "them)",
                 name, gbg_text_nearest(name, names));
    return NULL;
}

static void print_overview(FILE *to)
{
    fprintf(to, "gamboge: Brownian dynamics of chemically active hard colloids\n\n");
    for (const struct gbg_command *command = gbg_commands; command->name; command++) {
        char left[32];
        snprintf(left, sizeof left, "%s %s", command->name,
                 command->operand ? command->operand : "");
        fprintf(to, "  gamboge %-16s %s\n", left, command->summary);
    }
    fprintf(to, "\ngamboge help COMMAND lists its options; gamboge --version.\n"
                "Exit status: 0 done, 1 the run or check failed, 2 bad use or bad scene.\n");
}

static int help(int count, char **words)
{
    if (count == 0) {
        print_overview(stdout);
        return GBG_EXIT_DONE;
    }
    const struct gbg_command *command = find_command(words[0]);
    if (!command) {
        return GBG_EXIT_USE;
    }
    gbg_print_help(stdout, command);
    return GBG_EXIT_DONE;
}

static int asks_help(int count, char **words)
{
    for (int i = 0; i < count && strcmp(words[i], "--") != 0; i++) {
        if (strcmp(words[i], "--help") == 0 || strcmp(words[i], "-h") == 0) {
            return 1;
        }
    }
    return 0;
}

int main(int count, char **words)
{
    if (count < 2) {
        print_overview(stderr);
        return GBG_EXIT_USE;
    }
    const char *first = words[1];
    if (strcmp(first, "--version") == 0) {
        puts(gbg_version_text());
        return GBG_EXIT_DONE;
    }
    if (strcmp(first, "help") == 0 || strcmp(first, "--help") == 0 || strcmp(first, "-h") == 0) {
        return help(count - 2, words + 2);
    }
    const struct gbg_command *command = find_command(first);
    if (!command) {
        return GBG_EXIT_USE;
    }
    if (asks_help(count - 2, words + 2)) {
        gbg_print_help(stdout, command);
        return GBG_EXIT_DONE;
    }
    struct gbg_arguments arguments;
    int status = gbg_arguments_read(command, count - 2, words + 2, &arguments);
    if (status == GBG_EXIT_DONE) {
        status = command->run(&arguments);
    }
    if (fflush(stdout) || ferror(stdout)) {
        return gbg_complain(GBG_EXIT_FAILED, "standard output could not be written");
    }
    return status;
}
