/* Command: the program gamboge: help and the dispatch to its commands. */
#include <stdlib.h>
#include <string.h>

#include "command/command.h"
#include "core/text.h"

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
