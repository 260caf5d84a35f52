/* L4: contexts, statuses and what this build has. */
#include "gamboge/context.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _OPENMP
#include <omp.h>
#endif

#include "backend/backend.h"
#include "core/context.h"
#include "core/text.h"
#include "version.h"

enum { MOST_THREADS = 1024 };

static int default_threads(void)
{
#ifdef _OPENMP
    return omp_get_max_threads();
#else
    return 1;
#endif
}

/* One of threads=N, isa=NAME or a device number, `length` letters long; 0 if it is none of them. */
static int parse_option(const char *text, size_t length, struct gbg_context *context)
{
    static const char threads[] = "threads=", isa[] = "isa=";
    if (length > strlen(isa) && strncmp(text, isa, strlen(isa)) == 0) {
        length -= strlen(isa);
        if (length >= sizeof context->instructions) {
            return 0;
        }
        memcpy(context->instructions, text + strlen(isa), length);
        context->instructions[length] = 0;
        return 1;
    }
    const char *digits = text;
    int counts = strncmp(text, threads, strlen(threads)) == 0;
    if (counts) {
        digits += strlen(threads);
    }
    char *end = NULL;
    long number = strtol(digits, &end, 10);
    if (end == digits || end != text + length || number < counts || number > MOST_THREADS) {
        return 0;
    }
    *(counts ? &context->threads : &context->device) = (int)number;
    context->threads_given |= counts;
    return 1;
}

/* "name[:option[,option]]" */
static int parse_backend(const char *text, struct gbg_context *context)
{
    size_t length = strcspn(text, ":");
    if (length == 0 || length >= sizeof context->backend) {
        return gbg_fail(NULL, GBG_E_NAME,
                        "gbg_context_create: backend \"%s\" is none of cpu, "
                        "cpu:threads=N, poison, cuda:N, auto",
                        text);
    }
    memcpy(context->backend, text, length);
    context->backend[length] = 0;
    const char *rest = text + length;
    while (*rest) {
        rest++;
        length = strcspn(rest, ",");
        if (!parse_option(rest, length, context)) {
            return gbg_fail(NULL, GBG_E_ARGUMENT,
                            "gbg_context_create: \"%s\": after the colon "
                            "come, separated by commas, threads=N with N from 1 to %d, isa=NAME, "
                            "or a device number",
                            text, MOST_THREADS);
        }
        rest += length;
    }
    return GBG_OK;
}

/* Asks a backend whether it can run here; on failure the sentence is in the context. */
static int probe(struct gbg_context *context, const char *name)
{
    const struct gbg_backend *backend = gbg_backend_find(name);
    if (!backend) {
        return gbg_fail(context, GBG_E_NAME,
                        "no backend \"%s\"; there are cpu, poison, cuda and auto", name);
    }
    strcpy(context->backend, backend->name);
    return backend->probe(context);
}

/* auto: a GPU if there is one to use, else the CPU, with the reason. Threads and instruction sets
 * are the CPU's: who names them wants it. */
static int choose(struct gbg_context *context)
{
    int for_cpu = context->threads_given || context->instructions[0];
    if (for_cpu || !gbg_has_component("cuda")) {
        return probe(context, "cpu");
    }
    if (probe(context, "cuda") == GBG_OK) {
        snprintf(context->choice, sizeof context->choice, "auto takes cuda:%d, %s", context->device,
                 context->card);
        return GBG_OK;
    }
    static const char who[] = "backend cuda: ";
    const char *why = context->message;
    why += strncmp(why, who, strlen(who)) == 0 ? strlen(who) : 0;
    snprintf(context->choice, sizeof context->choice, "auto takes cpu: %.280s", why);
    context->message[0] = context->instructions[0] = 0;
    return probe(context, "cpu");
}

