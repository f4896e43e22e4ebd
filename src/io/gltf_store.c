#include "io/gltf_priv.h"
#include "io/bytes.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include <meshoptimizer.h>

static uint64_t aligned(uint64_t bytes) { return (bytes + 3) & ~(uint64_t)3; }

char *gltf_stem(const char *path)
{
    char *stem = mem_text(path), *dot = strrchr(stem, '.');
    if (dot && strcasecmp(dot, ".gltf") == 0) *dot = 0;
    return stem;
}

char *gltf_part_path(const char *stem, int part)
{
    size_t size = strlen(stem) + 32;
    char *path = NEW(char, size);
    if (part == 0)
        snprintf(path, size, "%s.bin", stem);
    else
        snprintf(path, size, "%s.%d.bin", stem, part);
    return path;
}

static bool open_part(Gltf *g, Err *err)
{
    GltfDoc *d = &g->doc;
    char *stem = gltf_stem(g->path), *path = gltf_part_path(stem, d->npart);
    mem_free(stem);
    RESERVE(d->part_bytes, d->cap_part, d->npart + 1);
    RESIZE(g->part, d->cap_part);
    bool ok = outfile_open(&g->part[d->npart], path, err);
    if (ok) d->part_bytes[d->npart++] = 0;
    mem_free(path);
    return ok;
}

/* Room for `bytes` in the last part, a new part where they would pass the limit. */
static bool make_room(Gltf *g, uint64_t bytes, Err *err)
{
    const GltfDoc *d = &g->doc;
    bool full = d->npart == 0 ||
                (d->part_bytes[d->npart - 1] > 0 && d->part_bytes[d->npart - 1] + aligned(bytes) > g->part_bytes);
    return !full || open_part(g, err);
}

static int add_view(GltfDoc *d, GltfView view)
{
    view.part = d->npart - 1;
    view.offset = d->part_bytes[view.part];
    RESERVE(d->view, d->cap_view, d->nview + 1);
    d->view[d->nview] = view;
    return d->nview++;
}

/* Goes on with the last view where that is alike and ends there, so that the many arrays of a run share few views. */
static int view_for(GltfDoc *d, int stride, int target)
{
    if (d->nview) {
        const GltfView *v = &d->view[d->nview - 1];
        bool alike = v->part == d->npart - 1 && v->stride == stride && v->target == target && target != GLTF_INDEX;
        if (alike && !v->packed && v->offset + v->bytes == d->part_bytes[v->part]) return d->nview - 1;
    }
    return add_view(d, (GltfView){.stride = stride, .target = target});
}

/* To the last view; the part is filled up to four bytes, which belong to no view. */
static bool put(Gltf *g, const uint8_t *bytes, size_t n, Err *err)
{
    uint64_t *end = &g->doc.part_bytes[g->doc.npart - 1];
    OutFile *file = &g->part[g->doc.npart - 1];
    size_t filling = (size_t)(aligned(*end + n) - *end - n);
    if (!outfile_write(file, bytes, n, err) || !outfile_write(file, "\0\0\0", filling, err)) return false;
    g->doc.view[g->doc.nview - 1].bytes += n;
    *end += n + filling;
    return true;
}

/* --- arrays ----------------------------------------------------------------------------------------- */

/* Some rows of one view. */
typedef struct Rows {
    int view;
    uint64_t at; /* within the view */
    int64_t count;
} Rows;

/* `at`: within a row. `range`: NULL: none is told. */
static int add_accessor(Gltf *g, const Rows *rows, int at, int component, int width, const GltfRange *range)
{
    GltfDoc *d = &g->doc;
    RESERVE(d->accessor, d->cap_accessor, d->naccessor + 1);
    d->accessor[d->naccessor] = (GltfAccessor){
        .view = rows->view, .component = component, .width = width, .count = rows->count, .offset = rows->at + (uint64_t)at};
    if (range) d->accessor[d->naccessor].range = *range;
    return d->naccessor++;
}

/* Where the bytes of the next array are made. */
static uint8_t *scratch(Gltf *g, size_t bytes)
{
    RESERVE(g->scratch, g->cap_scratch, bytes);
    return g->scratch;
}

