#include "base/thread.h"
#include "render/render_priv.h"

#include <math.h>

enum { TILE = 16 };
#define WIRE_PIXELS 1.1     /* how wide the lines are */

static const Vec3 clay = {0.15, 0.36, 0.52}, light_cell = {0.70, 0.70, 0.66}, dark_cell = {0.08, 0.24, 0.40},
                  paper = {0.94, 0.94, 0.94}, ink = {0.015, 0.02, 0.03};

struct Renderer {
    Tracer *tracer;
};

Renderer *renderer_open(Err *err)
{
    Tracer *t = tracer_open(err);
    if (!t) return NULL;
    Renderer *r = NEW(Renderer, 1);
    r->tracer = t;
    return r;
}

void renderer_close(Renderer *r)
{
    if (!r) return;
    tracer_close(r->tracer);
    mem_free(r);
}

/* All that the pixels of a frame are made of. */
typedef struct Scene {
    const Tracer *tracer;
    const RenderLook *look;
    const RenderFrame *frame;
    Picture *picture;
    Studio studio;
    float *normal;         /* [3*nvert] */
    float *reach;          /* [2*nvert] key, sky; NULL: unlit */
    uint8_t *wire;         /* [ntri] or NULL */
    uint32_t *object;      /* [nvert] or NULL */
    RestColumns rest;
    Motion before, after;  /* of LAYER_MOTION */
} Scene;

/* --- beauty -------------------------------------------------------------------------------------------- */

/* The i-th of n places in a pixel, none in another's row or column (Hammersley's). */
static void sample_place(int i, int n, double *x, double *y)
{
    *x = (i + 0.5) / n;
    *y = 0.5 / n;
    double half = 0.5;
    for (int bits = i; bits; bits >>= 1, half *= 0.5)
        if (bits & 1) *y += half;
    *y -= floor(*y);
}

static double distance_to_edge(Vec3 a, Vec3 b, double x, double y)
{
    double ux = b.x - a.x, uy = b.y - a.y, px = x - a.x, py = y - a.y, length2 = ux * ux + uy * uy;
    double t = length2 > 0 ? real_clamp((px * ux + py * uy) / length2, 0, 1) : 0, dx = px - t * ux, dy = py - t * uy;
    return sqrt(dx * dx + dy * dy);
}

/* How much of the place in the picture a line covers. */
static double wire_cover(const Scene *s, const Spot *spot, double x, double y)
{
    const Camera *c = &s->frame->camera;
    Vec3 p[3];
    double nearest = INFINITY;
    for (int k = 0; k < 3; k++) p[k] = camera_project(c, vertex_at(s->frame->mesh->pos, spot->corner[k]));
    for (int k = 0; k < 3; k++) {
        const Vec3 *a = &p[k], *b = &p[(k + 1) % 3];
        if (s->wire[spot->tri] >> k & 1 && a->z > 0 && b->z > 0) nearest = real_min(nearest, distance_to_edge(*a, *b, x, y));
    }
    return real_clamp(0.5 * WIRE_PIXELS + 0.5 - nearest, 0, 1);
}

static Vec3 checker_at(const Scene *s, const Spot *spot)
{
    /* no surface at rest lies in a plane between cells but by chance */
    const double shift = 0.381966;
    const TriMesh *m = s->frame->mesh;
    Vec3 p = v_scale(s->rest.place[0] ? rest_at(&s->rest, m, spot) : spot_blend(spot, m->pos), 1 / s->look->cell);
    double cell = floor(p.x + shift) + floor(p.y + shift) + floor(p.z + shift);
    return fmod(cell, 2) == 0 ? light_cell : dark_cell;
}

static Vec3 lit(const Scene *s, const Spot *spot, Vec3 along)
{
    Vec3 to_eye = v_unit(v_scale(along, -1)), n = v_unit(spot_blend(spot, s->normal));
    double reach[2] = {0, 0};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 2; i++) reach[i] += spot->weight[k] * (double)s->reach[2 * (size_t)spot->corner[k] + (size_t)i];
    if (v_dot(n, to_eye) < 0) n = v_unit(v_axpy(n, -2 * v_dot(n, to_eye), to_eye)); /* an inside, or a silhouette's smoothed normal */
    Vec3 albedo = s->look->surface == SURFACE_CHECKER ? checker_at(s, spot) : clay;
    return studio_shade(&s->studio, albedo, n, to_eye, reach[0], reach[1]);
}

static void put_beauty(const Scene *s, int x, int y)
{
    int n = s->look->samples, seen = 0;
    Vec3 sum = vec3(0, 0, 0);
    for (int i = 0; i < n; i++) {
        double px, py;
        Spot spot;
        sample_place(i, n, &px, &py);
        px += x;
        py += y;
        Vec3 along = camera_ray(&s->frame->camera, px, py);
        if (!tracer_hit(s->tracer, s->frame->mesh, s->frame->camera.eye, along, &spot)) continue;
        Vec3 colour = s->look->surface == SURFACE_PAPER ? paper : lit(s, &spot, along);
        if (s->wire) colour = v_mix(colour, ink, wire_cover(s, &spot, px, py));
        sum = v_add(sum, colour);
        seen++;
    }
    size_t at = (size_t)y * (size_t)s->picture->width + (size_t)x;
    s->picture->plane[PLANE_R][at].real = (float)(sum.x / n);
    s->picture->plane[PLANE_G][at].real = (float)(sum.y / n);
    s->picture->plane[PLANE_B][at].real = (float)(sum.z / n);
    s->picture->plane[PLANE_A][at].real = (float)((double)seen / n);
}

