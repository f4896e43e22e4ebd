#include "io/gltf_read.h"

#include "io/gltf_bytes_priv.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* In all channels: a file that shares few keys among many nodes must not make much of them. */
enum { KEYS_MOST = 1 << 24 };
#define GAP_MOST 1e9 /* frames between two keys */

typedef struct Key {
    double time;
    int64_t number;
    int32_t node, row;    /* row of its weights; NONE: the base */
    int64_t weights;      /* their accessor */
    bool is_frame;        /* the node is shown, and this is when it moves or appears */
} Key;

struct GltfReader {
    char *path;
    GltfJson json;
    GltfBytes bytes;
    GltfPlace *place;     /* [number of nodes] */
    int nkey, capkey;     /* once open: frames only, by time */
    Key *key;
};

static bool refuse(const GltfReader *r, const char *why, Err *err) { return gltf_refuse(&r->bytes, why, err); }
static json_t *items(const GltfReader *r, const char *name) { return json_object_get(r->json.root, name); }

/* --- channels ------------------------------------------------------------------------------------- */

typedef struct Sampler {
    int64_t input, output; /* accessors; NONE: there is no such channel */
} Sampler;

typedef struct NodeChannels {
    Sampler scale, weights;
} NodeChannels;

static bool note_channel(GltfReader *r, json_t *animation, json_t *channel, int nnode, NodeChannels *of, Err *err)
{
    json_t *target = json_object_get(channel, "target"),
           *sampler = gltf_at(json_object_get(animation, "samplers"), gltf_whole(channel, "sampler"));
    int64_t node = gltf_whole(target, "node");
    const char *path = json_string_value(json_object_get(target, "path")),
               *kind = json_string_value(json_object_get(sampler, "interpolation"));
    bool scale = path && strcmp(path, "scale") == 0, weights = path && strcmp(path, "weights") == 0;
    if (node == NONE || node >= nnode || !sampler || !(scale || weights))
        return refuse(r, "something but scale and weights is animated, which is not read", err);
    if (kind && strcmp(kind, "CUBICSPLINE") == 0)
        return refuse(r, "its animation is of cubic splines, which are not read", err);
    Sampler *s = scale ? &of[node].scale : &of[node].weights;
    *s = (Sampler){gltf_whole(sampler, "input"), gltf_whole(sampler, "output")};
    return true;
}

static bool note_channels(GltfReader *r, int nnode, NodeChannels *of, Err *err)
{
    json_t *animation, *channel;
    size_t i, k;
    for (int n = 0; n < nnode; n++) of[n] = (NodeChannels){{NONE, NONE}, {NONE, NONE}};
    json_array_foreach(items(r, "animations"), i, animation)
        json_array_foreach(json_object_get(animation, "channels"), k, channel)
            if (!note_channel(r, animation, channel, nnode, of, err)) return false;
    return true;
}

/* A sampler's times, at least one; the caller frees them. NULL on failure. */
static float *read_times(GltfReader *r, const Sampler *s, int *count, Err *err)
{
    GltfRows rows;
    if (!gltf_rows_find(&r->bytes, s->input, &rows, err)) return NULL;
    if (rows.width != 1 || rows.count > KEYS_MOST - r->nkey) {
        refuse(r, "its animation has more keys than are read", err);
        return NULL;
    }
    float *time = NEW(float, rows.count);
    bool good = gltf_rows_floats(&r->bytes, &rows, 0, rows.count, time, err);
    for (int k = 0; good && k < rows.count; k++)
        if (!(time[k] >= (k ? time[k - 1] : 0)) || !isfinite(time[k]))
            good = refuse(r, "the keys of its animation are out of order; it is damaged", err);
    *count = rows.count;
    if (good) return time;
    mem_free(time);
    return NULL;
}

/* --- which frames there are ----------------------------------------------------------------------- */

typedef struct Shown {
    int n;
    float *time;    /* [n] NULL: it is shown always */
    uint8_t *shown; /* [n] from that time on */
} Shown;

static void shown_free(Shown *s)
{
    mem_free(s->time);
    mem_free(s->shown);
}

