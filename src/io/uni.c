/* Mantaflow's .uni: gzip of a four-letter version, a header, and the samples, x fastest; one grid a file. Versions:
 *
 *   MNT1   dimensions, grid type, element type, bytes of an element: six 32-bit numbers
 *   MNT2   the same, 256 letters about the build, a 64-bit time
 *   MNT3   the same, 252 letters, the fourth dimension, a 64-bit time
 *
 * The grid's name is its file's, without ending and frame number (`phi_0012.uni`: phi); grids that the request names
 * besides are looked for beside it under the same number (`vel_0012.uni`). Voxels have size 1 and the first sample sits
 * at the origin, as nothing in the file says otherwise. */
#include "io/bytes.h"
#include "io/stream.h"

#include <ctype.h>
#include <string.h>
#include <unistd.h>

enum { TYPE_REAL = 1, TYPE_VEC3 = 4, TYPE_MAC = 8, TYPE_LEVELSET = 16 }; /* bits of the grid type */
enum { HEADER_SHORT = 4 + 24, HEADER_LONG = 4 + 24 + 264 };

typedef struct UniHeader {
    int n[3], ncomp;
    DenseType type;
    bool staggered, level_set;
} UniHeader;

typedef struct UniFile {
    VolumeFile base;
    int capother;
    char **other; /* [nentry] path of each entry; the first is NULL: the file itself */
} UniFile;

static int32_t get_i32(const uint8_t *p) { return (int32_t)get_u32(p); }

static bool header_parse(const char *path, const uint8_t *b, UniHeader *h, Err *err)
{
    int grid = get_i32(b + 16), element = get_i32(b + 20), bytes = get_i32(b + 24);
    for (int a = 0; a < 3; a++) h->n[a] = get_i32(b + 4 + 4 * a);
    h->ncomp = grid & (TYPE_VEC3 | TYPE_MAC) ? 3 : 1;
    h->staggered = grid & TYPE_MAC;
    h->level_set = grid & TYPE_LEVELSET;
    bool real = h->ncomp == 3 ? element == 2 : grid & (TYPE_REAL | TYPE_LEVELSET) && element == 1;
    if (!real)
        return fail(err, ERR_INPUT, "%.600s: holds a grid of type %d, which is neither real, level set nor vector; name another of the solver's grids", path, grid);
    if (bytes != 4 * h->ncomp && bytes != 8 * h->ncomp)
        return fail(err, ERR_INPUT, "%.600s: an element of %d components cannot have %d bytes; the file is damaged, write it again", path, h->ncomp, bytes);
    h->type = (DenseType){'f', bytes / h->ncomp, false};
    return true;
}

static bool header_read(Stream *s, const char *path, UniHeader *h, Err *err)
{
    uint8_t b[HEADER_LONG];
    if (!stream_read(s, HEADER_SHORT, b, err)) return false;
    bool known = memcmp(b, "MNT", 3) == 0 && b[3] >= '1' && b[3] <= '3';
    if (!known && (memcmp(b, "M4T", 3) == 0 || memcmp(b, "DDF2", 4) == 0))
        return fail(err, ERR_INPUT, "%.600s: has version %.4s of the .uni format, which is not read; write it as MNT3 (Mantaflow 0.12 or later)", path, (const char *)b);
    if (!known) return fail(err, ERR_INPUT, "%.600s: is no .uni file of Mantaflow's", path);
    if (b[3] > '1' && !stream_read(s, HEADER_LONG - HEADER_SHORT, b + HEADER_SHORT, err)) return false;
    if (b[3] == '3' && get_i32(b + HEADER_SHORT + 252) > 1)
        return fail(err, ERR_INPUT, "%.600s: holds a grid of four dimensions; write one of three a frame", path);
    return header_parse(path, b, h, err);
}

/* Opens the stream behind the header. */
static Stream *uni_stream(InFile *in, const char *path, UniHeader *h, Err *err)
{
    uint8_t b[2] = {0};
    if (!infile_open(in, path, err) || !infile_read(in, 0, sizeof b, b, err)) return NULL;
    bool packed = b[0] == 0x1f && b[1] == 0x8b; /* Mantaflow without zlib writes the plain bytes */
    Stream *s = stream_open(in, 0, packed ? STREAM_DEFLATE : STREAM_PLAIN, err);
    if (s && header_read(s, path, h, err)) return s;
    stream_close(s);
    return NULL;
}

