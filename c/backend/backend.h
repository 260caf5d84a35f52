/* L1: what a backend is: memory, transfers, and a struct of kernels that hold all formulas. */
#ifndef GBG_BACKEND_BACKEND_H
#define GBG_BACKEND_BACKEND_H

#include <stddef.h>
#include <stdint.h>

#include "core/box.h"
#include "core/view.h"

struct gbg_context;
struct gbg_device; /* a backend's own body: threads or a GPU, scratch */
struct gbg_slot;   /* a backend's own body: a copy of a state on its way to the host */
struct gbg_ewald;  /* a backend's own body: a sum by a mesh */
struct gbg_ewald_plan;

enum { GBG_SPECIES_MAX = 10 };

/* The particles of one rank, arrays in the backend's memory. NULL means that the scene does not
 * need the array. Particles 0..owned-1 are moved here; owned..owned+ghost-1 only act on others.
 * Sums over neighbours run in the order of ids, so that they depend neither on the order in which a
 * caller keeps the particles nor on that in memory: rows of lists are in ascending order of ranks.
 * rank NULL: particles stand in ascending order of ids, index and rank are the same. Where
 * particles stand in another order, both rank and id are there. */
struct gbg_state {
    struct gbg_box box;
    int64_t owned, ghost;
    uint32_t *high[3], *low[3]; /* fixed-point coordinates: high and low words */
    uint64_t *id;               /* NULL: the id of a particle is its index */
    int32_t *rank;              /* of each particle in the order of ids; NULL: its index */
    uint64_t epoch;    /* counts changes of the coordinates or their order that are no moves: lists
                          built    before one are built anew */
    uint8_t *species;  /* NULL: one species */
    int32_t *image[3]; /* box crossings */
    double *force[3];
    uint32_t *start_high[3], *start_low[3]; /* coordinates before the step */
    int32_t *start_image[3];
    uint8_t *overlapped;  /* 1: took part in an overlap in this step */
    float *source;        /* alpha of each particle, for 32-bit cut-off sums of several species */
    double *own_diameter; /* of each particle, for a caller's arrays; NULL: the species' */
    double *own_alpha;    /* the same; with it `source` holds the same */
    int n_species;
    double diameter[GBG_SPECIES_MAX], alpha[GBG_SPECIES_MAX], mobility[GBG_SPECIES_MAX];
};

GBG_INLINE int32_t gbg_rank_of(const struct gbg_state *state, int64_t i)
{
    return state->rank ? state->rank[i] : (int32_t)i;
}

/* Noise of the Brownian step: xi with an optional limit, times scale. */
struct gbg_noise {
    uint32_t seed, run; /* Philox key */
    int limit_by;       /* 0 none, 1 clamp, 2 redraw */
    double limit;       /* in standard deviations */
    double scale;       /* sqrt(T dt), divided by the deviation of the limited law if rescaled */
};

/* Largest moves of a step, for the checks that follow it: lengths. */
struct gbg_moves {
    double drift, noise, total;
    int64_t bad; /* index of a particle whose move is not finite or not below half the box; -1 */
};

/* Pairs within `radius` at the time of building; rows of neighbours in ascending order of
 * ranks. Complete for every pair closer than `reach` as long as nobody has moved more than (radius
 * - reach)/2. */
struct gbg_list;

/* How overlapping pairs are parted in rounds. BOUNCE: to the mirror distance; CONTACT: to contact;
 * CARTER: bounce as in Carter (2016), where the sum of a particle's pushes in a round, and not each
 * pair's, is cut to a quarter of its diameter, which does not conserve momentum. */
enum gbg_parting { GBG_PARTING_BOUNCE, GBG_PARTING_CONTACT, GBG_PARTING_CARTER };

/* Contact correction: what is asked for, and what came of it. The outputs count what one call did.
 */
