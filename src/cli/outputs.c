#include "cli/outputs.h"

#include "cli/attributes.h"
#include "io/ply.h"

#include <stdio.h>
#include <string.h>

static const char *const kind_name[KIND_COUNT] = {"mechanical", "geometric"};
static const char *const gltf_ending[GLTF_FILE_COUNT] = {"glb", "gltf"};
static const unsigned gltf_format[GLTF_FILE_COUNT] = {FORMAT_GLB, FORMAT_GLTF};

/* PREFIX.middle.ending, or PREFIX.middle.label.ending. */
static char *name_of(const char *prefix, const char *middle, const char *label, const char *ending)
{
    size_t size = strlen(prefix) + strlen(middle) + strlen(label) + strlen(ending) + 4;
    char *name = NEW(char, size);
    snprintf(name, size, "%s.%s%s%s.%s", prefix, middle, *label ? "." : "", label, ending);
    return name;
}

static bool open_lines(OutFile *f, const char *prefix, const char *middle, Err *err)
{
    char *path = name_of(prefix, middle, "", "jsonl");
    bool good = outfile_open(f, path, err);
    mem_free(path);
    return good;
}

static bool open_gltf(Outputs *o, int kind, int file, double fps, Err *err)
{
    const MeshJob *job = o->job;
    if (!(job->formats & gltf_format[file])) return true;
    o->gltf_path[kind][file] = name_of(job->prefix, kind_name[kind], "", gltf_ending[file]);
    GltfOptions options = {
        .path = o->gltf_path[kind][file], .fps = fps, .name = kind_name[kind], .step = job->gltf_step};
    o->gltf[kind][file] = gltf_open(&options, err);
    return o->gltf[kind][file] != NULL;
}

bool outputs_open(Outputs *o, const MeshJob *job, double fps, Err *err)
{
    *o = (Outputs){.job = job};
    bool good = open_lines(&o->report, job->prefix, "report", err) &&
                open_lines(&o->events, job->prefix, "events", err) &&
                open_lines(&o->timings, job->prefix, "timings", err);
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int file = 0; file < GLTF_FILE_COUNT; file++) good = good && open_gltf(o, kind, file, fps, err);
    if (!good) outputs_abort(o);
    return good;
}

/* --- frames --------------------------------------------------------------------------------------- */

/* Data for the next program: a reader that went away is a failure to write. */
static bool print_name(const Outputs *o, const char *path, Err *err)
{
    if (!o->job->print) return true;
    if (puts(path) >= 0 && fflush(stdout) == 0) return true;
    return fail(err, ERR_OUTPUT, "standard output cannot be written, where --print was to name %s", path);
}

static bool write_ply(const Outputs *o, int kind, const TriMesh *mesh, const char *label, Err *err)
{
    if (!(o->job->formats & FORMAT_PLY)) return true;
    char *path = name_of(o->job->prefix, kind_name[kind], label, "ply");
    bool good = ply_write(path, mesh, err) && print_name(o, path, err);
    mem_free(path);
    return good;
}

/* `shown`: the mesh as it is written. `track`: NULL for a frame that is held, whose connectivity is that of the last. */
static bool write_gltf(Outputs *o, int kind, const TriMesh *mesh, const TriMesh *shown, const Track *track, int frames, Err *err)
{
    if (!(o->job->formats & (FORMAT_GLB | FORMAT_GLTF))) return true;
    const Turn *turn = &o->job->turn;
    const TriMesh *last = &o->last[kind];
    float *pos = NULL, *normal = NULL;
    if (track && o->nframe && !trimesh_is_same_run(last, mesh)) {
        pos = NEW(float, 3 * last->nvert);
        normal = NEW(float, 3 * last->nvert);
        double start = console_clock();
        track_carry(track, last, pos, normal);
        turn_vectors(turn, turn->scale, last->nvert, pos);
        turn_vectors(turn, 1, last->nvert, normal);
        o->carry_s += console_clock() - start;
    }
    bool good = true;
    for (int file = 0; file < GLTF_FILE_COUNT; file++)
        if (o->gltf[kind][file]) good = good && gltf_add_frame(o->gltf[kind][file], shown, pos, normal, frames, err);
    mem_free(pos);
    mem_free(normal);
    return good;
}

