#include "cli/farm.h"

#include "cli/chunk.h"
#include "cli/reader.h"
#include "cli/state.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PLACES_MAX = 1000 * 1000 * 1000 };

/* --- names ---------------------------------------------------------------------------------------- */

char *plan_path(const Plan *p, const char *name)
{
    size_t size = strlen(p->folder) + strlen(name) + 2;
    char *path = NEW(char, size);
    snprintf(path, size, "%s/%s", p->folder, name);
    return path;
}

char *plan_chunk_prefix(const Plan *p, int k)
{
    char name[32];
    snprintf(name, sizeof name, "chunk.%04d", k + 1);
    return plan_path(p, name);
}

char *program_path(void)
{
    char path[FRAME_PATH_MAX];
    ssize_t n = readlink("/proc/self/exe", path, sizeof path - 1);
    path[n > 0 ? n : 0] = 0;
    return mem_text(n > 0 ? path : "twinmesh");
}

/* --- making --------------------------------------------------------------------------------------- */

/* What of the command line is about the farm's running, not about the meshes. */
static bool is_of_running(int id)
{
    return id == OPT_THREADS || id == OPT_RESUME;
}

static void take_arguments(Plan *p, const Options *o)
{
    p->arg = NEW(char *, OPTION_COUNT + 1 + o->noperand);
    for (int i = 0; i < OPTION_COUNT; i++) {
        if (!option_given(o, i) || is_of_running(i)) continue;
        const OptionSpec *spec = &option_table[i];
        size_t size = strlen(spec->name) + strlen(o->value[i].text) + 4;
        char *text = NEW(char, size);
        snprintf(text, size, spec->argument ? "--%s=%s" : "--%s", spec->name, o->value[i].text);
        p->arg[p->narg++] = text;
    }
    p->arg[p->narg++] = mem_text("--");
    for (int i = 0; i < o->noperand; i++) p->arg[p->narg++] = mem_text(o->operand[i]);
}

static void cut(Plan *p, int nframe, int nchunk, int overlap)
{
    p->nchunk = nchunk;
    p->chunk = NEW0(ChunkPlan, nchunk);
    for (int k = 0; k < nchunk; k++) {
        int first = (int)((int64_t)nframe * k / nchunk), end = (int)((int64_t)nframe * (k + 1) / nchunk);
        p->chunk[k].own = (PlaceRange){first, end - 1};
        p->chunk[k].run = (PlaceRange){k ? int_max(first - overlap, 0) : 0, int_min(end, nframe - 1)};
    }
}

/* The surface and the edge that a run of the whole sequence would choose. False where --on-error wants no run at all. */
static bool take_surface(Plan *p, const MeshJob *job, const Frame *frame, Surface *chosen, Err *err)
{
    ReadFrame *f = NEW0(ReadFrame, 1);
    f->frame = *frame;
    readframe_read(job, *chosen, NULL, f);
    bool good = f->good || job->on_error != ON_ERROR_STOP || fail(err, f->err.code, "frame %s: %s", frame->digits, f->err.text);
    if (f->good) {
        *chosen = f->surface;
        p->has_surface = f->field.nbrick > 0;
        p->spec = chosen->spec;
        p->edge = job->track.edge * (job->track.edge_in_voxels ? f->field.voxel : 1);
    }
    readframe_free(f);
    mem_free(f);
    return good;
}

static bool look_at_frames(Plan *p, const MeshJob *job, Sequence *s, Err *err)
{
    Frame *frame = NEW(Frame, 1);
    Surface chosen = {0};
    bool good = true;
    for (int i = 0, k = 0; good && sequence_next(s, frame, err) == SEQUENCE_FRAME; i++) {
        if (i == p->chunk[k].own.first) memcpy(p->chunk[k].first, frame->digits, sizeof frame->digits);
        if (i == p->chunk[k].own.last) memcpy(p->chunk[k++].last, frame->digits, sizeof frame->digits);
        if (!p->has_surface) good = take_surface(p, job, frame, &chosen, err);
    }
    mem_free(frame);
    return good;
}

bool plan_make(Plan *p, const MeshJob *job, const Options *o, int nchunk, int overlap, Err *err)
{
    Sequence s;
    char directory[FRAME_PATH_MAX];
    *p = (Plan){0};
    if (!getcwd(directory, sizeof directory)) return fail(err, ERR_RESOURCE, "this folder cannot be named: %s", strerror(errno));
    p->directory = mem_text(directory);
    size_t size = strlen(job->prefix) + sizeof ".farm";
    p->folder = NEW(char, size);
    snprintf(p->folder, size, "%s.farm", job->prefix);
    take_arguments(p, o);
    if (!job_find_step(job, o, &p->step, err) || !job_open_sequence(job, o, &s, err)) return false;
    int nframe = sequence_length(&s);
    bool good = nframe == NONE  ? fail(err, ERR_USAGE, "- (names on standard input): a farm needs all frames to be named beforehand; give files or a pattern")
                : nchunk > nframe ? fail(err, ERR_USAGE, "--chunks %d: there are %d frames; no chunk can do without one", nchunk, nframe)
                                  : true;
    if (good) cut(p, nframe, nchunk, overlap);
    good = good && look_at_frames(p, job, &s, err);
    sequence_close(&s);
    return good;
}

