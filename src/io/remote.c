/* remote.c: a volume file whose grids another process reads: the format that asks it, and the answers.
 *
 * What is asked: a file, then its grids by number, then NONE. What is answered: an Err, and, where its code is ERR_NONE, the
 * rest. A process that met something wrong, or grew large, reads no other file.
 * Both ends are one program, so numbers go as they lie in memory; the asking end takes none of them at its word. */
#include "io/isolate_priv.h"

#include <string.h>

enum { TEXT_MAX = 1 << 16, COORD_LIMIT = 1 << 20, KEEP_BYTES = 1 << 26, DIRECT_LEAST = 1 << 15 };

typedef struct RemoteFile {
    VolumeFile base;
    ReaderProcess *process;
    int64_t bytes;  /* of the files it has opened */
    int64_t taken;  /* of the grids it has handed over */
    bool wrong;
} RemoteFile;

/* A grid without its arrays. */
typedef struct GridHead {
    Affine xform;
    int staggered, lo[3], hi[3], nblock, ntile;
    float background[3];
} GridHead;

/* --- texts and requests ------------------------------------------------------------------------------ */

static bool put_text(Wire *w, const char *s)
{
    int32_t n = s ? (int32_t)strlen(s) : NONE;
    return wire_put(w, &n, sizeof n) && (!s || wire_put(w, s, (size_t)n));
}

static bool get_text(Wire *w, char **out)
{
    int32_t n;
    *out = NULL;
    if (!wire_get(w, &n, sizeof n) || n > TEXT_MAX) return false;
    if (n < 0) return true;
    *out = NEW0(char, n + 1);
    return wire_get(w, *out, (size_t)n);
}

static bool put_request(Wire *w, const char *path, const VolumeRequest *r)
{
    bool ok = put_text(w, path) && wire_put(w, r, sizeof *r) && put_text(w, r->grid) && put_text(w, r->velocity) &&
              put_text(w, r->raw_type) && put_text(w, r->raw_order);
    for (int i = 0; ok && i < r->nattribute; i++) ok = put_text(w, r->attribute[i]);
    return ok;
}

/* A request with texts of its own. */
typedef struct Request {
    char *path, *grid, *velocity, *type, *order, **attribute;
    VolumeRequest volume;
} Request;

static void request_free(Request *r)
{
    for (int i = 0; r->attribute && i < r->volume.nattribute; i++) mem_free(r->attribute[i]);
    mem_free(r->attribute);
    mem_free(r->path);
    mem_free(r->grid);
    mem_free(r->velocity);
    mem_free(r->type);
    mem_free(r->order);
}

static bool get_request(Wire *w, Request *r)
{
    *r = (Request){0};
    VolumeRequest *v = &r->volume;
    if (!get_text(w, &r->path) || !r->path || !wire_get(w, v, sizeof *v)) return false;
    if (!get_text(w, &r->grid) || !get_text(w, &r->velocity) || !get_text(w, &r->type) || !get_text(w, &r->order)) return false;
    r->attribute = NEW0(char *, v->nattribute);
    for (int i = 0; i < v->nattribute; i++)
        if (!get_text(w, &r->attribute[i])) return false;
    v->grid = r->grid;
    v->velocity = r->velocity;
    v->raw_type = r->type;
    v->raw_order = r->order;
    v->attribute = (const char *const *)r->attribute;
    return true;
}

/* --- arrays ------------------------------------------------------------------------------------------ */

/* Many samples are copied out of this process's memory, once, where the system allows that; else they are sent. */
static bool put_samples(Wire *w, const float *value, size_t size)
{
    uint64_t address = (uint64_t)(uintptr_t)value;
    uint8_t taken = 0;
    if (size < DIRECT_LEAST) return wire_put(w, value, size);
    if (!wire_put(w, &address, sizeof address) || !wire_get(w, &taken, 1)) return false;
    return taken || wire_put(w, value, size);
}

static bool get_samples(ReaderProcess *p, float *to, size_t size)
{
    uint64_t address;
    if (size < DIRECT_LEAST) return wire_get(&p->wire, to, size);
    if (!wire_get(&p->wire, &address, sizeof address)) return false;
    uint8_t taken = process_copy(p, address, to, size);
    return wire_put(&p->wire, &taken, 1) && (taken ? wire_flush(&p->wire) : wire_get(&p->wire, to, size));
}

/* --- where the file is read ---------------------------------------------------------------------------- */