static bool is_packed(const Gltf *g, int target) { return g->doc.compress == GLTF_MESHOPT && target; }

/* The first n bytes of g->packed as a view of their own. */
static bool put_packed(Gltf *g, size_t n, int size, int stride, int target, Rows *rows, Err *err)
{
    GltfDoc *d = &g->doc;
    ASSERT(n > 0); /* the bounds were enough */
    if (!make_room(g, n, err)) return false;
    rows->view = add_view(d, (GltfView){
        .stride = stride, .target = target, .packed = size, .count = rows->count, .raw = d->raw_bytes});
    d->raw_bytes += aligned((uint64_t)rows->count * (uint64_t)size);
    return put(g, g->packed, n, err);
}

/* The scratch as rows of `size` bytes that vertices (GLTF_ARRAY) or channels (0) read. */
static bool put_rows(Gltf *g, int count, int size, int target, Rows *rows, Err *err)
{
    ASSERT(count > 0);
    size_t bytes = (size_t)count * (size_t)size;
    *rows = (Rows){.count = count};
    if (is_packed(g, target)) {
        size_t most = meshopt_encodeVertexBufferBound((size_t)count, (size_t)size);
        RESERVE(g->packed, g->cap_packed, most);
        size_t n = meshopt_encodeVertexBuffer(g->packed, most, g->scratch, (size_t)count, (size_t)size);
        return put_packed(g, n, size, size, target, rows, err);
    }
    if (!make_room(g, bytes, err)) return false;
    rows->view = view_for(&g->doc, target ? size : 0, target);
    rows->at = g->doc.view[rows->view].bytes;
    return put(g, g->scratch, bytes, err);
}

/* Component k; the last one first makes it a range. */
static void widen(GltfRange *r, int k, int width, float v)
{
    if (!r->known || v < r->lo[k]) r->lo[k] = v;
    if (!r->known || v > r->hi[k]) r->hi[k] = v;
    if (k + 1 == width) r->known = 1;
}

static int store_floats(Gltf *g, const float *v, const float *minus, int count, int width, int target, bool with_range,
                        Err *err)
{
    Rows rows;
    GltfRange range = {0};
    size_t n = (size_t)count * (size_t)width;
    uint8_t *to = scratch(g, 4 * n);
    for (size_t i = 0; i < n; i++) {
        float x = minus ? v[i] - minus[i] : v[i];
        put_f32(to + 4 * i, x);
        if (with_range) widen(&range, (int)(i % (size_t)width), width, x);
    }
    if (!put_rows(g, count, 4 * width, target, &rows, err)) return NONE;
    return add_accessor(g, &rows, 0, GLTF_F32, width, &range);
}

int gltf_store_vec3(Gltf *g, const float *v, int n, Err *err)
{
    return store_floats(g, v, NULL, n, 3, GLTF_ARRAY, false, err);
}

int gltf_store_vec2(Gltf *g, const float *v, int n, Err *err)
{
    return store_floats(g, v, NULL, n, 2, GLTF_ARRAY, false, err);
}

int gltf_store_scalars(Gltf *g, const float *v, int n, Err *err)
{
    return store_floats(g, v, NULL, n, 1, GLTF_ARRAY, false, err);
}

int gltf_store_keys(Gltf *g, const float *v, int count, int width, bool with_range, Err *err)
{
    return store_floats(g, v, NULL, count, width, 0, with_range, err);
}

