#include "scenes.h"

#include "base/thread.h"

#include <string.h>

#define PI 3.14159265358979323846

/* --- shapes: negative inside --------------------------------------------------------------------------------------------- */

static double ball(const double p[3], double x, double y, double z, double r) { return v_dist(vec3(p[0], p[1], p[2]), vec3(x, y, z)) - r; }

/* About an axis through the centre: 0 x, 1 y, 2 z. */
static double torus(const double p[3], const double centre[3], int axis, double R, double r)
{
    double d[3];
    for (int a = 0; a < 3; a++) d[a] = p[a] - centre[a];
    double u = d[(axis + 1) % 3], v = d[(axis + 2) % 3], ring = sqrt(u * u + v * v) - R;
    return sqrt(ring * ring + d[axis] * d[axis]) - r;
}

/* The minimum, rounded over `blend` where two surfaces meet. */
static double smooth_min(double a, double b, double blend)
{
    double lesser = real_min(a, b);
    if (blend <= 0) return lesser;
    double h = real_max(blend - fabs(a - b), 0) / blend;
    return lesser - h * h * blend / 4;
}

static double smooth_max(double a, double b, double blend) { return -smooth_min(-a, -b, blend); }

/* There and back: 0 at frames 0 and 2 half, 1 at frame half. */
static double there_and_back(int frame, int half) { return 1 - fabs((double)(frame - half)) / half; }

/* --- the scenes ------------------------------------------------------------------------------------------------------------ */

/* Three balls come together, touch all at frame 12, close the hole between them, and part again. */
static double phi_three(const double p[3], int frame)
{
    static const double way[3][2] = {{1, 0}, {-0.5, 0.86602540378443865}, {-0.5, -0.86602540378443865}};
    double far = 22 - 14 * there_and_back(frame, 24), phi = 1e9;
    double r = 12.990381056766578; /* 15 sin 60: they touch where far is 15 */
    for (int k = 0; k < 3; k++) phi = real_min(phi, ball(p, 39.6 + far * way[k][0], 39.7 + far * way[k][1], 19.8, r));
    return phi;
}

/* A plate that thins in its middle until a hole opens, widens, and closes again. */
static double phi_disc(const double p[3], int frame)
{
    double x = p[0] - 31.6, y = p[1] - 31.7, z = p[2] - 13.3, rho = sqrt(x * x + y * y);
    double edge = rho - 24, flat = fabs(z) - 3.2;
    double plate = smooth_max(edge, flat, 4);
    double hole = -7 + 22 * there_and_back(frame, 20); /* its radius */
    return smooth_max(plate, hole - rho, 5);
}

/* Inside a large ball and beside it: what has a birth and a death swells from nothing and vanishes. */
static double phi_cavity(const double p[3], int frame)
{
    static const struct {
        double x, y, z, r;
        int birth, death;
        bool hollow;
    } body[] = {
        {31.6, 31.7, 31.8, 20, -1000, 1000, false}, {36.2, 33.1, 30.4, 6, 3, 21, true},  {24.1, 29.3, 35.2, 7, 10, 30, true},
        {45.3, 31.2, 31.6, 9, 18, 44, true},        {56.4, 50.1, 12.7, 5, 2, 12, false}, {7.9, 52.3, 50.2, 5.5, 8, 26, false},
        {54.2, 10.6, 52.8, 3, 20, 28, false},       {12.3, 12.8, 11.4, 7, 25, 45, false}, {31.7, 31.6, 30.9, 4, 33, 41, true},
        {9.2, 50.4, 12.6, 1.4, 5, 40, false},
    };
    double solid = 1e9, hollow = 1e9;
    for (size_t i = 0; i < sizeof body / sizeof *body; i++) {
        double life = (double)(frame - body[i].birth) / (body[i].death - body[i].birth);
        if (life <= 0 || life >= 1) continue;
        double r = body[i].birth < 0 ? body[i].r : body[i].r * 4 * life * (1 - life), d = ball(p, body[i].x, body[i].y, body[i].z, r);
        if (body[i].hollow) hollow = real_min(hollow, d);
        else solid = real_min(solid, d);
    }
    return real_max(solid, -hollow);
}

/* A ball and a torus fly through each other, each at 5 voxels a frame. The ball is larger than the torus's hole. */
static double phi_pass(const double p[3], int frame)
{
    const double at[3] = {128.3 - 5 * frame, 31.6, 31.8};
    return real_min(ball(p, 16.2 + 5 * frame, 34.4, 31.3, 11), torus(p, at, 0, 15, 6));
}

