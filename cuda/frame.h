/* L1, CUDA: copies of the state for output, made while the next steps run. */
#ifndef GBG_CUDA_FRAME_H
#define GBG_CUDA_FRAME_H

#include "cuda/cuda.h"

int gbg_cuda_frame_begin(struct gbg_device *device, const struct gbg_state *state, int images,
                         int overlapped, struct gbg_slot **slot);
const char *gbg_cuda_frame_wait(struct gbg_slot *slot, struct gbg_frame *frame);
void gbg_cuda_frame_release(struct gbg_slot *slot);

#endif
