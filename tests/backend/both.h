/* Tests: the same engine on the CPU and on a GPU, and comparisons of what their kernels did. */
#ifndef GBG_TESTS_BOTH_H
#define GBG_TESTS_BOTH_H

#include "made_scene.h"

enum { BOTH_SKIPPED = 77 }; /* ctest's SKIP_RETURN_CODE */

/* Under a sanitizer, where every kernel takes long, a part of the cases has to do: with
 * GBG_TESTS_PART=5 in the environment every fifth is made. */
static inline int both_part(void)
{
    const char *part = getenv("GBG_TESTS_PART");
    int of = part ? atoi(part) : 1;
    return of > 1 ? of : 1;
}

static inline int both_takes(int k)
{
    return k % both_part() == 0;
}

struct both {
    struct gbg_context *context[2];
    struct gbg_engine *engine[2]; /* CPU, GPU */
};

/* 1, with the reason on standard output, if there is no GPU to test. */
static inline int both_missing(void)
{
    struct gbg_context *context = NULL;
    if (gbg_context_create("cuda:0", &context) == GBG_OK) {
        gbg_context_destroy(&context);
        return 0;
    }
    printf("skipped: %s\n", gbg_message(NULL));
    return 1;
}

/* Engines of one scene (made for any context) and its particles. */
static inline struct both both_make(struct gbg_scene scene, const struct made_particles *made)
{
    static const char *const names[2] = {"cpu:threads=2", "cuda:0"};
    struct both both;
    for (int b = 0; b < 2; b++) {
        both.context[b] = made_context(names[b]);
        scene.context = both.context[b];
        both.engine[b] = made_engine(&scene, made);
    }
    return both;
}

static inline void both_free(struct both *both)
{
    for (int b = 0; b < 2; b++) {
        gbg_engine_free(both->engine[b]);
        gbg_context_destroy(&both->context[b]);
    }
}

/* A copy of `bytes` of the backend's memory, to be freed. */
static inline void *both_copy(struct gbg_engine *engine, const void *from, size_t bytes)
{
    void *copy = malloc(bytes + 1);
    assert_non_null(copy);
    if (bytes > 0) {
        assert_int_equal(engine->backend->download(engine->device, copy, from, bytes), GBG_OK);
    }
    return copy;
}

/* An array of each state, member a pointer to it: the same bytes. */
static inline void both_same(struct both *both, const void *cpu, const void *gpu, size_t bytes,
                             const char *what)
{
    unsigned char *p = both_copy(both->engine[0], cpu, bytes);
    unsigned char *q = both_copy(both->engine[1], gpu, bytes);
    for (size_t k = 0; k < bytes; k++) {
        if (p[k] != q[k]) {
            fail_msg("%s differ from byte %zu of %zu on", what, k, bytes);
        }
    }
    free(p);
    free(q);
}

/* Coordinates, images and flags: the same bytes. */
static inline void both_same_state(struct both *both)
{
    const struct gbg_state *p = &both->engine[0]->state, *q = &both->engine[1]->state;
    size_t words = (size_t)p->owned * 4;
    for (int a = 0; a < p->box.dimension; a++) {
        both_same(both, p->high[a], q->high[a], words, "high words");
        both_same(both, p->low[a], q->low[a], words, "low words");
        if (p->image[a]) {
            both_same(both, p->image[a], q->image[a], words, "image counts");
        }
    }
    if (p->overlapped) {
        both_same(both, p->overlapped, q->overlapped, (size_t)p->owned, "overlap flags");
    }
}

/* Asserts that a double is the same to the last bit. */
static inline void both_same_real(double cpu, double gpu, const char *what)
{
    if (memcmp(&cpu, &gpu, sizeof cpu) != 0) {
        fail_msg("%s: %.17g on the CPU, %.17g on the GPU", what, cpu, gpu);
    }
}

#endif
