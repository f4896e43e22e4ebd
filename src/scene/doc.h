/* doc.h: a scene file's text as a tree whose complaints name file, line, element and field. */
#pragma once
#include "scene/scene_priv.h"

#include <jansson.h>

enum { JSON_BYTES_MAX = 1 << 24 };

typedef struct Doc {
    const char *path;
    char *text;
    json_t *root;
    Err *err;
} Doc;

/* Where a value stands: a member (key) or an item (index) of what `up` stands for; NULL: the whole file. */
typedef struct Place {
    const struct Place *up;
    const char *key;      /* NULL: an item */
    int index;
} Place;

static inline Place place_key(const Place *up, const char *key) { return (Place){up, key, NONE}; }
static inline Place place_item(const Place *up, int index) { return (Place){up, NULL, index}; }

/* The file must hold an object. */
bool doc_open(Doc *d, const char *path, Err *err);
void doc_close(Doc *d);

/* "FILE:LINE: element 3, "radius": ..." Always false. */
bool doc_fail(const Doc *d, const Place *at, const char *fmt, ...) __attribute__((format(printf, 3, 4)));

/* False where an object has a member that is not in the list, which NULL ends. */
bool doc_check_keys(const Doc *d, const Place *at, const json_t *object, const char *const *known);
/* A finite number from low to high. */
bool doc_real(const Doc *d, const Place *at, const json_t *v, double low, double high, double *out);
/* `n` of them in an array. */
bool doc_reals(const Doc *d, const Place *at, const json_t *v, int n, double low, double high, double *out);
bool doc_point(const Doc *d, const Place *at, const json_t *v, Vec3 *out);
/* Which of the names a text is; names end with NULL. */
bool doc_choice(const Doc *d, const Place *at, const json_t *v, const char *const *names, int *out);
/* The line of a place in the text, from 1: of its key or its item; of what holds it, where it is not there. */
int doc_line(const Doc *d, const Place *at);
