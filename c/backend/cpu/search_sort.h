/* L1, CPU, per instruction set: the indices of a row in ascending order. */
#ifndef GBG_BACKEND_CPU_SEARCH_SORT_H
#define GBG_BACKEND_CPU_SEARCH_SORT_H

#include <stdint.h>
#include <string.h>

#include "backend/cpu/simd.h"

/* A row may be written in whole vectors: room behind it. */
enum { GBG_SORT_SLACK = 64, GBG_SORT_RANK_MOST = 160 };

#if VF_LANES < 16
/* Merges the ascending runs of a long row until one is left; returns where it stands. */
static int32_t *merge_runs(int32_t *row, int32_t *other, int64_t n)
{
    for (;;) {
        int64_t at = 0, merged = 0;
        while (at < n) {
            int64_t middle = at + 1, end;
            while (middle < n && row[middle] > row[middle - 1]) {
                middle++;
            }
            for (end = middle + 1; end < n && row[end] > row[end - 1]; end++) {
            }
            end = middle < n ? end : n;
            int64_t p = at, q = middle;
            for (int64_t k = at; k < end; k++) {
                other[k] = q >= end || (p < middle && row[p] < row[q]) ? row[p++] : row[q++];
            }
            at = end;
            merged++;
        }
        int32_t *swap = row;
        row = other;
        other = swap;
        if (merged <= 1) {
            return row;
        }
    }
}

/* Each index goes to the place that the number of smaller ones names. */
static inline void sort_by_rank(const int32_t *row, int64_t n, int32_t *to)
{
    const vi one = vi_set(1), zero = vi_set(0);
    for (int64_t k = 0; k < n; k += VF_LANES) {
        vi own = vi_load(row + k), rank = zero;
        for (int64_t j = 0; j < n; j++) {
            rank = vi_add(rank, vi_select(vi_lt(vi_set(row[j]), own), one, zero));
        }
        int32_t place[VF_LANES];
        vi_store(place, rank);
        int64_t lanes = n - k < VF_LANES ? n - k : VF_LANES;
        for (int64_t l = 0; l < lanes; l++) {
            to[place[l]] = row[k + l];
        }
    }
}

#else
/* Bitonic networks (Batcher 1968) on one, two and four registers. A step compares each lane with
 * the one at a distance of 8, 4, 2 or 1; the lanes of `larger` keep the larger. */
#define GBG_SORT_STEP(v, partner, larger)                                                          \
    do {                                                                                           \
        __m512i other_ = (partner);                                                                \
        v = _mm512_mask_max_epi32(_mm512_min_epi32(v, other_), larger, v, other_);                 \
    } while (0)
#define GBG_SORT_1(v) _mm512_shuffle_epi32(v, (_MM_PERM_ENUM)0xB1)
#define GBG_SORT_2(v) _mm512_shuffle_epi32(v, (_MM_PERM_ENUM)0x4E)
#define GBG_SORT_4(v) _mm512_shuffle_i32x4(v, v, 0xB1)
#define GBG_SORT_8(v) _mm512_shuffle_i32x4(v, v, 0x4E)

/* A sequence that rises and then falls. */
static inline __m512i sort_bitonic(__m512i v)
{
    GBG_SORT_STEP(v, GBG_SORT_8(v), 0xFF00);
    GBG_SORT_STEP(v, GBG_SORT_4(v), 0xF0F0);
    GBG_SORT_STEP(v, GBG_SORT_2(v), 0xCCCC);
    GBG_SORT_STEP(v, GBG_SORT_1(v), 0xAAAA);
    return v;
}

static inline __m512i sort_16(__m512i v)
{
    GBG_SORT_STEP(v, GBG_SORT_1(v), 0x6666);
    GBG_SORT_STEP(v, GBG_SORT_2(v), 0x3C3C);
    GBG_SORT_STEP(v, GBG_SORT_1(v), 0x5A5A);
    GBG_SORT_STEP(v, GBG_SORT_4(v), 0x0FF0);
    GBG_SORT_STEP(v, GBG_SORT_2(v), 0x33CC);
    GBG_SORT_STEP(v, GBG_SORT_1(v), 0x55AA);
    return sort_bitonic(v);
}

static inline __m512i sort_reverse(__m512i v)
{
    return _mm512_permutexvar_epi32(
        _mm512_set_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15), v);
}

/* Two ascending registers into one sequence. */
static inline void sort_merge_2(__m512i *a, __m512i *b)
{
    __m512i back = sort_reverse(*b), low = _mm512_min_epi32(*a, back);
    *b = sort_bitonic(_mm512_max_epi32(*a, back));
    *a = sort_bitonic(low);
}

