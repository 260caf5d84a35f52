/* Command: gamboge verify: every frame of a trajectory checked by code that is not the solver's. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "command/frames.h"
#include "command/progress.h"
#include "command/verify_pairs.h"

/* Pairs a little farther apart than contact are looked at too, to name the closest one. */
static const double reach_beyond = 1.05;

struct verdict {
    int64_t unreadable, outside, overlaps, own_image, passed;
    int64_t intervals, undecided; /* between frames */
    int64_t undecided_steps;      /* largest distance of such frames */
    double closest;               /* smallest distance over contact distance */
    int64_t closest_frame, closest_pair[2];
    double tolerance; /* largest, as a length */
};

struct verifier {
    struct gbg_frames frames;
    struct verdict verdict;
    double largest;        /* diameter */
    double smallest;       /* contact distance that is not zero */
    double tolerance;      /* of this frame: how far storage may have moved a distance */
    int64_t most, printed; /* violations to print */
    int has_previous;
    int64_t previous_step;
    double *previous[3], *move[3];
};

static void print_violation(struct verifier *verifier, const char *what, int64_t i, int64_t j,
                            double distance, double contact)
{
    if (verifier->printed++ >= verifier->most) {
        return;
    }
    printf("  frame %lld: particles %lld and %lld %s: distance %.15g, contact %.15g\n",
           (long long)verifier->frames.frame, (long long)i, (long long)j, what, distance, contact);
}

static double contact_of(const struct verifier *verifier, int64_t i, int64_t j)
{
    return 0.5 * (verifier->frames.diameter[i] + verifier->frames.diameter[j]);
}

/* What of a pair's distance may be due to storage and rounding. */
static double allowance(const struct verifier *verifier, double contact)
{
    double rounding = 1e-12 * contact;
    return verifier->tolerance > rounding ? verifier->tolerance : rounding;
}

static void check_pair(void *user, int64_t i, int64_t j, const double d[3], double distance)
{
    (void)d;
    struct verifier *verifier = user;
    struct verdict *verdict = &verifier->verdict;
    double contact = contact_of(verifier, i, j);
    if (contact > 0 && distance < verdict->closest * contact) {
        verdict->closest = distance / contact;
        verdict->closest_frame = verifier->frames.frame;
        verdict->closest_pair[0] = i;
        verdict->closest_pair[1] = j;
    }
    if (distance < contact - allowance(verifier, contact)) {
        verdict->overlaps++;
        print_violation(verifier, "overlap", i, j, distance, contact);
    }
}

static void check_coordinates(struct verifier *verifier)
{
    const struct gbg_frames *frames = &verifier->frames;
    for (int64_t i = 0; i < frames->n; i++) {
        int inside = 1;
        for (int a = 0; a < frames->dimension; a++) {
            double offset = frames->r[a][i] - frames->origin[a];
            inside = inside && offset >= -verifier->tolerance &&
                     offset <= frames->length[a] + verifier->tolerance;
        }
        verifier->verdict.outside += !inside;
        if (!inside && verifier->printed++ < verifier->most) {
            printf("  frame %lld: particle %lld is outside the box: %.17g %.17g %.17g\n",
                   (long long)frames->frame, (long long)i, frames->r[0][i], frames->r[1][i],
                   frames->dimension == 3 ? frames->r[2][i] : 0);
        }
    }
}

/* A core larger than the box overlaps its own image. */
static void check_own_images(struct verifier *verifier)
{
    const struct gbg_frames *frames = &verifier->frames;
    for (int64_t i = 0; i < frames->n; i++) {
        for (int a = 0; a < frames->dimension; a++) {
            double contact = frames->diameter[i];
            if (frames->length[a] < contact - allowance(verifier, contact)) {
                verifier->verdict.own_image++;
                print_violation(verifier, "(its own image) overlap", i, i, frames->length[a],
                                contact);
                break;
            }
        }
    }
}

/* The straight path of j seen from i, from the frame before to this one: nearer than
 * contact/sqrt(2) to i it leads from one side of i to the other, because two places outside contact
 * with no more than a right angle between them have no nearer point of their connecting line. */
static void check_passing(void *user, int64_t i, int64_t j, const double d[3], double distance)
{
    struct verifier *verifier = user;
    double dot = 0, square = 0, path = 0;
    for (int a = 0; a < verifier->frames.dimension; a++) {
        double move = verifier->move[a][j] - verifier->move[a][i], now = d[a] + move;
        dot -= d[a] * move;
        path += move * move;
        square += now * now;
    }
    double contact = contact_of(verifier, i, j);
    double least = contact - allowance(verifier, contact);
    double nearest = distance * distance - (path > 0 ? dot * dot / path : 0);
    if (contact > 0 && dot > 0 && dot < path && nearest < 0.5 * least * least &&
        distance >= least && sqrt(square) >= least) {
        verifier->verdict.passed++;
        print_violation(verifier, "passed through each other since the frame before", i, j,
                        sqrt(square), contact);
    }
}

