#include "cli/render_source.h"

#include "io/ply.h"
#include "render/render.h"

#include <string.h>
#include <strings.h>

static const char *const kind_name[] = {"geometric", "mechanical"};
enum { GEOMETRIC, MECHANICAL };

/* --- names on standard input ---------------------------------------------------------------------------- */

static bool is_ply(const char *path)
{
    size_t n = strlen(path);
    return n > 4 && strcasecmp(path + n - 4, ".ply") == 0;
}

/* mesh names both of a frame's meshes. */
static bool is_geometric(const char *path) { return is_ply(path) && !strstr(path, ".mechanical."); }
static bool is_mechanical(const char *path) { return is_ply(path) && !strstr(path, ".geometric."); }

/* Whether there is such a frame; waits for it. */
static SequenceStep await(RenderSource *s, int i, Err *err)
{
    Frame *frame = NEW(Frame, 1);
    SequenceStep step = SEQUENCE_FRAME;
    while (i >= s->n && step == SEQUENCE_FRAME && !s->ended) {
        step = sequence_next(&s->arrivals, frame, err);
        s->ended = step != SEQUENCE_FRAME;
        if (s->ended) break;
        if (s->n == s->cap) {
            int cap = s->cap;
            RESERVE(s->path, cap, s->n + 1);
            RESERVE(s->number, s->cap, s->n + 1);
        }
        s->path[s->n] = mem_text(frame->path);
        s->number[s->n++] = frame->number;
    }
    mem_free(frame);
    return step == SEQUENCE_ERROR ? step : i < s->n ? SEQUENCE_FRAME : SEQUENCE_END;
}

/* --- meshes -------------------------------------------------------------------------------------------- */

static bool check_reach(const TriMesh *m, const char *path, Err *err)
{
    return render_can_reach(m) ||
           fail(err, ERR_INPUT, "%.400s: has a vertex farther than %g from the origin, which cannot be pictured; scale or write it again", path, RENDER_REACH);
}

static bool read_file(const char *path, TriMesh *out, Err *err) { return ply_read(path, out, err) && check_reach(out, path, err); }

static bool read_stored(MeshSequence *meshes, int i, TriMesh *out, Err *err)
{
    return mesh_sequence_read(meshes, i, out, err) && check_reach(out, mesh_sequence_path(meshes, i), err);
}

/* The mechanical mesh that mesh wrote before this geometric one. */
static bool read_twin_file(const char *path, TriMesh *out, Err *err)
{
    const char *kind = strstr(path, ".geometric.");
    if (!kind) return fail(err, ERR_INPUT, "%.400s: has no mechanical mesh beside it: its name has no .geometric. in it", path);
    size_t size = strlen(path) + 8;
    char *twin = NEW(char, size);
    snprintf(twin, size, "%.*s.mechanical.%s", (int)(kind - path), path, kind + strlen(".geometric."));
    bool ok = read_file(twin, out, err);
    mem_free(twin);
    return ok;
}

/* --- opening ------------------------------------------------------------------------------------------- */

/* A glTF's frames are those of its run, where that left a report. */
static MeshSequence *open_kind(const RenderSource *s, const char *name, int kind, Err *err)
{
    MeshSequence *meshes = mesh_sequence_open(name, kind_name[kind], err);
    if (meshes && s->report.first != NONE) mesh_sequence_number_from(meshes, s->report.first, s->report.step);
    return meshes;
}

static bool open_stored(RenderSource *s, Options *o, int kind, Err *err)
{
    const char *name = o->operand[0];
    if (s->with_mechanical && !mesh_sequence_is_prefix(name))
        return fail(err, ERR_USAGE, "--style papers pictures both meshes: give the PREFIX that mesh was given instead of %.400s", name);
    if (mesh_sequence_is_prefix(name)) s->report = run_report_read(name);
    if (!run_report_suggest(&s->report, o, err)) return false;
    s->meshes = open_kind(s, name, kind, err);
    if (!s->meshes || (s->with_mechanical && !(s->mechanical = open_kind(s, name, MECHANICAL, err)))) return false;
    s->ended = true;
    s->n = mesh_sequence_length(s->meshes);
    s->number = NEW(int64_t, s->n);
    for (int i = 0; i < s->n; i++) s->number[i] = mesh_sequence_number(s->meshes, i);
    return render_source_length(s) > 0 || fail(err, ERR_INPUT, "%.400s: no frames are to be pictured; name others by --frames", name);
}