struct gbg_contacts {
    int parting; /* enum gbg_parting, for rounds */
    int64_t max_rounds;
    double tolerance; /* relative distance below which a pair counts as touching */
    double cap;       /* largest part of contact that a pair moves one of its discs in a round */
    const struct gbg_noise *noise; /* of the step, for the rule bridge: deviation and key */
    uint64_t step;                 /* number of the step, for the same */
    int pressed;                   /* for the same: 1: forces of many particles press on contacts */
    int64_t rounds;  /* out: rounds (sweeps for the rule bridge) that moved somebody */
    int64_t pairs;   /* out: pushes, or events */
    int64_t left;    /* out: overlapping pairs left (0 unless rounds ran out) */
    int64_t stopped; /* out: rule event: particles that reached the limit of events a step; rule
                        bridge, pressed: 1 if its solve came to its limit of rounds */
    double largest;  /* out: largest move since the start of the step among those corrected */
    double virial;   /* out: sum over pushes of the distance half way times the displacement of one
                        disc */
    int clear; /* out, rule bridge: 1 if no pair overlaps, so that rounds have nothing to do */
};

/* A pair of indices with its distance; first = -1: none. */
struct gbg_pair {
    int64_t first, second;
    double distance;
};

/* What is known of a step when its contacts are done, by code that shares nothing with the rules.
 * The outputs count what one call found. */
struct gbg_certificate {
    double tolerance; /* relative distance below contact that is allowed */
    int straight;     /* 1: look for pairs that passed through each other on straight paths */
    int listed;    /* out: 1 if the list was shown to hold all pairs in reach, 0: cells were used */
    int undecided; /* out: 1 if somebody moved so far that images of a path cannot be told apart */
    int64_t overlapping, passed; /* out: pairs */
    struct gbg_pair lowest; /* out: of those, the one of lowest indices, and how near it came */
    double largest;         /* out: largest move since the start of the step */
};

/* Many Brownian steps of one plan, made without asking the host in between: cut-off forces, noise,
 * and, where there are hard cores, the rule bridge, rounds and the certificate. */
enum { GBG_BATCH_FORCES = 8 };
struct gbg_batch {
    int64_t steps;  /* to be made */
    uint64_t first; /* number of the first */
    double dt;
    const struct gbg_noise *noise;
    struct gbg_list *pairs, *contacts; /* for forces and hard cores; NULL: none */
    int n_forces, use_double;
    double power[GBG_BATCH_FORCES], cutoff[GBG_BATCH_FORCES];
    struct gbg_contacts rule; /* what is asked for; out: sums over the steps made, the virial added
                                 to what was there */
    int bridge;               /* 1: the rule bridge comes before the rounds */
    double certified;         /* relative distance below contact that the certificate allows */
    double moved;             /* largest move of the step before; out: of the last one */
    int64_t done; /* out: steps made; fewer: the next one needs what a batch has not, as a
                     second correction, and is to be made kernel by kernel */
    int more;     /* out: 1: the rest may be asked of a batch again */
    int spoiled;  /* out: 1: the free move of the next step was made, without hard cores to keep */
    struct gbg_moves moves; /* out: of the last step made */
};

/* Neighbour search on a caller's coordinates: all pairs whose squared distance, sum over the axes
 * of the squares of the minimum-image differences in doubles, is <= radius radius. */
