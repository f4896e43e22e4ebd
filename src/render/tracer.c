#include "render/render_priv.h"

#include <embree3/rtcore.h>

#include <math.h>
#include <string.h>

struct Tracer {
    RTCDevice device;
    RTCScene scene;
};

/* One thread builds, and all machines use the same instructions: the same tree and the same hits everywhere. */
static const char device_settings[] = "threads=1,isa=sse2,frequency_level=simd128";

static bool embree_fail(RTCDevice device, Err *err)
{
    return fail(err, ERR_RESOURCE, "rays cannot be cast: Embree has %s",
                rtcGetDeviceError(device) == RTC_ERROR_OUT_OF_MEMORY ? "not enough memory" : "an error of its own");
}

Tracer *tracer_open(Err *err)
{
    Tracer *t = NEW0(Tracer, 1);
    t->device = rtcNewDevice(device_settings);
    if (t->device) return t;
    embree_fail(NULL, err);
    mem_free(t);
    return NULL;
}

void tracer_close(Tracer *t)
{
    if (!t) return;
    if (t->scene) rtcReleaseScene(t->scene);
    rtcReleaseDevice(t->device);
    mem_free(t);
}

/* Embree reads 16 bytes a vertex: its own buffers have room for that behind the last one. */
static bool fill_buffers(RTCGeometry g, const TriMesh *m)
{
    float *pos = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof *pos, (size_t)m->nvert);
    uint32_t *tri = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof *tri, (size_t)m->ntri);
    if (!pos || !tri) return false;
    memcpy(pos, m->pos, 3 * (size_t)m->nvert * sizeof *pos);
    memcpy(tri, m->tri, 3 * (size_t)m->ntri * sizeof *tri);
    return true;
}

static bool add_triangles(Tracer *t, const TriMesh *m)
{
    RTCGeometry g = rtcNewGeometry(t->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!g) return false;
    bool ok = fill_buffers(g, m);
    if (ok) {
        rtcCommitGeometry(g);
        rtcAttachGeometry(t->scene, g);
    }
    rtcReleaseGeometry(g);
    return ok;
}

bool tracer_load(Tracer *t, const TriMesh *m, Err *err)
{
    if (t->scene) rtcReleaseScene(t->scene);
    t->scene = rtcNewScene(t->device);
    if (!t->scene) return embree_fail(t->device, err);
    rtcSetSceneFlags(t->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(t->scene, RTC_BUILD_QUALITY_MEDIUM);
    if (m->ntri > 0 && !add_triangles(t, m)) return embree_fail(t->device, err);
    rtcCommitScene(t->scene);
    return rtcGetDeviceError(t->device) == RTC_ERROR_NONE || embree_fail(t->device, err);
}

static struct RTCRay ray_make(Vec3 from, Vec3 along)
{
    return (struct RTCRay){.org_x = (float)from.x, .org_y = (float)from.y, .org_z = (float)from.z,
                           .dir_x = (float)along.x, .dir_y = (float)along.y, .dir_z = (float)along.z,
                           .tfar = INFINITY, .mask = UINT32_MAX};
}

/* Where the ray meets the triangle's plane, or the nearest place in the triangle along its sides: Embree's ray was rounded. */
static void weigh(const TriMesh *m, Vec3 from, Vec3 along, Spot *s)
{
    Vec3 d[3];
    double sum = 0;
    for (int k = 0; k < 3; k++) d[k] = v_sub(vertex_at(m->pos, s->corner[k]), from);
    for (int k = 0; k < 3; k++) s->weight[k] = v_dot(along, v_cross(d[(k + 1) % 3], d[(k + 2) % 3]));
    bool away = s->weight[0] + s->weight[1] + s->weight[2] < 0;
    for (int k = 0; k < 3; k++) sum += s->weight[k] = real_max(away ? -s->weight[k] : s->weight[k], 0);
    for (int k = 0; k < 3; k++) s->weight[k] = sum > 0 ? s->weight[k] / sum : k == 0;
}

bool tracer_hit(const Tracer *t, const TriMesh *m, Vec3 from, Vec3 along, Spot *out)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    struct RTCRayHit r = {.ray = ray_make(from, along), .hit = {.geomID = RTC_INVALID_GEOMETRY_ID}};
    rtcIntersect1(t->scene, &context, &r);
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    out->tri = (int)r.hit.primID;
    memcpy(out->corner, m->tri + 3 * (size_t)out->tri, sizeof out->corner);
    weigh(m, from, along, out);
    return true;
}

bool tracer_is_blocked(const Tracer *t, Vec3 from, Vec3 along)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRay r = ray_make(from, along);
    rtcOccluded1(t->scene, &context, &r);
    return r.tfar < 0;
}
