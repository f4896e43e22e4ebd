/* light.c: a key that is a disc, a sky that is a sphere, a fill without shadows. */
#include "base/thread.h"
#include "render/render_priv.h"

enum { SKY_RAYS = 64, KEY_RAYS = 8, GRAIN = 128, SMOOTHINGS = 2 };
#define KEY_RADIUS 0.16          /* of its disc, at distance 1 */
#define LIFT 0.05                /* of a ray's start off the surface, in edges */
/* A turn by the golden angle: points so far apart around an axis never line up. */
#define GOLDEN_COS (-0.7373688780783197)
#define GOLDEN_SIN 0.6754902942615238

Studio studio_make(const Camera *c)
{
    Vec3 right = c->right, up = c->up, back = c->back;
    Studio s = {.up = up};
    s.key = v_unit(v_add(v_scale(right, -0.55), v_add(v_scale(up, 0.85), v_scale(back, 0.55))));
    s.fill = v_unit(v_add(v_scale(right, 0.9), v_add(v_scale(up, 0.1), v_scale(back, 0.6))));
    return s;
}

/* --- what reaches the vertices ---------------------------------------------------------------------- */

typedef struct Rays {
    Vec3 sky[SKY_RAYS], key[KEY_RAYS];
} Rays;

/* Even over the sphere, and over the key's disc: Fibonacci's spirals. */
static Rays rays_make(const Studio *s)
{
    Rays rays;
    Vec3 across = v_unit(v_cross(s->key, s->up)), along = v_cross(s->key, across);
    double x = 1, y = 0;
    for (int i = 0; i < SKY_RAYS; i++) {
        double z = 1 - (2 * i + 1) / (double)SKY_RAYS, r = sqrt(1 - z * z), was = x;
        rays.sky[i] = vec3(r * x, r * y, z);
        if (i < KEY_RAYS) {
            double q = KEY_RADIUS * sqrt((i + 0.5) / KEY_RAYS);
            rays.key[i] = v_axpy(v_axpy(s->key, q * x, across), q * y, along);
        }
        x = GOLDEN_COS * was - GOLDEN_SIN * y;
        y = GOLDEN_SIN * was + GOLDEN_COS * y;
    }
    return rays;
}

typedef struct ReachJob {
    const Tracer *tracer;
    const TriMesh *mesh;
    const float *normal;
    const Rays *rays;
    double lift;
    float *reach;  /* [2*nvert] key, sky */
} ReachJob;

static float open_part(const ReachJob *job, Vec3 from, Vec3 n, int count, const Vec3 *ray, bool by_angle)
{
    double open = 0, all = 0;
    for (int i = 0; i < count; i++) {
        double cosine = v_dot(n, ray[i]), weight = by_angle ? cosine : 1;
        if (cosine <= 0) continue;
        all += weight;
        if (!tracer_is_blocked(job->tracer, from, ray[i])) open += weight;
    }
    return all > 0 ? (float)(open / all) : 0;
}

static void reach_vertices(void *ctx, int begin, int end)
{
    const ReachJob *job = ctx;
    for (int v = begin; v < end; v++) {
        Vec3 n = vertex_at(job->normal, v), from = v_axpy(vertex_at(job->mesh->pos, v), job->lift, n);
        job->reach[2 * (size_t)v] = open_part(job, from, n, KEY_RAYS, job->rays->key, false);
        job->reach[2 * (size_t)v + 1] = open_part(job, from, n, SKY_RAYS, job->rays->sky, true);
    }
}

static double mean_edge(const TriMesh *m)
{
    double sum = 0;
    for (int t = 0; t < m->ntri; t++)
        for (int k = 0; k < 3; k++)
            sum += v_dist(vertex_at(m->pos, m->tri[3 * t + k]), vertex_at(m->pos, m->tri[3 * t + (k + 1) % 3]));
    return m->ntri ? sum / (3.0 * m->ntri) : 0;
}

/* Half of each vertex stays, the other half is its neighbours': few rays give coarse steps. */
static void smooth(const TriMesh *m, float *reach)
{
    double *sum = NEW0(double, 2 * (size_t)m->nvert);
    int *count = NEW0(int, m->nvert);
    for (int t = 0; t < m->ntri; t++)
        for (int k = 0; k < 3; k++) {
            int v = m->tri[3 * t + k], next = m->tri[3 * t + (k + 1) % 3];
            for (int i = 0; i < 2; i++) sum[2 * v + i] += (double)reach[2 * next + i];
            count[v]++;
        }
    for (int v = 0; v < m->nvert; v++)
        for (int i = 0; count[v] && i < 2; i++)
            reach[2 * v + i] = (float)(0.5 * ((double)reach[2 * v + i] + sum[2 * v + i] / count[v]));
    mem_free(sum);
    mem_free(count);
}

float *light_reaching(const Tracer *t, const TriMesh *m, const float *normal, const Studio *studio)
{
    Rays rays = rays_make(studio);
    ReachJob job = {t, m, normal, &rays, LIFT * mean_edge(m), NEW(float, 2 * (size_t)m->nvert)};
    parallel_for(m->nvert, GRAIN, reach_vertices, &job);
    for (int i = 0; i < SMOOTHINGS; i++) smooth(m, job.reach);
    return job.reach;
}

/* --- what leaves a place ------------------------------------------------------------------------------- */

static Vec3 times(Vec3 a, Vec3 b) { return vec3(a.x * b.x, a.y * b.y, a.z * b.z); }

static double power_5(double x) { return x * x * x * x * x; }

static double power_128(double x)
{
    for (int i = 0; i < 7; i++) x *= x;
    return x;
}

static Vec3 sky_towards(const Studio *s, Vec3 d)
{
    static const Vec3 above = {0.80, 0.92, 1.05}, below = {0.26, 0.25, 0.25};
    return v_mix(below, above, 0.5 + 0.5 * v_dot(d, s->up));
}

Vec3 studio_shade(const Studio *s, Vec3 albedo, Vec3 n, Vec3 to_eye, double key, double sky)
{
    static const Vec3 key_light = {1.15, 1.08, 0.98}, fill_light = {0.16, 0.17, 0.20};
    double facing = v_dot(n, to_eye), mirror = 0.03 + 0.4 * power_5(1 - facing); /* Schlick's; a rough surface's rim is dimmer */
    Vec3 half = v_unit(v_add(s->key, to_eye)), mirrored = v_axpy(v_scale(to_eye, -1), 2 * facing, n);

    Vec3 light = v_scale(sky_towards(s, n), 0.5 * sky * (0.5 + sky));
    light = v_axpy(light, key * real_max(v_dot(n, s->key), 0), key_light);
    light = v_axpy(light, sky * real_max(v_dot(n, s->fill), 0), fill_light);
    Vec3 out = v_axpy(times(albedo, light), mirror * sky, sky_towards(s, mirrored));
    return v_axpy(out, 0.5 * key * power_128(real_max(v_dot(n, half), 0)), key_light);
}
