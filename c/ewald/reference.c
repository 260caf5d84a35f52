/* Numbers of long-range sums: Ewald sums without a mesh. */
#include "ewald/reference.h"
