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
    Sequence sequence;
    int64_t step;            /* what the frames' numbers rise by */
    Reader *reader;
    Track *track;
    Outputs out;
    ReportTotals totals;
    ReadFrame slot[2];       /* the tracker's last frame stays where it was lent from until the next one is done */
    int next;                /* the slot for that one */
    char *tracked_label;     /* of the last frame that the tracker saw, NULL: none */
    int64_t tracked, shown;  /* numbers of the last frames that the tracker saw, and that were written; NONE */
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
        console_problem(c, "frame %s: components that differ from the topology of the grid: %d", label, s->wrong_components);
    if (s->inverted_left > 0)
        console_problem(c, "frame %s: mechanical triangles left inverted: %d", label, s->inverted_left);
    console_detail(c,
                   "frame %s: components %d, triangles %d + %d, splits %d, collapses %d, CG iterations %d, "
                   "components remade %d, identities kept %.1f %%",
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
    report_write_frame(run->out.report.stream, f->frame.digits, fate, f->surface[0] ? f->surface : NULL, stat);
    timings_write_frame(run->out.timings.stream, f->frame.digits, &seconds);
    report_totals_add(&run->totals, fate, stat, &seconds);
}

/* Frame intervals from one number to the next. Names on standard input need not come in order. */
static int intervals(int64_t from, int64_t to, int64_t step)
{
    int64_t n = from == NONE ? 1 : (to - from) / step;
    return n < 1 ? 1 : n > INT32_MAX ? INT32_MAX : (int)n;
}

/* What happened since the last frame tracked, whatever was skipped or held between. */
static void tell_events(Run *run, const char *label)
{
    events_write_frame(run->out.events.stream, label, run->tracked_label, track_events(run->track));
    mem_free(run->tracked_label);
    run->tracked_label = mem_text(label);
}

static bool track_one(Run *run, ReadFrame *f, double wait_s, Err *err)
{
    FrameStat stat = {0};
    say_choices(run, f);
    const Grid *velocity = f->has_velocity ? &f->velocity : NULL;
    int64_t number = f->frame.number;
    if (!track_frame(run->track, &f->field, velocity, intervals(run->tracked, number, 1), &stat, err)) return false;

    double start = console_clock();
    int gap = intervals(run->shown, number, run->step);
    if (!outputs_add_frame(&run->out, run->track, f->attribute, f->frame.digits, gap, err)) return false;
    StageSeconds seconds = report_stages(&stat);
    seconds.wait = wait_s;
    seconds.carry = run->out.carry_s;
    seconds.write = console_clock() - start - seconds.carry;
    say_problems(run, f->frame.digits, &stat);
    account(run, f, FRAME_TRACKED, &stat, seconds);
    tell_events(run, f->frame.digits);
    run->tracked = run->shown = number;
    run->next = !run->next;
    readframe_free(&run->slot[run->next]);
    return true;
}

/* A frame that could not be read: what --on-error wants. */
static bool pass_over(Run *run, ReadFrame *f, double wait_s, Err *err)
{
    OnError want = run->job.on_error;
    if (want == ON_ERROR_STOP) return fail(err, f->err.code, "frame %s: %s", f->frame.digits, f->err.text);
    bool hold = want == ON_ERROR_HOLD && run->out.nframe > 0;
    console_problem(&run->console, "frame %s is %s: %s", f->frame.digits, hold ? "held" : "skipped", f->err.text);
    double start = console_clock();
    int gap = intervals(run->shown, f->frame.number, run->step);
    if (hold && !outputs_hold_frame(&run->out, f->frame.digits, gap, err)) return false;
    StageSeconds seconds = {.wait = wait_s, .write = console_clock() - start};
    account(run, f, hold ? FRAME_HELD : FRAME_SKIPPED, NULL, seconds);
    if (hold) run->shown = f->frame.number;
    return true;
}

/* --- the sequence --------------------------------------------------------------------------------- */

static int64_t common_divisor(int64_t a, int64_t b)
{
    while (b) {
        int64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

/* The step of a sequence such as 10, 12, 14: played at a half of the frame rate it keeps its pace, without gaps.
 * Of names on standard input nothing is known yet: 1. */
static bool find_step(const MeshJob *job, const Options *o, int64_t *step, Err *err)
{
    Sequence s;
    Frame *frame = NEW(Frame, 1);
    int64_t last = NONE;
    *step = 0;
    bool good = job_open_sequence(job, o, &s, err);
    while (good && sequence_length(&s) != NONE && sequence_next(&s, frame, err) == SEQUENCE_FRAME) {
        if (last != NONE) *step = common_divisor(frame->number - last, *step);
        last = frame->number;
    }
    if (good) sequence_close(&s);
    if (*step == 0) *step = 1;
    mem_free(frame);
    return good;
}

/* True when the last frame is done, or a signal asks for an end between frames. */
static bool follow(Run *run, Err *err)
{
    for (;;) {
        ReadFrame *f = &run->slot[run->next];
        double start = console_clock();
        if (!reader_take(run->reader, f) || f->step == SEQUENCE_END) return true;
        if (f->step == SEQUENCE_ERROR) return fail(err, f->err.code, "%s", f->err.text);
        double wait_s = console_clock() - start;
        bool was_read = f->good;
        bool good = (was_read ? track_one : pass_over)(run, f, wait_s, err);
        if (!was_read) readframe_free(f);
        if (!good) return false;
        int done = run->totals.frames + run->totals.held + run->totals.skipped;
        console_progress(&run->console, done, int_max(sequence_length(&run->sequence), 0));
    }
}

static bool open_all(Run *run, const Options *o, Err *err)
{
    const MeshJob *job = &run->job;
    if (!find_step(job, o, &run->step, err)) return false;
    if (!job_open_sequence(job, o, &run->sequence, err)) return false;
    if (!outputs_open(&run->out, job, job->track.fps / (double)run->step, err)) return false;
    job_echo(o, TWINMESH_VERSION, run->out.report.stream);
    run->track = track_open(&job->track);
    run->reader = reader_open(job, &run->sequence, err);
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
    run->tracked = run->shown = NONE;
    run->frame_start_s = console_clock();
    thread_set_count(run->job.threads);

    bool good = open_all(run, o, &err) && follow(run, &err);
    reader_close(run->reader);
    int shown = run->out.nframe;
    good = close_outputs(run, good, &err);
    console_clear(&run->console);
    if (run->track) track_close(run->track);
    for (int i = 0; i < 2; i++) readframe_free(&run->slot[i]);
    mem_free(run->tracked_label);
    sequence_close(&run->sequence);

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
             "every frame. FRAME is a file, a pattern (phi.####.vdb, phi.%04d.vdb, phi.$F4.vdb), a folder, - for names\n"
             "on standard input, or a scene (scene.json), which is a sequence of its own.");
        options_print(stdout);
    } else if (option_given(&options, OPT_VERSION)) {
        puts("twinmesh " TWINMESH_VERSION);
    } else {
        if (!job_make(&run.job, &options, &err) || !job_load_scene(&run.job, &options, &err)) goto wrong;
        status = run_job(&run, &options);
    }
    job_free(&run.job);
    options_free(&options);
    return status;

wrong:
    job_free(&run.job);
    fprintf(stderr, "twinmesh mesh: %s\n", err.text);
    options_free(&options);
    return (int)err.code;
}