bool render_source_open(RenderSource *s, Options *o, Err *err)
{
    const char *frames = option_text(o, RENDER_FRAMES);
    int kind = option_choice(o, RENDER_KIND);
    *s = (RenderSource){.report.first = NONE, .range = {0, INT64_MAX, 1}, .held = {NONE, NONE, NONE}, .with_mechanical = option_choice(o, RENDER_STYLE) == 1};
    if (frames && !frame_range_parse(frames, &s->range, err)) return false;
    if (s->with_mechanical) kind = GEOMETRIC;
    if (strcmp(o->operand[0], "-") == 0) {
        sequence_open_names(&s->arrivals, kind == GEOMETRIC ? is_geometric : is_mechanical);
        return true;
    }
    if (open_stored(s, o, kind, err)) return true;
    render_source_close(s);
    return false;
}

void render_source_close(RenderSource *s)
{
    mesh_sequence_close(s->meshes);
    mesh_sequence_close(s->mechanical);
    run_report_free(&s->report);
    for (int i = 0; s->path && i < s->n; i++) mem_free(s->path[i]);
    mem_free(s->path);
    mem_free(s->number);
    for (int i = 0; i < NEARBY; i++) trimesh_free(&s->mesh[i]);
    trimesh_free(&s->twin);
    sequence_close(&s->arrivals);
    *s = (RenderSource){0};
}

/* --- frames -------------------------------------------------------------------------------------------- */

bool render_source_is_piped(const RenderSource *s) { return !s->meshes; }

static bool is_pictured(const RenderSource *s, int i)
{
    int64_t number = s->number[i];
    return number >= s->range.first && number <= s->range.last && (number - s->range.first) % s->range.step == 0;
}

int render_source_length(const RenderSource *s)
{
    int n = 0;
    for (int i = 0; s->meshes && i < s->n; i++) n += is_pictured(s, i);
    return s->meshes ? n : NONE;
}

int64_t render_source_first(const RenderSource *s)
{
    int i = 0;
    while (!is_pictured(s, i)) i++;
    return s->number[i];
}

int64_t render_source_last(const RenderSource *s)
{
    int i = s->n - 1;
    while (!is_pictured(s, i)) i--;
    return s->number[i];
}

void render_source_rewind(RenderSource *s) { s->at = 0; }

static bool hold(RenderSource *s, int i, Err *err)
{
    int slot = i % NEARBY;
    if (s->held[slot] == i) return true;
    trimesh_free(&s->mesh[slot]);
    s->held[slot] = NONE;
    bool ok = s->meshes ? read_stored(s->meshes, i, &s->mesh[slot], err) : read_file(s->path[i], &s->mesh[slot], err);
    if (ok) s->held[slot] = i;
    return ok;
}

static bool read_twin(RenderSource *s, int i, Err *err)
{
    trimesh_free(&s->twin);
    if (!s->meshes) return read_twin_file(s->path[i], &s->twin, err);
    int twin = mesh_sequence_find(s->mechanical, s->number[i]);
    if (twin == NONE) return fail(err, ERR_INPUT, "frame %lld has no mechanical mesh", (long long)s->number[i]);
    return read_stored(s->mechanical, twin, &s->twin, err);
}

static SequenceStep find_frame(RenderSource *s, Err *err)
{
    SequenceStep step;
    while ((step = await(s, s->at, err)) == SEQUENCE_FRAME && !is_pictured(s, s->at)) s->at++;
    return step;
}

static bool read_nearby(RenderSource *s, int i, RenderShot *out, Err *err)
{
    SequenceStep after = await(s, i + 1, err);
    if (after == SEQUENCE_ERROR) return false;
    if (i > 0 && !hold(s, i - 1, err)) return false;
    if (after == SEQUENCE_FRAME && !hold(s, i + 1, err)) return false;
    int64_t back = i > 0 ? s->number[i] - s->number[i - 1] : 0, on = after == SEQUENCE_FRAME ? s->number[i + 1] - s->number[i] : 0;
    out->to_before = back ? back : on ? on : 1;
    out->to_after = on ? on : out->to_before;
    if (back) out->before = &s->mesh[(i - 1) % NEARBY];
    if (on) out->after = &s->mesh[(i + 1) % NEARBY];
    return true;
}

SequenceStep render_source_next(RenderSource *s, bool motion, RenderShot *out, Err *err)
{
    *out = (RenderShot){0};
    SequenceStep step = find_frame(s, err);
    if (step != SEQUENCE_FRAME) return step;
    int i = s->at++;
    out->number = s->number[i];
    if (motion && !read_nearby(s, i, out, err)) return SEQUENCE_ERROR;
    if (!hold(s, i, err) || (s->with_mechanical && !read_twin(s, i, err))) return SEQUENCE_ERROR;
    out->mesh = &s->mesh[i % NEARBY];
    if (s->with_mechanical) out->mechanical = &s->twin;
    return SEQUENCE_FRAME;
}
