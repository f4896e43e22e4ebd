/* gltf_resume.c: an animated glTF left in one run and gone on with in the next. */
#include "io/gltf_priv.h"

/* --- the parts --------------------------------------------------------------------------------------- */

bool gltf_sync(Gltf *g, Err *err)
{
    for (int p = g->synced; p < g->doc.npart; p++)
        if (!outfile_sync(&g->part[p], err)) return false;
    g->synced = int_max(g->doc.npart - 1, 0); /* the ones before the last are full */
    return true;
}

/* --- whether the tables name only what is there ------------------------------------------------------ */

static bool is_row(int i, int n) { return i >= 0 && i < n; }

static bool is_view(const GltfDoc *d, const GltfView *v)
{
    if (!is_row(v->part, d->npart)) return false;
    uint64_t bytes = d->part_bytes[v->part];
    return v->offset <= bytes && v->bytes <= bytes - v->offset;
}

static bool is_run(const GltfDoc *d, const GltfRun *r)
{
    if (!is_row(r->index, d->naccessor) || !is_row(r->id, d->naccessor) || r->uv != NONE) return false;
    return r->attr >= 0 && r->nattr >= 0 && r->attr <= d->nattr && r->nattr <= d->nattr - r->attr;
}

static bool is_grid(const GltfGrid *grid)
{
    return grid->exponent >= GLTF_EXPONENT_LEAST && grid->exponent <= GLTF_EXPONENT_MOST;
}

static bool is_piece(const GltfDoc *d, const GltfPiece *p)
{
    int n = d->naccessor;
    if (d->compress && !is_row(p->grid, d->ngrid)) return false;
    if (!is_row(p->run, d->nrun) || !is_row(p->position, n) || !is_row(p->normal, n)) return false;
    if (p->velocity != NONE && !is_row(p->velocity, n)) return false;
    if (!is_row(p->ntarget, GLTF_TARGETS + 1)) return false;
    return p->ntarget == 0 || (is_row(p->target, n) && 2 * p->ntarget <= n - p->target);
}

static bool is_sound(const Gltf *g)
{
    const GltfDoc *d = &g->doc;
    bool sound = g->frame >= -1 && (!g->open || d->npiece > 0);
    for (int i = 0; i < d->nview; i++) sound = sound && is_view(d, &d->view[i]);
    for (int i = 0; i < d->naccessor; i++) sound = sound && is_row(d->accessor[i].view, d->nview);
    for (int i = 0; i < d->nattr; i++) sound = sound && d->attr[i].name && is_row(d->attr[i].accessor, d->naccessor);
    for (int i = 0; i < d->nrun; i++) sound = sound && is_run(d, &d->run[i]);
    for (int i = 0; i < d->ngrid; i++) sound = sound && is_grid(&d->grid[i]);
    for (int i = 0; i < d->npiece; i++) sound = sound && is_piece(d, &d->piece[i]);
    return sound;
}

/* --- what is kept ------------------------------------------------------------------------------------ */

static void store_tables(GltfDoc *d, Store *s)
{
#define TABLE(rows, n, cap) (STORE(s, d->n), STORE_ARRAY(s, d->rows, d->n), d->cap = s->reading ? d->n : d->cap)
    TABLE(part_bytes, npart, cap_part);
    TABLE(view, nview, cap_view);
    TABLE(accessor, naccessor, cap_accessor);
    TABLE(run, nrun, cap_run);
    TABLE(grid, ngrid, cap_grid);
    TABLE(piece, npiece, cap_piece);
#undef TABLE
    STORE(s, d->raw_bytes);
    STORE(s, d->nattr);
    if (s->reading) {
        store_expect(s, d->nattr >= 0 && (size_t)d->nattr <= s->n - s->at);
        d->cap_attr = d->nattr = s->bad ? 0 : d->nattr;
        d->attr = NEW0(GltfAttribute, d->nattr);
    }
    for (int a = 0; a < d->nattr; a++) {
        store_text(s, &d->attr[a].name);
        STORE(s, d->attr[a].accessor);
    }
}

void gltf_store(Gltf *g, Store *s)
{
    uint8_t open = g->open;
    store_tables(&g->doc, s);
    STORE(s, g->frame);
    STORE(s, open);
    g->open = open;
    trimesh_store(&g->last, s);
    int64_t n = open ? 3 * (int64_t)g->last.nvert : 0;
    STORE_ARRAY(s, g->base_pos, n);
    STORE_ARRAY(s, g->base_normal, n);
}

/* The first `npart` parts, as long as they were. */
static bool reopen_parts(Gltf *g, int npart, Err *err)
{
    g->part = NEW0(OutFile, npart);
    char *stem = gltf_stem(g->path);
    bool good = true;
    while (good && g->doc.npart < npart) {
        int p = g->doc.npart;
        char *path = gltf_part_path(stem, p);
        good = outfile_reopen(&g->part[p], path, g->doc.part_bytes[p], err);
        g->doc.npart += good;
        mem_free(path);
    }
    mem_free(stem);
    return good;
}

Gltf *gltf_reopen(const GltfOptions *options, Store *s, Err *err)
{
    Gltf *g = gltf_open(options, err);
    if (!g) return NULL;
    gltf_store(g, s);
    store_expect(s, !s->bad && is_sound(g));
    int npart = g->doc.npart;
    g->doc.npart = 0; /* none is open yet */
    if (!s->bad && reopen_parts(g, npart, err)) return g;
    gltf_leave(g);
    return NULL;
}

void gltf_sweep(const char *path)
{
    char *stem = gltf_stem(path);
    bool more = true;
    for (int p = 0; more; p++) {
        OutFile f = {0};
        char *name = gltf_part_path(stem, p);
        Err none;
        more = outfile_reopen(&f, name, 0, &none);
        outfile_abort(&f);
        mem_free(name);
    }
    mem_free(stem);
}