enum gbg_search_method {
    GBG_SEARCH_BRUTE,     /* every pair, 64-bit coordinates only */
    GBG_SEARCH_GRID,      /* cells of edge >= edge; as many around as the reach needs */
    GBG_SEARCH_OCTANT,    /* cells of edge >= edge >= 2 reach; on each axis one neighbour cell */
    GBG_SEARCH_OCCUPANCY, /* cells of edge <= edge with at most one particle each */
    GBG_SEARCH_METHODS
};
struct gbg_search_plan {
    int method; /* enum gbg_search_method */
    double radius;
    double skin; /* above 0: rows up to radius + skin are kept while nobody moved over skin/2 */
    double edge;
};
struct gbg_search_report {
    int64_t rows;       /* neighbours of all particles: twice the number of pairs */
    int64_t candidates; /* distances looked at for them, both directions */
    int64_t cells[3];
    double edge;           /* shortest edge of a cell */
    int searched;          /* 0: an earlier list was still good */
    double device_seconds; /* from coordinates on the device to rows there; 0: not told apart */
    /* two particles in one cell, for GBG_SEARCH_OCCUPANCY: the first such pair; first -1: none */
    struct gbg_pair crowded;
};
struct gbg_search; /* a backend's own body */
/* Pairs first < second in ascending order, with first - second (dimension numbers a pair). */
struct gbg_search_block {
    int64_t particle, entry; /* where to go on; 0, 0 at the start */
    int64_t capacity, count;
    int32_t *first, *second;
    double *separation;
};

struct gbg_kernels {
    /* required */
    /* xi(dimension, n) for ids first .. first+n-1 at a step. */
    int (*normals)(struct gbg_device *device, const struct gbg_noise *noise, uint64_t step,
                   uint64_t first, int64_t n, int dimension, double *values);
    /* x += sign (F dt + scale xi), image counts kept if present; a particle with a bad move stays.
     * sign -1 after +1 with the same arguments puts every bit back. */
    int (*integrate)(struct gbg_device *device, struct gbg_state *state,
                     const struct gbg_noise *noise, uint64_t step, double dt, int sign,
                     struct gbg_moves *moves);
    /* optional: NULL means that the planner refuses the scene and names the term */
    /* F_i (+)= mobility_i sum_k alpha_k r/|r|^(power+1) over all k, nearest images; add: 0 stores,
     * 1 adds to what is there. Mixed: 32-bit pairs from the high words, 64-bit sums. */
    int (*direct_mixed)(struct gbg_device *device, struct gbg_state *state, double power, int add);
    int (*direct_double)(struct gbg_device *device, struct gbg_state *state, double power, int add);
    /* Mixed, with the same bits on every backend: backend/cpu/direct_strict.h defines the sum. */
    int (*direct_strict)(struct gbg_device *device, struct gbg_state *state, double power, int add);

    /* Takes the scratch memory that direct sums need, before the first of them. */
    int (*direct_reserve)(struct gbg_device *device, const struct gbg_state *state);
    /* The same force in double precision on listed particles only: out[axis][target]; cutoff 0: all
     * pairs. The reference that errors are measured against. */
    int (*direct_targets)(struct gbg_device *device, struct gbg_state *state, double power,
                          double cutoff, int64_t n_targets, const int32_t *target,
                          double *const *out);

    /* Sums over all images, the wave k = 0 removed, by a mesh (ewald/plan.h), on the state's
     * species and box of that moment. force: F_i (+)= mobility_i sum_k alpha_k r/|r|^(power+1), as
     * direct_mixed; potential: phi_i = sum_k alpha_k (far and near part, own images, without the
     * particle itself) into the backend's memory, owned doubles. hurry: few steps will be made. */
    int (*ewald_create)(struct gbg_device *device, const struct gbg_state *state,
                        const struct gbg_ewald_plan *plan, int hurry, struct gbg_ewald **sum);
    void (*ewald_destroy)(struct gbg_device *device, struct gbg_ewald *sum);
    int (*ewald_force)(struct gbg_device *device, struct gbg_state *state, struct gbg_ewald *sum,
                       int add);
    int (*ewald_potential)(struct gbg_device *device, struct gbg_state *state,
                           struct gbg_ewald *sum, double *potential);
    double (*ewald_bytes)(const struct gbg_ewald *sum);

