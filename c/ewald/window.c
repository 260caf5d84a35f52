/* Numbers of long-range sums: prolate and B-spline windows. */
#include "ewald/window.h"
