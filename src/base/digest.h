/* digest.h: bits that tell contents apart (XXH3); no protection against forgers. */
#pragma once
#include "base/base.h"

uint64_t digest_bytes(const void *data, size_t n);

/* So many bits that two contents with the same ones are taken for the same. Starts at zero; what is added is mixed with what was. */
typedef struct Digest128 {
    uint64_t low, high;
} Digest128;

void digest_add(Digest128 *d, const void *data, size_t n);
static inline bool digest_is_same(Digest128 a, Digest128 b) { return a.low == b.low && a.high == b.high; }

/* Of a whole file. False with a sentence where it cannot be read. */
bool digest_file(const char *path, uint64_t *out, Err *err);
