#include "cli/run.h"

#include "base/thread.h"
#include "cli/attributes.h"
#include "cli/stop.h"
#include "cli/velocity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- one frame ------------------------------------------------------------------------------------ */

static void say_choices(Run *run, const ReadFrame *f)
{
    if (!f->why[0]) return;
    console_note(&run->console, "%s", f->why);
    if (f->has_velocity)
        console_note(&run->console, "velocity '%s': %s", run->job.request.velocity, velocity_units_say(f->units));
}

static void say_problems(Run *run, const char *label, const FrameStat *s)
{
    Console *c = &run->console;
    if (run->job.track.topology == TOPOLOGY_EXACT && s->wrong_components > 0)
        console_problem(c, "frame %s: components that differ from the topology of the grid: %d", label, s->wrong_components);
    if (s->inverted_left > 0)
        console_problem(c, "frame %s: mechanical triangles left inverted: %d", label, s->inverted_left);
    console_detail(c,
                   "frame %s: components %d, triangles %d + %d, splits %d, collapses %d, CG iterations %d, "
                   "components remade %d, identities kept %.1f %%",
                   label, s->components, s->triangles_mechanical, s->triangles_geometric, s->splits, s->collapses,
                   s->cg_iterations, s->remade_components, 100 * (isnan(s->ids_kept) ? 1 : s->ids_kept));
}

/* What happened since the last frame tracked, whatever was skipped or held between. */
static void take_events(Run *run, const char *label, OutFrame *out)
{
    out->events = track_take_events(run->track);
    out->since = run->tracked_label;
    run->tracked_label = mem_text(label);
}

/* Where a run of the glTF or the textures ends, the last meshes shown are carried on to this frame. */
static void carry_last(Run *run, const TriMesh *mesh, OutFrame *out)
{
    if (run->shown == NONE || !(run->job.formats & FORMATS_CARRIED)) return;
    double start = console_clock();
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        const TriMesh *last = &run->mesh[run->shown_at][kind];
        if (trimesh_is_same_run(last, &mesh[kind])) continue;
        for (int k = 0; k < 2; k++) out->carried[kind][k] = NEW(float, 3 * last->nvert);
        out->ncarried[kind] = last->nvert;
        track_carry(run->track, last, out->carried[kind][0], out->carried[kind][1]);
    }
    out->seconds.carry = console_clock() - start;
}

/* The meshes of the frame just tracked, in the place that the writer has left. */
static const TriMesh *take_meshes(Run *run, const ReadFrame *f)
{
    const VolumeRequest *r = &run->job.request;
    TriMesh *mesh = run->mesh[!run->shown_at];
    for (int kind = 0; kind < KIND_COUNT; kind++) trimesh_free(&mesh[kind]);
    track_meshes(run->track, run->job.open_border, &mesh[KIND_MECHANICAL], &mesh[KIND_GEOMETRIC]);
    for (int kind = 0; kind < KIND_COUNT; kind++)
        attributes_sample(&mesh[kind], f->attribute ? r->nattribute : 0, r->attribute, f->attribute);
    return mesh;
}

/* A source that makes its frames cannot be asked to begin in mid-way. */
static bool has_state(const Run *run) { return !run->job.source.next; }

/* Hands the frame to the writer, from time to time with the state behind it. */
static bool give(Run *run, const Options *o, const ReadFrame *f, OutFrame *out, Err *err)
{
    double now = console_clock();
    memcpy(out->label, f->frame.digits, sizeof out->label);
    out->seconds.read = f->seconds;
    out->seconds.whole = now - run->frame_start_s;
    run->frame_start_s = now;
    run->surface = f->surface;
    inputs_add(&run->inputs, f->frame.number, f->digest);
    if (!writer_wait(run->writer, err)) {
        outframe_free(out);
        return false;
    }
    if (has_state(run) && outputs_are_due(&run->out)) out->state = run_save(run, o);
    run->done++;
    writer_give(run->writer, out);
    return true;
}

static ReadFrame *before(Run *run, const ReadFrame *f) { return &run->slot[(f - run->slot + SLOTS - 1) % SLOTS]; }