/* --- data ---------------------------------------------------------------------------------------------- */

static void put_vec3(Picture *p, PlaneId first, size_t at, Vec3 v)
{
    for (int a = 0; a < 3; a++) p->plane[(int)first + a][at].real = (float)v_get(v, a);
}

/* `there`, of the other frame, as its camera sees it, less the place here; where that is behind the eye nothing is known. */
static void put_motion(const Scene *s, PlaneId first, size_t at, const Spot *spot, const Motion *motion, const Camera *camera)
{
    float known = 1;
    for (int k = 0; k < 3; k++) known = fminf(known, motion->known[spot->corner[k]]);
    Vec3 here = camera_project(&s->frame->camera, spot_blend(spot, s->frame->mesh->pos)),
         there = camera_project(camera, spot_blend(spot, motion->place));
    if (!(known > 0 && there.z > 0)) return;
    Sample *const *plane = s->picture->plane + first;
    plane[0][at].real = (float)(there.x - here.x);
    plane[1][at].real = (float)(here.y - there.y);
    plane[2][at].real = known;
}

static void put_data(const Scene *s, int x, int y)
{
    const RenderFrame *f = s->frame;
    Picture *p = s->picture;
    Spot spot;
    size_t at = (size_t)y * (size_t)p->width + (size_t)x;
    if (!tracer_hit(s->tracer, f->mesh, f->camera.eye, camera_ray(&f->camera, x + 0.5, y + 0.5), &spot)) return;
    Vec3 place = spot_blend(&spot, f->mesh->pos);
    int nearest = spot.corner[spot_nearest(&spot)];
    if (picture_has(p, LAYER_DEPTH)) p->plane[PLANE_Z][at].real = (float)camera_project(&f->camera, place).z;
    if (picture_has(p, LAYER_NORMAL)) put_vec3(p, PLANE_NORMAL_X, at, v_unit(spot_blend(&spot, s->normal)));
    if (picture_has(p, LAYER_POSITION)) put_vec3(p, PLANE_POSITION_X, at, place);
    if (picture_has(p, LAYER_MOTION)) {
        put_motion(s, PLANE_FORWARD_U, at, &spot, &s->after, &f->after.camera);
        put_motion(s, PLANE_BACKWARD_U, at, &spot, &s->before, &f->before.camera);
    }
    if (picture_has(p, LAYER_ID)) {
        p->plane[PLANE_OBJECT][at].number = s->object[nearest];
        p->plane[PLANE_VERTEX][at].number = (uint32_t)f->mesh->id[nearest];
    }
    if (picture_has(p, LAYER_REST) && s->rest.place[0]) put_vec3(p, PLANE_REST_X, at, rest_at(&s->rest, f->mesh, &spot));
}

/* --- a frame ------------------------------------------------------------------------------------------- */

static bool wants_data(const Picture *p)
{
    for (int layer = LAYER_BEAUTY + 1; layer < LAYER_COUNT; layer++)
        if (picture_has(p, (Layer)layer)) return true;
    return false;
}

static void put_tiles(void *ctx, int begin, int end)
{
    const Scene *s = ctx;
    bool beauty = picture_has(s->picture, LAYER_BEAUTY), data = wants_data(s->picture);
    int across = (s->picture->width + TILE - 1) / TILE;
    for (int tile = begin; tile < end; tile++) {
        int x0 = tile % across * TILE, y0 = tile / across * TILE;
        for (int y = y0; y < int_min(y0 + TILE, s->picture->height); y++)
            for (int x = x0; x < int_min(x0 + TILE, s->picture->width); x++) {
                if (beauty) put_beauty(s, x, y);
                if (data) put_data(s, x, y);
            }
    }
}

bool render_frame(Renderer *r, const RenderLook *look, const RenderFrame *frame, Picture *picture, Err *err)
{
    const TriMesh *m = frame->mesh;
    ASSERT(picture->width == frame->camera.width && picture->height == frame->camera.height && look->samples > 0);
    if (!tracer_load(r->tracer, m, err)) return false;
    Scene s = {.tracer = r->tracer, .look = look, .frame = frame, .picture = picture,
               .studio = studio_make(&frame->camera), .rest = surface_rest(m), .normal = surface_normals(m)};
    if (picture_has(picture, LAYER_BEAUTY)) {
        s.wire = surface_wire(m, look->wire);
        if (look->surface != SURFACE_PAPER) s.reach = light_reaching(r->tracer, m, s.normal, &s.studio);
    }
    if (picture_has(picture, LAYER_ID)) s.object = surface_objects(m);
    if (picture_has(picture, LAYER_MOTION)) {
        s.before = motion_find(m, &frame->before);
        s.after = motion_find(m, &frame->after);
    }
    int tiles = ((picture->width + TILE - 1) / TILE) * ((picture->height + TILE - 1) / TILE);
    parallel_for(tiles, 1, put_tiles, &s);
    motion_free(&s.before);
    motion_free(&s.after);
    mem_free(s.normal);
    mem_free(s.reach);
    mem_free(s.wire);
    mem_free(s.object);
    return true;
}
