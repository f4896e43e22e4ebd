#include "io/vdb_priv.h"

#include <string.h>

enum { SIDE_ROOT = 4096, COORD_LIMIT = 1 << 20 };

/* A place in a grid's bytes. Once something is wrong, `wrong` says what and all further steps fail. */
typedef struct Walk {
    const uint8_t *p, *end;
    uint32_t compression;
    size_t value_size, stored_size; /* bytes of a value; as stored in arrays (halves are shorter) */
    bool half;
    int64_t nleaf;
    const char *wrong;
} Walk;

static bool walk_fail(Walk *w, const char *what)
{
    if (!w->wrong) w->wrong = what;
    return false;
}

static const uint8_t *walk_bytes(Walk *w, size_t n)
{
    if (w->wrong || n > (size_t)(w->end - w->p)) {
        walk_fail(w, "it is cut short");
        return NULL;
    }
    const uint8_t *p = w->p;
    w->p += n;
    return p;
}

static uint32_t get_u32(const uint8_t *p) { return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24; }

static int64_t get_i64(const uint8_t *p) { return (int64_t)(get_u32(p) | (uint64_t)get_u32(p + 4) << 32); }

static double get_real(const uint8_t *p)
{
    double d;
    int64_t bits = get_i64(p);
    memcpy(&d, &bits, sizeof d);
    return d;
}

static bool walk_u32(Walk *w, uint32_t *out)
{
    const uint8_t *p = walk_bytes(w, 4);
    if (p) *out = get_u32(p);
    return p != NULL;
}

/* A string into `to`, cut off at its size. */
static bool walk_string(Walk *w, char *to, size_t size)
{
    uint32_t n;
    if (!walk_u32(w, &n)) return false;
    const uint8_t *p = walk_bytes(w, n);
    if (!p) return false;
    size_t kept = n < size - 1 ? n : size - 1;
    memcpy(to, p, kept);
    to[kept] = 0;
    return true;
}

static int count_on(const uint8_t *mask, int n)
{
    int on = 0;
    for (int i = 0; i < n / 8; i++) on += __builtin_popcount(mask[i]);
    return on;
}

/* --- trees ------------------------------------------------------------------------------------ */

/* `n` stored values, perhaps in a compressed chunk: its length, negative where it is not compressed, comes first. */
static bool walk_chunk(Walk *w, size_t n)
{
    size_t want = n * w->stored_size;
    if (w->half && n == 0) return true; /* half floats: not even the length of an empty chunk is written */
    if (!(w->compression & (VDB_COMPRESS_BLOSC | VDB_COMPRESS_ZIP))) return walk_bytes(w, want) != NULL;
    const uint8_t *p = walk_bytes(w, 8);
    if (!p) return false;
    int64_t length = get_i64(p);
    if (length <= 0) {
        if (length < -(int64_t)want || (size_t)-length != want) return walk_fail(w, "a chunk has another size than its samples");
        return walk_bytes(w, want) != NULL;
    }
    const uint8_t *chunk = (uint64_t)length <= (size_t)(w->end - w->p) ? walk_bytes(w, (size_t)length) : NULL;
    if (!chunk) return walk_fail(w, "it is cut short");
    /* blosc goes by the sizes in the chunk's own header of 16 bytes */
    if (w->compression & VDB_COMPRESS_BLOSC && (length < 16 || get_u32(chunk + 4) != want || get_u32(chunk + 12) != length))
        return walk_fail(w, "a blosc chunk has another size than its samples");
    return true;
}

