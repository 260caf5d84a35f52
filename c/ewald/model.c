/* Numbers of long-range sums: reach, band, mesh and window from the tolerance. */
#include "ewald/model.h"