/* Before the first key that key's value holds. */
static bool is_shown(const Shown *s, float time)
{
    if (!s->time) return true;
    int lo = 0, hi = s->n; /* the first key later than that lies in [lo, hi] */
    while (lo < hi) {
        int mid = lo + (hi - lo) / 2;
        if (s->time[mid] > time) hi = mid;
        else lo = mid + 1;
    }
    return s->shown[int_max(lo - 1, 0)];
}

static bool read_shown(GltfReader *r, const Sampler *s, Shown *out, Err *err)
{
    GltfRows rows;
    *out = (Shown){0};
    if (s->input == NONE) return true;
    out->time = read_times(r, s, &out->n, err);
    if (!out->time || !gltf_rows_find(&r->bytes, s->output, &rows, err)) return false;
    if (rows.width != 3 || rows.count != out->n)
        return refuse(r, "an animation has other numbers of times and values; it is damaged", err);
    float *scale = NEW(float, 3 * (size_t)out->n);
    out->shown = NEW(uint8_t, out->n);
    bool good = gltf_rows_floats(&r->bytes, &rows, 0, out->n, scale, err);
    for (int k = 0; good && k < out->n; k++) {
        const float *v = scale + 3 * k;
        out->shown[k] = v[0] != 0;
        if (v[0] != v[1] || v[1] != v[2] || (v[0] != 0 && v[0] != 1))
            good = refuse(r, "a mesh is scaled, which is not read", err);
    }
    mem_free(scale);
    return good;
}

static void add_key(GltfReader *r, Key key)
{
    RESERVE(r->key, r->capkey, r->nkey + 1);
    r->key[r->nkey++] = key;
}

static bool add_node(GltfReader *r, int node, const NodeChannels *c, Err *err)
{
    Shown shown;
    float *time = NULL;
    int n = 0;
    bool good = read_shown(r, &c->scale, &shown, err), moves = c->weights.input != NONE;
    if (good && moves) good = (time = read_times(r, &c->weights, &n, err)) != NULL;
    for (int k = 0; good && k < n; k++)
        add_key(r, (Key){.time = (double)time[k],
                         .node = node,
                         .row = k,
                         .weights = c->weights.output,
                         .is_frame = is_shown(&shown, time[k])});
    for (int k = 0; good && k < shown.n; k++) {
        bool appears = shown.shown[k] && (k == 0 || !shown.shown[k - 1]);
        add_key(r, (Key){.time = (double)shown.time[k], .node = node, .row = NONE, .is_frame = appears && !moves});
    }
    if (good && !moves && !shown.time) add_key(r, (Key){.node = node, .row = NONE, .is_frame = true});
    mem_free(time);
    shown_free(&shown);
    return good;
}

static bool is_hidden(json_t *node)
{
    json_t *scale = json_object_get(node, "scale");
    return json_array_size(scale) == 3 && json_number_value(json_array_get(scale, 0)) == 0;
}

/* Nodes without a mesh are passed over. */
static bool add_nodes(GltfReader *r, int nnode, const NodeChannels *of, Err *err)
{
    int meshes = 0, always = 0;
    for (int i = 0; i < nnode; i++) {
        json_t *node = gltf_at(items(r, "nodes"), i);
        bool animated = of[i].scale.input != NONE;
        if (!json_object_get(node, "mesh")) {
            if (animated) return refuse(r, "something but a mesh is animated, which is not read", err);
            continue;
        }
        if (!animated && is_hidden(node)) continue;
        meshes++;
        always += !animated;
        if (!add_node(r, i, &of[i], err)) return false;
    }
    return always == 0 || meshes == 1 ||
           refuse(r, "it shows several meshes at once; only what twinmesh writes is read", err);
}

static int compare_keys(const void *pa, const void *pb)
{
    const Key *a = pa, *b = pb;
    if (a->time != b->time) return a->time < b->time ? -1 : 1;
    if (a->node != b->node) return a->node < b->node ? -1 : 1;
    return a->row < b->row ? -1 : a->row > b->row;
}

