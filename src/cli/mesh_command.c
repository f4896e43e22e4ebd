#include "cli/command.h"

#include "base/thread.h"
#include "cli/outputs.h"
#include "cli/reader.h"
#include "cli/stop.h"
#include "cli/velocity.h"

#include <math.h>
#include <stdio.h>

typedef struct Run {
    MeshJob job;
    Console console;
    Sequence *sequence;
    Reader *reader;
    Track *track;
    Outputs out;
    ReportTotals totals;
    ReadFrame previous;      /* the tracker's last frame: lent to it until the next one is done */
    int since_tracked;       /* frame intervals since the tracker saw a frame */
    int since_shown;         /* and since a mesh was written */
    double frame_start_s;
} Run;

/* --- one frame ------------------------------------------------------------------------------------ */

static void say_choices(Run *run, const ReadFrame *f)
{
    if (!f->surface[0]) return;
    console_note(&run->console, "%s", f->surface);
    if (f->has_velocity)
        console_note(&run->console, "velocity '%s': %s", run->job.request.velocity, velocity_units_say(f->units));
}

static void say_problems(Run *run, const char *label, const FrameStat *s)
{
    Console *c = &run->console;
    if (run->job.track.topology == TOPOLOGY_EXACT && s->wrong_components > 0)
        console_problem(c, "frame %s: %d components differ from the topology of the grid", label, s->wrong_components);
    if (s->inverted_left > 0)
        console_problem(c, "frame %s: %d mechanical triangles are left inverted", label, s->inverted_left);
    console_detail(c,
                   "frame %s: %d components, %d + %d triangles, %d splits, %d collapses, %d CG iterations, "
                   "%d components remade, %.1f %% of identities kept",
                   label, s->components, s->triangles_mechanical, s->triangles_geometric, s->splits, s->collapses,
                   s->cg_iterations, s->remade_components, 100 * (isnan(s->ids_kept) ? 1 : s->ids_kept));
}

/* Report, timings, totals. */
static void account(Run *run, const ReadFrame *f, FrameFate fate, const FrameStat *stat, StageSeconds seconds)
{
    double now = console_clock();
    seconds.read = f->seconds;
    seconds.whole = now - run->frame_start_s;
    run->frame_start_s = now;
    report_write_frame(run->out.report.stream, f->label, fate, f->surface[0] ? f->surface : NULL, stat);
    timings_write_frame(run->out.timings.stream, f->label, &seconds);
    report_totals_add(&run->totals, fate, stat, &seconds);
}

static bool track_one(Run *run, ReadFrame *f, double wait_s, Err *err)
{
    FrameStat stat = {0};
    say_choices(run, f);
    const Grid *velocity = f->has_velocity ? &f->velocity : NULL;
    bool good = track_frame(run->track, &f->field, velocity, run->since_tracked, &stat, err);
    readframe_free(&run->previous);
    run->previous = *f;
    if (!good) return false;

    double start = console_clock();
    if (!outputs_add_frame(&run->out, run->track, f->label, run->since_shown, err)) return false;
    StageSeconds seconds = report_stages(&stat);
    seconds.wait = wait_s;
    seconds.write = console_clock() - start;
    say_problems(run, f->label, &stat);
    account(run, f, FRAME_TRACKED, &stat, seconds);
    run->since_tracked = run->since_shown = 1;
    return true;
}

/* A frame that could not be read: what --on-error wants. */
static bool pass_over(Run *run, ReadFrame *f, double wait_s, Err *err)
{
    OnError want = run->job.on_error;
    if (want == ON_ERROR_STOP) return fail(err, f->err.code, "frame %s: %s", f->label, f->err.text);
    bool hold = want == ON_ERROR_HOLD && run->out.nframe > 0;
    console_problem(&run->console, "frame %s is %s: %s", f->label, hold ? "held" : "skipped", f->err.text);
    double start = console_clock();
    if (hold && !outputs_hold_frame(&run->out, f->label, run->since_shown, err)) return false;
    StageSeconds seconds = {.wait = wait_s, .write = console_clock() - start};
    account(run, f, hold ? FRAME_HELD : FRAME_SKIPPED, NULL, seconds);
    run->since_tracked++;
    run->since_shown = hold ? 1 : run->since_shown + 1;
    return true;
}

