/* gltf_resume.c: an animated glTF left in one run and gone on with in the next. */
#include "io/gltf_priv.h"

bool gltf_sync(Gltf *g, Err *err)
{
    for (int p = g->synced; p < g->doc.npart; p++)
        if (!outfile_sync(&g->part[p], err)) return false;
    g->synced = int_max(g->doc.npart - 1, 0); /* the ones before the last are full */
    return true;
}

/* Whether the tables name only what is there. */
static bool is_sound(const Gltf *g)
{
    const GltfDoc *d = &g->doc;
    for (int i = 0; i < d->nview; i++) {
        const GltfView *v = &d->view[i];
        if (v->part < 0 || v->part >= d->npart || v->offset > d->part_bytes[v->part] || v->bytes > d->part_bytes[v->part] - v->offset) return false;
    }
    for (int i = 0; i < d->naccessor; i++)
        if (d->accessor[i].view < 0 || d->accessor[i].view >= d->nview) return false;
    for (int i = 0; i < d->nattr; i++)
        if (!d->attr[i].name || d->attr[i].accessor < 0 || d->attr[i].accessor >= d->naccessor) return false;
    for (int i = 0; i < d->nrun; i++) {
        const GltfRun *r = &d->run[i];
        if (r->index < 0 || r->index >= d->naccessor || r->id < 0 || r->id >= d->naccessor) return false;
        if (r->attr < 0 || r->nattr < 0 || r->nattr > d->nattr - r->attr) return false;
    }
    for (int i = 0; i < d->npiece; i++) {
        const GltfPiece *p = &d->piece[i];
        bool targets = p->ntarget == 0 || (p->target >= 0 && p->target < d->naccessor - 2 * p->ntarget + 1);
        if (p->run < 0 || p->run >= d->nrun || p->ntarget < 0 || p->ntarget > GLTF_TARGETS || !targets) return false;
        if (p->position < 0 || p->position >= d->naccessor || p->normal < 0 || p->normal >= d->naccessor) return false;
        if (p->velocity < NONE || p->velocity >= d->naccessor) return false;
    }
    return g->frame >= -1 && (!g->open || d->npiece > 0);
}

static void store_tables(GltfDoc *d, Store *s)
{
#define TABLE(rows, n, cap) (STORE(s, d->n), STORE_ARRAY(s, d->rows, d->n), d->cap = s->reading ? d->n : d->cap)
    TABLE(part_bytes, npart, cap_part);
    TABLE(view, nview, cap_view);
    TABLE(accessor, naccessor, cap_accessor);
    TABLE(run, nrun, cap_run);
    TABLE(piece, npiece, cap_piece);
#undef TABLE
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
