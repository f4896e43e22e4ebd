/* The file: magic, format version, library version, whether there are offsets, a UUID, metadata, the number of grids;
 * then each grid: name, type, parent, three offsets (start, blocks, end), and its bytes. */
#include "io/vdb_priv.h"

#include <string.h>

enum { VERSION_MIN = 222 };

static const struct {
    const char *type;
    VdbType kind;
} KINDS[] = {
    {"Tree_float_5_4_3", VDB_FLOAT}, {"Tree_double_5_4_3", VDB_DOUBLE}, {"Tree_vec3s_5_4_3", VDB_VEC3S},
    {"Tree_vec3d_5_4_3", VDB_VEC3D}, {"Tree_int32_5_4_3", VDB_INT32},   {"Tree_int64_5_4_3", VDB_INT64},
    {"Tree_vec3i_5_4_3", VDB_VEC3I},
};

/* A place in the file. */
typedef struct Place {
    InFile *in;
    int64_t at;
} Place;

static bool toc_damaged(const Place *p, Err *err)
{
    return fail(err, ERR_INPUT, "%s: its list of grids is damaged or cut short; write or copy the file again", p->in->path);
}

static bool get_int(Place *p, int size, int64_t *out, Err *err)
{
    uint8_t b[8];
    uint64_t v = 0;
    if (!infile_read(p->in, p->at, (size_t)size, b, err)) return false;
    for (int i = 0; i < size; i++) v |= (uint64_t)b[i] << 8 * i;
    *out = (int64_t)v;
    p->at += size;
    return true;
}

static bool skip(Place *p, int64_t n, Err *err)
{
    if (n > p->in->length - p->at) return toc_damaged(p, err);
    p->at += n;
    return true;
}

static bool skip_string(Place *p, Err *err)
{
    int64_t n;
    return get_int(p, 4, &n, err) && skip(p, n, err);
}

/* A string of at most size - 1 bytes; what a terminal would not print becomes '?', and the mark and number that
 * OpenVDB puts behind a name that is there twice become "[number]". */
static bool get_string(Place *p, char *to, size_t size, Err *err)
{
    int64_t n;
    if (!get_int(p, 4, &n, err)) return false;
    if (n > (int64_t)size - 2) return toc_damaged(p, err);
    if (!infile_read(p->in, p->at, (size_t)n, to, err)) return false;
    p->at += n;
    to[n] = 0;
    char *mark = memchr(to, 0x1e, (size_t)n);
    if (mark) {
        *mark = '[';
        to[n] = ']';
        to[n + 1] = 0;
    }
    for (char *c = to; *c; c++)
        if ((unsigned char)*c < 32 || *c == 127) *c = '?';
    return true;
}

static bool skip_metadata(Place *p, Err *err)
{
    int64_t count, n;
    if (!get_int(p, 4, &count, err)) return false;
    for (int64_t i = 0; i < count; i++)
        if (!skip_string(p, err) || !skip_string(p, err) || !get_int(p, 4, &n, err) || !skip(p, n, err)) return false;
    return true;
}

static void entry_classify(VdbEntry *e)
{
    static const char half[] = "_HalfFloat";
    size_t n = strlen(e->type), m = sizeof half - 1;
    e->half = n > m && strcmp(e->type + n - m, half) == 0;
    if (e->half) e->type[n - m] = 0;
    e->kind = VDB_OTHER;
    for (size_t i = 0; i < sizeof KINDS / sizeof *KINDS; i++)
        if (strcmp(e->type, KINDS[i].type) == 0) e->kind = KINDS[i].kind;
    /* only floating-point values can be stored as halves */
    if (e->half && e->kind > VDB_VEC3D) e->half = false;
}

/* Where a file has no offsets, the end of a grid is found by walking through it. */
static bool entry_measure(VdbToc *toc, VdbEntry *e, Err *err)
{
    if (e->kind == VDB_OTHER)
        return fail(err, ERR_INPUT, "%s: was written as a stream, and the end of grid '%s' of type %s cannot be told; "
                    "write it to a seekable file", toc->in.path, e->name, e->type);
    VdbTree t = {.path = toc->in.path, .name = e->name, .version = toc->version, .kind = e->kind, .half = e->half};
    size_t used = 0;
    t.size = (size_t)(toc->in.length - e->at);
    t.data = NEW(uint8_t, t.size);
    bool ok = infile_read(&toc->in, e->at, t.size, t.data, err) && vdb_walk_header(&t, false, err) &&
              (e->parent[0] || vdb_walk(&t, &used, err));
    e->end = e->at + (int64_t)(t.tree_at + used);
    vdb_tree_free(&t);
    return ok;
}