    /* Pair lists. update builds when it must; moved: largest move since the last update. */
    int (*list_create)(struct gbg_device *device, const struct gbg_state *state, double reach,
                       double radius, struct gbg_list **list);
    void (*list_destroy)(struct gbg_device *device, struct gbg_list *list);
    int (*list_update)(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                       double moved);
    /* Default skins of scenes with hard cores are longer by so many drifts of a step at contact:
     * above 0 where building a list costs many steps. */
    double skin_drifts;
    int64_t (*list_builds)(const struct gbg_list *list);
    double (*list_bytes)(const struct gbg_list *list);
    /* 0: there are no rows, for lack of memory, and each force finds its neighbours anew; NULL:
     * lists always have rows. */
    int (*list_is_kept)(const struct gbg_list *list);
    /* How far apart in memory the neighbours of a list stand: cache lines fetched for a row over
     * its particles, in a sample: 1 at random, about 0.1 in good order; 0 if all fit near the
     * processor. Decided by the list alone, whatever the threads. */
    double (*list_scatter)(const struct gbg_list *list);
    /* Puts the owned particles close in memory that are close in space (by_place 1), or in the
     * order of ids (0). Coordinates, images, ids, ranks, species, sources and overlap flags move
     * along; forces and the coordinates before the step do not and are void. */
    int (*arrange)(struct gbg_device *device, struct gbg_state *state, int by_place);
    int (*cutoff_mixed)(struct gbg_device *device, struct gbg_state *state,
                        const struct gbg_list *list, double power, double cutoff, int add);
    int (*cutoff_double)(struct gbg_device *device, struct gbg_state *state,
                         const struct gbg_list *list, double power, double cutoff, int add);

    /* Hard cores: keep the coordinates before a step, correct, put back, and the checks. */
    int (*keep)(struct gbg_device *device, struct gbg_state *state);
    int (*put_back)(struct gbg_device *device, struct gbg_state *state);
    /* Rounds of parting until no pair overlaps, or max_rounds. */
    int (*contacts)(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                    struct gbg_contacts *contacts);
    /* Rules that take the straight moves from the coordinates before the step to those now and put
     * corrected ones in their place; what they leave overlapping is for `contacts`. */
    int (*events)(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                  struct gbg_contacts *contacts);
    int (*bridge)(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                  struct gbg_contacts *contacts);
    /* A pair that came closer than contact (1 - tolerance) anywhere on the paths of the last call
     * of `events`, from the coordinates before the step over all collisions to those now. */
    int (*events_clear)(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                        double tolerance, struct gbg_pair *first);
    /* Pairs closer than contact (1 - tolerance): their number, the one of lowest indices, and the
     * first `capacity` as indices first < second in ascending order (NULL with capacity 0). */
    int (*overlaps)(struct gbg_device *device, struct gbg_state *state, double tolerance,
                    int64_t capacity, int32_t *first, int32_t *second, struct gbg_pair *lowest,
                    int64_t *count);
    /* The certificate of the step that began at the kept coordinates: the list holds every pair in
     * reach (else cells of its own are searched), no pair is nearer than contact (1 - tolerance),
     * none passed through each other: nearer than contact/sqrt(2) on the straight path. */
    int (*certify)(struct gbg_device *device, struct gbg_state *state, struct gbg_list *list,
                   struct gbg_certificate *certificate);
    /* Puts both particles of every pair that certify would name back to where they were before the
     * step, again and again until no such pair is left. The set that is put back only grows and the
     * state before the step has no overlap, so this ends. */
    int (*roll_back)(struct gbg_device *device, struct gbg_state *state, double tolerance,
                     int straight, int64_t *reverted);

    /* The steps of a batch, as far as they go: the same bits as kernel by kernel. */
    int (*steps)(struct gbg_device *device, struct gbg_state *state, struct gbg_batch *batch);

