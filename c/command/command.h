/* Command: what the files of the program share: option tables, arguments, messages, outputs. */
#ifndef GBG_COMMAND_COMMAND_H
#define GBG_COMMAND_COMMAND_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "gamboge/gamboge.h"

/* What the program tells the shell. */
enum gbg_exit { GBG_EXIT_DONE = 0, GBG_EXIT_FAILED = 1, GBG_EXIT_USE = 2 };

#define GBG_PI 3.14159265358979323846

enum { GBG_OPTIONS_MOST = 12, GBG_PATH_MOST = 4096, GBG_TEXT_MOST = 256 };

enum gbg_option_kind { GBG_FLAG, GBG_INTEGER, GBG_REAL, GBG_TEXT, GBG_CHOICE };

/* One option of a command; the same entry parses it, checks it and prints its help. */
struct gbg_option {
    const char *name;    /* without the dashes; NULL ends a table */
    const char *value;   /* word for the value in the help; for GBG_CHOICE "a|b|c" */
    const char *meaning; /* one line */
    int kind;            /* enum gbg_option_kind */
    double low, high;    /* range of numbers */
    int required;
};

struct gbg_arguments;

struct gbg_command {
    const char *name;
    const char *operand; /* word for the one operand in the help; "[WORD]": may be left out; NULL:
                          * the command has none */
    const char *summary;
    int (*run)(const struct gbg_arguments *arguments); /* returns enum gbg_exit */
    struct gbg_option options[GBG_OPTIONS_MOST];
};

struct gbg_arguments {
    const struct gbg_command *command;
    const char *operand;
    struct {
        int given;
        const char *text;
        double real;
        int64_t integer;
    } value[GBG_OPTIONS_MOST];
};

/* All commands, ended by an entry without a name. */
extern const struct gbg_command gbg_commands[];

/* Reads the words after the command's name. 0, or GBG_EXIT_USE after a sentence on stderr. */
int gbg_arguments_read(const struct gbg_command *command, int count, char **words,
                       struct gbg_arguments *arguments);
/* Value of an option that the command's table has; the fallback when it was not given. */
int gbg_given(const struct gbg_arguments *arguments, const char *option);
const char *gbg_text_of(const struct gbg_arguments *arguments, const char *option,
                        const char *fallback);
double gbg_real_of(const struct gbg_arguments *arguments, const char *option, double fallback);
int64_t gbg_integer_of(const struct gbg_arguments *arguments, const char *option, int64_t fallback);
void gbg_print_help(FILE *to, const struct gbg_command *command);

/* Prints "gamboge: sentence" on stderr and returns `exit_status`. */
int gbg_complain(int exit_status, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* The same with the library's own sentence. */
int gbg_complain_library(int exit_status, const struct gbg_context *context);

/* What the program ends with after a refusal of its input that had this status: bad use, unless
 * memory or the GPU failed, or what was asked for is not in this build or this machine. */
int gbg_exit_of(int status);

/* A context of the default backend whose warnings go to stderr; backend NULL: auto, threads 0: the
 * machine's. GBG_EXIT_DONE, or the exit status after a complaint. */
int gbg_open_context(const char *backend, int64_t threads, struct gbg_context **context);

/* Where the kernels run and, if auto could not take a GPU, why. Static storage. */
const char *gbg_backend_text(const struct gbg_context *context);

/* 1 if `path` ends in `suffix`, letters of either case. */
int gbg_has_suffix(const char *path, const char *suffix);
/* Last component of a path. */
const char *gbg_base_name(const char *path);
/* Refuses, with a complaint, an output that could not be written or that would replace `input`
 * (NULL: none): GBG_EXIT_DONE or GBG_EXIT_USE. Touches nothing. */
int gbg_check_output(const char *path, const char *input);
/* The name PATH.partial; GBG_EXIT_USE when it would be too long. */
int gbg_partial_name(const char *path, char name[GBG_PATH_MOST]);

/* "1 234 567", "2.5 min", "3.2 MB": numbers for people. Static storage of four texts in turn. */
const char *gbg_count_text(int64_t count);
const char *gbg_duration_text(double seconds);

/* Area (two dimensions) or volume of a core. */
double gbg_core_size(int dimension, double diameter);

/* A species' colour for place `index` of the palette, red, green, blue in 0..1; colours that people
 * with any common colour blindness can tell apart. */
void gbg_palette(int index, double colour[3]);

int gbg_command_check(const struct gbg_arguments *arguments);
int gbg_command_run(const struct gbg_arguments *arguments);
int gbg_command_verify(const struct gbg_arguments *arguments);
int gbg_command_forces(const struct gbg_arguments *arguments);
int gbg_command_sk(const struct gbg_arguments *arguments);
int gbg_command_render(const struct gbg_arguments *arguments);
int gbg_command_plot(const struct gbg_arguments *arguments);
int gbg_command_bench(const struct gbg_arguments *arguments);
int gbg_command_info(const struct gbg_arguments *arguments);

#endif