/* The frame solved becomes meshes, figures and events, and the writer's. */
static void complete(void *ctx)
{
    Run *run = ctx;
    Completion *c = &run->completion;
    const ReadFrame *f = c->frame;
    int64_t number = f->frame.number;
    track_complete(run->track, &c->out.stat);
    c->stat = c->out.stat;
    double wait_s = c->out.seconds.wait;
    c->out.seconds = report_stages(&c->stat);
    c->out.seconds.wait = wait_s;
    c->out.mesh = take_meshes(run, f);
    c->out.gap = job_intervals(run->shown, number, run->step);
    carry_last(run, c->out.mesh, &c->out);
    take_events(run, f->frame.digits, &c->out);
    run->tracked = run->shown = number;
    run->shown_at = !run->shown_at;
    c->good = give(run, c->options, f, &c->out, &c->err);
}

/* Waits for the frame that is being completed, if one is. */
static bool finish_completion(Run *run, Err *err)
{
    Completion *c = &run->completion;
    if (!c->busy) return true;
    task_wait(&c->task);
    c->busy = false;
    say_problems(run, c->frame->frame.digits, &c->stat);
    console_progress(&run->console, run->done, int_max(sequence_length(&run->sequence), 0));
    readframe_free(before(run, c->frame));
    if (!c->good) *err = c->err;
    return c->good;
}

static bool track_one(Run *run, const Options *o, ReadFrame *f, double wait_s, Err *err)
{
    say_choices(run, f);
    Completion *c = &run->completion;
    FrameStat stat;
    if (f->same) readframe_borrow(f, before(run, f));
    if (!track_solve(run->solver, &f->field, f->has_velocity ? &f->velocity : NULL, job_intervals(run->solved, f->frame.number, 1), &stat, err)) return false;
    run->solved = f->frame.number;
    if (!finish_completion(run, err)) return false;
    if (run->solver != run->track) track_pass_on(run->solver, run->track);
    *c = (Completion){.busy = true, .options = o, .frame = f};
    c->out = (OutFrame){.fate = FRAME_TRACKED, .stat = stat, .surface = f->why[0] ? mem_text(f->why) : NULL, .seconds = {.wait = wait_s}};
    run->next = (run->next + 1) % SLOTS;
    task_start(&c->task, complete, run);
    return run->solver != run->track || finish_completion(run, err);
}

/* A frame that could not be read: what --on-error wants. */
static bool pass_over(Run *run, const Options *o, ReadFrame *f, double wait_s, Err *err)
{
    OnError want = run->job.on_error;
    if (!finish_completion(run, err)) return false;
    if (want == ON_ERROR_STOP) return fail(err, f->err.code, "frame %s: %s", f->frame.digits, f->err.text);
    bool hold = want == ON_ERROR_HOLD && run->shown != NONE;
    console_problem(&run->console, "frame %s is %s: %s", f->frame.digits, hold ? "held" : "skipped", f->err.text);
    OutFrame out = {.fate = hold ? FRAME_HELD : FRAME_SKIPPED, .seconds = {.wait = wait_s}};
    if (hold) {
        out.gap = job_intervals(run->shown, f->frame.number, run->step);
        out.mesh = run->mesh[run->shown_at];
        run->shown = f->frame.number;
    }
    bool good = give(run, o, f, &out, err);
    readframe_free(f);
    console_progress(&run->console, run->done, int_max(sequence_length(&run->sequence), 0));
    return good;
}

/* --- the sequence --------------------------------------------------------------------------------- */

/* True when the last frame is done, or a signal asks for an end between frames. */
static bool follow(Run *run, const Options *o, Err *err)
{
    for (;;) {
        ReadFrame *f = &run->slot[run->next];
        double start = console_clock();
        if (!reader_take(run->reader, f) || f->step == SEQUENCE_END) return true;
        if (f->step == SEQUENCE_ERROR) return fail(err, f->err.code, "%s", f->err.text);
        double wait_s = console_clock() - start;
        if (!(f->good ? track_one : pass_over)(run, o, f, wait_s, err)) return false;
    }
}

/* A chunk's frames, by the places that the plan gave them. */
static bool pick_places(Run *run, Err *err)
{
    const MeshJob *job = &run->job;
    int n = sequence_length(&run->sequence);
    if (n == NONE || job->place > n || job->nplace > n - job->place)
        return fail(err, ERR_INPUT, "there are %d frames now, fewer than the plan was made for; plan again, or bring the others back", int_max(n, 0));
    sequence_pick(&run->sequence, job->place, job->nplace);
    return true;
}