/* Lanes k.. of a row; beyond its end the largest integer, which no index is. */
static inline __m512i sort_load(const int32_t *row, int64_t n, int k)
{
    int64_t left = n - k;
    __mmask16 lanes = left >= 16 ? 0xFFFF : left > 0 ? (__mmask16)((1u << left) - 1) : 0;
    return _mm512_mask_loadu_epi32(_mm512_set1_epi32(INT32_MAX), lanes, row + k);
}

static inline void sort_64(const int32_t *row, int64_t n, int32_t *to)
{
    __m512i v[4], back[2], low[2], high[2];
    for (int k = 0; k < 4; k++) {
        v[k] = sort_16(sort_load(row, n, 16 * k));
    }
    sort_merge_2(&v[0], &v[1]);
    sort_merge_2(&v[2], &v[3]);
    back[0] = sort_reverse(v[3]);
    back[1] = sort_reverse(v[2]);
    for (int k = 0; k < 2; k++) {
        low[k] = _mm512_min_epi32(v[k], back[k]);
        high[k] = _mm512_max_epi32(v[k], back[k]);
    }
    _mm512_storeu_si512(to, sort_bitonic(_mm512_min_epi32(low[0], low[1])));
    _mm512_storeu_si512(to + 16, sort_bitonic(_mm512_max_epi32(low[0], low[1])));
    _mm512_storeu_si512(to + 32, sort_bitonic(_mm512_min_epi32(high[0], high[1])));
    _mm512_storeu_si512(to + 48, sort_bitonic(_mm512_max_epi32(high[0], high[1])));
}

/* Merges two ascending runs, of lengths that are multiples of 16: the upper half of what has been
 * merged meets the next 16 of the run that goes on with the smaller index. */
static inline void merge_two(const int32_t *a, int64_t n_a, const int32_t *b, int64_t n_b,
                             int32_t *to)
{
    __m512i low = _mm512_loadu_si512(a), high = _mm512_loadu_si512(b);
    int64_t p = 16, q = 16;
    for (;;) {
        sort_merge_2(&low, &high);
        _mm512_storeu_si512(to, low);
        to += 16;
        low = high;
        if (p < n_a && (q >= n_b || a[p] < b[q])) {
            high = _mm512_loadu_si512(a + p);
            p += 16;
        } else if (q < n_b) {
            high = _mm512_loadu_si512(b + q);
            q += 16;
        } else {
            break;
        }
    }
    _mm512_storeu_si512(to, low);
}

/* Rows of more than 64: sorted by 64, then merged; the last merge writes to `to`. */
static void sort_long(int32_t *row, int32_t *other, int64_t n, int32_t *to)
{
    int64_t padded = (n + 63) & ~INT64_C(63);
    for (int64_t k = 0; k < padded; k += 64) {
        sort_64(row + k, n - k, row + k);
    }
    for (int64_t run = 64; run < padded; run *= 2) {
        int32_t *out = 2 * run >= padded ? to : other;
        for (int64_t k = 0; k < padded; k += 2 * run) {
            int64_t rest = padded - k - run;
            if (rest > 0) {
                merge_two(row + k, run, row + k + run, rest < run ? rest : run, out + k);
            } else {
                memcpy(out + k, row + k, (size_t)(padded - k) * sizeof *out);
            }
        }
        other = row;
        row = out;
    }
}
#endif

/* The n different indices of a row in ascending order at `to`, which has GBG_SORT_SLACK elements
 * of room behind them, as `row` and `other`, which is room for n, have. */
static inline void sort_row(int32_t *row, int32_t *other, int64_t n, int32_t *to)
{
#if VF_LANES == 16
    if (n <= 16) {
        _mm512_storeu_si512(to, sort_16(sort_load(row, n, 0)));
        return;
    }
    if (n <= 32) {
        __m512i a = sort_16(sort_load(row, n, 0)), b = sort_16(sort_load(row, n, 16));
        sort_merge_2(&a, &b);
        _mm512_storeu_si512(to, a);
        _mm512_storeu_si512(to + 16, b);
        return;
    }
    if (n <= 64) {
        sort_64(row, n, to);
        return;
    }
    sort_long(row, other, n, to);
#else
    if (n <= GBG_SORT_RANK_MOST) {
        sort_by_rank(row, n, to);
    } else {
        memcpy(to, merge_runs(row, other, n), (size_t)n * sizeof *to);
    }
#endif
}

#endif