/* A frame's meshes in all formats wanted; the PLYs first. */
static bool write_frame(Outputs *o, const TriMesh mesh[KIND_COUNT], const Track *track, const char *label, int frames, Err *err)
{
    TriMesh shown[KIND_COUNT];
    bool good = true;
    for (int kind = 0; kind < KIND_COUNT; kind++) shown[kind] = turn_mesh(&o->job->turn, &mesh[kind]);
    for (int kind = 0; kind < KIND_COUNT; kind++) good = good && write_ply(o, kind, &shown[kind], label, err);
    for (int kind = 0; kind < KIND_COUNT; kind++)
        good = good && write_gltf(o, kind, &mesh[kind], &shown[kind], track, frames, err);
    for (int kind = 0; kind < KIND_COUNT; kind++) turn_free(&shown[kind]);
    return good;
}

bool outputs_add_frame(Outputs *o, const Track *track, const Grid *attribute, const char *label, int frames, Err *err)
{
    TriMesh mesh[KIND_COUNT];
    o->carry_s = 0;
    track_meshes(track, o->job->open_border, &mesh[KIND_MECHANICAL], &mesh[KIND_GEOMETRIC]);
    const VolumeRequest *r = &o->job->request;
    for (int kind = 0; kind < KIND_COUNT; kind++) attributes_sample(&mesh[kind], attribute ? r->nattribute : 0, r->attribute, attribute);
    bool good = write_frame(o, mesh, track, label, frames, err);
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        if (o->nframe) trimesh_free(&o->last[kind]);
        o->last[kind] = mesh[kind];
    }
    o->nframe++;
    return good;
}

bool outputs_hold_frame(Outputs *o, const char *label, int frames, Err *err)
{
    ASSERT(o->nframe > 0);
    bool good = write_frame(o, o->last, NULL, label, frames, err);
    o->nframe++;
    return good;
}

/* --- the end -------------------------------------------------------------------------------------- */

static void free_all(Outputs *o)
{
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        if (o->nframe) trimesh_free(&o->last[kind]);
        for (int file = 0; file < GLTF_FILE_COUNT; file++) mem_free(o->gltf_path[kind][file]);
    }
    *o = (Outputs){0};
}

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

bool outputs_close(Outputs *o, const ReportTotals *totals, bool complete, Err *err)
{
    ReportRuns runs[KIND_COUNT];
    int nruns = collect_runs(o, runs);
    report_write_totals(o->report.stream, totals, nruns, runs, complete);
    events_write_totals(o->events.stream, totals, complete);
    timings_write_totals(o->timings.stream, totals);
    bool good = true;
    Err later; /* the first failure is told */
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int file = 0; file < GLTF_FILE_COUNT; file++) {
            if (!o->gltf[kind][file]) continue;
            Err *to = good ? err : &later;
            if (!gltf_close(o->gltf[kind][file], to) || !print_name(o, o->gltf_path[kind][file], to)) good = false;
        }
    if (!outfile_commit(&o->report, good ? err : &later)) good = false;
    if (!outfile_commit(&o->events, good ? err : &later)) good = false;
    if (!outfile_commit(&o->timings, good ? err : &later)) good = false;
    free_all(o);
    return good;
}

void outputs_abort(Outputs *o)
{
    if (o->report.stream) outfile_abort(&o->report);
    if (o->events.stream) outfile_abort(&o->events);
    if (o->timings.stream) outfile_abort(&o->timings);
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int file = 0; file < GLTF_FILE_COUNT; file++)
            if (o->gltf[kind][file]) gltf_abort(o->gltf[kind][file]);
    free_all(o);
}
