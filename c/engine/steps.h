/* L2: the steps that a plan is made of. */
#ifndef GBG_ENGINE_STEPS_H
#define GBG_ENGINE_STEPS_H

struct gbg_engine;
struct gbg_plan_step;

int gbg_step_pair_list(struct gbg_engine *engine, const struct gbg_plan_step *step);
int gbg_step_cutoff(struct gbg_engine *engine, const struct gbg_plan_step *step);
int gbg_step_direct(struct gbg_engine *engine, const struct gbg_plan_step *step);
int gbg_step_ewald(struct gbg_engine *engine, const struct gbg_plan_step *step);
int gbg_step_keep(struct gbg_engine *engine, const struct gbg_plan_step *step);
int gbg_step_integrate(struct gbg_engine *engine, const struct gbg_plan_step *step);
int gbg_step_contacts(struct gbg_engine *engine, const struct gbg_plan_step *step);

struct gbg_batch;
/* What the contact step asks for, for a batch of steps. */
void gbg_step_contacts_ask(const struct gbg_engine *engine, struct gbg_batch *batch);

/* Refuses this step with the sentence `why` and the largest dt for which nobody would move by more
 * than `allowed`. */
int gbg_step_refuse(struct gbg_engine *engine, double allowed, const char *why);

#endif