/* From a torus to two balls and back, by blending the distances: handles part, necks break. */
static double phi_morph(const double p[3], int frame)
{
    static const double centre[3] = {31.6, 31.7, 31.8};
    double t = there_and_back(frame, 24);
    double balls = real_min(ball(p, 15.6, 31.4, 31.9, 9), ball(p, 47.8, 31.9, 31.6, 9));
    return (1 - t) * torus(p, centre, 2, 16, 7) + t * balls;
}

/* GI'07 figure 11: a ball falls into a pool, rings run out, a jet rises from the middle and sheds its tip. */
static double phi_splash(const double p[3], int frame)
{
    double r = hypot(p[0] - 23.5, p[1] - 23.5), t = frame - 8; /* from the impact on */
    double wave = t > 0 ? 4.5 * sin(0.45 * t) * exp(-0.04 * t) * cos(0.55 * r - 0.45 * t) * exp(-r / 9) : 0;
    double water = (p[2] - 13 - wave) / 1.5, drop = ball(p, 23.5, 23.5, 29 - 2.1 * frame, 4.2);
    double rise = t > 8 ? 13 * sin(0.17 * (t - 8)) : 0, tip = 10 + rise, neck = 2.6 - 0.17 * (t - 8);
    double jet = real_max(r - neck, p[2] - tip), bead = ball(p, 23.5, 23.5, tip, 3.1);
    double d = frame < 12 ? real_min(water, drop) : water;
    return rise > 0 ? real_min(d, real_min(jet, bead)) : d;
}

/* GI'07 figure 12: a stream is poured into a basin that fills, and breaks up into drops. */
static double phi_pour(const double p[3], int frame)
{
    double r = hypot(p[0] - 19.5, p[1] - 19.5), far = hypot(r, 1);
    double level = 6 + 0.3 * frame + 1.6 * sin(0.7 * far - 0.8 * frame) / (1 + 0.15 * far);
    double stream = r - (4.2 - 0.16 * frame + 1.3 * sin(0.6 * (p[2] + 1.7 * frame)));
    return real_min((p[2] - level) / 1.4, real_max(stream / 1.3, 4 - p[2]));
}

const Scene scene_list[] = {
    {"three", "three balls meet at one frame, and part", {80, 80, 40}, 49, phi_three},
    {"disc", "a hole opens and closes in a plate", {64, 64, 28}, 41, phi_disc},
    {"cavity", "balls and cavities appear and vanish", {64, 64, 64}, 48, phi_cavity},
    {"pass", "a ball and a torus fly through each other at 5 voxels a frame each", {146, 64, 64}, 23, phi_pass},
    {"enright", "Enright's deformation and back", {64, 64, 64}, 61, NULL},
    {"morph", "a torus becomes two balls, and back", {64, 64, 64}, 49, phi_morph},
    {"splash", "a ball falls into a pool, and a jet sheds its tip (GI'07 figure 11)", {48, 48, 40}, 32, phi_splash},
    {"pour", "a stream fills a basin and breaks into drops (GI'07 figure 12)", {40, 40, 40}, 32, phi_pour},
};
const int scene_count = sizeof scene_list / sizeof *scene_list;

const Scene *scene_find(const char *name)
{
    for (int i = 0; i < scene_count; i++)
        if (strcmp(scene_list[i].name, name) == 0) return &scene_list[i];
    return NULL;
}

/* --- Enright's flow --------------------------------------------------------------------------------------------------------- */

/* u(x, t) = U(x) cos(pi t / 3) over the unit cube: the flow over time t is that of U over (3 / pi) sin(pi t / 3), there and
 * back within the period 3. Enright, Fedkiw, Ferziger, Mitchell 2002, section 4; LeVeque 1996. */
static Vec3 enright_velocity(Vec3 p)
{
    double sx = sin(PI * p.x), sy = sin(PI * p.y), sz = sin(PI * p.z);
    double s2x = sin(2 * PI * p.x), s2y = sin(2 * PI * p.y), s2z = sin(2 * PI * p.z);
    return vec3(2 * sx * sx * s2y * s2z, -s2x * sy * sy * s2z, -s2x * s2y * sz * sz);
}

