#include "cli/outputs.h"

#include "cli/chunk.h"
#include "cli/command.h"
#include "cli/state.h"
#include "io/ply.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>

static const char *const kind_name[KIND_COUNT] = {"mechanical", "geometric"};
static const char *const gltf_ending[GLTF_FILE_COUNT] = {"glb", "gltf"};
static const unsigned gltf_format[GLTF_FILE_COUNT] = {FORMAT_GLB, FORMAT_GLTF};
#define STATE_SHARE 0.04 /* of the time, that states take at most */

static const char *const lines_name[] = {"report", "events", "timings"};

/* PREFIX.KIND; to be freed. */
static char *kind_prefix(const MeshJob *job, int kind)
{
    size_t size = strlen(job->prefix) + strlen(kind_name[kind]) + 2;
    char *prefix = NEW(char, size);
    snprintf(prefix, size, "%s.%s", job->prefix, kind_name[kind]);
    return prefix;
}

/* PREFIX.middle.ending, or PREFIX.middle.label.ending. */
static char *name_of(const char *prefix, const char *middle, const char *label, const char *ending)
{
    size_t size = strlen(prefix) + strlen(middle) + strlen(label) + strlen(ending) + 4;
    char *name = NEW(char, size);
    snprintf(name, size, "%s.%s%s%s.%s", prefix, middle, *label ? "." : "", label, ending);
    return name;
}

void outframe_free(OutFrame *f)
{
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int k = 0; k < 2; k++) mem_free(f->carried[kind][k]);
    mem_free(f->surface);
    events_free(&f->events);
    mem_free(f->since);
    store_free(&f->state);
    *f = (OutFrame){0};
}

static bool has_lines(const MeshJob *job, int i) { return job->is_chunk == (i == LINES_CHUNK); }

static char *lines_path(const MeshJob *job, int i)
{
    return i == LINES_CHUNK ? chunk_path(job->prefix) : name_of(job->prefix, lines_name[i], "", "jsonl");
}

/* --- opening ---------------------------------------------------------------------------------------- */

/* Closes all; `remove`: leaves nothing. */
static void close_all(Outputs *o, bool remove)
{
    for (int i = 0; i < LINES_COUNT; i++) (remove ? outfile_abort : outfile_leave)(&o->lines[i]);
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int file = 0; file < GLTF_FILE_COUNT; file++) (remove ? gltf_abort : gltf_leave)(o->gltf[kind][file]);
    for (int kind = 0; kind < KIND_COUNT; kind++) (remove ? vat_abort : vat_leave)(o->vat[kind]);
    memset(o->gltf, 0, sizeof o->gltf);
    memset(o->vat, 0, sizeof o->vat);
}

/* `s`: NULL for a new run. */
static bool open_lines(Outputs *o, int i, Store *s, Err *err)
{
    uint64_t length = 0;
    if (!has_lines(o->job, i)) return true;
    char *path = lines_path(o->job, i);
    if (s) STORE(s, length);
    bool good = !s ? outfile_open(&o->lines[i], path, err) : !s->bad && outfile_reopen(&o->lines[i], path, length, err);
    mem_free(path);
    return good;
}

static bool open_gltf(Outputs *o, int kind, int file, double fps, Store *s, Err *err)
{
    const MeshJob *job = o->job;
    if (!(job->formats & gltf_format[file]) || job->is_chunk) return true;
    char *path = name_of(job->prefix, kind_name[kind], "", gltf_ending[file]);
    GltfOptions options = {
        .path = path, .fps = fps, .name = kind_name[kind], .step = job->gltf_step, .compress = job->compress};
    o->gltf[kind][file] = s ? gltf_reopen(&options, s, err) : gltf_open(&options, err);
    mem_free(path);
    return o->gltf[kind][file] != NULL;
}

static bool open_vat(Outputs *o, int kind, double fps, Store *s, Err *err)
{
    const MeshJob *job = o->job;
    if (!(job->formats & FORMAT_VAT) || job->is_chunk) return true;
    char *prefix = kind_prefix(job, kind);
    if (!s) vat_sweep(prefix);
    VatOptions options = {.prefix = prefix, .name = kind_name[kind], .fps = fps, .side = VAT_SIDE};
    o->vat[kind] = s ? vat_reopen(&options, s, err) : vat_open(&options);
    mem_free(prefix);
    return o->vat[kind] != NULL;
}

