#include "io/gltf_priv.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include <meshoptimizer.h>

/* --- copies of meshes ------------------------------------------------------------------------ */

static bool is_empty(const TriMesh *m) { return m->nvert == 0 || m->ntri == 0; }

/* A validator takes unit vectors only; a normal of no length gets an arbitrary direction. */
static void copy_normals(float *to, const float *from, int n)
{
    for (const float *end = from + 3 * (size_t)n; from != end; from += 3, to += 3) {
        double x = from[0], y = from[1], z = from[2], length = sqrt(x * x + y * y + z * z);
        bool usable = isfinite(length) && length > 0;
        bool unit = fabs(length - 1) < 1e-4;
        to[0] = unit ? from[0] : usable ? (float)(x / length) : 0;
        to[1] = unit ? from[1] : usable ? (float)(y / length) : 0;
        to[2] = unit ? from[2] : usable ? (float)(z / length) : 1;
    }
}

static void copy_mesh(TriMesh *to, const TriMesh *m)
{
    size_t v3 = 3 * (size_t)m->nvert, t3 = 3 * (size_t)m->ntri;
    trimesh_init(to, m->nvert, m->ntri, m->velocity != NULL, false);
    if (is_empty(m)) return; /* it may have no columns */
    memcpy(to->pos, m->pos, v3 * sizeof *m->pos);
    copy_normals(to->normal, m->normal, m->nvert);
    if (m->velocity) memcpy(to->velocity, m->velocity, v3 * sizeof *m->velocity);
    memcpy(to->id, m->id, (size_t)m->nvert * sizeof *m->id);
    memcpy(to->tri, m->tri, t3 * sizeof *m->tri);
}

static bool is_finite(const float *v, int n)
{
    for (size_t i = 0; v && i < 3 * (size_t)n; i++)
        if (!isfinite(v[i])) return false;
    return true;
}

/* --- pieces ------------------------------------------------------------------------ */

static GltfPiece *open_piece(Gltf *g) { return &g->doc.piece[g->doc.npiece - 1]; }

/* A piece of the last run that begins with `mesh` at `frame`; `next`: its vertices in the first target, or NULL. */
static bool piece_begin(Gltf *g, const TriMesh *mesh, const float *next, int frame, Err *err)
{
    GltfDoc *d = &g->doc;
    RESERVE(d->piece, d->cap_piece, d->npiece + 1);
    GltfPiece *p = &d->piece[d->npiece++];
    *p = (GltfPiece){.run = d->nrun - 1,
                     .from = frame,
                     .until = frame + 1,
                     .velocity = NONE,
                     .target = NONE,
                     .key = {frame}};
    p->weights_in = p->weights_out = p->scale_in = p->scale_out = NONE;
    if (d->compress) p->grid = gltf_grid_for(g, mesh->pos, next, mesh->nvert);

    p->position = gltf_store_vertices(g, &(GltfColumns){mesh->pos, mesh->normal}, NULL, mesh->nvert, err);
    if (p->position == NONE) return false;
    p->normal = p->position + 1;
    if (mesh->velocity) {
        p->velocity = gltf_store_vec3(g, mesh->velocity, mesh->nvert, err);
        if (p->velocity == NONE) return false;
    }
    size_t n = 3 * (size_t)mesh->nvert;
    RESIZE(g->base_pos, n);
    RESIZE(g->base_normal, n);
    memcpy(g->base_pos, mesh->pos, n * sizeof *mesh->pos);
    memcpy(g->base_normal, mesh->normal, n * sizeof *mesh->normal);
    return true;
}

/* Whether the open piece can take these vertices as a target. */
static bool piece_has_room(Gltf *g, const float *pos)
{
    const GltfPiece *p = open_piece(g);
    if (p->ntarget == GLTF_TARGETS) return false;
    return !g->doc.compress || gltf_grid_fits(&g->doc.grid[p->grid], g->base_pos, pos, g->last.nvert);
}

/* A new piece that begins at the last frame given, and goes on to `next`. */
static bool piece_hand_over(Gltf *g, const float *next, Err *err)
{
    if (open_piece(g)->from == g->frame) g->doc.npiece--; /* it would not be shown; what it has stored is left unused */
    else open_piece(g)->until = g->frame;
    return piece_begin(g, &g->last, next, g->frame, err);
}

/* The open piece's vertices at `frame`. */
static bool piece_add_target(Gltf *g, const float *pos, const float *normal, int frame, Err *err)
{
    if (!piece_has_room(g, pos) && !piece_hand_over(g, pos, err)) return false;
    GltfPiece *p = open_piece(g);
    const GltfColumns base = {g->base_pos, g->base_normal};
    int first = gltf_store_vertices(g, &(GltfColumns){pos, normal}, &base, g->last.nvert, err);
    if (first == NONE) return false;
    if (p->ntarget == 0) p->target = first;
    ASSERT(first == p->target + 2 * p->ntarget);
    p->key[++p->ntarget] = frame;
    return true;
}