static Vec3 runge_kutta(Vec3 p, double h)
{
    Vec3 a = enright_velocity(p), b = enright_velocity(v_axpy(p, h / 2, a)), c = enright_velocity(v_axpy(p, h / 2, b)), d = enright_velocity(v_axpy(p, h, c));
    return v_axpy(p, h / 6, v_add(v_add(a, d), v_scale(v_add(b, c), 2)));
}

typedef struct EnrightJob {
    SceneRun *run;
    double span; /* of U's flow, from the last frame to this one */
    float *phi;
} EnrightJob;

/* Backwards: the flow of U does not depend on time, so the way back grows frame by frame. */
static void enright_block(void *ctx, int begin, int end)
{
    EnrightJob *job = ctx;
    int side = job->run->n[0], steps = 1 + (int)(fabs(job->span) / 0.02);
    for (int i = begin; i < end; i++) {
        Vec3 *p = &job->run->back[i];
        if (job->run->frame == 0) *p = vec3((i % side + 0.5) / side, (i / side % side + 0.5) / side, (i / (side * side) + 0.5) / side);
        for (int k = 0; k < steps; k++) *p = runge_kutta(*p, -job->span / steps);
        job->phi[i] = (float)((v_dist(*p, vec3(0.35, 0.35, 0.35)) - 0.15) * side);
    }
}

static void enright_sample(SceneRun *run, float *phi)
{
    int last = run->scene->frames - 1;
    double now = run->frame ? 3 / PI * sin(PI * run->frame / last) : 0, before = run->frame ? 3 / PI * sin(PI * (run->frame - 1) / last) : 0;
    parallel_for((int)run->nsample, 4096, enright_block, &(EnrightJob){run, now - before, phi});
}

/* --- sampling --------------------------------------------------------------------------------------------------------------- */

void scene_open(SceneRun *run, const Scene *scene, int side)
{
    *run = (SceneRun){.scene = scene};
    for (int a = 0; a < 3; a++) run->n[a] = side && !scene->phi ? side : scene->side[a];
    run->nsample = (int64_t)run->n[0] * run->n[1] * run->n[2];
    if (!scene->phi) run->back = NEW(Vec3, run->nsample);
}

void scene_close(SceneRun *run)
{
    mem_free(run->back);
    *run = (SceneRun){0};
}

bool scene_next(SceneRun *run, float *phi)
{
    if (run->frame >= run->scene->frames) return false;
    if (!run->scene->phi) enright_sample(run, phi);
    for (int i = 0; run->scene->phi && i < run->nsample; i++) {
        const double p[3] = {i % run->n[0], i / run->n[0] % run->n[1], i / (run->n[0] * run->n[1])};
        phi[i] = (float)run->scene->phi(p, run->frame);
    }
    run->frame++;
    return true;
}

/* --- events ----------------------------------------------------------------------------------------------------------------- */

/* Even in [lo, hi). */
static double draw(uint64_t *state, double lo, double hi)
{
    *state = *state * 6364136223846793005ULL + 1442695040888963407ULL;
    return lo + (hi - lo) * ((double)(hash_mix(*state) >> 11) / 9007199254740992.0);
}

static int draw_int(uint64_t *state, int n) { return int_min((int)draw(state, 0, n), n - 1); }

static Vec3 draw_vector(uint64_t *state, double size)
{
    double x = draw(state, -size, size), y = draw(state, -size, size), z = draw(state, -size, size);
    return vec3(x, y, z);
}

static EventBall draw_ball(uint64_t *s, const Events *e, int k)
{
    static const double speed[] = {0.3, 0.3, 1, 1, 2.5, 5};
    EventBall b = {0};
    double side = int_min(e->n[0], int_min(e->n[1], e->n[2])), u = draw(s, 0, 1);
    b.is_cavity = k > 0 && draw_int(s, 4) == 0;
    b.radius = 1 + (0.3 * side - 1) * (k == 0 ? 0.4 + 0.6 * u : u * u);
    for (int a = 0; a < 3; a++) v_set(&b.centre, a, draw(s, 1, e->n[a] - 2));
    b.velocity = draw_vector(s, speed[draw_int(s, 6)]);
    b.birth = k == 0 ? -5 : draw(s, -8, 9);
    b.death = b.birth + draw(s, 3, k == 0 ? 30 : 18);
    b.sudden = draw_int(s, 3) == 0;
    if (b.is_cavity && draw_int(s, 4)) { /* inside an earlier one, breaking through it, or hollowing it to a shell that bursts */
        const EventBall *host = &e->ball[draw_int(s, 2) ? 0 : draw_int(s, k)];
        bool shell = draw_int(s, 2);
        b.centre = v_add(host->centre, draw_vector(s, (shell ? 0.15 : 0.7) * host->radius));
        b.velocity = v_axpy(host->velocity, shell ? 0.1 : 0.5, b.velocity);
        b.radius = host->radius * (shell ? draw(s, 0.7, 1) : draw(s, 0.2, 0.8));
        if (shell) b.birth = host->birth, b.death = host->death, b.sudden = host->sudden;
    }
    return b;
}