/* A node's values: how the inactive ones are told, then the others. `mask`: the active ones, count/8 bytes. */
static bool walk_values(Walk *w, const uint8_t *mask, int count)
{
    enum { PLAIN, MINUS, ONE, MASKED, MASKED_ONE, MASKED_TWO, ALL };
    const uint8_t *how = walk_bytes(w, 1);
    if (!how) return false;
    if (*how > ALL) return walk_fail(w, "a node's kind of mask is not known");
    size_t told = *how == ONE || *how == MASKED_ONE ? 1 : *how == MASKED_TWO ? 2 : 0;
    size_t selection = *how >= MASKED && *how <= MASKED_TWO ? (size_t)count / 8 : 0;
    if (!walk_bytes(w, told * w->value_size + selection)) return false;
    bool all = !(w->compression & VDB_COMPRESS_ACTIVE) || *how == ALL;
    return walk_chunk(w, (size_t)(all ? count : count_on(mask, count)));
}

/* An inner node (log2 of its side in children: 5, then 4) and all below it. */
static bool walk_node(Walk *w, int log2side)
{
    int count = 1 << 3 * log2side, bytes = count / 8;
    const uint8_t *child = walk_bytes(w, (size_t)bytes), *value = walk_bytes(w, (size_t)bytes);
    if (!child || !value || !walk_values(w, value, count)) return false;
    int nchild = count_on(child, count);
    if (log2side == 4) {
        w->nleaf += nchild;
        return walk_bytes(w, (size_t)nchild * (GRID_CELLS / 8)) != NULL;
    }
    for (int i = 0; i < nchild; i++)
        if (!walk_node(w, log2side - 1)) return false;
    return true;
}

/* The corner of a root tile or child: on the root's raster, within reach, no two at one place. */
static bool walk_corner(Walk *w, Map *taken)
{
    const uint8_t *p = walk_bytes(w, 12);
    if (!p) return false;
    int c[3];
    for (int a = 0; a < 3; a++) {
        c[a] = (int)get_u32(p + 4 * a);
        if (c[a] % SIDE_ROOT != 0) return walk_fail(w, "a node lies off the raster");
        if (c[a] < -COORD_LIMIT || c[a] >= COORD_LIMIT)
            return walk_fail(w, "samples lie beyond +-2^20 voxels from the origin");
    }
    int before = taken->count;
    map_put(taken, key_coord(c[0] / SIDE_ROOT, c[1] / SIDE_ROOT, c[2] / SIDE_ROOT), 0);
    return taken->count > before || walk_fail(w, "two nodes lie at one place");
}

static bool walk_root(Walk *w, Map *taken)
{
    uint32_t ntile = 0, nchild = 0, nbuffer = 0;
    if (!walk_u32(w, &nbuffer) || !walk_bytes(w, w->value_size)) return false;
    if (nbuffer != 1) return walk_fail(w, "it has several buffers, as only old files had");
    if (!walk_u32(w, &ntile) || !walk_u32(w, &nchild)) return false;
    for (uint32_t i = 0; i < ntile; i++) {
        if (!walk_corner(w, taken) || !walk_bytes(w, w->value_size)) return false;
        const uint8_t *active = walk_bytes(w, 1);
        if (!active) return false;
        if (*active > 1) return walk_fail(w, "a tile is neither active nor inactive");
    }
    for (uint32_t i = 0; i < nchild; i++)
        if (!walk_corner(w, taken) || !walk_node(w, 5)) return false;
    /* the buffers: each leaf's mask once more, and its samples */
    for (int64_t i = 0; i < w->nleaf; i++) {
        const uint8_t *mask = walk_bytes(w, GRID_CELLS / 8);
        if (!mask || !walk_values(w, mask, GRID_CELLS)) return false;
    }
    return true;
}

static bool walk_report(const VdbTree *t, const Walk *w, Err *err)
{
    return fail(err, ERR_INPUT, "%s: grid '%s' cannot be read: %s; write or copy the file again", t->path, t->name,
                w->wrong ? w->wrong : "it is damaged");
}