/* The mean of the ways between two times that are about as long as the shortest: times far from 0 are rounded. */
static double frame_seconds(const GltfReader *r)
{
    double shortest = INFINITY, sum = 0;
    int n = 0;
    for (int pass = 0; pass < 2; pass++) {
        double before = 0;
        for (int k = 0; k < r->nkey; before = r->key[k++].time) {
            double way = r->key[k].time - before;
            if (pass == 0 && way > 0) shortest = real_min(shortest, way);
            if (pass == 1 && way > 0 && way < 1.5 * shortest) sum += way, n++;
        }
    }
    return n ? sum / n : 1;
}

/* Numbers the keys, which stand whole frames apart. What a frame lasts is known the better the farther they go. */
static bool number_keys(GltfReader *r, Err *err)
{
    double before = 0, seconds;
    int64_t number = 0;
    if (r->nkey) qsort(r->key, (size_t)r->nkey, sizeof *r->key, compare_keys);
    seconds = frame_seconds(r);
    for (int k = 0; k < r->nkey; k++) {
        double steps = (r->key[k].time - before) / seconds;
        if (!(steps <= GAP_MOST)) return refuse(r, "the keys of its animation are no frames", err);
        number += (int64_t)(steps + 0.5);
        r->key[k].number = number;
        before = r->key[k].time;
        if (number > 0) seconds = before / (double)number;
    }
    return true;
}

static bool keep_frames(GltfReader *r, Err *err)
{
    int n = 0;
    for (int k = 0; k < r->nkey; k++) {
        if (!r->key[k].is_frame) continue;
        if (n && r->key[n - 1].number == r->key[k].number)
            return refuse(r, "it shows several meshes at once; only what twinmesh writes is read", err);
        r->key[n++] = r->key[k];
    }
    r->nkey = n;
    return true;
}

static bool check_extensions(const GltfReader *r, Err *err)
{
    json_t *required;
    size_t i;
    json_array_foreach(items(r, "extensionsRequired"), i, required)
    {
        const char *name = json_string_value(required);
        bool known = name && (strcmp(name, "KHR_mesh_quantization") == 0 || strcmp(name, "EXT_meshopt_compression") == 0);
        if (!known) return refuse(r, "it needs an extension, such as another compression, that is not read; write it plain", err);
    }
    return true;
}

static bool find_frames(GltfReader *r, Err *err)
{
    int nnode = (int)json_array_size(items(r, "nodes"));
    if (!check_extensions(r, err)) return false;
    r->place = NEW(GltfPlace, nnode);
    if (!gltf_json_places(&r->json, r->place))
        return refuse(r, "its nodes have places or parents of their own; only what twinmesh writes is read", err);
    NodeChannels *of = NEW(NodeChannels, nnode);
    bool good =
        note_channels(r, nnode, of, err) && add_nodes(r, nnode, of, err) && number_keys(r, err) && keep_frames(r, err);
    mem_free(of);
    return good;
}

/* --- a frame's mesh ------------------------------------------------------------------------------- */

/* The one primitive of a key's mesh, or NULL. */
static json_t *primitive_of(const GltfReader *r, const Key *key)
{
    json_t *node = gltf_at(items(r, "nodes"), key->node),
           *list = json_object_get(gltf_at(items(r, "meshes"), gltf_whole(node, "mesh")), "primitives");
    json_t *primitive = json_array_size(list) == 1 ? json_array_get(list, 0) : NULL,
           *mode = json_object_get(primitive, "mode");
    return mode && json_integer_value(mode) != 4 ? NULL : primitive;
}

static bool find_column(GltfReader *r, json_t *attributes, const char *name, int width, int count, GltfRows *out,
                        Err *err)
{
    if (!gltf_rows_find(&r->bytes, gltf_whole(attributes, name), out, err)) return false;
    return out->width == width && (count == NONE || out->count == count)
               ? true
               : refuse(r, "an attribute has another shape than its mesh; it is damaged", err);
}