static bool put_grid(Wire *w, const Grid *g)
{
    GridHead h = {.xform = g->xform, .staggered = g->staggered, .nblock = g->nblock, .ntile = g->ntile};
    memcpy(h.lo, g->lo, sizeof h.lo);
    memcpy(h.hi, g->hi, sizeof h.hi);
    memcpy(h.background, g->background, sizeof h.background);
    /* The samples come last: once they are taken neither end waits for the other. */
    return wire_put(w, &h, sizeof h) && wire_put(w, g->origin, (size_t)g->nblock * sizeof *g->origin) &&
           wire_put(w, g->tile, (size_t)g->ntile * sizeof *g->tile) &&
           put_samples(w, g->value, (size_t)g->nblock * (size_t)g->ncomp * GRID_CELLS * sizeof *g->value);
}

static bool answer_grid(Wire *w, VolumeFile *f, int32_t i)
{
    Grid g;
    Err err = {0};
    if (i < 0 || i >= f->nentry) return false;
    grid_init(&g, f->entry[i].ncomp);
    f->format->read(f, i, &g, &err);
    bool ok = wire_put(w, &err, sizeof err) && (err.code || (wire_put(w, &f->entry[i], sizeof *f->entry) && put_grid(w, &g)));
    grid_free(&g);
    return ok;
}

/* False where there is no other file to come. */
static bool serve_file(Wire *w)
{
    Request request;
    Err err = {0};
    int32_t i = 0;
    isolate_ungrant();
    bool ok = get_request(w, &request);
    VolumeFile *f = ok ? volume_open_here(request.path, &request.volume, &err) : NULL;
    int64_t bytes = isolate_granted();
    ok = ok && wire_put(w, &err, sizeof err) && f && wire_put(w, &bytes, sizeof bytes) && wire_put(w, &f->nentry, sizeof f->nentry) &&
         wire_put(w, f->entry, (size_t)f->nentry * sizeof *f->entry);
    while (ok && wire_get(w, &i, sizeof i) && i != NONE) ok = answer_grid(w, f, i);
    volume_close(f);
    request_free(&request);
    return ok && !w->failed;
}

void remote_serve(Wire *w)
{
    while (serve_file(w)) continue;
    wire_get(w, &(char){0}, 1); /* what is put yet goes out, and the end waits for whoever reads it */
}

/* --- where it is asked for ------------------------------------------------------------------------------ */

static bool nonsense(const RemoteFile *r, Err *err)
{
    return fail(err, ERR_INPUT, "%.600s: the process that read it answered nonsense; the file is damaged: write or copy it again", r->base.path);
}

/* The outcome of what was asked. */
static bool get_outcome(RemoteFile *r, Err *err)
{
    Err said;
    if (!wire_get(&r->process->wire, &said, sizeof said)) return process_fail(r->process, r->base.path, err);
    said.text[sizeof said.text - 1] = 0;
    if (said.code == ERR_NONE) return true;
    if (said.code < ERR_CHECK || said.code > ERR_RESOURCE) return nonsense(r, err);
    return fail(err, said.code, "%s", said.text);
}

static bool is_text(const char *s, size_t size) { return memchr(s, 0, size) != NULL; }

static bool is_entry(const VolumeEntry *e)
{
    return is_text(e->name, sizeof e->name) && is_text(e->type, sizeof e->type) && is_text(e->grid_class, sizeof e->grid_class) &&
           (e->ncomp == 0 || e->ncomp == 1 || e->ncomp == 3);
}

static bool remote_open(VolumeFile *f, Err *err)
{
    RemoteFile *r = (RemoteFile *)f;
    int n = 0;
    r->wrong = true;
    r->process = process_start(err);
    if (!r->process) return false;
    Wire *w = &r->process->wire;
    process_allow(r->process, 0);
    if (!put_request(w, f->path, f->request)) return process_fail(r->process, f->path, err);
    if (!get_outcome(r, err)) return false;
    if (!wire_get(w, &r->bytes, sizeof r->bytes) || !wire_get(w, &n, sizeof n)) return process_fail(r->process, f->path, err);
    if (r->bytes < 0 || !process_can_hold(r->bytes, n, sizeof *f->entry)) return nonsense(r, err);
    f->entry = NEW(VolumeEntry, n);
    if (!wire_get(w, f->entry, (size_t)n * sizeof *f->entry)) return process_fail(r->process, f->path, err);
    for (int i = 0; i < n; i++)
        if (!is_entry(&f->entry[i])) return nonsense(r, err);
    f->nentry = f->capentry = n;
    r->wrong = false;
    return true;
}

