/* resume.c: where a run stands, kept as frames are done, and how another goes on from there. */
#include "cli/run.h"
#include "cli/state.h"

#include <string.h>

/* --- the settings ------------------------------------------------------------------------------------------------------- */

/* As it was given, or its default; NULL: neither. */
static const char *setting(const Options *o, int i)
{
    if (option_table[i].kind == OPTION_FLAG) return option_given(o, i) ? "given" : NULL;
    return o->value[i].text;
}

/* The settings that the outputs depend on, those of the running itself left out. */
static void save_settings(const Options *o, Store *s)
{
    for (int i = 0; i < OPTION_COUNT; i++) {
        if (option_table[i].echo == OPTION_RUN) continue;
        const char *now = setting(o, i);
        char *text = now ? mem_text(now) : NULL;
        store_text(s, &text);
        mem_free(text);
    }
}

/* What is written, and of which frames: another run's affair. */
static bool is_of_outputs(int i)
{
    return i == OPT_FORMAT || i == OPT_GLTF_INTERPOLATION || i == OPT_COMPRESS || i == OPT_UP || i == OPT_SCALE || i == OPT_FRAMES || i == OPT_ON_ERROR ||
           i == OPT_ATTRIBUTE;
}

static bool check_settings(const Options *o, bool is_start, Store *s, Err *err)
{
    for (int i = 0; i < OPTION_COUNT && !s->bad; i++) {
        if (option_table[i].echo == OPTION_RUN) continue;
        const char *now = setting(o, i);
        char *was = NULL;
        store_text(s, &was);
        bool same = (is_start && is_of_outputs(i)) || s->bad || (was && now ? strcmp(was, now) == 0 : !was && !now);
        if (!same)
            fail(err, ERR_USAGE, "--%s was %s in the run to go on with and is %s now; options must be the same", option_table[i].name,
                 was ? was : "not given", now ? now : "not given");
        mem_free(was);
        if (!same) return false;
    }
    return true;
}

/* --- the run ------------------------------------------------------------------------------------------------------------ */

/* Both ways. */
static void store_run(Run *run, Store *s)
{
    uint8_t chosen = run->surface.chosen, below = run->surface.spec.inside_below;
    STORE(s, run->step);
    STORE(s, chosen);
    STORE(s, below);
    STORE(s, run->surface.spec.iso);
    run->surface = (Surface){chosen, {run->surface.spec.iso, below}};
    inputs_store(&run->inputs, s);
    store_text(s, &run->tracked_label);
    STORE(s, run->tracked);
    STORE(s, run->shown);
    store_expect(s, run->step >= 1 && run->tracked >= NONE && run->shown >= NONE);
    for (int kind = 0; kind < KIND_COUNT; kind++) trimesh_store(&run->mesh[run->shown_at][kind], s);
    track_store(run->track, s);
}

Store run_save(Run *run, const Options *o)
{
    Store s = store_writing();
    save_settings(o, &s);
    store_run(run, &s);
    return s;
}

/* The field that the tracker saw last, from its file. */
static bool read_last(Run *run, const Frame *frame, Err *err)
{
    ReadFrame *f = &run->slot[(run->next + SLOTS - 1) % SLOTS];
    *f = (ReadFrame){.frame = *frame};
    readframe_read(&run->job, run->surface, NULL, f);
    if (!f->good) {
        *err = f->err;
        return false;
    }
    track_remind(run->track, &f->field, f->has_velocity ? &f->velocity : NULL);
    return true;
}

/* Behind the frames done; what the state says of outputs is still to be read. */
static bool pass_done(Run *run, Err *err)
{
    Frame *last = NEW0(Frame, 1);
    bool good = inputs_pass(&run->inputs, run->job.start_from, &run->sequence, run->tracked, last, err);
    if (good && run->tracked != NONE) good = read_last(run, last, err);
    mem_free(last);
    run->done = run->inputs.n;
    return good;
}

static bool go_on(Run *run, const Options *o, Store *s, Err *err)
{
    int64_t step = run->step;
    if (!check_settings(o, false, s, err)) return false;
    store_run(run, s);
    if (s->bad) return false;
    if (run->step != step)
        return fail(err, ERR_INPUT, "the frames' numbers rise by %lld, and by %lld in the run to go on with", (long long)step, (long long)run->step);
    return pass_done(run, err) && outputs_reopen(&run->out, &run->job, run->job.track.fps / (double)run->step, s, err);
}

/* A new run that begins with the last frame of another. */
static bool start_from(Run *run, const Options *o, Store *s, Err *err)
{
    int64_t step = run->step;
    if (!check_settings(o, true, s, err)) return false;
    store_run(run, s);
    run->step = step;
    run->shown = NONE;
    for (int kind = 0; kind < KIND_COUNT; kind++) trimesh_free(&run->mesh[run->shown_at][kind]);
    if (s->bad) return false;
    if (!inputs_keep(&run->inputs, run->tracked)) return fail(err, ERR_INPUT, "it has tracked no frame");
    return pass_done(run, err);
}

/* Reads a state and takes it up; RESUME_NEW where there is none. */
static ResumeKind take_up(Run *run, const Options *o, const char *path, bool is_start, Err *err)
{
    StateFile f;
    ResumeKind kind = RESUME_FAILED;
    if (!state_read(path, &f, err)) kind = RESUME_FAILED;
    else if (!f.exists) kind = RESUME_NEW;
    else if (f.finished && !is_start) kind = RESUME_OVER;
    else if ((is_start ? start_from : go_on)(run, o, &f.store, err)) kind = RESUME_ON;
    if (f.store.bad) fail(err, ERR_INPUT, "%.800s: holds what no run leaves", path);
    state_free(&f);
    return kind;
}

ResumeKind run_resume(Run *run, const Options *o, Err *err)
{
    const MeshJob *job = &run->job;
    ResumeKind kind = RESUME_NEW;
    Err why = {0};
    if (job->resume) {
        char *path = state_path(job->prefix);
        kind = take_up(run, o, path, false, &why);
        mem_free(path);
        if (kind == RESUME_FAILED) fail(err, why.code, "%.800s; mend that, or start again without --resume", why.text);
    }
    if (kind != RESUME_NEW || !job->start_from) return kind;
    kind = take_up(run, o, job->start_from, true, &why);
    if (kind == RESUME_NEW) kind = RESUME_FAILED, fail(&why, ERR_INPUT, "there is no such file");
    if (kind == RESUME_FAILED) fail(err, why.code, "--start-from %.400s: %.500s", job->start_from, why.text);
    return kind == RESUME_ON ? RESUME_NEW : kind;
}