/* The instruction set of the processor for what is not the backend's. */
static void note_host(struct gbg_context *context)
{
    struct gbg_context other = {.threads = context->threads};
    const char *set = context->instructions;
    if (strcmp(context->backend, "cuda") == 0) {
        set = probe(&other, "cpu") == GBG_OK ? other.instructions : "generic";
    }
    gbg_text_copy(context->host, sizeof context->host, set);
}

int gbg_context_create(const char *backend, struct gbg_context **context)
{
    if (!context) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "gbg_context_create: context is NULL");
    }
    *context = NULL;
    struct gbg_context made = {.threads = default_threads()};
    int status = parse_backend(backend ? backend : "auto", &made);
    if (status != GBG_OK) {
        return status;
    }
    struct gbg_context *fresh = malloc(sizeof *fresh);
    if (!fresh) {
        return gbg_fail(NULL, GBG_E_MEMORY, "gbg_context_create: %zu bytes could not be had",
                        sizeof *fresh);
    }
    *fresh = made;
    status = strcmp(made.backend, "auto") == 0 ? choose(fresh) : probe(fresh, made.backend);
    if (status != GBG_OK) {
        gbg_fail(NULL, status, "gbg_context_create: %s%s", fresh->message,
                 status == GBG_E_UNBUILT ? "; cpu and auto work without it" : "");
        free(fresh);
        return status;
    }
    note_host(fresh);
    *context = fresh;
    return GBG_OK;
}

int gbg_context_destroy(struct gbg_context **context)
{
    if (context) {
        free(*context);
        *context = NULL;
    }
    return GBG_OK;
}

const char *gbg_message(const struct gbg_context *context)
{
    return gbg_message_of(context);
}

int gbg_context_set_log(struct gbg_context *context, gbg_log_sink sink, void *user)
{
    if (!context) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "gbg_context_set_log: context is NULL");
    }
    context->sink = sink;
    context->sink_user = user;
    return GBG_OK;
}

int gbg_context_backend(const struct gbg_context *context, const char **name,
                        const char **instructions, int *threads)
{
    if (!context) {
        return gbg_fail(NULL, GBG_E_ARGUMENT, "gbg_context_backend: context is NULL");
    }
    if (name) {
        *name = context->backend;
    }
    if (instructions) {
        *instructions = context->instructions;
    }
    if (threads) {
        *threads = context->threads;
    }
    return GBG_OK;
}

const char *gbg_status_name(int status)
{
    switch (status) {
#define NAME_CASE(name, value, meaning, remedy)                                                    \
    case value:                                                                                    \
        return #name;
        GBG_STATUS_LIST(NAME_CASE)
#undef NAME_CASE
    }
    return "unknown status";
}

const char *gbg_status_text(int status)
{
    switch (status) {
#define TEXT_CASE(name, value, meaning, remedy)                                                    \
    case value:                                                                                    \
        return meaning;
        GBG_STATUS_LIST(TEXT_CASE)
#undef TEXT_CASE
    }
    return "unknown status";
}

static const char *const components[] = {
#ifdef GBG_WITH_FFTW
    "fftw",
#endif
#ifdef GBG_WITH_NETCDF
    "netcdf",
#endif
#ifdef GBG_WITH_CYAML
    "yaml",
#endif
#ifdef _OPENMP
    "openmp",
#endif
#ifdef GBG_WITH_CUDA
    "cuda",
#endif
    NULL};

int gbg_has_component(const char *component)
{
    return component && gbg_text_find(component, components) >= 0;
}

const char *gbg_version_text(void)
{
    static const char text[] = "gamboge " GBG_VERSION
#ifdef GBG_WITH_NETCDF
                               " netcdf"
#endif
#ifdef GBG_WITH_FFTW
                               " fftw"
#endif
#ifdef GBG_WITH_CYAML
                               " yaml"
#endif
#ifdef _OPENMP
                               " openmp"
#endif
#ifdef GBG_WITH_CUDA
                               " cuda"
#endif
        ;
    return text;
}
