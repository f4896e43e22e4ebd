#include "io/vat_priv.h"

#include <stdio.h>
#include <string.h>

char *vat_path(const char *prefix)
{
    size_t size = strlen(prefix) + sizeof ".vat.json";
    char *path = NEW(char, size);
    snprintf(path, size, "%s.vat.json", prefix);
    return path;
}

/* Of an open run's blocks, but for the ".part" behind it. */
static char *stream_path(const char *prefix, int slot)
{
    size_t size = strlen(prefix) + sizeof ".vat.0";
    char *path = NEW(char, size);
    snprintf(path, size, "%s.vat.%d", prefix, slot);
    return path;
}

/* --- runs ------------------------------------------------------------------------------------------- */

static VatRun *last_run(Vat *v) { return &v->run[v->nrun - 1]; }

static size_t block_floats(const VatRun *r) { return 2 * 3 * (size_t)r->nvert; }

static void copy_base(TriMesh *to, const TriMesh *m)
{
    trimesh_free(to);
    trimesh_init(to, m->nvert, m->ntri, false, false);
    memcpy(to->pos, m->pos, 3 * (size_t)m->nvert * sizeof *m->pos);
    memcpy(to->normal, m->normal, 3 * (size_t)m->nvert * sizeof *m->normal);
    memcpy(to->id, m->id, (size_t)m->nvert * sizeof *m->id);
    memcpy(to->tri, m->tri, 3 * (size_t)m->ntri * sizeof *m->tri);
}

static bool add_block(Vat *v, const float *pos, const float *normal, Err *err)
{
    VatRun *r = last_run(v);
    size_t n = 3 * (size_t)r->nvert;
    for (size_t i = 0; i < n; i++) {
        if (pos[i] < r->lo[i % 3]) r->lo[i % 3] = pos[i];
        if (pos[i] > r->hi[i % 3]) r->hi[i % 3] = pos[i];
        v->block[i] = pos[i] - v->base.pos[i];
    }
    memcpy(v->block + n, normal, n * sizeof *normal);
    return outfile_write(&v->stream[v->slot], v->block, block_floats(r) * sizeof *v->block, err);
}

/* The narrowest power of two that holds a block in one row, as far as a texture may be wide. */
static int width_for(const Vat *v, int nvert)
{
    int width = 1;
    while (width < nvert && width < v->side) width *= 2;
    return width;
}

static int rows_for(int nvert, int width) { return nvert / width + (nvert % width > 0); }

static bool begin_run(Vat *v, const TriMesh *mesh, const char *label, Err *err)
{
    v->slot = !v->slot;
    outfile_abort(&v->stream[v->slot]); /* of the run before the last */
    char *path = stream_path(v->prefix, v->slot);
    bool good = outfile_open(&v->stream[v->slot], path, err);
    mem_free(path);
    if (!good) return false;

    int width = width_for(v, mesh->nvert);
    RESERVE(v->run, v->cap, v->nrun + 1);
    VatRun *r = &v->run[v->nrun++];
    *r = (VatRun){.first = v->frame, .frames = 1, .nvert = mesh->nvert, .ntri = mesh->ntri, .width = width,
                  .rows = rows_for(mesh->nvert, width)};
    snprintf(r->label, sizeof r->label, "%s", label);
    memcpy(r->lo, mesh->pos, sizeof r->lo);
    memcpy(r->hi, mesh->pos, sizeof r->hi);
    copy_base(&v->base, mesh);
    RESIZE(v->block, block_floats(r));
    v->open = true;
    return add_block(v, mesh->pos, mesh->normal, err);
}

/* With a block of where it would be at the next frame, where that is known. */
static bool end_run(Vat *v, const float *pos, const float *normal, Err *err)
{
    if (pos) {
        last_run(v)->carried = 1;
        if (!add_block(v, pos, normal, err)) return false;
    }
    v->open = false;
    return vat_write_run(v, err);
}

/* Frames a run may have, so that with the one carried on the textures stay in their bounds. */
static int frames_most(const Vat *v, const VatRun *r) { return int_max(v->side / r->rows - 1, 1); }

static bool add_frame(Vat *v, const TriMesh *mesh, const float *carried_pos, const float *carried_normal, int frames,
                      const char *label, Err *err)
{
    if (frames > INT32_MAX - 2 - v->frame)
        return fail(err, ERR_OUTPUT, "%.800s: the sequence has too many frames", v->prefix);
    v->frame += frames;
    bool same = v->open && trimesh_is_same_run(&v->base, mesh);
    if (same && frames == 1 && last_run(v)->frames < frames_most(v, last_run(v))) {
        last_run(v)->frames++;
        return add_block(v, mesh->pos, mesh->normal, err);
    }
    if (same) carried_pos = mesh->pos, carried_normal = mesh->normal;
    bool follows = frames == 1 && carried_pos && carried_normal;
    if (v->open && !end_run(v, follows ? carried_pos : NULL, carried_normal, err)) return false;
    return mesh->ntri == 0 || begin_run(v, mesh, label, err);
}

