/* Benchmarks: on what machine, and of what commit, a figure was measured. */
#ifndef GBG_BENCH_MACHINE_H
#define GBG_BENCH_MACHINE_H

struct gbg_machine {
    char model[128]; /* of the processor, without quotation marks */
    int cores;       /* that this process may use */
    double load;     /* runnable processes, mean of the last minute; -1: not known */
};

void gbg_machine_look(struct gbg_machine *machine);

/* Short hash, with "-dirty" when the tree had changes; "unknown" outside a repository. */
const char *gbg_machine_commit(void);

#endif
