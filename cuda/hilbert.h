/* L1, CUDA: cells of a box in an order in which neighbours stand close together. */
#ifndef GBG_CUDA_HILBERT_H
#define GBG_CUDA_HILBERT_H

#include <stdint.h>

/* Number of a cell along the Hilbert curve (Skilling 2004): axes of `bits` bits are undone level by
 * level, then turned into a Gray code. */
template <int dimension>
static __device__ uint32_t gbg_cuda_hilbert(uint32_t x[dimension], int bits)
{
    for (uint32_t q = 1u << (bits - 1); q > 1; q >>= 1) {
        for (int a = 0; a < dimension; a++) {
            uint32_t t = x[a] & q ? q - 1 : 0, swapped = t ? 0 : (x[0] ^ x[a]) & (q - 1);
            x[0] ^= t | swapped;
            x[a] ^= swapped;
        }
    }
    for (int a = 1; a < dimension; a++) {
        x[a] ^= x[a - 1];
    }
    uint32_t turn = 0, number = 0;
    for (uint32_t q = 1u << (bits - 1); q > 1; q >>= 1) {
        turn ^= x[dimension - 1] & q ? q - 1 : 0;
    }
    for (int bit = bits - 1; bit >= 0; bit--) {
        for (int a = 0; a < dimension; a++) {
            number = number << 1 | ((x[a] ^ turn) >> bit & 1);
        }
    }
    return number;
}

#endif