static bool read_ids(GltfReader *r, json_t *attributes, TriMesh *m, Err *err)
{
    GltfRows rows;
    for (int v = 0; v < m->nvert; v++) m->id[v] = v;
    if (!json_object_get(attributes, "_ID")) return true;
    if (!gltf_rows_find(&r->bytes, gltf_whole(attributes, "_ID"), &rows, err)) return false;
    if (rows.count != m->nvert || rows.width > 2) return refuse(r, "its identities are damaged", err);
    bool good;
    if (rows.component == GLTF_READ_F32 && rows.width == 1) {
        float *id = NEW(float, m->nvert);
        good = gltf_rows_floats(&r->bytes, &rows, 0, m->nvert, id, err);
        for (int v = 0; good && v < m->nvert; v++) {
            good = fabsf(id[v]) <= 0x1p24f || refuse(r, "its identities are damaged", err);
            if (good) m->id[v] = (int32_t)id[v];
        }
        mem_free(id);
        return good;
    }
    uint32_t *half = NEW(uint32_t, 2 * (size_t)m->nvert);
    good = rows.component == GLTF_READ_U16 && rows.width == 2
               ? gltf_rows_wholes(&r->bytes, &rows, 0, m->nvert, half, err)
               : refuse(r, "its identities are of a kind that is not read", err);
    for (int v = 0; good && v < m->nvert; v++) m->id[v] = (int32_t)(half[2 * v] | half[2 * v + 1] << 16);
    mem_free(half);
    return good;
}

static bool read_triangles(GltfReader *r, const GltfRows *rows, TriMesh *m, Err *err)
{
    uint32_t *index = NEW(uint32_t, rows->count);
    bool good = gltf_rows_wholes(&r->bytes, rows, 0, rows->count, index, err);
    for (int h = 0; good && h < rows->count; h++) {
        if (index[h] >= (uint32_t)m->nvert)
            good = refuse(r, "a triangle names a vertex that there is not; the file is damaged", err);
        else m->tri[h] = (int32_t)index[h];
    }
    mem_free(index);
    return good;
}

/* Adds to a column what the targets with a weight have in it. */
static bool add_targets(GltfReader *r, json_t *targets, const char *name, const float *weight, int nvert, float *column,
                        Err *err)
{
    float *change = NEW(float, 3 * (size_t)nvert);
    bool good = true;
    for (size_t k = 0; good && k < json_array_size(targets); k++) {
        GltfRows rows;
        json_t *target = json_array_get(targets, k);
        if (weight[k] == 0 || !json_object_get(target, name)) continue;
        good = find_column(r, target, name, 3, nvert, &rows, err) &&
               gltf_rows_floats(&r->bytes, &rows, 0, nvert, change, err);
        for (size_t i = 0; good && i < 3 * (size_t)nvert; i++) column[i] += weight[k] * change[i];
    }
    mem_free(change);
    return good;
}

/* The weights at a key; all 0 for the base. The caller frees them. */
static float *read_weights(GltfReader *r, const Key *key, int n, Err *err)
{
    float *weight = NEW0(float, n);
    if (key->row == NONE || n == 0) return weight;
    GltfRows rows;
    bool good = gltf_rows_find(&r->bytes, key->weights, &rows, err);
    if (good && (rows.width != 1 || (int64_t)(key->row + 1) * n > rows.count))
        good = refuse(r, "an animation has too few weights; it is damaged", err);
    good = good && gltf_rows_floats(&r->bytes, &rows, key->row * n, n, weight, err);
    if (good) return weight;
    mem_free(weight);
    return NULL;
}

static bool is_finite(const float *v, int n)
{
    for (size_t i = 0; i < 3 * (size_t)n; i++)
        if (!isfinite(v[i])) return false;
    return true;
}

/* From the numbers of its node to the world. */
static void place_mesh(const GltfPlace *place, TriMesh *m)
{
    if (place->scale == 1 && place->at[0] == 0 && place->at[1] == 0 && place->at[2] == 0) return;
    for (size_t i = 0; i < 3 * (size_t)m->nvert; i++) m->pos[i] = (float)(place->scale * (double)m->pos[i] + place->at[i % 3]);
}