/* --- the sequence --------------------------------------------------------------------------------- */

/* True when the last frame is done, or a signal asks for an end between frames. */
static bool follow(Run *run, Err *err)
{
    for (;;) {
        ReadFrame f;
        double start = console_clock();
        if (!reader_take(run->reader, &f) || f.end) return true;
        double wait_s = console_clock() - start;
        bool was_read = f.good;
        bool good = (was_read ? track_one : pass_over)(run, &f, wait_s, err);
        if (!was_read) readframe_free(&f);
        if (!good) return false;
        int done = run->totals.frames + run->totals.held + run->totals.skipped;
        console_progress(&run->console, done, sequence_count(run->sequence));
    }
}

static bool open_all(Run *run, const Options *o, Err *err)
{
    const MeshJob *job = &run->job;
    run->sequence = sequence_open(o->noperand, o->operand, job->frames, err);
    if (!run->sequence || !outputs_open(&run->out, job, err)) return false;
    job_echo(o, TWINMESH_VERSION, run->out.report.stream);
    run->track = track_open(&job->track);
    run->reader = reader_open(job, run->sequence, err);
    return run->reader != NULL;
}

/* What was finished stays; where nothing was, nothing is left. */
static bool close_outputs(Run *run, bool good, Err *err)
{
    if (run->out.nframe == 0) {
        if (run->out.report.stream) outputs_abort(&run->out);
        if (good && !stop_signal())
            return fail(err, ERR_INPUT, run->totals.skipped ? "none of the frames could be read"
                                                            : "there were no frames to read");
        return good;
    }
    Err first = *err;
    bool closed = outputs_close(&run->out, &run->totals, good && !stop_signal(), err);
    if (!good) *err = first;
    return good && closed;
}

static int run_job(Run *run, const Options *o)
{
    Err err = {0};
    run->console = console_make(run->job.loudness);
    run->totals = report_totals_zero();
    run->since_tracked = run->since_shown = 1;
    run->frame_start_s = console_clock();
    thread_set_count(run->job.threads);

    bool good = open_all(run, o, &err) && follow(run, &err);
    reader_close(run->reader);
    int shown = run->out.nframe;
    good = close_outputs(run, good, &err);
    console_clear(&run->console);
    if (run->track) track_close(run->track);
    readframe_free(&run->previous);
    sequence_close(run->sequence);

    if (!good) console_problem(&run->console, "%s", err.text);
    if (shown && run->job.loudness > LOUD_QUIET) report_summarise(stderr, &run->totals);
    if (stop_signal()) {
        console_problem(&run->console, "stopped by a signal; %d finished frames are kept", shown);
        return 128 + stop_signal();
    }
    return good ? 0 : (int)err.code;
}

int mesh_command(int argc, char **argv)
{
    Options options;
    Run run = {0};
    Err err;
    int status = 0;
    if (!options_parse(&options, argc, argv, &err)) goto wrong;
    if (option_given(&options, OPT_HELP)) {
        puts("twinmesh mesh FRAME... -o PREFIX\n\n"
             "Follows the surface through a sequence of volumes and writes the mechanical and the geometric mesh of\n"
             "every frame. FRAME is a file, a pattern (phi.####.vdb, phi.%04d.vdb, phi.$F4.vdb), a folder, or - for\n"
             "names on standard input.");
        options_print(stdout);
    } else if (option_given(&options, OPT_VERSION)) {
        puts("twinmesh " TWINMESH_VERSION);
    } else {
        if (!job_make(&run.job, &options, &err)) goto wrong;
        status = run_job(&run, &options);
    }
    options_free(&options);
    return status;

wrong:
    fprintf(stderr, "twinmesh mesh: %s\n", err.text);
    options_free(&options);
    return (int)err.code;
}
