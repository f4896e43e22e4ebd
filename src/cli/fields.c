#include "cli/fields.h"

#include "cli/volume_options.h"

#include <string.h>

bool fields_open(Fields *f, const Options *o, Err *err)
{
    *f = (Fields){.request = volume_options_request(o),
                  .iso = volume_options_iso(o),
                  .inside = volume_options_inside(o),
                  .trilinear = option_choice(o, options_find(o, "projection")) == 1};
    const char *frames = option_text(o, options_find(o, "frames"));
    f->has_scene = o->noperand == 1 && scene_is_known(o->operand[0]);
    if (!f->has_scene) return sequence_open(&f->sequence, o->noperand, o->operand, frames, volume_is_known, err);
    f->spec.inside_below = f->chosen = true;
    return scene_load(o->operand[0], &f->scene, err) &&
           sequence_open_numbers(&f->sequence, f->scene.path, f->scene.first, f->scene.last, frames, err);
}

void fields_close(Fields *f)
{
    sequence_close(&f->sequence);
    if (f->has_scene) scene_free(&f->scene);
    f->has_scene = false;
}

SequenceStep fields_next(Fields *f, FieldFrame *out, Err *err)
{
    *out = (FieldFrame){0};
    return sequence_next(&f->sequence, &out->frame, err);
}

static void choose_surface(Fields *f, const Volume *v, FieldFrame *frame)
{
    if (f->chosen) return;
    SurfaceChoice choice = volume_choose_surface(v, f->iso, f->inside);
    f->spec = choice.spec;
    f->chosen = !grid_is_empty(&v->surface);
    if (f->chosen) memcpy(frame->surface, choice.why, sizeof frame->surface);
}

static bool read_volume(const Fields *f, FieldFrame *frame, Volume *v, Err *err)
{
    *v = (Volume){0};
    if (!f->has_scene) return volume_read(frame->frame.path, &f->request, v, err);
    frame->scene = scene_frame(&f->scene, frame->frame.number);
    grid_init(&v->surface, 1);
    if (scene_fill_grid(frame->scene, false, &v->surface, err)) return true;
    volume_free(v);
    return false;
}

bool fields_read(Fields *f, FieldFrame *frame, Err *err)
{
    Volume v;
    Err why;
    if (!read_volume(f, frame, &v, err)) return false;
    choose_surface(f, &v, frame);
    bool ok = field_build(&frame->field, &v.surface, &f->spec, &why);
    if (!ok) fail(err, why.code, "%.400s: %.500s", frame->frame.path, why.text);
    if (ok && frame->scene && !f->trilinear) frame->field.exact = scene_exact(frame->scene);
    volume_free(&v);
    return ok;
}

void fieldframe_free(FieldFrame *frame)
{
    field_free(&frame->field);
    scene_frame_free(frame->scene);
    *frame = (FieldFrame){0};
}
