/* hash.h: a map from a 64-bit key to an int32, open addressing; iteration order is never used. */
#pragma once
#include "base/base.h"

typedef struct Map {
    uint64_t *key;
    int32_t *value; /* NONE: a free slot */
    int cap, count; /* cap is 0 or a power of two */
} Map;

void map_init(Map *m, int expected);
void map_free(Map *m);
/* The value, or NONE. */
int32_t map_get(const Map *m, uint64_t key);
/* The slot's value; inserts `fresh` (>= 0) where the key is new. */
int32_t map_put(Map *m, uint64_t key, int32_t fresh);
void map_clear(Map *m);

static inline uint64_t hash_mix(uint64_t x)
{
    x ^= x >> 33; x *= 0xff51afd7ed558ccdULL;
    x ^= x >> 33; x *= 0xc4ceb9fe1a85ec53ULL;
    return x ^ x >> 33;
}
/* Integer coordinates within +-2^20 as one key. */
static inline uint64_t key_coord(int x, int y, int z)
{
    return ((uint64_t)(uint32_t)(x + (1 << 20)) << 42) | ((uint64_t)(uint32_t)(y + (1 << 20)) << 21) |
           (uint64_t)(uint32_t)(z + (1 << 20));
}
static inline uint64_t key_pair(int a, int b) { return ((uint64_t)(uint32_t)a << 32) | (uint32_t)b; }