Events events_make(uint64_t seed)
{
    static const double voxel[] = {1, 1, 0.1, 1.0 / 128}, place[] = {0, 0, 10.25, -300};
    Events e = {.seed = seed, .unit = 1, .edge_vox = 1.5};
    uint64_t s = hash_mix(seed + 1);
    for (int a = 0; a < 3; a++) e.n[a] = 24 + draw_int(&s, 17);
    e.blend = draw_int(&s, 2) ? draw(&s, 0.5, 4) : 0;
    e.noise = draw_int(&s, 10) == 0 ? draw(&s, 0.05, 0.6) : 0;
    e.steps = draw_int(&s, 6) == 0 ? 1 + draw_int(&s, 8) : 0;
    e.clamp = draw_int(&s, 4) == 0 ? draw(&s, 1, 5) : 0;
    double size = voxel[draw_int(&s, 4)], t = place[draw_int(&s, 4)];
    e.xform = (Affine){.m = {{size, 0, 0}, {0, size, 0}, {0, 0, size}}, .t = vec3(t, -t * size, t / 3)};
    affine_invert(&e.xform);
    if (draw_int(&s, 2)) e.unit = size;
    int edge = draw_int(&s, 8);
    if (edge < 2) e.edge_vox = edge ? 1 : 2.5;
    e.nball = 6 + draw_int(&s, EVENTS_BALLS_MAX - 5);
    for (int k = 0; k < e.nball; k++) e.ball[k] = draw_ball(&s, &e, k);
    e.carried = draw_int(&s, 4) == 0;
    return e;
}

int events_samples(const Events *e) { return e->n[0] * e->n[1] * e->n[2]; }

/* Distance to the ball's surface at a frame; false when it is not there. */
static bool ball_phi(const EventBall *b, int frame, Vec3 p, double *phi)
{
    double life = (frame - b->birth) / (b->death - b->birth);
    if (!(life > 0 && life < 1)) return false;
    double r = b->sudden ? b->radius : b->radius * 4 * life * (1 - life);
    *phi = v_dist(p, v_axpy(b->centre, frame, b->velocity)) - r;
    return true;
}

static double events_phi(const Events *e, int frame, Vec3 p)
{
    double phi = e->n[0], d;
    for (int k = 0; k < e->nball; k++)
        if (!e->ball[k].is_cavity && ball_phi(&e->ball[k], frame, p, &d)) phi = smooth_min(phi, d, e->blend);
    for (int k = 0; k < e->nball; k++)
        if (e->ball[k].is_cavity && ball_phi(&e->ball[k], frame, p, &d)) phi = smooth_max(phi, -d, e->blend);
    return phi;
}

void events_sample(const Events *e, int frame, float *phi)
{
    for (int i = 0; i < events_samples(e); i++) {
        uint64_t s = hash_mix(e->seed * 1000003 + (uint64_t)i);
        double v = events_phi(e, frame, vec3(i % e->n[0], i / e->n[0] % e->n[1], i / (e->n[0] * e->n[1])));
        if (e->noise > 0) v += draw(&s, -e->noise, e->noise);
        if (e->steps) v = rint(v * e->steps) / e->steps;
        if (e->clamp > 0) v = real_clamp(v, -e->clamp, e->clamp);
        phi[i] = (float)(v * e->unit);
    }
}

Grid events_grid(const Events *e, int frame)
{
    Grid g;
    float *phi = NEW(float, events_samples(e));
    events_sample(e, frame, phi);
    grid_init(&g, 1);
    grid_from_dense(&g, phi, e->n);
    g.xform = e->xform;
    mem_free(phi);
    return g;
}

Grid events_velocity(const Events *e, double fps)
{
    Grid g;
    grid_init(&g, 3);
    for (int a = 0; a < 3; a++) g.background[a] = (float)(v_get(e->ball[0].velocity, a) * e->xform.m[a][a] * fps);
    return g;
}
