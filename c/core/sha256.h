/* L0: SHA-256 (FIPS 180-4), for state hashes, restart files and the names of inputs. */
#ifndef GBG_CORE_SHA256_H
#define GBG_CORE_SHA256_H

#include <stddef.h>
#include <stdint.h>

/* Hidden from users, shared between our own libraries. */
#pragma GCC visibility push(default)

struct gbg_sha256 {
    uint32_t state[8];
    uint64_t bytes;
    unsigned char block[64];
};

void gbg_sha256_start(struct gbg_sha256 *hash);
void gbg_sha256_add(struct gbg_sha256 *hash, const void *data, size_t bytes);
void gbg_sha256_finish(struct gbg_sha256 *hash, unsigned char digest[32]);
/* Digest as 64 hexadecimal digits and a zero. */
void gbg_sha256_text(const unsigned char digest[32], char text[65]);
/* Digest text of a whole file; 0, or -1 when it cannot be read. */
int gbg_sha256_file(const char *path, char text[65]);

#pragma GCC visibility pop

#endif
