/* L0: SHA-256 (FIPS 180-4). */
#include "core/sha256.h"

#include <stdio.h>
#include <string.h>

static const uint32_t round_constant[64] = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

static uint32_t rotate(uint32_t x, int n)
{
    return x >> n | x << (32 - n);
}

static void compress(uint32_t state[8], const unsigned char *block)
{
    uint32_t w[64], s[8];
    for (int t = 0; t < 16; t++) {
        w[t] = (uint32_t)block[4 * t] << 24 | (uint32_t)block[4 * t + 1] << 16 |
               (uint32_t)block[4 * t + 2] << 8 | block[4 * t + 3];
    }
    for (int t = 16; t < 64; t++) {
        uint32_t a = rotate(w[t - 15], 7) ^ rotate(w[t - 15], 18) ^ w[t - 15] >> 3;
        uint32_t b = rotate(w[t - 2], 17) ^ rotate(w[t - 2], 19) ^ w[t - 2] >> 10;
        w[t] = w[t - 16] + a + w[t - 7] + b;
    }
    memcpy(s, state, sizeof s);
    for (int t = 0; t < 64; t++) {
        uint32_t e = rotate(s[4], 6) ^ rotate(s[4], 11) ^ rotate(s[4], 25);
        uint32_t choice = (s[4] & s[5]) ^ (~s[4] & s[6]);
        uint32_t t1 = s[7] + e + choice + round_constant[t] + w[t];
        uint32_t a = rotate(s[0], 2) ^ rotate(s[0], 13) ^ rotate(s[0], 22);
        uint32_t majority = (s[0] & s[1]) ^ (s[0] & s[2]) ^ (s[1] & s[2]);
        memmove(s + 1, s, 7 * sizeof s[0]);
        s[4] += t1;
        s[0] = t1 + a + majority;
    }
    for (int k = 0; k < 8; k++) {
        state[k] += s[k];
    }
}

void gbg_sha256_start(struct gbg_sha256 *hash)
{
    static const uint32_t first[8] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    memcpy(hash->state, first, sizeof first);
    hash->bytes = 0;
}

void gbg_sha256_add(struct gbg_sha256 *hash, const void *data, size_t bytes)
{
    const unsigned char *p = data;
    size_t filled = hash->bytes % 64;
    hash->bytes += bytes;
    while (bytes > 0) {
        size_t take = 64 - filled < bytes ? 64 - filled : bytes;
        memcpy(hash->block + filled, p, take);
        filled += take;
        p += take;
        bytes -= take;
        if (filled == 64) {
            compress(hash->state, hash->block);
            filled = 0;
        }
    }
}

void gbg_sha256_finish(struct gbg_sha256 *hash, unsigned char digest[32])
{
    uint64_t bits = hash->bytes * 8;
    unsigned char pad[72] = {0x80};
    size_t filled = hash->bytes % 64;
    size_t zeros = (filled < 56 ? 56 : 120) - filled;
    for (int k = 0; k < 8; k++) {
        pad[zeros + (size_t)k] = (unsigned char)(bits >> (56 - 8 * k));
    }
    gbg_sha256_add(hash, pad, zeros + 8);
    for (int k = 0; k < 32; k++) {
        digest[k] = (unsigned char)(hash->state[k / 4] >> (24 - 8 * (k % 4)));
    }
}

void gbg_sha256_text(const unsigned char digest[32], char text[65])
{
    static const char digit[] = "0123456789abcdef";
    for (int k = 0; k < 32; k++) {
        text[2 * k] = digit[digest[k] >> 4];
        text[2 * k + 1] = digit[digest[k] & 15];
    }
    text[64] = 0;
}

int gbg_sha256_file(const char *path, char text[65])
{
    FILE *file = fopen(path, "rb");
    if (!file) {
        return -1;
    }
    struct gbg_sha256 hash;
    gbg_sha256_start(&hash);
    unsigned char buffer[16384];
    size_t got;
    while ((got = fread(buffer, 1, sizeof buffer, file)) > 0) {
        gbg_sha256_add(&hash, buffer, got);
    }
    int bad = ferror(file);
    fclose(file);
    unsigned char digest[32];
    gbg_sha256_finish(&hash, digest);
    gbg_sha256_text(digest, text);
    return bad ? -1 : 0;
}
