/* Numbers of long-range sums: influence of waves. */
#include "ewald/plan.h"
