#include "base/hash.h"

void map_init(Map *m, int expected)
{
    int cap = 16;
    while (cap < 2 * expected) cap *= 2;
    *m = (Map){.key = NEW(uint64_t, cap), .value = NEW(int32_t, cap), .cap = cap};
    map_clear(m);
}

void map_free(Map *m)
{
    mem_free(m->key);
    mem_free(m->value);
    *m = (Map){0};
}

void map_clear(Map *m)
{
    for (int i = 0; i < m->cap; i++) m->value[i] = NONE;
    m->count = 0;
}

static int slot_of(const Map *m, uint64_t key)
{
    unsigned mask = (unsigned)m->cap - 1;
    unsigned i = (unsigned)hash_mix(key) & mask;
    while (m->value[i] != NONE && m->key[i] != key) i = (i + 1) & mask;
    return (int)i;
}

int32_t map_get(const Map *m, uint64_t key)
{
    return m->cap ? m->value[slot_of(m, key)] : NONE;
}

static void grow(Map *m)
{
    Map old = *m;
    map_init(m, old.cap);
    for (int i = 0; i < old.cap; i++)
        if (old.value[i] != NONE) {
            int s = slot_of(m, old.key[i]);
            m->key[s] = old.key[i];
            m->value[s] = old.value[i];
            m->count++;
        }
    map_free(&old);
}

int32_t map_put(Map *m, uint64_t key, int32_t fresh)
{
    ASSERT(fresh >= 0);
    if (2 * (m->count + 1) > m->cap) {
        if (m->cap) grow(m); else map_init(m, 16);
    }
    int s = slot_of(m, key);
    if (m->value[s] == NONE) {
        m->key[s] = key;
        m->value[s] = fresh;
        m->count++;
    }
    return m->value[s];
}
