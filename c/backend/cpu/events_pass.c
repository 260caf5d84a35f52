/* L1, CPU: shares the collisions of a step out to clusters of particles, and joins those that turn
 * out to have met.
 *
 * Where everybody goes is determined by the free paths alone, so how the particles are shared out
 * cannot change it, provided that every cluster saw all that its particles meet. That is checked
 * after each pass: two clusters that both changed the same particle, or whose changed paths meet,
 * are joined and done again from the free paths. */
#include "backend/cpu/cpu.h"
#include "backend/cpu/events.h"

enum { PASSES_APART = 6, TAKEN_AT_ONCE = 8 };

static int32_t root_particle(struct gbg_events *work, int32_t i)
{
    while (work->root[i] != i) {
        work->root[i] = work->root[work->root[i]];
        i = work->root[i];
    }
    return i;
}

static int32_t root_cluster(struct gbg_events *work, int32_t c)
{
    while (work->cluster[c].parent != c) {
        work->cluster[c].parent = work->cluster[work->cluster[c].parent].parent;
        c = work->cluster[c].parent;
    }
    return c;
}

/* Joins two clusters; the root is to be done again. Returns 1 if they were apart. */
static int unite(struct gbg_events *work, int32_t p, int32_t q)
{
    p = root_cluster(work, p);
    q = root_cluster(work, q);
    if (p == q) {
        return 0;
    }
    int32_t into = p < q ? p : q, from = p < q ? q : p;
    work->cluster[from].parent = into;
    work->cluster[work->cluster[into].last].next = from;
    work->cluster[into].last = work->cluster[from].last;
    work->cluster[into].again = 1;
    return 1;
}

static void join_particles(struct gbg_events *work)
{
    for (int c = 0; c < work->n_parts; c++) {
        const struct gbg_events_part *part = &work->part[c];
        for (int64_t e = 0; e < part->first_events.used; e++) {
            int32_t pair[2] = {part->first_event[e].first, part->first_event[e].second};
            for (int k = 0; k < 2; k++) {
                pair[k] = work->root[pair[k]] < 0 ? (work->root[pair[k]] = pair[k])
                                                  : root_particle(work, pair[k]);
            }
            work->root[pair[0] < pair[1] ? pair[1] : pair[0]] =
                pair[0] < pair[1] ? pair[0] : pair[1];
        }
    }
}

/* Cluster of each event of the free paths, in the order of their first events; counts them. */
static int number_clusters(const struct gbg_events_call *call)
{
    struct gbg_events *work = call->work;
    work->clusters.used = 0;
    for (int c = 0; c < work->n_parts; c++) {
        const struct gbg_events_part *part = &work->part[c];
        for (int64_t e = 0; e < part->first_events.used; e++) {
            int32_t root = root_particle(work, part->first_event[e].first);
            if (work->number[root] < 0) {
                int status = gbg_events_grow(call->device, &work->cluster, &work->clusters, 1,
                                             sizeof *work->cluster);
                if (status != GBG_OK) {
                    return status;
                }
                int32_t made = (int32_t)work->clusters.used++;
                work->number[root] = made;
                work->cluster[made] =
                    (struct gbg_cluster){.parent = made, .next = -1, .last = made};
            }
            work->cluster[work->number[root]].end++;
        }
    }
    return GBG_OK;
}

/* Lays the events out cluster by cluster. */
static void place_events(struct gbg_events *work)
{
    int64_t begin = 0;
    for (int64_t c = 0; c < work->clusters.used; c++) {
        int64_t count = work->cluster[c].end;
        work->cluster[c].begin = work->cluster[c].end = begin;
        begin += count;
    }
    work->events.used = begin;
    for (int c = 0; c < work->n_parts; c++) {
        const struct gbg_events_part *part = &work->part[c];
        for (int64_t e = 0; e < part->first_events.used; e++) {
            int32_t root = root_particle(work, part->first_event[e].first);
            work->event[work->cluster[work->number[root]].end++] = part->first_event[e];
        }
    }
}

static void forget_particles(struct gbg_events *work)
{
    for (int64_t e = 0; e < work->events.used; e++) {
        const struct gbg_event *event = &work->event[e];
        work->root[event->first] = work->root[event->second] = -1;
        work->number[event->first] = work->number[event->second] = -1;
    }
}

static int make_clusters(const struct gbg_events_call *call)
{
    struct gbg_events *work = call->work;
    int64_t events = 0;
    for (int c = 0; c < work->n_parts; c++) {
        events += work->part[c].first_events.used;
    }
    work->events.used = 0;
    int status =
        gbg_events_grow(call->device, &work->event, &work->events, events, sizeof *work->event);
    if (status == GBG_OK) {
        join_particles(work);
        status = number_clusters(call);
        place_events(work);
        forget_particles(work);
    }
    work->todos.used = 0;
    status = status ? status
                    : gbg_events_grow(call->device, &work->todo, &work->todos, work->clusters.used,
                                      sizeof *work->todo);
    return status;
}

/* One thread's share of a pass: whatever cluster is next. */
static int take_clusters(const struct gbg_events_call *call, struct gbg_events_part *part,
                         int (*job)(const struct gbg_events_call *, struct gbg_events_part *,
                                    int32_t))
{
    struct gbg_events *work = call->work;
    for (;;) {
        int64_t begin = __atomic_fetch_add(&work->next_todo, TAKEN_AT_ONCE, __ATOMIC_RELAXED);
        for (int64_t k = begin; k < begin + TAKEN_AT_ONCE; k++) {
            if (k >= work->todos.used) {
                return GBG_OK;
            }
            int status = job(call, part, work->todo[k]);
            if (status != GBG_OK) {
                return status;
            }
        }
    }
}

