/* L2: a sample of particles, all particles as sources on the host, and how wrong forces are. */
#include "engine/sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "core/random.h"
#include "ewald/reference.h"
#include "gamboge/status.h"

static void choose(int64_t n, int64_t samples, int32_t *index)
{
    for (int64_t s = 0; s < samples; s++) {
        int64_t begin = n * s / samples, end = n * (s + 1) / samples;
        struct gbg_philox r =
            gbg_philox(gbg_philox_counter(0, (uint64_t)s, GBG_STREAM_START), 0x5EED, 0);
        index[s] = (int32_t)(begin + (int64_t)(r.word[0] % (uint64_t)(end - begin)));
    }
}

int gbg_sample_make(struct gbg_context *context, int dimension, int64_t n, int64_t most,
                    struct gbg_sample *sample)
{
    int64_t size = most < n ? most : n;
    void *index = NULL, *work = NULL;
    *sample = (struct gbg_sample){.context = context, .dimension = dimension, .n = n, .size = size};
    int status = gbg_allocate(context, &work, 10 * size, sizeof(double), "force error");
    status = status ? status
                    : gbg_allocate(context, &index, size, sizeof(int32_t), "force error sample");
    sample->work = work;
    sample->index = index;
    for (int a = 0; a < 3 && status == GBG_OK; a++) {
        sample->force[a] = sample->work + a * size;
        sample->reference[a] = sample->work + (3 + a) * size;
        sample->term[a] = sample->work + (6 + a) * size;
    }
    if (status == GBG_OK) {
        choose(n, size, sample->index);
    }
    return status;
}

void gbg_sample_release(struct gbg_sample *sample)
{
    gbg_release(sample->work);
    gbg_release(sample->index);
    *sample = (struct gbg_sample){0};
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Squares are taken of numbers over this one, so that none overflows or vanishes. */
static double largest(const struct gbg_sample *sample)
{
    double most = 0.0;
    for (int a = 0; a < sample->dimension; a++) {
        for (int64_t s = 0; s < sample->size; s++) {
            most = fmax(most, fmax(fabs(sample->force[a][s]), fabs(sample->reference[a][s])));
        }
    }
    return most > 0.0 ? most : 1.0;
}

struct gbg_deviation gbg_sample_compare(const struct gbg_sample *sample)
{
    double *length = sample->work + 9 * sample->size, unit = largest(sample);
    double wrong = 0.0, all = 0.0, n = (double)sample->size;
    if (sample->size == 0) {
        return (struct gbg_deviation){0};
    }
    for (int64_t s = 0; s < sample->size; s++) {
        double squared = 0.0;
        for (int a = 0; a < sample->dimension; a++) {
            double d = (sample->force[a][s] - sample->reference[a][s]) / unit;
            double r = sample->reference[a][s] / unit;
            wrong += d * d;
            squared += r * r;
        }
        all += squared;
        length[s] = sqrt(squared);
    }
    qsort(length, (size_t)sample->size, sizeof *length, compare);
    return (struct gbg_deviation){unit * sqrt(wrong / n), unit * sqrt(all / n),
                                  unit * length[sample->size / 2]};
}

int gbg_sources_make(struct gbg_context *context, int dimension, const double *length, int64_t n,
                     struct gbg_sources *sources)
{
    void *block = NULL;
    *sources = (struct gbg_sources){.n = n, .dimension = dimension};
    int status =
        gbg_allocate(context, &block, (dimension + 2) * n, sizeof(double), "sources on the host");
    sources->block = block;
    if (status != GBG_OK) {
        return status;
    }
    for (int a = 0; a < dimension; a++) {
        sources->length[a] = length[a];
        sources->position[a] = sources->block + a * n;
    }
    sources->alpha = sources->block + dimension * n;
    sources->mobility = sources->block + (dimension + 1) * n;
    return GBG_OK;
}

void gbg_sources_release(struct gbg_sources *sources)
{
    gbg_release(sources->block);
    *sources = (struct gbg_sources){0};
}

static double rms(const double *value, int64_t n)
{
    double most = 0.0, sum = 0.0;
    for (int64_t i = 0; i < n; i++) {
        most = fmax(most, fabs(value[i]));
    }
    for (int64_t i = 0; most > 0.0 && i < n; i++) {
        sum += value[i] / most * (value[i] / most);
    }
    return n > 0 ? most * sqrt(sum / (double)n) : 0.0;
}

double gbg_sources_typical(const struct gbg_sources *sources, double power)
{
    double spacing = 1.0;
    for (int a = 0; a < sources->dimension; a++) {
        spacing *= pow(sources->length[a], 1.0 / sources->dimension);
    }
    spacing *= pow(fmax((double)sources->n, 1.0), -1.0 / sources->dimension);
    return rms(sources->alpha, sources->n) * rms(sources->mobility, sources->n) *
           pow(spacing, -power);
}

int gbg_sources_reference(struct gbg_context *context, const struct gbg_sources *sources,
                          double power, const struct gbg_sample *sample, double *const *out)
{
    struct gbg_ewald_sources all = {
        .dimension = sources->dimension, .power = power, .n = sources->n, .alpha = sources->alpha};
    for (int a = 0; a < sources->dimension; a++) {
        all.length[a] = sources->length[a];
        all.position[a] = sources->position[a];
    }
    int status = gbg_ewald_reference(context, &all, 1.0, sample->size, sample->index, out, NULL);
    for (int a = 0; status == GBG_OK && a < sources->dimension; a++) {
        for (int64_t s = 0; s < sample->size; s++) {
            out[a][s] *= sources->mobility[sample->index[s]];
        }
    }
    return status;
}