/* Moves since the frame before, nearest images; the length of the largest. */
static double find_moves(struct verifier *verifier)
{
    const struct gbg_frames *frames = &verifier->frames;
    double largest = 0;
    for (int64_t i = 0; i < frames->n; i++) {
        double square = 0;
        for (int a = 0; a < frames->dimension; a++) {
            double move =
                gbg_nearest_image(frames->r[a][i] - verifier->previous[a][i], frames->length[a]);
            verifier->move[a][i] = move;
            square += move * move;
        }
        largest = square > largest ? square : largest;
    }
    return sqrt(largest);
}

/* With moves of at most m a path as above needs a pair closer than 2 m + contact/sqrt(2) before the
 * step, and 2 m above contact times sqrt(2), so that small moves settle the question without
 * looking at pairs. */
static int check_step(struct verifier *verifier)
{
    struct gbg_frames *frames = &verifier->frames;
    struct verdict *verdict = &verifier->verdict;
    double move = find_moves(verifier), half = 0.5 * frames->length[0];
    for (int a = 1; a < frames->dimension; a++) {
        half = 0.5 * frames->length[a] < half ? 0.5 * frames->length[a] : half;
    }
    verdict->intervals++;
    if (2 * move < 1.4 * verifier->smallest) {
        return GBG_EXIT_DONE;
    }
    double reach = 2 * move + verifier->largest / sqrt(2.0);
    if (reach >= half) {
        verdict->undecided++;
        return GBG_EXIT_DONE;
    }
    return gbg_visit_pairs(frames->dimension, frames->length, frames->n, verifier->previous, reach,
                           check_passing, verifier)
               ? gbg_complain(GBG_EXIT_FAILED, "no memory to look at %lld particles",
                              (long long)frames->n)
               : GBG_EXIT_DONE;
}

static int check_interval(struct verifier *verifier)
{
    struct gbg_frames *frames = &verifier->frames;
    int64_t distance = frames->step - verifier->previous_step;
    int status = GBG_EXIT_DONE;
    if (verifier->has_previous && distance == 1) {
        status = check_step(verifier);
    } else if (verifier->has_previous) {
        verifier->verdict.intervals++;
        verifier->verdict.undecided++;
        if (distance > verifier->verdict.undecided_steps) {
            verifier->verdict.undecided_steps = distance;
        }
    }
    for (int a = 0; a < frames->dimension; a++) {
        memcpy(verifier->previous[a], frames->r[a], (size_t)frames->n * sizeof(double));
    }
    verifier->previous_step = frames->step;
    verifier->has_previous = 1;
    return status;
}

/* A frame that the reader refuses, such as one with a coordinate that is not a number. */
static void unreadable(struct verifier *verifier)
{
    verifier->verdict.unreadable++;
    verifier->has_previous = 0;
    if (verifier->printed++ < verifier->most) {
        printf("  frame %lld: %s\n", (long long)verifier->frames.frame,
               gbg_message(verifier->frames.context));
    }
}

static int check_frame(struct verifier *verifier, int64_t frame)
{
    struct gbg_frames *frames = &verifier->frames;
    if (gbg_frames_try(frames, frame) != GBG_OK) {
        unreadable(verifier);
        return GBG_EXIT_DONE;
    }
    /* Each of the two ends may be off by the storage error on each axis. */
    verifier->tolerance = 2 * sqrt((double)frames->dimension) * gbg_frames_storage_error(frames);
    double allowed = allowance(verifier, verifier->largest);
    verifier->verdict.tolerance =
        allowed > verifier->verdict.tolerance ? allowed : verifier->verdict.tolerance;
    check_coordinates(verifier);
    if (verifier->largest > 0) {
        check_own_images(verifier);
        if (gbg_visit_pairs(frames->dimension, frames->length, frames->n, frames->r,
                            verifier->largest * reach_beyond, check_pair, verifier)) {
            return gbg_complain(GBG_EXIT_FAILED, "no memory to look at %lld particles",
                                (long long)frames->n);
        }
    }
    return verifier->largest > 0 ? check_interval(verifier) : GBG_EXIT_DONE;
}

