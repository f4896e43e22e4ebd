#include "io/gltf_priv.h"
#include "io/bytes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* --- the animation ------------------------------------------------------------------------ */

/* Toward zero: a player that asks for frame / fps must find the key at or before that time. */
static float key_time(const Gltf *g, int frame)
{
    double t = frame / g->fps;
    float f = (float)t;
    return (double)f > t ? nextafterf(f, 0) : f;
}

static int store_times(Gltf *g, const int *frame, int n, Err *err)
{
    float time[GLTF_TARGETS + 1];
    for (int k = 0; k < n; k++) time[k] = key_time(g, frame[k]);
    return gltf_store_keys(g, time, n, 1, true, err);
}

/* Row 0 rests at the base, row k shows target k - 1 alone. */
static int store_identity(Gltf *g, int ntarget, Err *err)
{
    float weight[(GLTF_TARGETS + 1) * GLTF_TARGETS] = {0};
    for (int k = 0; k < ntarget; k++) weight[(k + 1) * ntarget + k] = 1;
    return gltf_store_keys(g, weight, (ntarget + 1) * ntarget, 1, false, err);
}

typedef struct Visibility {
    int n, frame[4], shown[4];
} Visibility;

/* When a piece is shown, among `frames` frames: the clip lasts until the last one was seen. */
static Visibility piece_visibility(const GltfPiece *p, bool is_last, int frames)
{
    Visibility v = {0};
    int shown_at_end = p->until == frames;
    if (p->from > 0) v.frame[v.n] = 0, v.shown[v.n++] = 0;
    v.frame[v.n] = p->from, v.shown[v.n++] = 1;
    v.frame[v.n] = p->until, v.shown[v.n++] = shown_at_end;
    if (is_last && !shown_at_end) v.frame[v.n] = frames, v.shown[v.n++] = 0;
    return v;
}

static int store_scales(Gltf *g, const Visibility *v, Err *err)
{
    float scale[3 * 4];
    for (int k = 0; k < 3 * v->n; k++) scale[k] = (float)v->shown[k / 3];
    return gltf_store_keys(g, scale, v->n, 3, false, err);
}

/* The accessors of all channels. The outputs take few shapes, which the pieces share. */
static bool store_animation(Gltf *g, Err *err)
{
    int identity[GLTF_TARGETS + 1], scales[16];
    for (int k = 0; k <= GLTF_TARGETS; k++) identity[k] = NONE;
    for (int k = 0; k < 16; k++) scales[k] = NONE;
    int frames = g->frame + 1;
    for (int i = 0; i < g->doc.npiece && frames > 1; i++) {
        GltfPiece *p = &g->doc.piece[i];
        if (p->ntarget) {
            int *rows = &identity[p->ntarget];
            if (*rows == NONE) *rows = store_identity(g, p->ntarget, err);
            p->weights_out = *rows;
            p->weights_in = *rows == NONE ? NONE : store_times(g, p->key, p->ntarget + 1, err);
            if (p->weights_in == NONE) return false;
        }
        Visibility v = piece_visibility(p, i + 1 == g->doc.npiece, frames);
        /* `from > 0` and what follows the 1 tell the shapes apart */
        int *shape = &scales[(p->from > 0) + 2 * v.shown[v.n - 1] + 4 * (v.n - (p->from > 0) > 2)];
        if (*shape == NONE) *shape = store_scales(g, &v, err);
        p->scale_out = *shape;
        p->scale_in = *shape == NONE ? NONE : store_times(g, v.frame, v.n, err);
        if (p->scale_in == NONE) return false;
    }
    return true;
}

/* --- the two kinds of file ------------------------------------------------------------------------ */

static bool put_chunk(OutFile *file, uint64_t bytes, uint32_t kind, Err *err)
{
    uint8_t head[8];
    put_u32(head, (uint32_t)bytes);
    put_u32(head + 4, kind);
    return outfile_write(file, head, sizeof head, err);
}

uint64_t gltf_sum_of_parts(const Gltf *g)
{
    uint64_t sum = 0;
    for (int p = 0; p < g->doc.npart; p++) sum += g->doc.part_bytes[p];
    return sum;
}

/* Chunks are filled up to four bytes; the parts are already. */
static uint64_t glb_bytes(const Gltf *g, uint64_t text)
{
    uint64_t bin = gltf_sum_of_parts(g);
    return 12 + 8 + ((text + 3) & ~(uint64_t)3) + (bin ? 8 + bin : 0);
}

static bool write_glb(Gltf *g, uint64_t text, Err *err)
{
    OutFile file;
    if (!outfile_open(&file, g->path, err)) return false;
    uint64_t bin = gltf_sum_of_parts(g), filling = -text & 3;
    uint8_t head[12];
    put_u32(head, 0x46546c67); /* glTF */
    put_u32(head + 4, 2);
    put_u32(head + 8, (uint32_t)glb_bytes(g, text));
    bool ok = outfile_write(&file, head, sizeof head, err) && put_chunk(&file, text + filling, 0x4e4f534a /* JSON */, err) &&
              gltf_write_text(g, true, &file, err) && outfile_write(&file, "   ", filling, err);
    if (ok && bin) ok = put_chunk(&file, bin, 0x004e4942 /* BIN */, err);
    for (int p = 0; p < g->doc.npart && ok; p++) ok = outfile_append(&file, &g->part[p], err);
    if (ok) return outfile_commit(&file, err);
    outfile_abort(&file);
    return false;
}

/* The JSON comes last: until it is there, the .bin files are nothing. */
static bool write_gltf(Gltf *g, const char *path, Err *err)
{
    OutFile file;
    if (!outfile_open(&file, path, err)) return false;
    bool ok = gltf_write_text(g, false, &file, err) && outfile_write(&file, "\n", 1, err);
    int done = 0;
    while (ok && done < g->doc.npart) ok = outfile_publish(&g->part[done++], err);
    if (ok) ok = outfile_commit(&file, err);
    outfile_abort(&file);
    for (int p = 0; p < done && !ok; p++) remove(g->part[p].path);
    return ok;
}

/* PREFIX.gltf in place of PREFIX.glb; the parts are renamed to PREFIX.bin and so on. */
static bool write_outgrown(Gltf *g, Err *err)
{
    size_t size = strlen(g->prefix) + sizeof ".gltf";
    char *path = NEW(char, size), sentence[1000];
    snprintf(path, size, "%s.gltf", g->prefix);
    for (int p = 0; p < g->doc.npart; p++) {
        mem_free(g->part[p].path);
        g->part[p].path = gltf_part_path(g->prefix, p);
    }
    bool ok = write_gltf(g, path, err);
    if (ok && g->warn) {
        snprintf(sentence, sizeof sentence, "%.400s: larger than a .glb can be; %.400s and its .bin files were written instead", g->path, path);
        g->warn(sentence);
    }
    mem_free(path);
    return ok;
}

bool gltf_assemble(Gltf *g, Err *err)
{
    if (!store_animation(g, err)) return false;
    if (!g->binary) return write_gltf(g, g->path, err);
    uint64_t text = gltf_text_size(g, true);
    return glb_bytes(g, text) <= g->glb_bytes ? write_glb(g, text, err) : write_outgrown(g, err);
}
