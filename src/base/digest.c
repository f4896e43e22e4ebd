#include "base/digest.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <xxhash.h>

uint64_t digest_bytes(const void *data, size_t n) { return XXH3_64bits(data, n); }

void digest_add(Digest128 *d, const void *data, size_t n)
{
    XXH128_hash_t part = XXH3_128bits(data, n);
    uint64_t all[4] = {d->low, d->high, part.low64, part.high64};
    XXH128_hash_t sum = XXH3_128bits(all, sizeof all);
    *d = (Digest128){sum.low64, sum.high64};
}

bool digest_file(const char *path, uint64_t *out, Err *err)
{
    enum { BLOCK = 1 << 18 };
    FILE *f = fopen(path, "rb");
    if (!f) return fail(err, ERR_INPUT, "%.800s: cannot be read: %s", path, strerror(errno));
    uint8_t *block = NEW(uint8_t, BLOCK);
    XXH3_state_t *state = XXH3_createState();
    if (!state || XXH3_64bits_reset(state) != XXH_OK) return fail(err, ERR_RESOURCE, "out of memory");
    for (size_t n; (n = fread(block, 1, BLOCK, f)) > 0;) XXH3_64bits_update(state, block, n);
    bool good = !ferror(f) || fail(err, ERR_INPUT, "%.800s: cannot be read: %s", path, strerror(errno));
    *out = XXH3_64bits_digest(state);
    XXH3_freeState(state);
    mem_free(block);
    fclose(f);
    return good;
}