/* --- the calls -------------------------------------------------------------------------------------- */

Vat *vat_open(const VatOptions *options)
{
    Vat *v = NEW0(Vat, 1);
    v->prefix = mem_text(options->prefix);
    v->name = mem_text(options->name);
    v->fps = options->fps;
    v->side = options->side;
    v->frame = -1;
    return v;
}

bool vat_add_frame(Vat *v, const TriMesh *mesh, const float *carried_pos, const float *carried_normal, int frames,
                   const char *label, Err *err)
{
    ASSERT(frames >= 1);
    if (v->broken.code == ERR_NONE && !add_frame(v, mesh, carried_pos, carried_normal, frames, label, err)) v->broken = *err;
    if (v->broken.code == ERR_NONE) return true;
    *err = v->broken;
    return false;
}

bool vat_finish(Vat *v, Err *err)
{
    if (v->broken.code == ERR_NONE) return (!v->open || vat_write_run(v, err)) && vat_write_json(v, err);
    *err = v->broken;
    return false;
}

static void free_all(Vat *v, void (*close)(OutFile *))
{
    if (!v) return;
    for (int i = 0; i < 2; i++) close(&v->stream[i]);
    trimesh_free(&v->base);
    mem_free(v->block);
    mem_free(v->run);
    mem_free(v->prefix);
    mem_free(v->name);
    mem_free(v);
}

void vat_abort(Vat *v) { free_all(v, outfile_abort); }
void vat_leave(Vat *v) { free_all(v, outfile_leave); }

/* --- going on --------------------------------------------------------------------------------------- */

bool vat_sync(Vat *v, Err *err) { return !v->open || outfile_sync(&v->stream[v->slot], err); }

static bool is_run(const Vat *v, const VatRun *r)
{
    return r->frames > 0 && r->nvert > 0 && r->ntri > 0 && r->width == width_for(v, r->nvert) &&
           r->rows == rows_for(r->nvert, r->width) && r->frames <= frames_most(v, r) &&
           (r->carried == 0 || r->carried == 1) && memchr(r->label, 0, sizeof r->label);
}

static bool is_sound(Vat *v)
{
    bool sound = v->frame >= -1 && (v->slot == 0 || v->slot == 1) && (!v->open || v->nrun > 0);
    for (int i = 0; i < v->nrun; i++) sound = sound && is_run(v, &v->run[i]);
    return sound && (!v->open || (v->base.nvert == last_run(v)->nvert && v->base.ntri == last_run(v)->ntri));
}

void vat_store(Vat *v, Store *s)
{
    uint8_t open = v->open;
    STORE(s, v->frame);
    STORE(s, v->slot);
    STORE(s, open);
    v->open = open;
    STORE(s, v->nrun);
    STORE_ARRAY(s, v->run, v->nrun);
    if (s->reading) v->cap = v->nrun;
    if (open) trimesh_store(&v->base, s);
}

static bool reopen_stream(Vat *v, Err *err)
{
    const VatRun *r = last_run(v);
    uint64_t bytes = (uint64_t)vat_blocks(r) * block_floats(r) * sizeof *v->block;
    char *path = stream_path(v->prefix, v->slot);
    bool good = outfile_reopen(&v->stream[v->slot], path, bytes, err);
    mem_free(path);
    RESIZE(v->block, block_floats(r));
    return good;
}

static void sweep(const char *prefix, int slot)
{
    char *path = stream_path(prefix, slot);
    outfile_sweep(path);
    mem_free(path);
}

Vat *vat_reopen(const VatOptions *options, Store *s, Err *err)
{
    Vat *v = vat_open(options);
    vat_store(v, s);
    store_expect(s, !s->bad && is_sound(v));
    if (s->bad || (v->open && !reopen_stream(v, err))) {
        vat_leave(v);
        return NULL;
    }
    for (int slot = 0; slot < 2; slot++)
        if (!v->open || slot != v->slot) sweep(v->prefix, slot); /* begun behind the state */
    return v;
}

void vat_sweep(const char *prefix)
{
    for (int slot = 0; slot < 2; slot++) sweep(prefix, slot);
}
