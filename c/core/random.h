/* L0: the counter-based generator Philox4x32-10 (Salmon et al., SC 2011). */
#ifndef GBG_CORE_RANDOM_H
#define GBG_CORE_RANDOM_H

#include <stdint.h>

#include "core/inline.h"

/* Streams: the top 8 bits of the last counter word, so that uses never share a number. */
enum gbg_stream {
    GBG_STREAM_NOISE = 0,    /* one call a particle and step; redraws follow in 1..15 */
    GBG_STREAM_START = 16,   /* start configurations */
    GBG_STREAM_CONTACT = 17, /* directions of coincident pairs */
    GBG_STREAM_BRIDGE = 18,  /* one call a pair and step, rule bridge */
    GBG_STREAM_PAIR = 19     /* folds a pair of ids that do not fit in 32 bits */
};

struct gbg_philox {
    uint32_t word[4];
};

/* key (seed, run), counter (step, id, stream): id below 2^56. */
GBG_INLINE struct gbg_philox gbg_philox_counter(uint64_t step, uint64_t id, uint32_t stream)
{
    struct gbg_philox c = {{(uint32_t)step, (uint32_t)(step >> 32), (uint32_t)id,
                            ((uint32_t)(id >> 32) & 0xFFFFFFu) | stream << 24}};
    return c;
}

GBG_INLINE struct gbg_philox gbg_philox(struct gbg_philox c, uint32_t key0, uint32_t key1)
{
    for (int round = 0; round < 10; round++) {
        uint64_t p = (uint64_t)0xD2511F53u * c.word[0];
        uint64_t q = (uint64_t)0xCD9E8D57u * c.word[2];
        struct gbg_philox next = {{(uint32_t)(q >> 32) ^ c.word[1] ^ key0, (uint32_t)q,
                                   (uint32_t)(p >> 32) ^ c.word[3] ^ key1, (uint32_t)p}};
        c = next;
        key0 += 0x9E3779B9u;
        key1 += 0xBB67AE85u;
    }
    return c;
}

/* Counter of a pair of ids min < max below 2^56 in a step: plain for ids below 2^32 and steps below
 * 2^56; larger ids are first folded to 56 bits under the same key. */
GBG_INLINE struct gbg_philox gbg_philox_pair(uint64_t step, uint64_t min, uint64_t max,
                                                uint32_t stream, uint32_t key0, uint32_t key1)
{
    uint32_t first = (uint32_t)min, second = (uint32_t)max;
    if (max >> 32) {
        struct gbg_philox folded =
            gbg_philox(gbg_philox_counter(min, max, GBG_STREAM_PAIR), key0, key1);
        first = folded.word[0];
        second = folded.word[1];
    }
    struct gbg_philox c = {
        {(uint32_t)step, first, second, ((uint32_t)(step >> 32) & 0xFFFFFFu) | stream << 24}};
    return c;
}

/* Uniform in (0,1) from 53 bits: never 0 or 1. */
GBG_INLINE double gbg_uniform(uint32_t high, uint32_t low)
{
    uint64_t bits = ((uint64_t)high << 32 | low) >> 11;
    return ((double)bits + 0.5) * 0x1p-53;
}

#endif