/* Position and normal of a vertex side by side: three 16-bit whole numbers, three of 8 bits, both filled up to four bytes. */
static int store_whole_vertices(Gltf *g, const GltfGrid *grid, const GltfColumns *of, const GltfColumns *base, int n,
                                Err *err)
{
    enum { NORMAL_AT = 8, SIZE = 12 };
    Rows rows;
    GltfRange range = {0};
    uint8_t *to = scratch(g, SIZE * (size_t)n);
    memset(to, 0, SIZE * (size_t)n);
    for (size_t v = 0; v < (size_t)n; v++, to += SIZE) {
        int normal[3];
        gltf_round_normal(of->normal + 3 * v, base ? base->normal + 3 * v : NULL, normal);
        for (int k = 0; k < 3; k++) {
            size_t i = 3 * v + (size_t)k;
            int x = gltf_round(grid, k, of->pos[i]) - (base ? gltf_round(grid, k, base->pos[i]) : 0);
            ASSERT(x >= -GLTF_I16_MOST && x <= GLTF_I16_MOST);
            put_u16(to + 2 * k, (uint16_t)x);
            to[NORMAL_AT + k] = (uint8_t)normal[k];
            widen(&range, k, 3, (float)x);
        }
    }
    if (!put_rows(g, n, SIZE, GLTF_ARRAY, &rows, err)) return NONE;
    int position = add_accessor(g, &rows, 0, GLTF_I16, 3, &range);
    add_accessor(g, &rows, NORMAL_AT, GLTF_I8, 3, NULL);
    return position;
}

int gltf_store_vertices(Gltf *g, const GltfColumns *of, const GltfColumns *base, int n, Err *err)
{
    const GltfPiece *p = &g->doc.piece[g->doc.npiece - 1];
    if (g->doc.compress) return store_whole_vertices(g, &g->doc.grid[p->grid], of, base, n, err);
    int position = store_floats(g, of->pos, base ? base->pos : NULL, n, 3, GLTF_ARRAY, true, err);
    if (position == NONE) return NONE;
    return store_floats(g, of->normal, base ? base->normal : NULL, n, 3, GLTF_ARRAY, false, err) == NONE ? NONE : position;
}

int gltf_store_indices(Gltf *g, const TriMesh *mesh, Err *err)
{
    bool narrow = mesh->nvert < 65535; /* index 65535 would restart the primitive */
    size_t n = 3 * (size_t)mesh->ntri;
    int size = narrow ? 2 : 4, component = narrow ? GLTF_U16 : GLTF_U32;
    Rows rows = {.count = (int64_t)n};
    if (is_packed(g, GLTF_INDEX)) { /* as a sequence: packed as triangles their corners would come back turned */
        size_t most = meshopt_encodeIndexSequenceBound(n, (size_t)mesh->nvert);
        RESERVE(g->packed, g->cap_packed, most);
        size_t bytes = meshopt_encodeIndexSequence(g->packed, most, (const unsigned *)mesh->tri, n);
        return put_packed(g, bytes, size, 0, GLTF_INDEX, &rows, err) ? add_accessor(g, &rows, 0, component, 1, NULL) : NONE;
    }
    uint8_t *to = scratch(g, n * (size_t)size);
    for (size_t i = 0; i < n; i++) {
        if (narrow) put_u16(to + 2 * i, (uint16_t)mesh->tri[i]);
        else put_i32(to + 4 * i, mesh->tri[i]);
    }
    if (!make_room(g, n * (size_t)size, err)) return NONE;
    rows.view = view_for(&g->doc, 0, GLTF_INDEX);
    return put(g, to, n * (size_t)size, err) ? add_accessor(g, &rows, 0, component, 1, NULL) : NONE;
}

int gltf_store_ids(Gltf *g, const TriMesh *mesh, Err *err)
{
    Rows rows;
    size_t n = (size_t)mesh->nvert;
    bool exact = true; /* a float holds whole numbers below 2^24 */
    for (size_t v = 0; v < n; v++) exact = exact && mesh->id[v] >= 0 && mesh->id[v] < 1 << 24;
    uint8_t *to = scratch(g, 4 * n);
    for (size_t v = 0; v < n; v++) {
        if (exact) put_f32(to + 4 * v, (float)mesh->id[v]);
        else put_i32(to + 4 * v, mesh->id[v]); /* little-endian: the low half comes first */
    }
    if (!put_rows(g, mesh->nvert, 4, GLTF_ARRAY, &rows, err)) return NONE;
    return add_accessor(g, &rows, 0, exact ? GLTF_F32 : GLTF_U16, exact ? 1 : 2, NULL);
}
