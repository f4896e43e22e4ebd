#include "cli/chunk.h"

#include "base/digest.h"

#include <errno.h>
#include <string.h>

typedef struct Head {
    char magic[16];        /* with the version of the layout */
    char version[16];
    uint64_t record_bytes; /* tells other builds' structs, where they differ */
} Head;

typedef struct RecordHead {
    uint64_t bytes, digest; /* of what follows */
} RecordHead;

static Head own_head(void)
{
    return (Head){.magic = "twinmesh chunk\n", .version = TWINMESH_VERSION, .record_bytes = sizeof(FrameStat) + sizeof(StageSeconds) + sizeof(FrameEvent)};
}

char *chunk_path(const char *prefix)
{
    size_t size = strlen(prefix) + sizeof ".chunk";
    char *path = NEW(char, size);
    snprintf(path, size, "%s.chunk", prefix);
    return path;
}

/* --- a frame, both ways --------------------------------------------------------------------------- */

static void store_carried(OutFrame *f, Store *s)
{
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        uint8_t is_there = f->carried[kind][0] != NULL;
        STORE(s, is_there);
        STORE(s, f->ncarried[kind]);
        if (!is_there) continue;
        for (int k = 0; k < 2; k++) STORE_ARRAY(s, f->carried[kind][k], 3 * (int64_t)f->ncarried[kind]);
    }
}

/* What the stitching leans on, beyond what a mesh alone can be held to. */
static void expect_twins(const TriMesh mesh[KIND_COUNT], Store *s)
{
    const TriMesh *mech = &mesh[KIND_MECHANICAL], *fine = &mesh[KIND_GEOMETRIC];
    store_expect(s, fine->parent != NULL);
    for (int t = 0; t < fine->ntri && !s->bad; t++) store_expect(s, fine->parent[t] >= 0 && fine->parent[t] < mech->ntri);
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int v = 0; v < mesh[kind].nvert && !s->bad; v++) store_expect(s, mesh[kind].id[v] >= 0);
}

/* `mesh`: of a tracked frame. */
static void store_frame(OutFrame *f, TriMesh mesh[KIND_COUNT], Store *s)
{
    int32_t fate = (int32_t)f->fate;
    STORE(s, f->label);
    STORE(s, fate);
    store_expect(s, fate >= FRAME_TRACKED && fate <= FRAME_SKIPPED && memchr(f->label, 0, sizeof f->label));
    STORE(s, f->seconds);
    if (s->bad) fate = FRAME_SKIPPED;
    f->fate = (FrameFate)fate;
    if (fate != FRAME_TRACKED) return;
    STORE(s, f->stat);
    store_text(s, &f->surface);
    store_text(s, &f->since);
    events_store(&f->events, s);
    store_carried(f, s);
    for (int kind = 0; kind < KIND_COUNT; kind++) trimesh_store(&mesh[kind], s);
    if (s->reading) expect_twins(mesh, s);
}

/* --- writing -------------------------------------------------------------------------------------- */

bool chunk_begin(OutFile *f, Err *err)
{
    Head head = own_head();
    return outfile_write(f, &head, sizeof head, err);
}

bool chunk_add_frame(OutFile *f, OutFrame *frame, Err *err)
{
    Store s = store_writing();
    TriMesh mesh[KIND_COUNT];
    if (frame->mesh) memcpy(mesh, frame->mesh, sizeof mesh); /* columns are only read */
    store_frame(frame, mesh, &s);
    RecordHead head = {s.n, digest_bytes(s.data, s.n)};
    bool good = outfile_write(f, &head, sizeof head, err) && outfile_write(f, s.data, s.n, err);
    store_free(&s);
    return good;
}

/* --- reading -------------------------------------------------------------------------------------- */

bool chunk_open(ChunkFile *c, const char *prefix, Err *err)
{
    Head head, own = own_head();
    *c = (ChunkFile){.path = chunk_path(prefix)};
    c->stream = fopen(c->path, "rb");
    bool good = c->stream || fail(err, ERR_INPUT, "%.800s: cannot be read: %s; run this chunk first", c->path, strerror(errno));
    if (good && (fread(&head, sizeof head, 1, c->stream) != 1 || memcmp(head.magic, own.magic, sizeof head.magic) != 0))
        good = fail(err, ERR_INPUT, "%.800s: is no chunk of a sequence; run it again", c->path);
    if (good && memcmp(&head, &own, sizeof head) != 0)
        good = fail(err, ERR_INPUT, "%.800s: was left by another version of the program; run the chunk again", c->path);
    if (!good) chunk_close(c);
    return good;
}

/* Bytes from here to the file's end. */
static uint64_t bytes_left(FILE *f)
{
    long at = ftell(f);
    long end = at >= 0 && fseek(f, 0, SEEK_END) == 0 ? ftell(f) : -1;
    return end >= at && at >= 0 && fseek(f, at, SEEK_SET) == 0 ? (uint64_t)(end - at) : 0;
}

/* The caller frees *data. */
static bool read_record(ChunkFile *c, uint8_t **data, size_t *n, bool *more)
{
    RecordHead head;
    size_t got = fread(&head, 1, sizeof head, c->stream);
    *data = NULL;
    *more = got != 0;
    if (!*more) return !ferror(c->stream);
    if (got != sizeof head || head.bytes > bytes_left(c->stream)) return false;
    *n = (size_t)head.bytes;
    *data = NEW(uint8_t, *n);
    return fread(*data, 1, *n, c->stream) == *n && digest_bytes(*data, *n) == head.digest;
}

bool chunk_next(ChunkFile *c, OutFrame *out, bool *more, Err *err)
{
    uint8_t *data;
    size_t n = 0;
    *out = (OutFrame){0};
    bool good = read_record(c, &data, &n, more);
    if (good && *more) {
        Store s = store_reading(data, n);
        TriMesh mesh[KIND_COUNT] = {0};
        store_frame(out, mesh, &s);
        good = !s.bad && s.at == s.n;
        for (int kind = 0; kind < KIND_COUNT; kind++) {
            if (out->fate == FRAME_TRACKED) trimesh_free(&c->mesh[kind]), c->mesh[kind] = mesh[kind];
        }
        if (out->fate == FRAME_TRACKED) out->mesh = c->mesh;
    }
    mem_free(data);
    return good || fail(err, ERR_INPUT, "%.800s: is damaged; run the chunk again", c->path);
}

void chunk_rewind(ChunkFile *c)
{
    fseek(c->stream, (long)sizeof(Head), SEEK_SET);
}

void chunk_close(ChunkFile *c)
{
    for (int kind = 0; kind < KIND_COUNT; kind++) trimesh_free(&c->mesh[kind]);
    if (c->stream) fclose(c->stream);
    mem_free(c->path);
    *c = (ChunkFile){0};
}