void plan_free(Plan *p)
{
    for (int i = 0; i < p->narg; i++) mem_free(p->arg[i]);
    mem_free(p->arg);
    mem_free(p->folder);
    mem_free(p->directory);
    mem_free(p->chunk);
    *p = (Plan){0};
}

/* The next argument that the meshes depend on, or NULL. */
static const char *next_that_matters(const Plan *p, int *i)
{
    while (*i < p->narg) {
        const char *arg = p->arg[(*i)++];
        bool matters = true;
        for (int id = 0; id < OPTION_COUNT && matters; id++) {
            const OptionSpec *spec = &option_table[id];
            size_t n = strlen(spec->name);
            if (strncmp(arg, "--", 2) == 0 && strncmp(arg + 2, spec->name, n) == 0 && (arg[2 + n] == 0 || arg[2 + n] == '=')) matters = spec->echo != OPTION_RUN;
        }
        if (matters) return arg;
    }
    return NULL;
}

bool plan_is_same(const Plan *a, const Plan *b)
{
    int i = 0, j = 0;
    const char *x, *y;
    do {
        x = next_that_matters(a, &i);
        y = next_that_matters(b, &j);
    } while (x && y && strcmp(x, y) == 0);
    if (x || y || a->nchunk != b->nchunk || a->step != b->step) return false;
    for (int k = 0; k < a->nchunk; k++) {
        const ChunkPlan *c = &a->chunk[k], *d = &b->chunk[k];
        if (c->own.last != d->own.last || c->run.first != d->run.first || c->run.last != d->run.last) return false;
        if (strcmp(c->first, d->first) != 0 || strcmp(c->last, d->last) != 0) return false;
    }
    return a->has_surface == b->has_surface && a->spec.iso == b->spec.iso && a->spec.inside_below == b->spec.inside_below && a->edge == b->edge;
}

void plan_sweep(const Plan *p)
{
    for (int k = 0; k < p->nchunk; k++) {
        char *prefix = plan_chunk_prefix(p, k), *path = chunk_path(prefix);
        Err unsaid; /* what cannot be removed is replaced, or cannot be written */
        state_remove(prefix, &unsaid);
        outfile_sweep(path);
        remove(path);
        mem_free(path);
        mem_free(prefix);
    }
}

/* --- writing -------------------------------------------------------------------------------------- */

static void add_word(json_t *words, const char *text) { json_array_append_new(words, json_string(text)); }

static void add_option(json_t *words, const char *name, int value)
{
    char text[16];
    snprintf(text, sizeof text, "%d", value);
    add_word(words, name);
    add_word(words, text);
}

/* Of chunk k, or for NONE of the stitching. */
static json_t *command(const Plan *p, int k, int threads)
{
    char *program = program_path(), *plan = plan_path(p, "plan.json");
    json_t *words = json_array();
    add_word(words, program);
    add_word(words, "farm");
    if (k == NONE) add_word(words, "--stitch");
    else add_option(words, "--chunk", k + 1);
    if (k != NONE) add_option(words, "--threads", threads);
    add_word(words, plan);
    mem_free(program);
    mem_free(plan);
    return words;
}

static json_t *chunk_task(const Plan *p, int k, int threads)
{
    const ChunkPlan *c = &p->chunk[k];
    char *prefix = plan_chunk_prefix(p, k), *output = chunk_path(prefix);
    json_t *task = json_pack("{s:i, s:o, s:{s:[s,s], s:[i,i], s:[i,i]}, s:[s]}", "task", k + 1, "command", command(p, k, threads), "frames",
                             "own", c->first, c->last, "own_places", c->own.first, c->own.last, "run_places", c->run.first, c->run.last,
                             "outputs", output);
    mem_free(prefix);
    mem_free(output);
    return task;
}

static json_t *to_json(const Plan *p, int threads)
{
    json_t *arguments = json_array(), *tasks = json_array(), *surface = json_null();
    bool good = true;
    for (int i = 0; i < p->narg; i++) good = json_array_append_new(arguments, json_string(p->arg[i])) == 0 && good;
    for (int k = 0; k < p->nchunk; k++) good = json_array_append_new(tasks, chunk_task(p, k, threads)) == 0 && good;
    if (p->has_surface) surface = json_pack("{s:f, s:s, s:f}", "iso", p->spec.iso, "inside", p->spec.inside_below ? "below" : "above", "edge", p->edge);
    json_t *root = json_pack("{s:s, s:s, s:s, s:o, s:I, s:o, s:[{s:s, s:[], s:o}, {s:s, s:[s], s:[{s:i, s:o}]}]}", "program", "twinmesh",
                             "version", TWINMESH_VERSION, "directory", p->directory, "mesh_arguments", arguments, "frame_step", (json_int_t)p->step,
                             "surface", surface, "steps", "name", "chunks", "depends_on", "tasks", tasks, "name", "stitch", "depends_on", "chunks",
                             "tasks", "task", 1, "command", command(p, NONE, 0));
    if (good) return root;
    json_decref(root);
    return NULL;
}

