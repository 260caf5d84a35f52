/* Command: a trajectory opened to read, one frame of it in memory at a time. */
#include "command/frames.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

static int make_arrays(struct gbg_frames *frames)
{
    size_t n = (size_t)frames->n + 1;
    frames->species = calloc(n, sizeof *frames->species);
    frames->diameter = calloc(n, sizeof *frames->diameter);
    int made = frames->species && frames->diameter;
    for (int a = 0; a < 3; a++) {
        frames->r[a] = calloc(n, sizeof *frames->r[a]);
        made = made && frames->r[a];
    }
    return made ? GBG_EXIT_DONE
                : gbg_complain(GBG_EXIT_FAILED, "%s: no memory for %lld particles", frames->path,
                               (long long)frames->n);
}

static int read_particles(struct gbg_frames *frames)
{
    struct gbg_trajectory *trajectory = frames->trajectory;
    if (gbg_trajectory_species(trajectory, frames->n, frames->species, 0) != GBG_OK ||
        gbg_trajectory_diameters(trajectory, frames->n, frames->diameter) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_USE, frames->context);
    }
    for (int64_t i = 0; i < frames->n; i++) {
        if (frames->species[i] < 0 || frames->species[i] >= GBG_MAX_SPECIES) {
            return gbg_complain(GBG_EXIT_USE,
                                "%s: particle %lld is of species %d, and %d are "
                                "known here",
                                frames->path, (long long)i, frames->species[i], GBG_MAX_SPECIES);
        }
        frames->count[frames->species[i]]++;
    }
    return GBG_EXIT_DONE;
}

int gbg_frames_open(const struct gbg_arguments *arguments, struct gbg_frames *frames)
{
    *frames = (struct gbg_frames){.path = arguments->operand, .frame = -1};
    if (access(frames->path, F_OK) != 0) {
        return gbg_complain(GBG_EXIT_USE, "there is no file %s", frames->path);
    }
    int status = gbg_open_context("cpu", gbg_integer_of(arguments, "threads", 0), &frames->context);
    if (status) {
        return status;
    }
    if (gbg_trajectory_open(frames->context, frames->path, &frames->trajectory) != GBG_OK ||
        gbg_trajectory_size(frames->trajectory, &frames->frames, &frames->n, &frames->dimension,
                            &frames->n_species) != GBG_OK ||
        gbg_trajectory_is_double(frames->trajectory, &frames->is_double) != GBG_OK ||
        gbg_trajectory_is_hard(frames->trajectory, &frames->is_hard) != GBG_OK) {
        return gbg_complain_library(GBG_EXIT_USE, frames->context);
    }
    status = make_arrays(frames);
    return status ? status : read_particles(frames);
}

int gbg_frames_try(struct gbg_frames *frames, int64_t frame)
{
    double **r = frames->r;
    frames->frame = frame;
    int status = gbg_trajectory_frame(frames->trajectory, frame, &frames->time, &frames->step,
                                      frames->length, frames->origin);
    return status ? status
                  : gbg_trajectory_positions(frames->trajectory, frame, frames->n, r[0], r[1],
                                             frames->dimension == 3 ? r[2] : NULL, 1);
}

int gbg_frames_load(struct gbg_frames *frames, int64_t frame)
{
    return gbg_frames_try(frames, frame) ? gbg_complain_library(GBG_EXIT_USE, frames->context)
                                         : GBG_EXIT_DONE;
}

void gbg_frames_close(struct gbg_frames *frames)
{
    free(frames->species);
    free(frames->diameter);
    for (int a = 0; a < 3; a++) {
        free(frames->r[a]);
    }
    gbg_trajectory_destroy(&frames->trajectory);
    gbg_context_destroy(&frames->context);
}

int gbg_frames_range(const struct gbg_arguments *arguments, const struct gbg_frames *frames,
                     int64_t *first, int64_t *last, int64_t *stride)
{
    if (frames->frames == 0) {
        return gbg_complain(GBG_EXIT_USE, "%s holds no frame", frames->path);
    }
    *first = gbg_integer_of(arguments, "first", 0);
    *last = gbg_integer_of(arguments, "last", frames->frames - 1);
    *stride = gbg_integer_of(arguments, "stride", 1);
    if (*first > *last || *last >= frames->frames) {
        return gbg_complain(GBG_EXIT_USE,
                            "--first %lld --last %lld: the frames of %s are 0 to %lld, and first "
                            "comes before last",
                            (long long)*first, (long long)*last, frames->path,
                            (long long)frames->frames - 1);
    }
    return GBG_EXIT_DONE;
}

double gbg_frames_storage_error(const struct gbg_frames *frames)
{
    double largest = 0;
    for (int a = 0; a < frames->dimension; a++) {
        double low = fabs(frames->origin[a]), high = fabs(frames->origin[a] + frames->length[a]);
        double reach = low > high ? low : high;
        largest = reach > largest ? reach : largest;
    }
    return largest * (frames->is_double ? 0x1p-52 : 0x1p-24);
}

void gbg_frames_species_name(const struct gbg_frames *frames, int species, size_t capacity,
                             char *name)
{
    if (gbg_trajectory_species_name(frames->trajectory, species, (int64_t)capacity, name) !=
        GBG_OK) {
        snprintf(name, capacity, "%c", 'A' + species);
    }
}
