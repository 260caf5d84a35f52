/* Numbers of long-range sums: tables of the near and the far part. */
#include "ewald/split.h"
