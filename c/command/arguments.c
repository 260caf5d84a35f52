/* Command: words of the command line against a command's option table, and the help made of it. */
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "command/command.h"
#include "core/text.h"

static int option_count(const struct gbg_command *command)
{
    int n = 0;
    while (n < GBG_OPTIONS_MOST && command->options[n].name) {
        n++;
    }
    return n;
}

/* Index of the option named by the first `length` letters of name, -1 if there is none. */
static int find_option(const struct gbg_command *command, const char *name, size_t length)
{
    int n = option_count(command);
    for (int i = 0; i < n; i++) {
        const char *known = command->options[i].name;
        if (strlen(known) == length && strncmp(known, name, length) == 0) {
            return i;
        }
    }
    return -1;
}

static int unknown_option(const struct gbg_command *command, const char *word)
{
    const char *names[GBG_OPTIONS_MOST + 2] = {"help"};
    int n = option_count(command);
    for (int i = 0; i < n; i++) {
        names[i + 1] = command->options[i].name;
    }
    char name[64];
    gbg_text_copy(name, sizeof name, word + strspn(word, "-"));
    name[strcspn(name, "=")] = 0;
    return gbg_complain(GBG_EXIT_USE,
                        "%s: there is no option %s; the nearest is --%s (gamboge help %s lists "
                        "them)",
                        command->name, word, gbg_text_nearest(name, names), command->name);
}

static int read_integer(const struct gbg_option *option, const char *text, int64_t *value)
{
    char *end = NULL;
    errno = 0;
    long long number = strtoll(text, &end, 10);
    if (end == text || *end || errno || (double)number < option->low ||
        (double)number > option->high) {
        return gbg_complain(GBG_EXIT_USE, "--%s %s: an integer from %.0f to %.0f is needed",
                            option->name, text, option->low, option->high);
    }
    *value = number;
    return GBG_EXIT_DONE;
}

static int read_real(const struct gbg_option *option, const char *text, double *value)
{
    char *end = NULL;
    double number = strtod(text, &end);
    if (end == text || *end || !(number >= option->low && number <= option->high)) {
        return gbg_complain(GBG_EXIT_USE, "--%s %s: a number from %g to %g is needed", option->name,
                            text, option->low, option->high);
    }
    *value = number;
    return GBG_EXIT_DONE;
}

static int check_choice(const struct gbg_option *option, const char *text)
{
    size_t length = strlen(text);
    for (const char *choice = option->value; *choice;) {
        size_t size = strcspn(choice, "|");
        if (size == length && strncmp(choice, text, length) == 0) {
            return GBG_EXIT_DONE;
        }
        choice += size + (choice[size] == '|');
    }
    return gbg_complain(GBG_EXIT_USE, "--%s %s: one of %s is needed", option->name, text,
                        option->value);
}

/* Takes an option at words[*at], with its value from the same word (--name=value) or the next. */
static int read_option(struct gbg_arguments *arguments, int count, char **words, int *at)
{
    const char *word = words[*at];
    const char *equals = strchr(word, '=');
    size_t length = equals ? (size_t)(equals - word) - 2 : strlen(word) - 2;
    int index = word[1] == '-' ? find_option(arguments->command, word + 2, length) : -1;
    if (index < 0) {
        return unknown_option(arguments->command, word);
    }
    const struct gbg_option *option = &arguments->command->options[index];
    arguments->value[index].given = 1;
    if (option->kind == GBG_FLAG) {
        return equals ? gbg_complain(GBG_EXIT_USE, "--%s takes no value", option->name)
                      : GBG_EXIT_DONE;
    }
    const char *text = equals ? equals + 1 : NULL;
    if (!text && *at + 1 < count && strncmp(words[*at + 1], "--", 2) != 0) {
        text = words[++*at];
    }
    if (!text || !*text) {
        return gbg_complain(GBG_EXIT_USE, "--%s needs a value: %s", option->name, option->meaning);
    }
    arguments->value[index].text = text;
    switch (option->kind) {
    case GBG_INTEGER:
        return read_integer(option, text, &arguments->value[index].integer);
    case GBG_REAL:
        return read_real(option, text, &arguments->value[index].real);
    case GBG_CHOICE:
        return check_choice(option, text);
    default:
        return GBG_EXIT_DONE;
    }
}

static int check_complete(const struct gbg_arguments *arguments)
{
    const struct gbg_command *command = arguments->command;
    if (command->operand && command->operand[0] != '[' && !arguments->operand) {
        return gbg_complain(GBG_EXIT_USE, "%s needs %s (gamboge help %s)", command->name,
                            command->operand, command->name);
    }
    int n = option_count(command);
    for (int i = 0; i < n; i++) {
        if (command->options[i].required && !arguments->value[i].given) {
            return gbg_complain(GBG_EXIT_USE, "%s needs --%s %s: %s", command->name,
                                command->options[i].name, command->options[i].value,
                                command->options[i].meaning);
        }
    }
    return GBG_EXIT_DONE;
}

int gbg_arguments_read(const struct gbg_command *command, int count, char **words,
                       struct gbg_arguments *arguments)
{
    memset(arguments, 0, sizeof *arguments);
    arguments->command = command;
    int options_end = 0;
    for (int i = 0; i < count; i++) {
        if (!options_end && strcmp(words[i], "--") == 0) {
            options_end = 1;
        } else if (!options_end && words[i][0] == '-' && words[i][1]) {
            int status = read_option(arguments, count, words, &i);
            if (status) {
                return status;
            }
        } else if (!command->operand || arguments->operand) {
            return gbg_complain(GBG_EXIT_USE, "%s: \"%s\" is one word too many (gamboge help %s)",
                                command->name, words[i], command->name);
        } else {
            arguments->operand = words[i];
        }
    }
    return check_complete(arguments);
}

static int index_of(const struct gbg_arguments *arguments, const char *option)
{
    int index = find_option(arguments->command, option, strlen(option));
    return index < 0 ? 0 : index;
}

int gbg_given(const struct gbg_arguments *arguments, const char *option)
{
    return arguments->value[index_of(arguments, option)].given;
}

const char *gbg_text_of(const struct gbg_arguments *arguments, const char *option,
                        const char *fallback)
{
    int index = index_of(arguments, option);
    return arguments->value[index].given ? arguments->value[index].text : fallback;
}

double gbg_real_of(const struct gbg_arguments *arguments, const char *option, double fallback)
{
    int index = index_of(arguments, option);
    return arguments->value[index].given ? arguments->value[index].real : fallback;
}

int64_t gbg_integer_of(const struct gbg_arguments *arguments, const char *option, int64_t fallback)
{
    int index = index_of(arguments, option);
    return arguments->value[index].given ? arguments->value[index].integer : fallback;
}

void gbg_print_help(FILE *to, const struct gbg_command *command)
{
    fprintf(to, "gamboge %s%s%s: %s\n", command->name, command->operand ? " " : "",
            command->operand ? command->operand : "", command->summary);
    int n = option_count(command);
    for (int i = 0; i < n; i++) {
        const struct gbg_option *option = &command->options[i];
        char left[64];
        snprintf(left, sizeof left, "--%s %s", option->name, option->value ? option->value : "");
        fprintf(to, "  %-32s %s%s\n", left, option->meaning, option->required ? " (needed)" : "");
    }
}