static int prepare(struct verifier *verifier)
{
    struct gbg_frames *frames = &verifier->frames;
    int points = 0;
    for (int64_t i = 0; i < frames->n && frames->is_hard; i++) {
        double diameter = frames->diameter[i];
        points = points || diameter == 0;
        verifier->largest = diameter > verifier->largest ? diameter : verifier->largest;
        if (diameter > 0 && (verifier->smallest == 0 || diameter < verifier->smallest)) {
            verifier->smallest = diameter;
        }
    }
    if (points) {
        verifier->smallest *= 0.5;
    }
    verifier->verdict.closest = reach_beyond;
    for (int a = 0; a < frames->dimension; a++) {
        verifier->previous[a] = calloc((size_t)frames->n + 1, sizeof(double));
        verifier->move[a] = calloc((size_t)frames->n + 1, sizeof(double));
        if (!verifier->previous[a] || !verifier->move[a]) {
            return gbg_complain(GBG_EXIT_FAILED, "no memory to compare %lld particles",
                                (long long)frames->n);
        }
    }
    return GBG_EXIT_DONE;
}

static void print_passed(const struct verdict *verdict)
{
    printf("passed through %lld", (long long)verdict->passed);
    if (verdict->undecided > 0) {
        printf("; cannot be decided between %s of %s pairs of frames",
               gbg_count_text(verdict->undecided), gbg_count_text(verdict->intervals));
        if (verdict->undecided_steps > 1) {
            printf(", up to %s steps apart (frames of every step decide it)",
                   gbg_count_text(verdict->undecided_steps));
        }
    }
    printf("\n");
}

static void print_cores(const struct verifier *verifier)
{
    const struct verdict *verdict = &verifier->verdict;
    if (verifier->largest == 0) {
        printf("overlaps       none possible: the particles have no hard cores\n");
        return;
    }
    printf("overlaps       %lld\n", (long long)(verdict->overlaps + verdict->own_image));
    if (verdict->closest < reach_beyond) {
        printf("closest pair   %.13g of contact (frame %lld, particles %lld and %lld)\n",
               verdict->closest, (long long)verdict->closest_frame,
               (long long)verdict->closest_pair[0], (long long)verdict->closest_pair[1]);
    } else {
        printf("closest pair   more than %g of contact\n", reach_beyond);
    }
    print_passed(verdict);
}

static int print_verdict(const struct verifier *verifier, int64_t frames_seen)
{
    const struct gbg_frames *frames = &verifier->frames;
    const struct verdict *verdict = &verifier->verdict;
    int64_t bad = verdict->unreadable + verdict->outside + verdict->overlaps + verdict->own_image +
                  verdict->passed;
    printf("%s: %s frame%s, %s particles, %d dimensions, coordinates stored as %s\n", frames->path,
           gbg_count_text(frames_seen), frames_seen == 1 ? "" : "s", gbg_count_text(frames->n),
           frames->dimension, frames->is_double ? "double" : "float");
    printf("tolerance      %.2g of length, for this storage\n", verdict->tolerance);
    printf("bad frames     %lld (unreadable, or with a coordinate that is not finite)\n",
           (long long)verdict->unreadable);
    printf("outside box    %lld\n", (long long)verdict->outside);
    print_cores(verifier);
    if (bad > verifier->most) {
        printf("               (the first %lld of %lld violations are printed above)\n",
               (long long)verifier->most, (long long)bad);
    }
    printf("verdict        %s\n", bad ? "BAD" : "good");
    return bad ? gbg_complain(GBG_EXIT_FAILED, "%s: %s violation%s", frames->path,
                              gbg_count_text(bad), bad == 1 ? "" : "s")
               : GBG_EXIT_DONE;
}

static int verify(const struct gbg_arguments *arguments, struct verifier *verifier)
{
    int64_t first, last, stride, seen = 0;
    int status = gbg_frames_open(arguments, &verifier->frames);
    status =
        status ? status : gbg_frames_range(arguments, &verifier->frames, &first, &last, &stride);
    status = status ? status : prepare(verifier);
    if (status) {
        return status;
    }
    verifier->most = gbg_integer_of(arguments, "most", 5);
    struct gbg_progress progress;
    gbg_progress_start(&progress, "frame", first, last, 0);
    progress.quiet = !progress.terminal;
    for (int64_t f = first; f <= last && !status; f += stride) {
        status = check_frame(verifier, f);
        gbg_progress_show(&progress, f);
        seen++;
    }
    gbg_progress_end(&progress);
    return status ? status : print_verdict(verifier, seen);
}

int gbg_command_verify(const struct gbg_arguments *arguments)
{
    struct verifier verifier = {.most = 0};
    int status = verify(arguments, &verifier);
    for (int a = 0; a < 3; a++) {
        free(verifier.previous[a]);
        free(verifier.move[a]);
    }
    gbg_frames_close(&verifier.frames);
    return status;
}