static bool open_all(Outputs *o, double fps, Store *s, Err *err)
{
    bool good = true;
    for (int i = 0; i < LINES_COUNT; i++) good = good && open_lines(o, i, s, err);
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int file = 0; file < GLTF_FILE_COUNT; file++) good = good && open_gltf(o, kind, file, fps, s, err);
    for (int kind = 0; kind < KIND_COUNT; kind++) good = good && open_vat(o, kind, fps, s, err);
    if (good) return true;
    close_all(o, !s);
    o->job = NULL;
    return false;
}

bool outputs_open(Outputs *o, const MeshJob *job, double fps, Err *err)
{
    *o = (Outputs){.job = job, .totals = report_totals_zero()};
    if (!state_remove(job->prefix, err) || !open_all(o, fps, NULL, err)) return false;
    bool begun = !job->is_chunk || chunk_begin(&o->lines[LINES_CHUNK], err);
    if (begun && job->render) begun = (o->pictures = pictures_start(job, err)) != NULL;
    if (begun) return true;
    close_all(o, true);
    o->job = NULL;
    return false;
}

bool outputs_reopen(Outputs *o, const MeshJob *job, double fps, Store *s, Err *err)
{
    *o = (Outputs){.job = job, .kept = true};
    STORE(s, o->nframe);
    STORE(s, o->totals);
    store_expect(s, o->nframe >= 0);
    return open_all(o, fps, s, err);
}

/* --- frames --------------------------------------------------------------------------------------- */

static bool print_name(const Outputs *o, const char *path, Err *err)
{
    return !o->job->print || command_print_name(path, err);
}

typedef struct PlyJob {
    const TriMesh *mesh;
    char *path;
    bool good;
    Err err;
} PlyJob;

static void *ply_run(void *ctx)
{
    PlyJob *job = ctx;
    job->good = ply_write(job->path, job->mesh, &job->err);
    return NULL;
}

static bool name_ply(const Outputs *o, PlyJob *job, Err *err)
{
    if (!job->good) *err = job->err;
    else if (o->pictures) pictures_name(o->pictures, job->path);
    return job->good && print_name(o, job->path, err);
}

/* Both at once: most of the time is the disk's. */
static bool write_plys(const Outputs *o, const TriMesh *mesh, const char *label, Err *err)
{
    if (!(o->job->formats & FORMAT_PLY)) return true;
    PlyJob job[KIND_COUNT] = {0};
    pthread_t beside;
    for (int kind = 0; kind < KIND_COUNT; kind++)
        job[kind].mesh = &mesh[kind], job[kind].path = name_of(o->job->prefix, kind_name[kind], label, "ply");
    bool both = pthread_create(&beside, NULL, ply_run, &job[KIND_GEOMETRIC]) == 0;
    ply_run(&job[KIND_MECHANICAL]);
    if (both) pthread_join(beside, NULL);
    else ply_run(&job[KIND_GEOMETRIC]);
    bool good = name_ply(o, &job[KIND_MECHANICAL], err) && name_ply(o, &job[KIND_GEOMETRIC], err);
    for (int kind = 0; kind < KIND_COUNT; kind++) mem_free(job[kind].path);
    return good;
}

static bool write_gltf(Outputs *o, int kind, const TriMesh *shown, const OutFrame *f, Err *err)
{
    const float *pos = f->carried[kind][0], *normal = f->carried[kind][1];
    bool good = true;
    for (int file = 0; file < GLTF_FILE_COUNT; file++)
        if (o->gltf[kind][file]) good = good && gltf_add_frame(o->gltf[kind][file], shown, pos, normal, f->gap, err);
    return good;
}

static bool write_vat(Outputs *o, int kind, const TriMesh *shown, const OutFrame *f, Err *err)
{
    const float *pos = f->carried[kind][0], *normal = f->carried[kind][1];
    return !o->vat[kind] || vat_add_frame(o->vat[kind], shown, pos, normal, f->gap, f->label, err);
}

