/* store.h: values as bytes in memory, and back: what PREFIX.state is made of.
 *
 * One description serves both ways. A function that lists what is to be kept with the calls below writes it into a store
 * made by store_writing, and takes it out again, in the same order, from one made by store_reading. Bytes that are read
 * are not trusted: whatever they cannot be makes the store `bad`, and from then on every value reads as zero and every
 * array as empty, so that the caller looks once, at the end. Numbers are as this machine and this build have them. */
#pragma once
#include "base/base.h"
#include "base/hash.h"

typedef struct Store {
    bool reading, bad;
    uint8_t *data;   /* writing: owned, [cap]; reading: borrowed */
    size_t n, cap;
    size_t at;       /* of the next value to read */
} Store;

Store store_writing(void);
Store store_reading(const void *data, size_t n);
void store_free(Store *s);

void store_bytes(Store *s, void *value, size_t size);
/* An array of n items, a number that was stored before. Reading allocates it, which the bytes that are there must justify. */
void store_array(Store *s, void **array, int64_t n, size_t size);
void store_text(Store *s, char **text); /* NULL is kept */
void store_map(Store *s, Map *m);
/* While reading: what was read must hold. */
void store_expect(Store *s, bool holds);

#define STORE(s, value) store_bytes((s), &(value), sizeof(value))
#define STORE_ARRAY(s, array, n) store_array((s), (void **)&(array), (n), sizeof *(array))