bool plan_write(const Plan *p, int threads, Err *err)
{
    if (mkdir(p->folder, 0777) != 0 && errno != EEXIST)
        return fail(err, ERR_OUTPUT, "%.800s: the folder cannot be made: %s", p->folder, strerror(errno));
    json_t *root = to_json(p, threads);
    char *text = root ? json_dumps(root, JSON_INDENT(1)) : NULL, *path = plan_path(p, "plan.json");
    OutFile f;
    bool good = text || fail(err, ERR_USAGE, "a name of the command line or of this folder is no UTF-8, which %.800s must be", path);
    if (good && (good = outfile_open(&f, path, err))) {
        if (outfile_write(&f, text, strlen(text), err) && outfile_write(&f, "\n", 1, err)) good = outfile_commit(&f, err);
        else outfile_abort(&f), good = false;
    }
    free(text);
    mem_free(path);
    json_decref(root);
    return good;
}

/* --- reading -------------------------------------------------------------------------------------- */

static bool read_range(const json_t *frames, const char *name, PlaceRange *out)
{
    return json_unpack((json_t *)frames, "{s:[i,i]}", name, &out->first, &out->last) == 0 && out->first >= 0 && out->last >= out->first && out->last < PLACES_MAX;
}

static bool read_chunk(const json_t *task, int before, ChunkPlan *c)
{
    const char *first, *last;
    json_t *frames = json_object_get(task, "frames");
    if (!read_range(frames, "own_places", &c->own) || !read_range(frames, "run_places", &c->run)) return false;
    if (json_unpack(frames, "{s:[s,s]}", "own", &first, &last) != 0) return false;
    if (strlen(first) >= sizeof c->first || strlen(last) >= sizeof c->last) return false;
    strcpy(c->first, first);
    strcpy(c->last, last);
    return c->own.first == before + 1 && c->run.first <= c->own.first && c->run.last >= c->own.last;
}

static bool read_surface(const json_t *surface, Plan *p)
{
    const char *inside;
    p->has_surface = !json_is_null(surface);
    if (!p->has_surface) return true;
    if (json_unpack((json_t *)surface, "{s:F, s:s, s:F}", "iso", &p->spec.iso, "inside", &inside, "edge", &p->edge) != 0) return false;
    p->spec.inside_below = strcmp(inside, "below") == 0;
    return p->edge > 0;
}

static bool read_steps(const json_t *root, Plan *p)
{
    json_int_t step;
    const char *directory;
    json_t *arguments, *surface, *tasks;
    if (json_unpack((json_t *)root, "{s:s, s:o, s:I, s:o, s:[{s:o}]}", "directory", &directory, "mesh_arguments", &arguments, "frame_step", &step,
                    "surface", &surface, "steps", "tasks", &tasks) != 0)
        return false;
    int narg = (int)json_array_size(arguments), nchunk = (int)json_array_size(tasks);
    p->directory = mem_text(directory);
    p->step = step;
    p->arg = NEW0(char *, narg);
    p->chunk = NEW0(ChunkPlan, nchunk);
    for (int i = 0; i < narg; i++) {
        const char *text = json_string_value(json_array_get(arguments, (size_t)i));
        if (!text) return false;
        p->arg[p->narg++] = mem_text(text);
    }
    for (; p->nchunk < nchunk; p->nchunk++) {
        int before = p->nchunk ? p->chunk[p->nchunk - 1].own.last : -1;
        if (!read_chunk(json_array_get(tasks, (size_t)p->nchunk), before, &p->chunk[p->nchunk])) return false;
    }
    return nchunk > 0 && step > 0 && read_surface(surface, p);
}

bool plan_read(Plan *p, const char *path, Err *err)
{
    json_error_t e;
    const char *slash = strrchr(path, '/');
    *p = (Plan){.folder = mem_text(slash ? path : ".")};
    if (slash) p->folder[slash - path] = 0;
    json_t *root = json_load_file(path, 0, &e);
    bool good = root ? read_steps(root, p) || fail(err, ERR_INPUT, "%.800s: is no plan of a farm; let twinmesh farm write it again", path)
                     : fail(err, ERR_INPUT, "%.800s: cannot be read as a plan: %s", path, e.text);
    json_decref(root);
    return good;
}