/* --- runs ------------------------------------------------------------------------ */

/* "_TEMPERATURE" of grid "temperature": capitals, as the specification writes its own; three.js lowers them
 * all, so that names must differ in more than case. The caller frees it. */
static char *attribute_name(const Gltf *g, int first, const char *grid)
{
    size_t n = strlen(grid);
    if (n > 200) n = 200;
    char *name = NEW(char, n + (size_t)(g->doc.nattr - first) + 8);
    name[0] = '_';
    for (size_t i = 0; i < n; i++) {
        char c = grid[i];
        bool small = c >= 'a' && c <= 'z', plain = (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
        name[i + 1] = (char)(small ? c - 'a' + 'A' : plain ? c : '_');
    }
    name[++n] = 0;
    for (;;) {
        bool taken = strcmp(name, "_ID") == 0 || strcmp(name, "_VELOCITY") == 0;
        for (int a = first; a < g->doc.nattr; a++) taken = taken || strcmp(name, g->doc.attr[a].name) == 0;
        if (!taken) return name;
        name[n++] = '_';
        name[n] = 0;
    }
}

static bool run_begin(Gltf *g, const TriMesh *mesh, int frame, Err *err)
{
    GltfDoc *d = &g->doc;
    RESERVE(d->run, d->cap_run, d->nrun + 1);
    GltfRun *run = &d->run[d->nrun++];
    *run = (GltfRun){.frames = 1, .attr = d->nattr, .uv = NONE};
    run->index = gltf_store_indices(g, mesh, err);
    if (run->index == NONE) return false;
    run->id = gltf_store_ids(g, mesh, err);
    if (run->id == NONE) return false;
    for (int a = 0; a < mesh->nattr; a++) {
        int accessor = gltf_store_scalars(g, mesh->attr[a], mesh->nvert, err);
        if (accessor == NONE) return false;
        char *name = attribute_name(g, run->attr, mesh->attr_name[a]);
        RESERVE(d->attr, d->cap_attr, d->nattr + 1);
        d->attr[d->nattr++] = (GltfAttribute){.name = name, .accessor = accessor};
        run->nattr++;
    }
    g->open = true;
    return piece_begin(g, &g->now, NULL, frame, err);
}

static bool run_extend(Gltf *g, int frame, Err *err)
{
    g->doc.run[g->doc.nrun - 1].frames++;
    if (g->doc.step && open_piece(g)->ntarget == GLTF_TARGETS) {
        /* without interpolation no piece needs to reach the next one's first frame */
        if (!piece_begin(g, &g->now, NULL, frame, err)) return false;
    } else if (!piece_add_target(g, g->now.pos, g->now.normal, frame, err)) {
        return false;
    }
    open_piece(g)->until = frame + 1;
    return true;
}

/* Lets the surface move on until `frame`, when something else is shown. */
static bool run_end(Gltf *g, const float *carried_pos, const float *carried_normal, int frame, Err *err)
{
    g->open = false;
    if (!carried_pos || g->doc.step) return true;
    int n = g->last.nvert;
    float *normal = NEW(float, 3 * (size_t)n);
    copy_normals(normal, carried_normal ? carried_normal : g->last.normal, n);
    bool ok = piece_add_target(g, carried_pos, normal, frame, err);
    mem_free(normal);
    if (ok) open_piece(g)->until = g->frame + 1;
    return ok;
}

static bool add_frame(Gltf *g, const TriMesh *mesh, const float *carried_pos, const float *carried_normal,
                      int frames, Err *err)
{
    if (frames > INT32_MAX - 2 - g->frame)
        return fail(err, ERR_OUTPUT, "%.800s: the sequence has too many frames", g->path);
    bool empty = is_empty(mesh);
    if (!empty && !(is_finite(mesh->pos, mesh->nvert) && is_finite(mesh->velocity, mesh->nvert)))
        return fail(err, ERR_OUTPUT,
                    "%.800s: a vertex is not finite; this is a mistake in the program, please report it",
                    g->path);
    if (g->open && !is_finite(carried_pos, g->last.nvert)) carried_pos = NULL; /* held where carrying fails */

    int frame = g->frame + frames;
    copy_mesh(&g->now, mesh);
    bool same = g->open && trimesh_is_same_run(&g->last, &g->now);
    if (same && frames == 1) {
        if (!run_extend(g, frame, err)) return false;
    } else {
        /* skipped frames end a run, though the way to the next mesh may be known */
        if (same) carried_pos = g->now.pos, carried_normal = g->now.normal;
        if (g->open && !run_end(g, carried_pos, carried_normal, frame, err)) return false;
        if (!empty && !run_begin(g, mesh, frame, err)) return false;
    }
    g->frame = frame;
    trimesh_free(&g->last);
    g->last = g->now;
    g->now = (TriMesh){0};
    return true;
}

/* --- the calls ------------------------------------------------------------------------ */

Gltf *gltf_open(const GltfOptions *options, Err *err)
{
    const char *dot = strrchr(options->path, '.');
    bool binary = dot && strcasecmp(dot, ".glb") == 0;
    if (!binary && !(dot && strcasecmp(dot, ".gltf") == 0)) {
        fail(err, ERR_USAGE, "%.800s: the name of a glTF file must end in .glb or .gltf", options->path);
        return NULL;
    }
    if (!(options->fps > 0) || !isfinite(options->fps)) {
        fail(err, ERR_USAGE, "%.800s: the frames a second must be a positive number", options->path);
        return NULL;
    }
    Gltf *g = NEW0(Gltf, 1);
    g->path = mem_text(options->path);
    g->prefix = mem_text(options->path);
    g->prefix[dot - options->path] = 0;
    g->name = mem_text(options->name);
    g->doc.name = g->name;
    g->doc.step = options->step;
    g->doc.compress = options->compress;
    g->binary = binary;
    g->fps = options->fps;
    g->warn = options->warn;
    g->part_bytes = GLTF_PART_BYTES;
    g->glb_bytes = GLTF_GLB_BYTES;
    g->frame = -1;
    meshopt_encodeVertexVersion(0); /* the bitstreams that EXT_meshopt_compression specifies, whatever the library's default */
    meshopt_encodeIndexVersion(1);
    return g;
}

bool gltf_add_frame(Gltf *g, const TriMesh *mesh, const float *carried_pos, const float *carried_normal,
                    int frames, Err *err)
{
    ASSERT(frames >= 1);
    if (g->broken.code == ERR_NONE && !add_frame(g, mesh, carried_pos, carried_normal, frames, err)) {
        g->broken = *err;
        trimesh_free(&g->now);
    }
    if (g->broken.code == ERR_NONE) return true;
    *err = g->broken;
    return false;
}

static void free_all(Gltf *g)
{
    GltfDoc *d = &g->doc;
    for (int a = 0; a < d->nattr; a++) mem_free(d->attr[a].name);
    mem_free(g->part);
    mem_free(d->part_bytes);
    mem_free(d->view);
    mem_free(d->accessor);
    mem_free(d->attr);
    mem_free(d->run);
    mem_free(d->grid);
    mem_free(d->piece);
    trimesh_free(&g->last);
    trimesh_free(&g->now);
    mem_free(g->base_pos);
    mem_free(g->base_normal);
    mem_free(g->scratch);
    mem_free(g->packed);
    mem_free(g->path);
    mem_free(g->prefix);
    mem_free(g->name);
    mem_free(g);
}

void gltf_abort(Gltf *g)
{
    if (!g) return;
    for (int p = 0; p < g->doc.npart; p++) outfile_abort(&g->part[p]);
    free_all(g);
}

void gltf_leave(Gltf *g)
{
    if (!g) return;
    for (int p = 0; p < g->doc.npart; p++) outfile_leave(&g->part[p]);
    free_all(g);
}

bool gltf_finish(Gltf *g, Err *err)
{
    if (g->broken.code == ERR_NONE) return gltf_assemble(g, err);
    *err = g->broken;
    return false;
}

bool gltf_close(Gltf *g, Err *err)
{
    bool ok = gltf_finish(g, err);
    gltf_abort(g);
    return ok;
}

bool gltf_write_still(const char *path, const TriMesh *mesh, const float *uv, const char *name, Err *err)
{
    Gltf *g = gltf_open(&(GltfOptions){.path = path, .fps = 1, .name = name}, err);
    if (!g) return false;
    bool good = gltf_add_frame(g, mesh, NULL, NULL, 1, err);
    if (good) good = (g->doc.run[0].uv = gltf_store_vec2(g, uv, mesh->nvert, err)) != NONE;
    if (good) return gltf_close(g, err);
    gltf_abort(g);
    return false;
}

static int by_size(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

GltfStat gltf_stat(const Gltf *g)
{
    int n = g->doc.nrun;
    if (n == 0) return (GltfStat){0};
    int *frames = NEW(int, n);
    for (int r = 0; r < n; r++) frames[r] = g->doc.run[r].frames;
    qsort(frames, (size_t)n, sizeof *frames, by_size);
    double median = 0.5 * (frames[(n - 1) / 2] + (double)frames[n / 2]);
    mem_free(frames);
    return (GltfStat){.runs = n, .median_run = median};
}
