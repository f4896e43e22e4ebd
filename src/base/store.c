#include "base/store.h"

#include <string.h>

Store store_writing(void) { return (Store){0}; }

Store store_reading(const void *data, size_t n)
{
    return (Store){.reading = true, .data = (uint8_t *)data, .n = n}; /* never written to */
}

void store_free(Store *s)
{
    if (!s->reading) mem_free(s->data);
    *s = (Store){0};
}

void store_expect(Store *s, bool holds)
{
    if (s->reading && !holds) s->bad = true;
}

static void put(Store *s, const void *value, size_t size)
{
    if (size == 0) return;
    RESERVE(s->data, s->cap, s->n + size);
    memcpy(s->data + s->n, value, size);
    s->n += size;
}

static void get(Store *s, void *value, size_t size)
{
    store_expect(s, size <= s->n - s->at);
    if (size == 0) return;
    if (s->bad) {
        memset(value, 0, size);
        return;
    }
    memcpy(value, s->data + s->at, size);
    s->at += size;
}

void store_bytes(Store *s, void *value, size_t size)
{
    if (s->reading) get(s, value, size);
    else put(s, value, size);
}

void store_array(Store *s, void **array, int64_t n, size_t size)
{
    if (s->reading) {
        store_expect(s, n >= 0 && (size_t)n <= (s->n - s->at) / size);
        if (s->bad) n = 0;
        *array = mem_alloc((size_t)n, size);
    }
    store_bytes(s, *array, (size_t)n * size);
}

void store_text(Store *s, char **text)
{
    int n = s->reading || !*text ? 0 : (int)strlen(*text) + 1;
    STORE(s, n);
    STORE_ARRAY(s, *text, n);
    if (!s->reading) return;
    store_expect(s, s->bad || n == 0 || (*text)[n - 1] == 0);
    if (n && !s->bad) return;
    mem_free(*text);
    *text = NULL;
}

void store_map(Store *s, Map *m)
{
    int count = m->count;
    STORE(s, count);
    if (!s->reading) {
        for (int i = 0; i < m->cap; i++)
            if (m->value[i] != NONE) STORE(s, m->key[i]), STORE(s, m->value[i]);
        return;
    }
    store_expect(s, count >= 0 && (size_t)count <= (s->n - s->at) / (sizeof(uint64_t) + sizeof(int32_t)));
    map_init(m, s->bad ? 0 : count);
    for (int i = 0; i < count && !s->bad; i++) {
        uint64_t key = 0;
        int32_t value = 0;
        STORE(s, key);
        STORE(s, value);
        store_expect(s, value >= 0);
        if (!s->bad) map_put(m, key, value);
    }
}
