/* gltf_json_priv.h: the JSON of a .glb or .gltf and where the file's own bytes are; pieces of it, each checked. */
#pragma once
#include "io/io_priv.h"

#include <jansson.h>

typedef struct GltfJson {
    json_t *root;
    bool binary;
    int64_t chunk_at, chunk_bytes; /* the binary chunk of a .glb; bytes 0: there is none */
} GltfJson;

/* Memory is some twenty times the JSON's length. The root is json_decref'ed by the caller. */
bool gltf_json_read(InFile *in, GltfJson *out, Err *err);

/* An item, or NULL. */
static inline json_t *gltf_at(json_t *array, int64_t i) { return i < 0 ? NULL : json_array_get(array, (size_t)i); }
/* A whole number that is not negative, of an object; or NONE. */
static inline int64_t gltf_whole(json_t *object, const char *key)
{
    json_t *v = json_object_get(object, key);
    return json_is_integer(v) && json_integer_value(v) >= 0 ? json_integer_value(v) : NONE;
}

/* Where a node stands: its coordinates times scale, and at. */
typedef struct GltfPlace {
    double scale, at[3];
} GltfPlace;

/* place[number of nodes]. A node stands where its parent says, which has neither a mesh nor a parent; its own scale is left
 * out: it tells whether it is shown. False where nodes stand in other ways: turned, deeper or stretched; the places are as far
 * as they are known then. */
bool gltf_json_places(const GltfJson *json, GltfPlace *place);
