/* render_priv.h: the parts of a rendering: rays, light, motion, textures, wires. */
#pragma once
#include "render/render.h"

static inline Vec3 vertex_at(const float *column, int v)
{
    const float *p = column + 3 * (size_t)v;
    return vec3(p[0], p[1], p[2]);
}

/* A place in a triangle. */
typedef struct Spot {
    int tri;
    int32_t corner[3];
    double weight[3];   /* of the corners; none negative, their sum is 1 */
} Spot;

static inline Vec3 spot_blend(const Spot *s, const float *column)
{
    Vec3 sum = v_scale(vertex_at(column, s->corner[0]), s->weight[0]);
    for (int k = 1; k < 3; k++) sum = v_axpy(sum, s->weight[k], vertex_at(column, s->corner[k]));
    return sum;
}
static inline int spot_nearest(const Spot *s)
{
    int k = s->weight[1] > s->weight[0] ? 1 : 0;
    return s->weight[2] > s->weight[k] ? 2 : k;
}

/* --- tracer.c: rays. Embree says which triangle; where in it, we compute ourselves, in double. */
typedef struct Tracer Tracer;
Tracer *tracer_open(Err *err);
void tracer_close(Tracer *t);
/* Takes a copy of the places and triangles; they replace those before. */
bool tracer_load(Tracer *t, const TriMesh *m, Err *err);
/* The first triangle along the ray, or false. Any number of threads at a time. */
bool tracer_hit(const Tracer *t, const TriMesh *m, Vec3 from, Vec3 along, Spot *out);
bool tracer_is_blocked(const Tracer *t, Vec3 from, Vec3 along);

/* --- light.c */
typedef struct Studio {
    Vec3 key, fill, up;        /* towards them; unit */
} Studio;
Studio studio_make(const Camera *c);
/* How much of the key and of the sky reaches each vertex, 0 to 1: [2 * nvert], of the caller's; normal: [3 * nvert]. */
float *light_reaching(const Tracer *t, const TriMesh *m, const float *normal, const Studio *studio);
/* Light that leaves the place for the eye, linear. n and to_eye are unit vectors, n on the eye's side. */
Vec3 studio_shade(const Studio *s, Vec3 albedo, Vec3 n, Vec3 to_eye, double key, double sky);

/* --- follow.c */
typedef struct Motion {
    float *place;              /* [3*nvert] in the other frame */
    float *known;              /* [nvert] as PLANE_FORWARD_KNOWN */
} Motion;
Motion motion_find(const TriMesh *m, const RenderOther *other);
void motion_free(Motion *motion);

/* --- onmesh.c: what lies on the mesh */
float *surface_normals(const TriMesh *m);     /* [3*nvert] unit, the mesh's own where they agree with its triangles; of the caller's */
uint32_t *surface_objects(const TriMesh *m);  /* [nvert] the least identity of each one's component; of the caller's */
/* [ntri] bit k: the edge from corner k to the next one is drawn. NULL of WIRE_NONE; of the caller's. */
uint8_t *surface_wire(const TriMesh *m, RenderWire wire);
typedef struct RestColumns {
    const float *place[3], *frame; /* [nvert]; place[0] NULL: there are none */
} RestColumns;
RestColumns surface_rest(const TriMesh *m);
Vec3 rest_at(const RestColumns *r, const TriMesh *m, const Spot *s);
