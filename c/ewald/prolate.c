/* Numbers of long-range sums: the prolate function of order zero, by Legendre polynomials. */
#include "ewald/prolate.h"