static bool entry_read(VdbToc *toc, Place *p, bool has_offsets, Err *err)
{
    RESERVE(toc->entry, toc->capentry, toc->nentry + 1);
    VdbEntry *e = &toc->entry[toc->nentry++];
    int64_t start, blocks;
    *e = (VdbEntry){0};
    if (!get_string(p, e->name, sizeof e->name, err) || !get_string(p, e->type, sizeof e->type, err) ||
        !get_string(p, e->parent, sizeof e->parent, err) || !get_int(p, 8, &start, err) ||
        !get_int(p, 8, &blocks, err) || !get_int(p, 8, &e->end, err))
        return false;
    entry_classify(e);
    e->at = p->at;
    if (!has_offsets) {
        if (!entry_measure(toc, e, err)) return false;
    } else if (start != p->at || e->end < p->at) {
        return toc_damaged(p, err);
    } else if (e->end > p->in->length) {
        return fail(err, ERR_INPUT, "%s: is cut short in grid '%s' (%lld of at least %lld bytes); write or copy the file again",
                    p->in->path, e->name, (long long)p->in->length, (long long)e->end);
    }
    p->at = e->end;
    return true;
}

static bool toc_read(VdbToc *toc, Err *err)
{
    static const uint8_t magic[8] = {0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0};
    uint8_t b[8];
    Place p = {&toc->in, 8};
    int64_t version, offsets, ngrid;
    if (!infile_read(&toc->in, 0, 8, b, err)) return false;
    if (memcmp(b, magic, 8) != 0) return fail(err, ERR_INPUT, "%s: is no OpenVDB file", toc->in.path);
    if (!get_int(&p, 4, &version, err)) return false;
    if (version < VERSION_MIN)
        return fail(err, ERR_INPUT, "%s: has the old OpenVDB format %lld; write it again with OpenVDB 3 or later",
                    toc->in.path, (long long)version);
    toc->version = (uint32_t)version;
    bool ok = skip(&p, 8, err) && get_int(&p, 1, &offsets, err) && skip(&p, 36, err) && skip_metadata(&p, err) &&
              get_int(&p, 4, &ngrid, err);
    if (ok && ngrid > INT32_MAX) ok = toc_damaged(&p, err);
    for (int64_t i = 0; ok && i < ngrid; i++) ok = entry_read(toc, &p, offsets != 0, err);
    return ok;
}

bool vdb_toc_open(VdbToc *toc, const char *path, Err *err)
{
    *toc = (VdbToc){0};
    bool ok = infile_open(&toc->in, path, err) && toc_read(toc, err);
    if (!ok) vdb_toc_close(toc);
    return ok;
}

void vdb_toc_close(VdbToc *toc)
{
    infile_close(&toc->in);
    mem_free(toc->entry);
    *toc = (VdbToc){0};
}

bool vdb_tree_load(VdbToc *toc, int i, VdbTree *out, Err *err)
{
    const VdbEntry *e = &toc->entry[i];
    *out = (VdbTree){.path = toc->in.path, .name = e->name, .version = toc->version, .kind = e->kind, .half = e->half,
                     .size = (size_t)(e->end - e->at)};
    out->data = NEW(uint8_t, out->size);
    size_t used = 0;
    bool ok = infile_read(&toc->in, e->at, out->size, out->data, err) && vdb_walk_header(out, true, err);
    if (ok && !e->parent[0]) {
        ok = vdb_walk(out, &used, err);
        if (ok && out->tree_at + used != out->size)
            ok = fail(err, ERR_INPUT, "%s: grid '%s' does not end where it should; write or copy the file again",
                      out->path, out->name);
    }
    if (!ok) vdb_tree_free(out);
    return ok;
}

void vdb_tree_free(VdbTree *t)
{
    mem_free(t->data);
    t->data = NULL;
    t->size = 0;
}
