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
    if (d->raw_bytes)
        put(s, ",{\"byteLength\":%llu,\"extensions\":{\"EXT_meshopt_compression\":{\"fallback\":true}}}",
            (unsigned long long)d->raw_bytes);
    put(s, "],");
}

/* Of a packed view: the bytes that there are; the view itself is told as if it were unpacked. */
static void put_packing(Sink *s, const GltfView *v, int buffer, uint64_t offset)
{
    put(s,
        ",\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":%d,\"byteOffset\":%llu,\"byteLength\":%llu,"
        "\"byteStride\":%d,\"count\":%lld,\"mode\":\"%s\"}}",
        buffer, (unsigned long long)offset, (unsigned long long)v->bytes, v->packed, (long long)v->count,
        v->target == GLTF_INDEX ? "INDICES" : "ATTRIBUTES");
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
        int buffer = one ? 0 : v->part, placeholder = one ? 1 : d->npart;
        uint64_t offset = start + v->offset, unpacked = (uint64_t)v->packed * (uint64_t)v->count;
        put(s, "%s{\"buffer\":%d,\"byteOffset\":%llu,\"byteLength\":%llu", comma(i), v->packed ? placeholder : buffer,
            (unsigned long long)(v->packed ? v->raw : offset), (unsigned long long)(v->packed ? unpacked : v->bytes));
        if (v->stride) put(s, ",\"byteStride\":%d", v->stride);
        if (v->target) put(s, ",\"target\":%d", v->target);
        if (v->packed) put_packing(s, v, buffer, offset);
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
        if (a->component == GLTF_I8) put(s, ",\"normalized\":true");
        if (a->range.known) put_range(s, "min", a->width, a->range.lo);
        if (a->range.known) put_range(s, "max", a->width, a->range.hi);
        put(s, "}");
    }
    put(s, "],");
}

/* --- what is shown ------------------------------------------------------------------------------------ */

static void put_mesh(Sink *s, const GltfDoc *d, const GltfPiece *p)
{
    const GltfRun *run = &d->run[p->run];
    put(s, "{\"primitives\":[{\"attributes\":{\"POSITION\":%d,\"NORMAL\":%d,\"_ID\":%d", p->position, p->normal, run->id);
    if (run->uv != NONE) put(s, ",\"TEXCOORD_0\":%d", run->uv);
    if (p->velocity != NONE) put(s, ",\"_VELOCITY\":%d", p->velocity);
    for (int a = run->attr; a < run->attr + run->nattr; a++) put(s, ",\"%s\":%d", d->attr[a].name, d->attr[a].accessor);
    put(s, "},\"indices\":%d,\"mode\":4", run->index);
    for (int k = 0; k < p->ntarget; k++)
        put(s, "%s{\"POSITION\":%d,\"NORMAL\":%d}", k ? "," : ",\"targets\":[", p->target + 2 * k, p->target + 2 * k + 1);
    put(s, "%s}]}", p->ntarget ? "]" : "");
}

/* Only the first piece is visible to a viewer that plays no animation. */
static void put_pieces(Sink *s, const GltfDoc *d)
{
    for (int i = 0, within = 0; i < d->npiece; i++) {
        int run = d->piece[i].run;
        within = i && d->piece[i - 1].run == run ? within + 1 : 0;
        put(s, "%s{\"mesh\":%d,\"name\":\"%s_%d", comma(i), i, d->name, run);
        if (within) put(s, "_%d", within);
        put(s, i ? "\",\"scale\":[0,0,0]}" : "\"}");
    }
}

/* Behind the pieces: the nodes that make places of their whole numbers, each with its pieces as children. */
static void put_grids(Sink *s, const GltfDoc *d)
{
    for (int k = 0, i = 0; k < d->ngrid; k++) {
        const GltfGrid *grid = &d->grid[k];
        double step = gltf_grid_step(grid);
        put(s, ",{\"name\":\"%s_grid_%d\",\"scale\":[%.17g,%.17g,%.17g],\"translation\":[%.17g,%.17g,%.17g]", d->name, k, step,
            step, step, step * grid->origin[0], step * grid->origin[1], step * grid->origin[2]);
        int n = 0; /* it may have lost its only piece */
        for (; i < d->npiece && d->piece[i].grid == k; i++) put(s, "%s%d", n++ ? "," : ",\"children\":[", i);
        put(s, n ? "]}" : "}");
    }
}

static void put_nodes(Sink *s, const GltfDoc *d)
{
    put(s, "\"meshes\":[");
    for (int i = 0; i < d->npiece; i++) {
        put(s, "%s", comma(i));
        put_mesh(s, d, &d->piece[i]);
    }
    put(s, "],\"nodes\":[");
    put_pieces(s, d);
    put_grids(s, d);
    put(s, "],");
}

static void put_scene(Sink *s, const GltfDoc *d)
{
    int first = d->ngrid ? d->npiece : 0, n = d->ngrid ? d->ngrid : d->npiece;
    put(s, "\"scene\":0,\"scenes\":[{\"name\":\"%s\"", d->name);
    for (int i = 0; i < n; i++) put(s, "%s%d", i ? "," : ",\"nodes\":[", first + i);
    put(s, n ? "]}]" : "}]");
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

static void put_extensions(Sink *s, const GltfDoc *d)
{
    const char *packing = d->raw_bytes ? ",\"EXT_meshopt_compression\"" : "";
    if (!d->ngrid) return;
    put(s, "\"extensionsRequired\":[\"KHR_mesh_quantization\"%s],", packing);
    put(s, "\"extensionsUsed\":[\"KHR_mesh_quantization\"%s],", packing);
}

static void put_all(Sink *s, const Gltf *g, bool one)
{
    const GltfDoc *d = &g->doc;
    put(s, "{\"asset\":{\"generator\":\"twinmesh\",\"version\":\"2.0\"},");
    put_extensions(s, d);
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
