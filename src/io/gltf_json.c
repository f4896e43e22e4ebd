#include "io/gltf_json_priv.h"

#include "io/bytes.h"

#include <string.h>

enum { HEAD = 20, CHUNK_HEAD = 8, JSON_CHUNK = 0x4e4f534a, BIN_CHUNK = 0x004e4942 };
static const int64_t JSON_MOST = (int64_t)1 << 28; /* bytes; a sequence of a million frames has less */

/* Where the JSON is in the file. */
static bool find_json(InFile *in, GltfJson *out, int64_t *from, int64_t *size, Err *err)
{
    uint8_t b[HEAD];
    *from = 0;
    *size = in->length;
    if (in->length >= HEAD && !infile_read(in, 0, sizeof b, b, err)) return false;
    out->binary = in->length >= HEAD && memcmp(b, "glTF", 4) == 0;
    if (out->binary) {
        *from = HEAD;
        *size = get_u32(b + 12);
        if (get_u32(b + 4) != 2 || get_u32(b + 16) != JSON_CHUNK || *size > in->length - HEAD || get_u32(b + 8) > in->length)
            return fail(err, ERR_INPUT, "%.600s: is no whole binary glTF 2 file; write or copy it again", in->path);
    }
    if (*size > JSON_MOST)
        return fail(err, ERR_INPUT, "%.600s: has more JSON than any glTF should; it is damaged", in->path);
    return true;
}

static bool find_chunk(InFile *in, int64_t at, GltfJson *out, Err *err)
{
    uint8_t b[CHUNK_HEAD];
    if (!out->binary || in->length - at < CHUNK_HEAD) return true;
    if (!infile_read(in, at, sizeof b, b, err)) return false;
    if (get_u32(b + 4) != BIN_CHUNK) return true;
    out->chunk_at = at + CHUNK_HEAD;
    out->chunk_bytes = get_u32(b);
    return out->chunk_bytes <= in->length - out->chunk_at ||
           fail(err, ERR_INPUT, "%.600s: is cut short (%lld bytes); write or copy the file again", in->path,
                (long long)in->length);
}

bool gltf_json_read(InFile *in, GltfJson *out, Err *err)
{
    int64_t from, size;
    *out = (GltfJson){0};
    if (!find_json(in, out, &from, &size, err)) return false;
    char *text = NEW(char, size);
    bool ok = infile_read(in, from, (size_t)size, text, err);
    out->root = ok ? json_loadb(text, (size_t)size, JSON_REJECT_DUPLICATES, NULL) : NULL;
    mem_free(text);
    if (ok && !json_is_string(json_object_get(json_object_get(out->root, "asset"), "version")))
        ok = fail(err, ERR_INPUT, "%.600s: its JSON is damaged or no glTF; write or copy the file again", in->path);
    ok = ok && find_chunk(in, from + size, out, err);
    if (ok) return true;
    json_decref(out->root);
    *out = (GltfJson){0};
    return false;
}

/* --- places ----------------------------------------------------------------------------------------- */

static bool read_vec3(json_t *list, double out[3])
{
    for (size_t k = 0; k < 3; k++) {
        if (!json_is_number(json_array_get(list, k))) return false;
        out[k] = json_number_value(json_array_get(list, k));
    }
    return json_array_size(list) == 3;
}

static bool read_place(json_t *node, GltfPlace *out)
{
    double scale[3] = {1, 1, 1};
    json_t *s = json_object_get(node, "scale"), *t = json_object_get(node, "translation");
    *out = (GltfPlace){.scale = 1};
    if ((s && !read_vec3(s, scale)) || (t && !read_vec3(t, out->at))) return false;
    out->scale = scale[0];
    return scale[0] == scale[1] && scale[1] == scale[2] && scale[0] > 0;
}

/* A node beside which no other names the same child. */
static bool place_children(json_t *nodes, json_t *parent, uint8_t *placed, GltfPlace *place)
{
    GltfPlace here;
    json_t *child;
    size_t i;
    if (json_object_get(parent, "mesh") || !read_place(parent, &here)) return false;
    json_array_foreach(json_object_get(parent, "children"), i, child)
    {
        json_int_t at = json_is_integer(child) ? json_integer_value(child) : NONE;
        json_t *node = gltf_at(nodes, at);
        if (!node || placed[at] || json_object_get(node, "children")) return false;
        place[at] = here;
        placed[at] = 1;
    }
    return true;
}

bool gltf_json_places(const GltfJson *json, GltfPlace *place)
{
    static const char *const foreign[] = {"matrix", "rotation", "skin"};
    json_t *nodes = json_object_get(json->root, "nodes"), *node;
    size_t i, n = json_array_size(nodes);
    uint8_t *placed = NEW0(uint8_t, n);
    bool good = true;
    for (i = 0; i < n; i++) place[i] = (GltfPlace){.scale = 1};
    json_array_foreach(nodes, i, node)
    {
        for (size_t k = 0; k < sizeof foreign / sizeof *foreign; k++) good = good && !json_object_get(node, foreign[k]);
        bool is_parent = json_object_get(node, "children") != NULL;
        if (is_parent) good = good && place_children(nodes, node, placed, place);
        else good = good && !(json_object_get(node, "mesh") && json_object_get(node, "translation"));
    }
    mem_free(placed);
    return good;
}
