/* L0: one lock for the planner of FFTW. */
#include "core/planner.h"

#include <pthread.h>

static pthread_mutex_t planner = PTHREAD_MUTEX_INITIALIZER;

void gbg_planner_lock(void)
{
    pthread_mutex_lock(&planner);
}

void gbg_planner_unlock(void)
{
    pthread_mutex_unlock(&planner);
}
