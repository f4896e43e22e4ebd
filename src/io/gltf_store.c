#include "io/gltf_priv.h"
#include "io/bytes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { CHUNK = 3 * 4096 }; /* floats converted at a time */

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

/* Room for `bytes` in the last part, a new part where they would pass the limit. Goes on with the last view
 * where that is alike and ends there, so that the many arrays of a run share few views. Returns the view or
 * NONE. */
static int begin(Gltf *g, uint64_t bytes, int stride, int target, Err *err)
{
    GltfDoc *d = &g->doc;
    if (d->npart == 0 ||
        (d->part_bytes[d->npart - 1] > 0 && d->part_bytes[d->npart - 1] + aligned(bytes) > g->part_bytes))
        if (!open_part(g, err)) return NONE;

    int part = d->npart - 1;
    if (d->nview) {
        const GltfView *v = &d->view[d->nview - 1];
        bool alike = v->part == part && v->stride == stride && v->target == target && target != GLTF_INDEX;
        if (alike && v->offset + v->bytes == d->part_bytes[part]) return d->nview - 1;
    }
    RESERVE(d->view, d->cap_view, d->nview + 1);
    d->view[d->nview] =
        (GltfView){.part = part, .stride = stride, .target = target, .offset = d->part_bytes[part]};
    return d->nview++;
}

static bool put(Gltf *g, const uint8_t *bytes, size_t n, Err *err)
{
    int part = g->doc.npart - 1;
    if (!outfile_write(&g->part[part], bytes, n, err)) return false;
    g->doc.part_bytes[part] += n;
    g->doc.view[g->doc.nview - 1].bytes += n;
    return true;
}

/* Fills the part up to four bytes; the filling belongs to no view. */
static bool pad(Gltf *g, Err *err)
{
    int part = g->doc.npart - 1;
    uint64_t *bytes = &g->doc.part_bytes[part], n = aligned(*bytes) - *bytes;
    if (n && !outfile_write(&g->part[part], "\0\0\0", n, err)) return false;
    *bytes += n;
    return true;
}

static int add_accessor(Gltf *g, int view, int component, int width, int64_t count)
{
    GltfDoc *d = &g->doc;
    RESERVE(d->accessor, d->cap_accessor, d->naccessor + 1);
    d->accessor[d->naccessor] = (GltfAccessor){
        .view = view, .component = component, .width = width, .count = count, .offset = d->view[view].bytes};
    return d->naccessor++;
}

static void widen(GltfAccessor *a, const float *v, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        size_t k = i % (size_t)a->width;
        if (!a->has_range || v[i] < a->lo[k]) a->lo[k] = v[i];
        if (!a->has_range || v[i] > a->hi[k]) a->hi[k] = v[i];
        if (k + 1 == (size_t)a->width) a->has_range = 1;
    }
}

static int store_floats(Gltf *g, const float *v, const float *minus, int count, int width, int target,
                        bool with_range, Err *err)
{
    ASSERT(count > 0);
    size_t n = (size_t)count * (size_t)width;
    int view = begin(g, 4 * (uint64_t)n, target ? 4 * width : 0, target, err);
    if (view == NONE) return NONE;
    int accessor = add_accessor(g, view, GLTF_F32, width, count);
    float part[CHUNK];
    uint8_t bytes[4 * CHUNK];
    for (size_t at = 0; at < n; at += CHUNK) {
        size_t m = n - at < CHUNK ? n - at : CHUNK;
        for (size_t i = 0; i < m; i++) {
            part[i] = minus ? v[at + i] - minus[at + i] : v[at + i];
            put_f32(bytes + 4 * i, part[i]);
        }
        if (with_range) widen(&g->doc.accessor[accessor], part, m);
        if (!put(g, bytes, 4 * m, err)) return NONE;
    }
    return accessor;
}

int gltf_store_vec3(Gltf *g, const float *v, const float *minus, int n, bool with_range, Err *err)
{
    return store_floats(g, v, minus, n, 3, GLTF_ARRAY, with_range, err);
}

int gltf_store_scalars(Gltf *g, const float *v, int n, Err *err)
{
    return store_floats(g, v, NULL, n, 1, GLTF_ARRAY, false, err);
}

int gltf_store_keys(Gltf *g, const float *v, int count, int width, bool with_range, Err *err)
{
    return store_floats(g, v, NULL, count, width, 0, with_range, err);
}

int gltf_store_indices(Gltf *g, const TriMesh *mesh, Err *err)
{
    bool narrow = mesh->nvert < 65535; /* index 65535 would restart the primitive */
    size_t n = 3 * (size_t)mesh->ntri, size = narrow ? 2 : 4;
    int view = begin(g, n * size, 0, GLTF_INDEX, err);
    if (view == NONE) return NONE;
    int accessor = add_accessor(g, view, narrow ? GLTF_U16 : GLTF_U32, 1, (int64_t)n);
    uint8_t bytes[4 * CHUNK];
    for (size_t at = 0; at < n; at += CHUNK) {
        size_t m = n - at < CHUNK ? n - at : CHUNK;
        for (size_t i = 0; i < m; i++) {
            if (narrow)
                put_u16(bytes + 2 * i, (uint16_t)mesh->tri[at + i]);
            else
                put_i32(bytes + 4 * i, mesh->tri[at + i]);
        }
        if (!put(g, bytes, size * m, err)) return NONE;
    }
    return pad(g, err) ? accessor : NONE;
}

int gltf_store_ids(Gltf *g, const TriMesh *mesh, Err *err)
{
    size_t n = (size_t)mesh->nvert;
    bool exact = true; /* a float holds whole numbers below 2^24 */
    for (size_t v = 0; v < n; v++) exact = exact && mesh->id[v] >= 0 && mesh->id[v] < 1 << 24;

    int view = begin(g, 4 * (uint64_t)n, 4, GLTF_ARRAY, err);
    if (view == NONE) return NONE;
    int accessor = add_accessor(g, view, exact ? GLTF_F32 : GLTF_U16, exact ? 1 : 2, (int64_t)n);
    uint8_t bytes[4 * CHUNK];
    for (size_t at = 0; at < n; at += CHUNK) {
        size_t m = n - at < CHUNK ? n - at : CHUNK;
        for (size_t i = 0; i < m; i++) {
            if (exact)
                put_f32(bytes + 4 * i, (float)mesh->id[at + i]);
            else
                put_i32(bytes + 4 * i, mesh->id[at + i]); /* little-endian: the low half comes first */
        }
        if (!put(g, bytes, 4 * m, err)) return NONE;
    }
    return accessor;
}