bool vdb_walk(const VdbTree *t, size_t *used, Err *err)
{
    static const size_t SIZES[] = {[VDB_FLOAT] = 4, [VDB_DOUBLE] = 8, [VDB_VEC3S] = 12, [VDB_VEC3D] = 24,
                                   [VDB_INT32] = 4, [VDB_INT64] = 8,  [VDB_VEC3I] = 12};
    ASSERT(t->kind != VDB_OTHER && t->tree_at <= t->size);
    bool vector = t->kind == VDB_VEC3S || t->kind == VDB_VEC3D;
    Walk w = {.p = t->data + t->tree_at, .end = t->data + t->size, .compression = t->compression, .half = t->half};
    w.value_size = SIZES[t->kind];
    w.stored_size = !t->half ? w.value_size : vector ? 6 : 2;
    Map taken = {0};
    bool ok = walk_root(&w, &taken);
    map_free(&taken);
    if (!ok) return walk_report(t, &w, err);
    *used = (size_t)(w.p - (t->data + t->tree_at));
    return true;
}

/* --- what comes before the tree ----------------------------------------------------------------- */

/* Metadata by name, type and value: only the grid's class matters here. */
static bool walk_metadata(Walk *w, char *grid_class, size_t size)
{
    uint32_t count = 0, n;
    char name[64], type[64];
    if (!walk_u32(w, &count)) return false;
    for (uint32_t i = 0; i < count; i++) {
        if (!walk_string(w, name, sizeof name) || !walk_string(w, type, sizeof type)) return false;
        if (strcmp(name, "class") == 0 && strcmp(type, "string") == 0) {
            if (!walk_string(w, grid_class, size)) return false;
        } else if (!walk_u32(w, &n) || !walk_bytes(w, n)) {
            return false;
        }
    }
    return true;
}

/* OpenVDB's points are rows: world = index * M. The scaling maps store, beside the scale, four vectors that
 * follow from it. */
static bool walk_transform(Walk *w, Affine *out, bool *affine)
{
    char type[64];
    if (!walk_string(w, type, sizeof type)) return false;
    bool matrix = strcmp(type, "AffineMap") == 0 || strcmp(type, "UnitaryMap") == 0;
    bool scale = strcmp(type, "ScaleMap") == 0 || strcmp(type, "UniformScaleMap") == 0;
    bool both = strcmp(type, "ScaleTranslateMap") == 0 || strcmp(type, "UniformScaleTranslateMap") == 0;
    bool shift = both || strcmp(type, "TranslationMap") == 0;
    *affine = matrix || scale || shift;
    if (!*affine) return true;
    const uint8_t *p = walk_bytes(w, (size_t)(matrix ? 16 : both ? 18 : shift ? 3 : 15) * 8);
    if (!p) return false;
    for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++) out->m[a][b] = matrix ? get_real(p + (b * 4 + a) * 8) : a == b;
        if (scale || both) out->m[a][a] = get_real(p + (a + (both ? 3 : 0)) * 8);
        v_set(&out->t, a, matrix ? get_real(p + (12 + a) * 8) : shift ? get_real(p + a * 8) : 0);
    }
    return true;
}

bool vdb_walk_header(VdbTree *t, bool transform_wanted, Err *err)
{
    Walk w = {.p = t->data, .end = t->data + t->size};
    bool affine = true;
    t->grid_class[0] = 0;
    if (!walk_u32(&w, &t->compression) || !walk_metadata(&w, t->grid_class, sizeof t->grid_class) ||
        !walk_transform(&w, &t->xform, &affine))
        return walk_report(t, &w, err);
    if (!affine)
        return fail(err, ERR_INPUT, "%s: grid '%s' has a frustum (or another non-linear) transform; resample it into "
                    "a grid of cubic voxels first", t->path, t->name);
    t->tree_at = (size_t)(w.p - t->data);
    bool finite = isfinite(t->xform.t.x) && isfinite(t->xform.t.y) && isfinite(t->xform.t.z);
    if (transform_wanted && !(finite && affine_invert(&t->xform)))
        return fail(err, ERR_INPUT, "%s: grid '%s' has a transform without an inverse; give its voxels a size", t->path, t->name);
    return true;
}