/* The PLYs first. */
static bool write_meshes(Outputs *o, const OutFrame *f, Err *err)
{
    const Turn *turn = &o->job->turn;
    TriMesh shown[KIND_COUNT];
    bool good = true;
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        shown[kind] = turn_mesh(turn, &f->mesh[kind]);
        if (!f->carried[kind][0]) continue;
        int n = f->ncarried[kind];
        turn_vectors(turn, turn->scale, n, f->carried[kind][0]);
        turn_vectors(turn, 1, n, f->carried[kind][1]);
    }
    good = good && write_plys(o, shown, f->label, err);
    for (int kind = 0; kind < KIND_COUNT; kind++) good = good && write_gltf(o, kind, &shown[kind], f, err);
    for (int kind = 0; kind < KIND_COUNT; kind++) good = good && write_vat(o, kind, &shown[kind], f, err);
    for (int kind = 0; kind < KIND_COUNT; kind++) turn_free(&shown[kind]);
    if (good) o->nframe++;
    return good;
}

/* Behind what the run will need: how far the files are. */
static void describe(Outputs *o, Store *s)
{
    STORE(s, o->nframe);
    STORE(s, o->totals);
    for (int i = 0; i < LINES_COUNT; i++) {
        if (!has_lines(o->job, i)) continue;
        uint64_t length = outfile_length(&o->lines[i]);
        STORE(s, length);
    }
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int file = 0; file < GLTF_FILE_COUNT; file++)
            if (o->gltf[kind][file]) gltf_store(o->gltf[kind][file], s);
    for (int kind = 0; kind < KIND_COUNT; kind++)
        if (o->vat[kind]) vat_store(o->vat[kind], s);
}

static bool sync_all(Outputs *o, Err *err)
{
    for (int i = 0; i < LINES_COUNT; i++)
        if (has_lines(o->job, i) && !outfile_sync(&o->lines[i], err)) return false;
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int file = 0; file < GLTF_FILE_COUNT; file++)
            if (o->gltf[kind][file] && !gltf_sync(o->gltf[kind][file], err)) return false;
    for (int kind = 0; kind < KIND_COUNT; kind++)
        if (o->vat[kind] && !vat_sync(o->vat[kind], err)) return false;
    return true;
}

/* Parts of textures go with their run of frames: a state that tells of them may not outlast them. */
bool outputs_are_due(const Outputs *o) { return (o->job->formats & FORMAT_VAT) || console_clock() >= o->due_s; }

/* What is on disk then is what the state tells of. */
static bool write_state(Outputs *o, Store *s, Err *err)
{
    double start = console_clock();
    describe(o, s);
    bool good = sync_all(o, err) && state_write(o->job->prefix, s, err);
    double end = console_clock();
    o->kept = o->kept || good;
    o->due_s = end + (end - start) / STATE_SHARE;
    return good;
}

static bool write_frame(Outputs *o, OutFrame *f, Err *err)
{
    double start = console_clock();
    if (f->mesh && !write_meshes(o, f, err)) return false;
    const FrameStat *stat = f->fate == FRAME_TRACKED ? &f->stat : NULL;
    report_write_frame(o->lines[LINES_REPORT].stream, f->label, f->fate, f->surface, stat);
    if (stat) events_write_frame(o->lines[LINES_EVENTS].stream, f->label, f->since, &f->events);
    f->seconds.write = console_clock() - start; /* but for the state, which holds them */
    timings_write_frame(o->lines[LINES_TIMINGS].stream, f->label, &f->seconds);
    report_totals_add(&o->totals, f->fate, stat, &f->seconds);
    return true;
}

static bool write_record(Outputs *o, OutFrame *f, Err *err)
{
    if (!chunk_add_frame(&o->lines[LINES_CHUNK], f, err)) return false;
    o->nframe++;
    report_totals_add(&o->totals, f->fate, f->fate == FRAME_TRACKED ? &f->stat : NULL, &f->seconds);
    return true;
}

