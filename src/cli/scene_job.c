/* scene_job.c: the frames of a job; a scene in place of them. */
#include "cli/job.h"

#include <stdio.h>

/* What says how a grid is to be read says nothing about a scene. */
static bool is_plain(const Options *o, const char *path, Err *err)
{
    static const int grids[] = {OPT_GRID, OPT_ISO, OPT_INSIDE, OPT_VELOCITY, OPT_VELOCITY_UNITS, OPT_ATTRIBUTE, OPT_DIMS, OPT_TYPE, OPT_ORDER, OPT_SPACING, OPT_ORIGIN};
    for (size_t i = 0; i < sizeof grids / sizeof *grids; i++)
        if (option_given(o, grids[i])) return fail(err, ERR_USAGE, "--%s: goes with volumes, not with a scene; leave it out for %.400s", option_table[grids[i]].name, path);
    return o->noperand == 1 || fail(err, ERR_USAGE, "%.400s: a scene is a sequence of its own; name it alone", path);
}

bool job_load_scene(MeshJob *job, Options *o, Err *err)
{
    const char *path = NULL;
    for (int i = 0; i < o->noperand && !path; i++)
        if (scene_is_known(o->operand[i])) path = o->operand[i];
    if (!path) return true;
    if (!is_plain(o, path, err) || !scene_load(path, &job->scene, err)) return false;
    job->has_scene = true;
    if (!option_given(o, OPT_FPS)) o->value[OPT_FPS].real[0] = job->track.fps = job->scene.fps;
    return true;
}

bool job_open_sequence(const MeshJob *job, const Options *o, Sequence *out, Err *err)
{
    const Scene *s = &job->scene;
    if (job->source.next) return job->source.open(job->source.maker, out, err);
    if (job->has_scene) return sequence_open_numbers(out, s->path, s->first, s->last, job->frames, err);
    return sequence_open(out, o->noperand, o->operand, job->frames, volume_is_known, err);
}

static int64_t common_divisor(int64_t a, int64_t b)
{
    while (b) {
        int64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

bool job_find_step(const MeshJob *job, const Options *o, int64_t *step, Err *err)
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

int job_intervals(int64_t from, int64_t to, int64_t step)
{
    int64_t n = from == NONE ? 1 : (to - from) / step;
    return n < 1 ? 1 : n > INT32_MAX ? INT32_MAX : (int)n;
}

void job_free(MeshJob *job)
{
    if (job->has_scene) scene_free(&job->scene);
    job->has_scene = false;
}
