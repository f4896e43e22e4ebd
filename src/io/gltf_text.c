/* gltf_text.c: the JSON of a glTF, written from its tables row by row: memory does not grow with the animation. (As a tree in
 * memory, which libraries want first, it took 33 KB a frame.) */
#include "io/gltf_priv.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

typedef struct Sink {
    OutFile *file;   /* NULL: only counted */
    uint64_t bytes;
    bool good;
    Err *err;
} Sink;

__attribute__((format(printf, 2, 3))) static void put(Sink *s, const char *fmt, ...)
{
    char text[1024]; /* names are cut before: attribute_name in gltf.c */
    va_list args;
    va_start(args, fmt);
    int n = vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    ASSERT(n >= 0 && (size_t)n < sizeof text);
    s->bytes += (uint64_t)n;
    if (s->file && s->good) s->good = outfile_write(s->file, text, (size_t)n, s->err);
}

static const char *comma(int i) { return i ? "," : ""; }

/* --- buffers ------------------------------------------------------------------------------------------ */

/* The last component of the part's name, percent-encoded, so that it is both a URI and a JSON string. */
static void put_uri(Sink *s, const char *path)
{
    const char *slash = strrchr(path, '/');
    for (const char *c = slash ? slash + 1 : path; *c; c++) {
        bool plain = (*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z') || (*c >= '0' && *c <= '9') || strchr("-._~", *c);
        put(s, plain ? "%c" : "%%%02X", (unsigned char)*c);
    }
}

static void put_buffers(Sink *s, const Gltf *g, bool one)
{
    const GltfDoc *d = &g->doc;
    if (d->npart == 0) return;
    put(s, "\"buffers\":[");
    if (one) put(s, "{\"byteLength\":%llu}", (unsigned long long)gltf_sum_of_parts(g));
    for (int p = 0; p < d->npart && !one; p++) {
        put(s, "%s{\"byteLength\":%llu,\"uri\":\"", comma(p), (unsigned long long)d->part_bytes[p]);
        put_uri(s, g->part[p].path);
        put(s, "\"}");
    }
    put(s, "],");
}

static void put_views(Sink *s, const GltfDoc *d, bool one)
{
    uint64_t start = 0; /* of the view's part in the one buffer; views lie in the order of the parts */
    int part = 0;
    if (d->nview == 0) return;
    put(s, "\"bufferViews\":[");
    for (int i = 0; i < d->nview; i++) {
        const GltfView *v = &d->view[i];
        for (; one && part < v->part; part++) start += d->part_bytes[part];
        put(s, "%s{\"buffer\":%d,\"byteOffset\":%llu,\"byteLength\":%llu", comma(i), one ? 0 : v->part,
            (unsigned long long)(start + v->offset), (unsigned long long)v->bytes);
        if (v->stride) put(s, ",\"byteStride\":%d", v->stride);
        if (v->target) put(s, ",\"target\":%d", v->target);
        put(s, "}");
    }
    put(s, "],");
}

/* Exact: a validator holds them to the data. */
static void put_range(Sink *s, const char *name, int width, const float *x)
{
    put(s, ",\"%s\":[", name);
    for (int k = 0; k < width; k++) put(s, "%s%.17g", comma(k), (double)x[k]);
    put(s, "]");
}

static void put_accessors(Sink *s, const GltfDoc *d)
{
    static const char *const type[] = {"", "SCALAR", "VEC2", "VEC3"};
    if (d->naccessor == 0) return;
    put(s, "\"accessors\":[");
    for (int i = 0; i < d->naccessor; i++) {
        const GltfAccessor *a = &d->accessor[i];
        put(s, "%s{\"bufferView\":%d,\"byteOffset\":%llu,\"componentType\":%d,\"count\":%lld,\"type\":\"%s\"", comma(i), a->view,
            (unsigned long long)a->offset, a->component, (long long)a->count, type[a->width]);
        if (a->has_range) put_range(s, "min", a->width, a->lo);
        if (a->has_range) put_range(s, "max", a->width, a->hi);
        put(s, "}");
    }
    put(s, "],");
}

/* --- what is shown ------------------------------------------------------------------------------------ */

static void put_mesh(Sink *s, const GltfDoc *d, const GltfPiece *p)
{
    const GltfRun *run = &d->run[p->run];
    put(s, "{\"primitives\":[{\"attributes\":{\"POSITION\":%d,\"NORMAL\":%d,\"_ID\":%d", p->position, p->normal, run->id);
    if (p->velocity != NONE) put(s, ",\"_VELOCITY\":%d", p->velocity);
    for (int a = run->attr; a < run->attr + run->nattr; a++) put(s, ",\"%s\":%d", d->attr[a].name, d->attr[a].accessor);
    put(s, "},\"indices\":%d,\"mode\":4", run->index);
    for (int k = 0; k < p->ntarget; k++)
        put(s, "%s{\"POSITION\":%d,\"NORMAL\":%d}", k ? "," : ",\"targets\":[", p->target + 2 * k, p->target + 2 * k + 1);
    put(s, "%s}]}", p->ntarget ? "]" : "");
}

/* Only the first piece is visible to a viewer that plays no animation. */
static void put_nodes(Sink *s, const GltfDoc *d)
{
    put(s, "\"meshes\":[");
    for (int i = 0; i < d->npiece; i++) {
        put(s, "%s", comma(i));
        put_mesh(s, d, &d->piece[i]);
    }
    put(s, "],\"nodes\":[");
    for (int i = 0, within = 0; i < d->npiece; i++) {
        int run = d->piece[i].run;
        within = i && d->piece[i - 1].run == run ? within + 1 : 0;
        put(s, "%s{\"mesh\":%d,\"name\":\"%s_%d", comma(i), i, d->name, run);
        if (within) put(s, "_%d", within);
        put(s, i ? "\",\"scale\":[0,0,0]}" : "\"}");
    }
    put(s, "],");
}

static void put_scene(Sink *s, const GltfDoc *d)
{
    put(s, "\"scene\":0,\"scenes\":[{\"name\":\"%s\"", d->name);
    for (int i = 0; i < d->npiece; i++) put(s, "%s%d", i ? "," : ",\"nodes\":[", i);
    put(s, d->npiece ? "]}]" : "}]");
}

/* --- the animation ------------------------------------------------------------------------------------ */

typedef void PutChannel(Sink *s, int i, int node, const char *path, int input, int output, bool step);

static void put_channel(Sink *s, int i, int node, const char *path, int input, int output, bool step)
{
    (void)input, (void)output, (void)step;
    put(s, "%s{\"sampler\":%d,\"target\":{\"node\":%d,\"path\":\"%s\"}}", comma(i), i, node, path);
}

static void put_sampler(Sink *s, int i, int node, const char *path, int input, int output, bool step)
{
    (void)node, (void)path;
    put(s, "%s{\"input\":%d,\"interpolation\":\"%s\",\"output\":%d}", comma(i), input, step ? "STEP" : "LINEAR", output);
}

static int for_channels(Sink *s, const GltfDoc *d, PutChannel *fn)
{
    int n = 0;
    for (int i = 0; i < d->npiece; i++) {
        const GltfPiece *p = &d->piece[i];
        if (p->weights_in != NONE) fn(s, n++, i, "weights", p->weights_in, p->weights_out, d->step);
        if (p->scale_in != NONE) fn(s, n++, i, "scale", p->scale_in, p->scale_out, true);
    }
    return n;
}

static void put_animation(Sink *s, const GltfDoc *d)
{
    if (for_channels(&(Sink){0}, d, put_channel) == 0) return;
    put(s, "\"animations\":[{\"channels\":[");
    for_channels(s, d, put_channel);
    put(s, "],\"samplers\":[");
    for_channels(s, d, put_sampler);
    put(s, "]}],");
}

/* ------------------------------------------------------------------------------------------------------ */

static void put_all(Sink *s, const Gltf *g, bool one)
{
    const GltfDoc *d = &g->doc;
    put(s, "{\"asset\":{\"generator\":\"twinmesh\",\"version\":\"2.0\"},");
    put_buffers(s, g, one);
    put_views(s, d, one);
    put_accessors(s, d);
    put_animation(s, d);
    if (d->npiece) put_nodes(s, d);
    put_scene(s, d);
    put(s, "}");
}

uint64_t gltf_text_size(const Gltf *g, bool one_buffer)
{
    Sink s = {0};
    put_all(&s, g, one_buffer);
    return s.bytes;
}

bool gltf_write_text(const Gltf *g, bool one_buffer, OutFile *file, Err *err)
{
    Sink s = {.file = file, .good = true, .err = err};
    put_all(&s, g, one_buffer);
    return s.good;
}
