#include "cli/skin_source.h"

#include "io/points.h"

#include <math.h>
#include <string.h>
#include <strings.h>

SkinReading skin_reading(const Options *o)
{
    SkinReading r = {
        .request = {.grid = option_text(o, SKIN_GRID), .raw_type = option_text(o, SKIN_TYPE), .raw_order = option_text(o, SKIN_ORDER), .has_origin = option_given(o, SKIN_ORIGIN)},
        .iso = option_given(o, SKIN_ISO) ? option_real(o, SKIN_ISO) : NAN,
        .inside = !option_given(o, SKIN_INSIDE) ? 0 : option_choice(o, SKIN_INSIDE) == 0 ? 1 : -1,
        .points = option_text(o, SKIN_POINTS),
        .kernel = (SkinKernel)option_choice(o, SKIN_KERNEL),
        .radius = option_real(o, SKIN_RADIUS),
        .radius_in_voxels = o->value[SKIN_RADIUS].in_voxels,
        .voxel = option_real(o, SKIN_VOXEL),
        .voxel_in_voxels = o->value[SKIN_VOXEL].in_voxels,
    };
    for (int a = 0; a < 3; a++) {
        r.request.raw_dims[a] = (int)o->value[SKIN_DIMS].real[a];
        r.request.spacing[a] = option_given(o, SKIN_SPACING) ? o->value[SKIN_SPACING].real[a] : 0;
        r.request.origin[a] = o->value[SKIN_ORIGIN].real[a];
    }
    return r;
}

static double voxel_of(const SkinReading *r, double own) { return r->voxel > 0 ? r->voxel * (r->voxel_in_voxels ? own : 1) : own; }

static bool build_field(SkinShape *s, SkinReading *r, const char *path, const Volume *v, Err *err)
{
    Err why;
    if (!field_build(&s->field, &v->surface, &r->spec, &why)) return fail(err, why.code, "%.400s: %.500s", path, why.text);
    s->lattice = (SkinLattice){s->field.xform.t, voxel_of(r, s->field.voxel)};
    return true;
}

static bool read_volume(SkinShape *s, SkinReading *r, const char *path, Err *err)
{
    Volume v;
    if (!volume_read(path, &r->request, &v, err)) return false;
    if (!r->chosen) {
        SurfaceChoice choice = volume_choose_surface(&v, r->iso, r->inside);
        r->spec = choice.spec;
        r->chosen = !grid_is_empty(&v.surface);
        if (r->chosen) memcpy(s->said, choice.why, sizeof s->said);
    }
    bool ok = build_field(s, r, path, &v, err);
    volume_free(&v);
    return ok;
}

static bool read_points(SkinShape *s, SkinReading *r, const char *path, Err *err)
{
    PointSet p;
    if (!points_read(path, r->points, &p, err)) return false;
    double given = r->radius * (r->radius_in_voxels ? p.voxel : 1);
    *s = (SkinShape){.is_points = true, .npoint = p.n, .place = p.place, .radius = p.radius, .common = given > 0 ? given : p.voxel};
    if (given > 0) { /* overrules the file's */
        mem_free(s->radius);
        s->radius = NULL;
    }
    double least = s->common;
    if (s->radius)
        for (int i = 0; i < s->npoint; i++) least = i == 0 ? (double)s->radius[i] : real_min(least, (double)s->radius[i]);
    if (!(least > 0)) {
        skinshape_free(s);
        return fail(err, ERR_USAGE, "%.400s: says nothing of the particles' radius; give --radius in world units, such as once or twice the distance between them", path);
    }
    SkinLattice lattice = {vec3(0, 0, 0), voxel_of(r, 0.5 * least)};
    if (r->points && r->request.grid && !read_volume(s, r, path, err)) {
        skinshape_free(s);
        return false;
    }
    s->lattice = lattice;
    return true;
}

bool skinshape_of_scene(SkinShape *s, SkinReading *r, const Scene *scene, int64_t frame, Err *err)
{
    *s = (SkinShape){0};
    Volume v = {0};
    SceneFrame *f = scene_frame(scene, frame);
    grid_init(&v.surface, 1);
    SkinReading own = *r;
    own.spec = (FieldSpec){.iso = 0, .inside_below = true};
    bool ok = scene_fill_grid(f, true, &v.surface, err) && build_field(s, &own, scene->path, &v, err);
    volume_free(&v);
    scene_frame_free(f);
    return ok;
}

static bool read_scene(SkinShape *s, SkinReading *r, const char *path, Err *err)
{
    Scene scene;
    if (!scene_load(path, &scene, err)) return false;
    bool ok = skinshape_of_scene(s, r, &scene, scene.first, err);
    scene_free(&scene);
    return ok;
}

bool skinshape_read(SkinShape *s, SkinReading *r, const char *path, Err *err)
{
    *s = (SkinShape){0};
    if (scene_is_known(path)) return read_scene(s, r, path, err);
    bool points = r->points || points_are_in(path);
    return points ? read_points(s, r, path, err) : read_volume(s, r, path, err);
}

void skinshape_free(SkinShape *s)
{
    field_free(&s->field);
    mem_free(s->place);
    mem_free(s->radius);
    *s = (SkinShape){0};
}

SkinTarget *skinshape_target(const SkinShape *s, const SkinReading *r, const SkinLattice *l, Err *err)
{
    if (!s->is_points) return skin_target_field(l, &s->field, err);
    SkinPoints p = {s->npoint, s->place, s->radius, s->common};
    return skin_target_points(l, &p, r->kernel, r->points && r->request.grid ? &s->field : NULL, err);
}

bool skin_is_known(const char *path)
{
    size_t n = strlen(path);
    return volume_is_known(path) || (n > 4 && strcasecmp(path + n - 4, ".ply") == 0);
}