static int run_todo(const struct gbg_events_call *call,
                    int (*job)(const struct gbg_events_call *, struct gbg_events_part *, int32_t))
{
    struct gbg_events *work = call->work;
    int status = GBG_OK;
    work->next_todo = 0;
#pragma omp parallel for num_threads(call->device->threads) schedule(static, 1)
    for (int c = 0; c < work->n_parts; c++) {
        work->part[c].status = take_clusters(call, &work->part[c], job);
    }
    for (int c = 0; c < work->n_parts; c++) {
        status = work->part[c].status != GBG_OK ? work->part[c].status : status;
    }
    return status;
}

/* Enters the particles that a pass changed; unites clusters that both changed one. */
static int enter_members(const struct gbg_events_call *call, int *united)
{
    struct gbg_events *work = call->work;
    for (int64_t t = 0; t < work->todos.used; t++) {
        int32_t root = work->todo[t];
        const struct gbg_cluster *cluster = &work->cluster[root];
        int status = gbg_events_grow(call->device, &work->changed, &work->changes, cluster->members,
                                     sizeof *work->changed);
        if (status != GBG_OK) {
            return status;
        }
        for (int64_t m = cluster->first_member; m < cluster->first_member + cluster->members; m++) {
            int32_t i = work->part[cluster->part].member[m].particle;
            if (work->owner[i] == 0) {
                work->changed[work->changes.used++] = (struct gbg_changed){cluster->part, root, m};
                work->owner[i] = (uint32_t)work->changes.used;
            } else {
                *united |= unite(work, root, work->changed[work->owner[i] - 1].cluster);
            }
        }
    }
    return GBG_OK;
}

static int unite_conflicts(struct gbg_events *work)
{
    int united = 0;
    for (int c = 0; c < work->n_parts; c++) {
        struct gbg_events_part *part = &work->part[c];
        for (int64_t k = 0; k < part->conflicts.used; k += 2) {
            united |= unite(work, part->conflict[k], part->conflict[k + 1]);
        }
        part->conflicts.used = 0;
    }
    return united;
}

static void forget_members(struct gbg_events *work, int32_t c)
{
    struct gbg_cluster *cluster = &work->cluster[c];
    for (int64_t m = cluster->first_member; m < cluster->first_member + cluster->members; m++) {
        uint32_t *owner = &work->owner[work->part[cluster->part].member[m].particle];
        if (*owner != 0 && work->changed[*owner - 1].cluster == c) {
            work->changed[*owner - 1].cluster = -1;
            *owner = 0;
        }
    }
    cluster->members = cluster->events = 0;
}

/* The joined clusters are to be done again; all of them as one after some passes, or if they hold
 * most of the events: then more passes would only join them step by step. */
static void choose_todo(struct gbg_events *work, int pass)
{
    int32_t only = -1;
    int64_t events = 0, again = 0;
    for (int64_t c = 0; c < work->clusters.used; c++) {
        events += work->cluster[c].events;
        again += work->cluster[root_cluster(work, (int32_t)c)].again ? work->cluster[c].events : 0;
    }
    int together = pass >= PASSES_APART || again > events / 2;
    for (int64_t c = 0; together && c < work->clusters.used; c++) {
        if (work->cluster[c].parent == c && work->cluster[c].again) {
            only = only < 0 ? (int32_t)c : only;
            unite(work, only, (int32_t)c);
        }
    }
    work->todos.used = 0;
    for (int64_t c = 0; c < work->clusters.used; c++) {
        if (work->cluster[c].parent != c || !work->cluster[c].again) {
            continue;
        }
        work->cluster[c].again = 0;
        work->todo[work->todos.used++] = (int32_t)c;
        for (int32_t k = (int32_t)c; k >= 0; k = work->cluster[k].next) {
            forget_members(work, k);
        }
    }
}

/* Whether one cluster holds most of the events: the rest is then not worth a pass of its own. */
static int is_one_cluster(const struct gbg_events *work)
{
    int64_t most = 0;
    for (int64_t c = 0; c < work->clusters.used; c++) {
        int64_t events = work->cluster[c].end - work->cluster[c].begin;
        most = events > most ? events : most;
    }
    return 2 * most > work->events.used;
}

static void start_todo(struct gbg_events *work, int together)
{
    for (int64_t c = 0; c < work->clusters.used; c++) {
        if (together) {
            unite(work, 0, (int32_t)c);
        }
        if (!together || c == 0) {
            work->todo[work->todos.used++] = (int32_t)c;
        }
    }
    if (work->clusters.used > 0) {
        work->cluster[0].again = 0;
    }
}

int gbg_events_passes(const struct gbg_events_call *call)
{
    struct gbg_events *work = call->work;
    int status = make_clusters(call);
    if (status == GBG_OK) {
        start_todo(work, call->together || is_one_cluster(work));
    }
    for (int pass = 1; status == GBG_OK && work->todos.used > 0; pass++) {
        int united = 0;
        work->passes++;
        work->pass = pass;
        status = run_todo(call, gbg_events_work);
        status = status ? status : enter_members(call, &united);
        status = status ? status : run_todo(call, gbg_events_conflicts);
        united |= unite_conflicts(work);
        if (!united) {
            break;
        }
        choose_todo(work, pass);
    }
    return status;
}