bool outputs_add_frame(Outputs *o, OutFrame *f, Err *err)
{
    if (!(o->job->is_chunk ? write_record : write_frame)(o, f, err)) return false;
    return f->state.n == 0 || write_state(o, &f->state, err);
}

/* --- the end -------------------------------------------------------------------------------------- */

static int collect_runs(const Outputs *o, ReportRuns runs[KIND_COUNT])
{
    int n = 0;
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        const Gltf *g = o->gltf[kind][0] ? o->gltf[kind][0] : o->gltf[kind][1];
        if (!g) continue;
        GltfStat stat = gltf_stat(g);
        runs[n++] = (ReportRuns){.mesh = kind_name[kind], .runs = stat.runs, .median_run = stat.median_run};
    }
    return n;
}

static void write_totals(Outputs *o, bool complete)
{
    ReportRuns runs[KIND_COUNT];
    int nruns = collect_runs(o, runs);
    report_write_totals(o->lines[LINES_REPORT].stream, &o->totals, nruns, runs, complete);
    events_write_totals(o->lines[LINES_EVENTS].stream, &o->totals, complete);
    timings_write_totals(o->lines[LINES_TIMINGS].stream, &o->totals);
}

static bool publish_gltf(Outputs *o, int kind, int file, Err *err)
{
    char *path = name_of(o->job->prefix, kind_name[kind], "", gltf_ending[file]);
    bool good = gltf_finish(o->gltf[kind][file], err) && print_name(o, path, err);
    mem_free(path);
    return good;
}

static bool publish_vat(Outputs *o, int kind, Err *err)
{
    char *prefix = kind_prefix(o->job, kind), *path = vat_path(prefix);
    bool good = vat_finish(o->vat[kind], err) && print_name(o, path, err);
    mem_free(prefix);
    mem_free(path);
    return good;
}

/* Everything under its final name, beside the parts. */
static bool publish(Outputs *o, bool complete, Err *err)
{
    if (!o->job->is_chunk) write_totals(o, complete);
    bool good = true;
    Err later; /* the first failure is told */
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int file = 0; file < GLTF_FILE_COUNT; file++)
            if (o->gltf[kind][file] && !publish_gltf(o, kind, file, good ? err : &later)) good = false;
    for (int kind = 0; kind < KIND_COUNT; kind++)
        if (o->vat[kind] && !publish_vat(o, kind, good ? err : &later)) good = false;
    for (int i = 0; i < LINES_COUNT; i++)
        if (has_lines(o->job, i) && !outfile_publish(&o->lines[i], good ? err : &later)) good = false;
    return good;
}

bool outputs_close(Outputs *o, bool complete, Store *state, Err *err)
{
    bool good = !state || write_state(o, state, err);
    if (o->nframe > 0 && !publish(o, complete, good ? err : &(Err){0})) good = false;
    bool whole = good && complete && o->nframe > 0;
    if (whole && o->kept) good = state_finish(o->job->prefix, err);
    bool over = (whole && good) || !o->kept || o->nframe == 0; /* nothing is left to go on with */
    o->left = !over;
    close_all(o, over);
    if (over && o->kept && !(whole && o->job->keep_state)) good = state_remove(o->job->prefix, err) && good;
    bool pictured = pictures_finish(o->pictures, good ? err : &(Err){0});
    return good && (pictured || !complete);
}

static void sweep_lines(const MeshJob *job, int i)
{
    char *path = lines_path(job, i);
    outfile_sweep(path);
    mem_free(path);
}

bool outputs_sweep(const MeshJob *job, Err *err)
{
    for (int i = 0; i < LINES_COUNT; i++)
        if (has_lines(job, i)) sweep_lines(job, i);
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int file = 0; file < GLTF_FILE_COUNT; file++) {
            char *path = name_of(job->prefix, kind_name[kind], "", gltf_ending[file]);
            gltf_sweep(path);
            mem_free(path);
        }
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        char *prefix = kind_prefix(job, kind);
        vat_sweep(prefix);
        mem_free(prefix);
    }
    return job->keep_state || state_remove(job->prefix, err);
}