/* False also where nothing is left to do: err->code is ERR_NONE then. */
static bool open_all(Run *run, const Options *o, Err *err)
{
    const MeshJob *job = &run->job;
    if (!job_find_step(job, o, &run->step, err)) return false;
    if (!job_open_sequence(job, o, &run->sequence, err)) return false;
    if (job->is_chunk && !pick_places(run, err)) return false;
    run->track = track_open(&job->track);
    run->solver = job->track.topology == TOPOLOGY_PAPERS ? run->track : track_open(&job->track);
    ResumeKind kind = run_resume(run, o, err);
    if (kind == RESUME_FAILED) return false;
    if (kind == RESUME_OVER) {
        if (outputs_sweep(job, err)) console_note(&run->console, "all frames of this run are done");
        return false;
    }
    if (kind == RESUME_ON) console_note(&run->console, "going on after %d frames", run->done);
    run->solved = run->tracked;
    if (run->solver != run->track && run->solved != NONE) track_pass_on(run->track, run->solver);
    if (kind == RESUME_NEW) {
        if (!outputs_open(&run->out, job, job->track.fps / (double)run->step, err)) return false;
        if (!job->is_chunk) job_echo(o, TWINMESH_VERSION, run->out.lines[LINES_REPORT].stream);
    }
    run->writer = writer_open(&run->out, err);
    if (!run->writer) return false;
    run->reader = reader_open(job, &run->sequence, run->surface, err);
    return run->reader != NULL;
}

/* What was finished stays; where nothing was, nothing is left. */
static bool close_outputs(Run *run, const Options *o, bool good, Err *err)
{
    Outputs *out = &run->out;
    Err *to = good ? err : &(Err){0}; /* the first failure is told */
    bool written = writer_close(run->writer, to);
    good = written && good;
    if (!out->job) return good;
    if (good && out->nframe == 0 && !stop_signal())
        good = fail(err, ERR_INPUT, out->totals.skipped ? "none of the frames could be read" : "there were no frames to read");
    to = good ? err : &(Err){0};
    bool complete = good && !stop_signal(), wanted = has_state(run) && written && out->nframe > 0 && (!complete || run->job.keep_state);
    Store state = wanted ? run_save(run, o) : (Store){0};
    good = outputs_close(out, complete, wanted ? &state : NULL, to) && good;
    store_free(&state);
    return good;
}

static void free_all(Run *run)
{
    if (run->solver != run->track) track_close(run->solver);
    track_close(run->track);
    for (int i = 0; i < SLOTS; i++) readframe_free(&run->slot[i]);
    for (int i = 0; i < 2; i++)
        for (int kind = 0; kind < KIND_COUNT; kind++) trimesh_free(&run->mesh[i][kind]);
    inputs_free(&run->inputs);
    mem_free(run->tracked_label);
    sequence_close(&run->sequence);
}

/* The last words, and the exit status. */
static int say_end(Run *run, bool good, const Err *err)
{
    Console *c = &run->console;
    const Outputs *out = &run->out;
    if (err->code != ERR_NONE) console_problem(c, "%s", err->text);
    if (out->nframe && run->job.loudness > LOUD_QUIET && !c->json) report_summarise(stderr, &out->totals);
    if (stop_signal()) console_problem(c, "stopped by a signal");
    if (out->left) console_problem(c, "%d frame%s finished and kept; the same command with --resume goes on", out->nframe, out->nframe == 1 ? " is" : "s are");
    if (stop_signal()) return 128 + stop_signal();
    return good ? 0 : (int)err->code;
}

int run_job(Run *run, const Options *o)
{
    Err err = {0};
    run->console = console_make(run->job.loudness);
    run->console.json = run->job.json_log;
    run->tracked = run->shown = run->solved = NONE;
    run->frame_start_s = console_clock();
    thread_set_count(run->job.threads);
    if (run->job.max_memory && !mem_limit(run->job.max_memory)) console_note(&run->console, "--max-memory: this system cannot limit it");

    bool good = open_all(run, o, &err) && follow(run, o, &err);
    good = finish_completion(run, good ? &err : &(Err){0}) && good;
    reader_close(run->reader);
    good = close_outputs(run, o, good, &err);
    console_clear(&run->console);
    free_all(run);
    return say_end(run, good, &err);
}
