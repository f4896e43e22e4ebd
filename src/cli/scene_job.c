/* scene_job.c: a scene in place of frames. */
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

void job_free(MeshJob *job)
{
    if (job->has_scene) scene_free(&job->scene);
    job->has_scene = false;
}