static bool is_head(const RemoteFile *r, const GridHead *h, int ncomp)
{
    for (int a = 0; a < 3; a++)
        if (h->lo[a] < -COORD_LIMIT || h->hi[a] > COORD_LIMIT || (h->lo[a] > h->hi[a]) != (h->lo[0] > h->hi[0])) return false;
    return process_can_hold(r->bytes, h->nblock, (size_t)ncomp * GRID_CELLS * sizeof(float)) &&
           process_can_hold(r->bytes, h->ntile, sizeof(GridTile));
}

static bool is_tile(const GridTile *t)
{
    if (t->log2side != 3 && t->log2side != 7 && t->log2side != 12) return false;
    for (int a = 0; a < 3; a++)
        if (t->lo[a] < -COORD_LIMIT || t->lo[a] >= COORD_LIMIT || t->lo[a] % (1 << t->log2side) != 0) return false;
    return true;
}

/* Room for the blocks at once, each entered as if it came from a file. */
static bool get_blocks(RemoteFile *r, int n, Grid *out, Err *err)
{
    if (n == 0) return true;
    grid_reserve(out, n);
    map_init(&out->block_at, n);
    if (!wire_get(&r->process->wire, out->origin, (size_t)n * sizeof *out->origin)) return process_fail(r->process, r->base.path, err);
    for (int b = 0; b < n; b++) {
        const int *o = out->origin[b];
        if (!grid_add_block(out, o[0], o[1], o[2]) || out->nblock != b + 1) return nonsense(r, err);
    }
    return true;
}

static bool get_tiles(RemoteFile *r, int n, Grid *out, Err *err)
{
    GridTile tile;
    for (int i = 0; i < n; i++) {
        if (!wire_get(&r->process->wire, &tile, sizeof tile)) return process_fail(r->process, r->base.path, err);
        if (!is_tile(&tile)) return nonsense(r, err);
        grid_add_tile(out, tile);
    }
    return true;
}

static bool get_grid(RemoteFile *r, Grid *out, Err *err)
{
    GridHead h;
    if (!wire_get(&r->process->wire, &h, sizeof h)) return process_fail(r->process, r->base.path, err);
    if (!is_head(r, &h, out->ncomp)) return nonsense(r, err);
    out->xform = h.xform;
    out->staggered = h.staggered;
    memcpy(out->lo, h.lo, sizeof h.lo);
    memcpy(out->hi, h.hi, sizeof h.hi);
    memcpy(out->background, h.background, sizeof h.background);
    if (!affine_invert(&out->xform)) return nonsense(r, err);
    if (!get_blocks(r, h.nblock, out, err) || !get_tiles(r, h.ntile, out, err)) return false;
    size_t size = (size_t)out->nblock * (size_t)out->ncomp * GRID_CELLS * sizeof *out->value;
    return get_samples(r->process, out->value, size) || process_fail(r->process, r->base.path, err);
}

static bool ask_grid(RemoteFile *r, int i, Grid *out, Err *err)
{
    Wire *w = &r->process->wire;
    VolumeEntry e;
    int32_t which = i;
    process_allow(r->process, r->bytes);
    if (!wire_put(w, &which, sizeof which)) return process_fail(r->process, r->base.path, err);
    if (!get_outcome(r, err)) return false;
    if (!wire_get(w, &e, sizeof e)) return process_fail(r->process, r->base.path, err);
    if (!is_entry(&e) || e.ncomp != out->ncomp) return nonsense(r, err);
    r->base.entry[i] = e;
    return get_grid(r, out, err);
}

static bool remote_read(VolumeFile *f, int i, Grid *out, Err *err)
{
    RemoteFile *r = (RemoteFile *)f;
    bool ok = ask_grid(r, i, out, err);
    r->wrong = r->wrong || !ok;
    r->taken += (int64_t)out->nblock * out->ncomp * GRID_CELLS * (int64_t)sizeof(float);
    return ok;
}

static void remote_close(VolumeFile *f)
{
    RemoteFile *r = (RemoteFile *)f;
    const int32_t none = NONE;
    bool keep = !r->wrong && r->taken < KEEP_BYTES && wire_put(&r->process->wire, &none, sizeof none);
    (keep ? process_keep : process_end)(r->process);
}

const Format REMOTE_FORMAT = {"", "", sizeof(RemoteFile), remote_open, remote_read, remote_close};