    /* Neighbour search: coordinates and results live with the caller. */
    int (*search_create)(struct gbg_device *device, const struct gbg_box *box,
                         struct gbg_search **search);
    void (*search_destroy)(struct gbg_device *device, struct gbg_search *search);
    /* Finds all pairs; afterwards the three calls below read them. */
    int (*search_update)(struct gbg_device *device, struct gbg_search *search,
                         const struct gbg_search_plan *plan, const struct gbg_points *points,
                         struct gbg_search_report *report);
    /* Neighbours of each particle in ascending order: offset[n + 1] and indices, from base. */
    int (*search_rows)(struct gbg_device *device, struct gbg_search *search, int base,
                       int64_t *offset, int32_t *neighbour);
    int (*search_pairs)(struct gbg_device *device, struct gbg_search *search, int base,
                        int32_t *first, int32_t *second);
    /* The next pairs, from 0, up to the capacity of the block; none left: count 0. */
    int (*search_block)(struct gbg_device *device, struct gbg_search *search,
                        struct gbg_search_block *block);
    /* Edge of a grid's cells over the reach, where nobody asked for one and a particle has that
     * many neighbours in the mean. NULL: the rule of the engine, which was measured on a CPU. */
    double (*search_edge)(const struct gbg_device *device, int dimension, double neighbours);

    /* Designs of earlier work, for the benchmark alone. direct_published: the sum of direct_mixed
     * by design 0 (tiles in shared memory) or 1 (warp shuffle) of Carter (2016). search_published:
     * the particles of the last search_update, once more by cells of at least `edge`, all 3^d of
     * them (Green 2010) or the 2^d of an octant (Perea and Cordero 2017, edge at least two radii);
     * seconds on the device, and the neighbours found. */
    int (*direct_published)(struct gbg_device *device, struct gbg_state *state, double power,
                            int design);
    int (*search_published)(struct gbg_device *device, struct gbg_search *search, int octant,
                            double edge, double *seconds, int64_t *rows);
};

struct gbg_backend {
    const char *name;
    /* Checks that the backend can run here; fills in context->instructions. */
    int (*probe)(struct gbg_context *context);
    int (*create)(struct gbg_context *context, struct gbg_device **device);
    void (*destroy)(struct gbg_device *device);
    int (*allocate)(struct gbg_device *device, void **pointer, int64_t count, size_t size,
                    const char *what);
    void (*release)(struct gbg_device *device, void *pointer);
    int (*upload)(struct gbg_device *device, void *to, const void *from, size_t bytes);
    int (*download)(struct gbg_device *device, void *to, const void *from, size_t bytes);
    int (*sync)(struct gbg_device *device);
    /* May be NULL, all three. Copies of states for output, made while later kernels run. begin
     * takes the state as it is at this point in the order of kernels, with image counts and overlap
     * flags or without; *slot is NULL or an earlier one that nobody reads any more, and is made to
     * fit. wait, which any thread may call, gives a sentence or NULL when the frame is there, until
     * the next begin. Slots outlive the device and belong to the caller. */
    int (*frame_begin)(struct gbg_device *device, const struct gbg_state *state, int images,
                       int overlapped, struct gbg_slot **slot);
    const char *(*frame_wait)(struct gbg_slot *slot, struct gbg_frame *frame);
    void (*frame_release)(struct gbg_slot *slot);
    /* May be NULL. Tells the device, before it makes lists, that no kernel of the scene works on
     * all pairs of its n particles: unless the caller named a number of threads, it takes fewer
     * where starting them costs more than it saves. */
    void (*expect)(struct gbg_device *device, int64_t n);
    /* May be NULL. Bytes of memory of the context's device that nobody has. */
    double (*free_bytes)(const struct gbg_context *context);
    /* Bytes of scratch memory that the device holds. */
    double (*scratch_bytes)(const struct gbg_device *device);
    /* The kernels for this device (the instruction set that its context chose). */
    const struct gbg_kernels *(*kernels)(const struct gbg_device *device);
};

/* The backend of that name, or NULL. Hidden from users, shared with the program's benchmarks. */
#pragma GCC visibility push(default)
const struct gbg_backend *gbg_backend_find(const char *name);
#pragma GCC visibility pop

#endif