/* --- names -------------------------------------------------------------------------------------- */

/* The stretch of a path that is the grid's name. */
static void name_span(const char *path, size_t *from, size_t *to)
{
    const char *slash = strrchr(path, '/');
    *from = slash ? (size_t)(slash + 1 - path) : 0;
    size_t end = strlen(path) - strlen(".uni");
    *to = end;
    while (*to > *from && isdigit((unsigned char)path[*to - 1])) --*to;
    while (*to < end && *to > *from && strchr("_.-", path[*to - 1])) --*to;
    if (*to == *from) *to = end; /* a number is all there is */
}

static char *sibling(const char *path, const char *name)
{
    size_t from, to, n = strlen(name);
    name_span(path, &from, &to);
    char *out = NEW(char, strlen(path) + n + 1);
    memcpy(out, path, from);
    memcpy(out + from, name, n);
    strcpy(out + from + n, path + to);
    return out;
}

/* Takes over the path; NULL: the file's own. */
static bool add_grid(UniFile *uni, const char *name, char *other, Err *err)
{
    VolumeFile *f = &uni->base;
    UniHeader h;
    InFile in = {0};
    RESERVE(uni->other, uni->capother, f->nentry + 1);
    uni->other[f->nentry] = other;
    VolumeEntry *e = volume_add_entry(f, name, "", 0);
    Stream *s = uni_stream(&in, other ? other : f->path, &h, err);
    bool ok = s != NULL;
    stream_close(s);
    infile_close(&in);
    if (!ok) return false;
    e->ncomp = h.ncomp;
    snprintf(e->type, sizeof e->type, "%s%s", h.type.size == 4 ? "float" : "double", h.staggered ? " MAC" : h.ncomp == 3 ? " vec3" : "");
    snprintf(e->grid_class, sizeof e->grid_class, "%s", h.staggered ? "staggered" : h.level_set ? "level set" : "");
    return true;
}

static bool add_sibling(UniFile *uni, const char *name, Err *err)
{
    if (!name || strchr(name, '/') || volume_find(&uni->base, name) != NONE) return true;
    char *path = sibling(uni->base.path, name);
    if (access(path, F_OK) == 0) return add_grid(uni, name, path, err);
    mem_free(path); /* that there is no such grid is said by whoever wants it */
    return true;
}

/* --- the format --------------------------------------------------------------------------------- */

static bool uni_open(VolumeFile *f, Err *err)
{
    UniFile *uni = (UniFile *)f;
    char name[256];
    size_t from, to;
    name_span(f->path, &from, &to);
    snprintf(name, sizeof name, "%.*s", (int)(to - from), f->path + from);
    if (!add_grid(uni, name, NULL, err) || !add_sibling(uni, f->request->velocity, err)) return false;
    for (int i = 0; i < f->request->nattribute; i++)
        if (!add_sibling(uni, f->request->attribute[i], err)) return false;
    return true;
}

static bool uni_read(VolumeFile *f, int i, Grid *out, Err *err)
{
    const char *path = ((UniFile *)f)->other[i] ? ((UniFile *)f)->other[i] : f->path;
    UniHeader h;
    InFile in = {0};
    Stream *s = uni_stream(&in, path, &h, err);
    bool ok = s && dense_place(path, f->request, NULL, out, err);
    if (ok && h.ncomp != out->ncomp) ok = fail(err, ERR_INPUT, "%.600s: changed while it was read", path);
    ok = ok && dense_read(s, path, h.type, (DenseShape){{h.n[0], h.n[1], h.n[2]}, true}, out, err);
    if (ok) out->staggered = h.staggered;
    stream_close(s);
    infile_close(&in);
    return ok;
}

static void uni_close(VolumeFile *f)
{
    UniFile *uni = (UniFile *)f;
    for (int i = 0; i < f->nentry; i++) mem_free(uni->other[i]);
    mem_free(uni->other);
}

const Format UNI_FORMAT = {"Mantaflow", ".uni", sizeof(UniFile), uni_open, uni_read, uni_close};