/* Of sums of whole numbers. */
static void normalise(float *normal, int n)
{
    for (float *end = normal + 3 * (size_t)n; normal != end; normal += 3) {
        double x = (double)normal[0], y = (double)normal[1], z = (double)normal[2], length = sqrt(x * x + y * y + z * z);
        for (int k = 0; k < 3 && length > 0; k++) normal[k] = (float)((double)normal[k] / length);
    }
}

static bool read_columns(GltfReader *r, const Key *key, json_t *primitive, TriMesh *m, Err *err)
{
    json_t *attributes = json_object_get(primitive, "attributes"), *targets = json_object_get(primitive, "targets");
    GltfRows rows;
    float *weight = read_weights(r, key, (int)json_array_size(targets), err);
    bool has_normals = json_object_get(attributes, "NORMAL") != NULL;
    bool good = weight && find_column(r, attributes, "POSITION", 3, m->nvert, &rows, err) &&
                gltf_rows_floats(&r->bytes, &rows, 0, m->nvert, m->pos, err) &&
                add_targets(r, targets, "POSITION", weight, m->nvert, m->pos, err);
    if (good && has_normals)
        good = find_column(r, attributes, "NORMAL", 3, m->nvert, &rows, err) &&
               gltf_rows_floats(&r->bytes, &rows, 0, m->nvert, m->normal, err) &&
               add_targets(r, targets, "NORMAL", weight, m->nvert, m->normal, err);
    if (good && has_normals && rows.component != GLTF_READ_F32) normalise(m->normal, m->nvert);
    if (good && !has_normals) memset(m->normal, 0, 3 * (size_t)m->nvert * sizeof *m->normal);
    mem_free(weight);
    if (good) place_mesh(&r->place[key->node], m);
    if (good && !(is_finite(m->pos, m->nvert) && is_finite(m->normal, m->nvert)))
        good = refuse(r, "it has a value that is not finite; it is damaged", err);
    return good;
}

bool gltf_reader_mesh(GltfReader *r, int i, TriMesh *mesh, Err *err)
{
    const Key *key = &r->key[i];
    json_t *primitive = primitive_of(r, key), *attributes = json_object_get(primitive, "attributes");
    GltfRows position, index;
    *mesh = (TriMesh){0};
    if (!primitive) return refuse(r, "a mesh is not one of triangles alone; only what twinmesh writes is read", err);
    if (!find_column(r, attributes, "POSITION", 3, NONE, &position, err) ||
        !gltf_rows_find(&r->bytes, gltf_whole(primitive, "indices"), &index, err))
        return false;
    if (index.width != 1 || index.count % 3 != 0) return refuse(r, "its triangles are damaged", err);
    trimesh_init(mesh, position.count, index.count / 3, false, false);
    if (read_columns(r, key, primitive, mesh, err) && read_ids(r, attributes, mesh, err) &&
        read_triangles(r, &index, mesh, err))
        return true;
    trimesh_free(mesh);
    return false;
}

/* --- the calls ------------------------------------------------------------------------------------ */

GltfReader *gltf_reader_open(const char *path, Err *err)
{
    InFile in;
    if (!infile_open(&in, path, err)) return NULL;
    GltfReader *r = NEW0(GltfReader, 1);
    r->path = mem_text(path);
    bool good = gltf_json_read(&in, &r->json, err);
    infile_close(&in);
    if (good) gltf_bytes_init(&r->bytes, r->path, &r->json);
    if (good && find_frames(r, err)) return r;
    gltf_reader_close(r);
    return NULL;
}

void gltf_reader_close(GltfReader *r)
{
    if (!r) return;
    gltf_bytes_free(&r->bytes);
    json_decref(r->json.root);
    mem_free(r->place);
    mem_free(r->key);
    mem_free(r->path);
    mem_free(r);
}

int gltf_reader_length(const GltfReader *r) { return r->nkey; }
int64_t gltf_reader_frame(const GltfReader *r, int i) { return r->key[i].number; }
