/* The active skin: what GI'98 says it does, in figures. */
#include "fields.h"
#include "skin/skin_priv.h"
#include "topology/iso.h"

#include <stdlib.h>

#define PI 3.14159265358979323846

static const SkinLattice UNIT = {.voxel = 1};

static SkinTarget *target_of(const SkinLattice *l, int n, FieldFn *fn, const double *k)
{
    Field f = field_of(n, fn, k);
    Err err;
    SkinTarget *t = skin_target_field(l, &f, &err);
    if (!t) fail_msg("%s", err.text);
    field_free(&f);
    return t;
}

static Grid grid_of_skin(const Skin *s)
{
    Grid g;
    grid_init(&g, 1);
    skin_to_grid(s, &g);
    return g;
}

/* --- what the surface does --------------------------------------------------------------------------------------------- */

typedef void CrossingFn(void *ctx, const Grid *g, const int at[3], int axis, double t);

/* Each edge that the surface crosses, at t of the way from a sample to the next one along the axis. */
static void each_crossing(const Grid *g, CrossingFn *fn, void *ctx)
{
    for (int b = 0; b < g->nblock; b++)
        for (int i = 0; i < 3 * GRID_CELLS; i++) {
            int c = i / 3, axis = i % 3;
            const int at[3] = {g->origin[b][0] + (c & 7), g->origin[b][1] + (c >> 3 & 7), g->origin[b][2] + (c >> 6)};
            double v0 = grid_at(g, at[0], at[1], at[2], 0), v1 = grid_at(g, at[0] + (axis == 0), at[1] + (axis == 1), at[2] + (axis == 2), 0);
            if ((v0 < 0) != (v1 < 0)) fn(ctx, g, at, axis, v0 / (v0 - v1));
        }
}

typedef struct Figures {
    const Grid *before;
    const Field *target;
    int n, cap;
    double *value; /* voxels */
} Figures;

static void add_figure(Figures *f, double x)
{
    RESERVE(f->value, f->cap, f->n + 1);
    f->value[f->n++] = x;
}

static void add_motion(void *ctx, const Grid *g, const int at[3], int axis, double t)
{
    Figures *f = ctx;
    double v0 = grid_at(f->before, at[0], at[1], at[2], 0), v1 = grid_at(f->before, at[0] + (axis == 0), at[1] + (axis == 1), at[2] + (axis == 2), 0);
    add_figure(f, fabs(v0 + t * (v1 - v0)) / g->xform.m[0][0]);
}

static void add_distance(void *ctx, const Grid *g, const int at[3], int axis, double t)
{
    Figures *f = ctx;
    Vec3 p = vec3(at[0], at[1], at[2]);
    v_set(&p, axis, at[axis] + t);
    add_figure(f, field_distance_vox(f->target, affine_to_world(&g->xform, p)));
}

static int compare_reals(const void *a, const void *b) { return *(const double *)a < *(const double *)b ? -1 : *(const double *)a > *(const double *)b; }

/* The value that a share of the figures lies below; frees them. */
static double share(Figures *f, double part)
{
    assert_true(f->n > 50);
    qsort(f->value, (size_t)f->n, sizeof *f->value, compare_reals);
    double x = f->value[(int)((f->n - 1) * part)];
    mem_free(f->value);
    return x;
}

/* The farthest that the surface went in a frame, voxels. */
static double motion(Skin *s, const SkinTarget *t, double part)
{
    Grid before = grid_of_skin(s);
    skin_move(s, t, 1);
    Grid after = grid_of_skin(s);
    Figures f = {.before = &before};
    each_crossing(&after, add_motion, &f);
    grid_free(&before);
    grid_free(&after);
    return share(&f, part);
}

static int components(const Skin *s)
{
    Grid g = grid_of_skin(s);
    Field f;
    Err err;
    IsoSurface iso;
    assert_true(field_build(&f, &g, &(FieldSpec){.inside_below = true}, &err));
    iso_build(&iso, &f);
    int n = iso.ncomp;
    iso_free(&iso);
    field_free(&f);
    grid_free(&g);
    return n;
}

static double radius_of(SkinStat s) { return cbrt(3 * s.volume / (4 * PI)); }

/* --- motion strategies --------------------------------------------------------------------------------------------------- */

/* dR/dt = -2 beta / R. */
static void a_ball_shrinks_under_tension(void **state)
{
    (void)state;
    static const double ball[] = {20.3, 20.1, 19.8, 14}, beta = 0.1, beta_vox = 9 * 0.1;
    SkinTarget *t = target_of(&UNIT, 40, fn_ball, ball);
    Skin *s = skin_begin(&UNIT, &(SkinSettings){.beta = beta}, t);
    double before = radius_of(skin_move(s, t, 1));
    for (int i = 0; i < 20; i++) {
        double after = radius_of(skin_move(s, t, 1)), want = before - sqrt(before * before - 4 * beta_vox);
        if (getenv("TWINMESH_TOLD")) print_message("R %.4f: %.5f of the way\n", after, (before - after) / want);
        assert_true(fabs((before - after) / want - 1) < 0.02);
        before = after;
    }
    skin_end(s);
    skin_target_free(t);
}

/* A tenth of a droplet of a voxel's radius is all that is left of it: no trouble on the way out. */
static void a_ball_vanishes_under_tension(void **state)
{
    (void)state;
    static const double ball[] = {12.3, 12.1, 11.8, 4};
    SkinTarget *t = target_of(&UNIT, 24, fn_ball, ball);
    Skin *s = skin_begin(&UNIT, &(SkinSettings){.beta = 0.4}, t);
    SkinStat stat = {0};
    for (int i = 0; i < 4; i++) stat = skin_move(s, t, 1);
    assert_true(stat.bricks == 0 && stat.volume == 0);
    Grid g = grid_of_skin(s);
    assert_true(g.nblock == 0 && !skin_is_inside(s, vec3(12, 12, 12)));
    grid_free(&g);
    skin_end(s);
    skin_target_free(t);
}

/* Section 4.3: at rest without oscillation; and on the target's own surface. */
static void the_skin_comes_to_rest_on_the_target(void **state)
{
    (void)state;
    static const double balls[] = {14.3, 20.1, 19.8, 9, 26.1, 20.4, 20.2, 7}, torus[] = {20.2, 19.7, 20.4, 11, 5}, octahedron[] = {20.2, 19.7, 20.4, 13};
    static const struct {
        FieldFn *fn;
        const double *k;
    } shapes[] = {{fn_two_balls, balls}, {fn_torus, torus}, {fn_octahedron, octahedron}};
    static const SkinLattice lattices[] = {{{0, 0, 0}, 1}, {{0.3, -0.2, 0.45}, 0.8}};
    for (int i = 0; i < 6; i++) {
        const SkinLattice *l = &lattices[i % 2];
        Field f = field_of(40, shapes[i / 2].fn, shapes[i / 2].k);
        SkinTarget *t = target_of(l, 40, shapes[i / 2].fn, shapes[i / 2].k);
        Skin *s = skin_begin(l, &(SkinSettings){.alpha = 2}, t);
        skin_move(s, t, 8);
        double moved = motion(s, t, 1);
        Grid g = grid_of_skin(s);
        Figures d = {.target = &f};
        each_crossing(&g, add_distance, &d);
        double away = share(&d, 0.99);
        if (getenv("TWINMESH_TOLD")) print_message("shape %d: motion %.5f, distance %.5f voxels\n", i, moved, away);
        assert_true(moved <= 0.01);
        assert_true(away <= 0.1);
        grid_free(&g);
        skin_end(s);
        skin_target_free(t);
        field_free(&f);
    }
}

/* From elsewhere, inflating and deflating, and under tension: it stays where the two balance. */
static void the_skin_comes_to_rest_from_elsewhere(void **state)
{
    (void)state;
    static const double small[] = {20.3, 20.1, 19.8, 6}, torus[] = {20.2, 19.7, 20.4, 11, 5}, ball[] = {20.2, 19.7, 20.4, 13};
    SkinTarget *start = target_of(&UNIT, 40, fn_torus, torus), *other = target_of(&UNIT, 40, fn_ball, small), *t = target_of(&UNIT, 40, fn_ball, ball);
    for (int i = 0; i < 2; i++) {
        Skin *s = skin_begin(&UNIT, &(SkinSettings){.alpha = 2, .beta = i * 0.05}, i ? start : other);
        skin_move(s, t, 12);
        assert_true(motion(s, t, 1) <= 0.01);
        assert_int_equal(components(s), 1);
        /* alpha (R0 - R) = 2 beta / R, bands */
        double R0 = 13.0 / 3, R = 0.5 * (R0 + sqrt(R0 * R0 - 8 * i * 0.05 / 2)), got = radius_of(skin_move(s, t, 1)) / 3;
        if (getenv("TWINMESH_TOLD")) print_message("R %.4f, to be %.4f voxels\n", 3 * got, 3 * R);
        assert_true(fabs(got - R) < 0.03 / 3);
        skin_end(s);
    }
    skin_target_free(start);
    skin_target_free(other);
    skin_target_free(t);
}

/* Section 5. */
static void volume_and_area_are_kept(void **state)
{
    (void)state;
    static const double octahedron[] = {20.2, 19.7, 20.4, 15}, ball[] = {20.2, 19.7, 20.4, 12};
    for (int i = 0; i < 2; i++) {
        SkinTarget *t = target_of(&UNIT, 40, i ? fn_ball : fn_octahedron, i ? ball : octahedron);
        SkinSettings keep = {.beta = 0.1, .gamma = 20, .keep = i ? KEEP_AREA : KEEP_VOLUME};
        Extent before = band_measure(&t->band);
        Skin *s = skin_begin(&UNIT, &keep, t);
        SkinStat stat = {0};
        for (int k = 0; k < (i ? 30 : 100); k++) stat = skin_move(s, t, 1);
        double ratio = i ? stat.area / (9 * before.area) : stat.volume / (27 * before.volume);
        if (getenv("TWINMESH_TOLD")) print_message("kept %.5f, area / volume^(2/3) of a ball's %.5f\n", ratio, stat.area / pow(stat.volume, 2.0 / 3) / cbrt(36 * PI));
        assert_true(fabs(ratio - 1) < 0.01);
        assert_true(stat.area / pow(stat.volume, 2.0 / 3) < 1.01 * cbrt(36 * PI)); /* and the octahedron is a ball by now */
        skin_end(s);
        skin_target_free(t);
    }
}

/* Section 3.4: the target jumps, the skin does not. */
static void levels_of_detail_do_not_pop(void **state)
{
    (void)state;
    enum { FINE = 8, COARSE = 4 };
    static Vec3 fine[FINE * FINE * FINE], coarse[COARSE * COARSE * COARSE];
    for (int i = 0; i < FINE * FINE * FINE; i++) fine[i] = v_scale(vec3(i % FINE + 0.5, i / FINE % FINE + 0.5, i / FINE / FINE + 0.5), 2);
    for (int i = 0; i < COARSE * COARSE * COARSE; i++) coarse[i] = v_scale(vec3(i % COARSE + 0.5, i / COARSE % COARSE + 0.5, i / COARSE / COARSE + 0.5), 4);
    Err err;
    SkinTarget *a = skin_target_points(&UNIT, &(SkinPoints){.n = FINE * FINE * FINE, .place = fine, .common = 2}, SKIN_BLOB, NULL, &err);
    SkinTarget *b = skin_target_points(&UNIT, &(SkinPoints){.n = COARSE * COARSE * COARSE, .place = coarse, .common = 4}, SKIN_BLOB, NULL, &err);
    assert_true(a && b);
    double most[2];
    for (int i = 0; i < 2; i++) { /* as the coating does it geometrically, and with the paper's alpha over 24 frames */
        Skin *s = skin_begin(&UNIT, &(SkinSettings){.alpha = i ? 2.0 / 24 : 50, .beta = 0.02 * 2 / 24}, a);
        skin_move(s, a, 4);
        most[i] = motion(s, b, 1);
        double before = most[i];
        for (int k = 0; i && k < 6; k++) { /* on its way without a leap */
            double now = motion(s, b, 1);
            assert_true(now < 1.05 * before);
            before = now;
        }
        if (getenv("TWINMESH_TOLD")) print_message("switch of detail: %.3f voxels in a frame\n", most[i]);
        skin_end(s);
    }
    assert_true(most[0] > 1);
    assert_true(most[1] < 0.15 * most[0]);
    skin_target_free(a);
    skin_target_free(b);
}

/* --- topology --------------------------------------------------------------------------------------------------------------- */

static void a_metamorphosis_changes_topology(void **state)
{
    (void)state;
    static const double torus[] = {20.2, 19.7, 20.4, 11, 5}, balls[] = {10.3, 20.1, 19.8, 7, 30.1, 20.4, 20.2, 6};
    SkinTarget *one = target_of(&UNIT, 40, fn_torus, torus), *two = target_of(&UNIT, 40, fn_two_balls, balls);
    Skin *s = skin_begin(&UNIT, &(SkinSettings){.alpha = 2, .beta = 0.01}, one);
    assert_int_equal(components(s), 1);
    for (int i = 0; i < 8; i++) skin_move(s, two, 1);
    assert_int_equal(components(s), 2);
    for (int i = 0; i < 10; i++) skin_move(s, one, 1);
    assert_int_equal(components(s), 1);
    Grid g = grid_of_skin(s);
    assert_true(skin_is_inside(s, vec3(31, 20, 20)) && !skin_is_inside(s, vec3(20, 20, 20)));
    grid_free(&g);
    skin_end(s);
    skin_target_free(one);
    skin_target_free(two);
}

/* Eq. 3 alone never finds what the skin does not touch. */
static void what_appears_is_born(void **state)
{
    (void)state;
    static const double ball[] = {12.3, 20.1, 19.8, 8}, far[] = {12.3, 20.1, 19.8, 8, 30.1, 20.4, 20.2, 4}, cavity[] = {20.2, 19.7, 20.4, 15, 5},
                        full[] = {20.2, 19.7, 20.4, 15}, speck[] = {12.3, 20.1, 19.8, 8, 30.1, 20.4, 20.2, 1.7};
    const struct {
        FieldFn *from, *to;
        const double *a, *b;
        double beta;
        int born, components;
    } cases[] = {
        {fn_ball, fn_two_balls, ball, far, 0.01, 1, 2},
        {fn_ball, fn_cavity, full, cavity, 0.01, 1, 2},
        {fn_cavity, fn_ball, cavity, full, 0.01, 0, 1},
        {fn_ball, fn_two_balls, ball, speck, 0.01, 1, 2},
        {fn_ball, fn_two_balls, ball, speck, 0.1, 0, 1}, /* the tension would take it at once */
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        SkinTarget *a = target_of(&UNIT, 40, cases[i].from, cases[i].a), *b = target_of(&UNIT, 40, cases[i].to, cases[i].b);
        Skin *s = skin_begin(&UNIT, &(SkinSettings){.alpha = 2, .beta = cases[i].beta}, a);
        assert_int_equal(skin_move(s, a, 1).born, 0);
        assert_int_equal(skin_move(s, b, 1).born, cases[i].born);
        for (int k = 0; k < 6; k++) assert_int_equal(skin_move(s, b, 1).born, 0);
        assert_int_equal(components(s), cases[i].components);
        skin_end(s);
        skin_target_free(a);
        skin_target_free(b);
    }
}

/* A target without a surface takes the skin away, and one with a surface brings it back. */
static void an_empty_target_is_followed_too(void **state)
{
    (void)state;
    static const double ball[] = {12.3, 12.1, 11.8, 6}, none[] = {12, 12, 12, -50};
    SkinTarget *a = target_of(&UNIT, 24, fn_ball, ball), *b = target_of(&UNIT, 24, fn_ball, none);
    Skin *s = skin_begin(&UNIT, &(SkinSettings){.alpha = 2, .beta = 0.01, .gamma = 20, .keep = KEEP_VOLUME}, b);
    assert_int_equal(skin_move(s, b, 1).bricks, 0);
    assert_int_equal(skin_move(s, a, 1).born, 1);
    for (int i = 0; i < 6; i++) skin_move(s, a, 1);
    assert_int_equal(components(s), 1);
    SkinStat stat = {0};
    for (int i = 0; i < 6; i++) stat = skin_move(s, b, 1);
    assert_int_equal(stat.bricks, 0);
    skin_end(s);
    skin_target_free(a);
    skin_target_free(b);
}

/* --- the band --------------------------------------------------------------------------------------------------------------- */

/* A ball's distance bent out of shape; the zero stays. */
static double fn_bent(const double *k, Vec3 p)
{
    double d = fn_ball(k, p);
    return d * (1 + 0.3 * sin(0.35 * p.x) * cos(0.3 * p.y)) * (1 + 0.05 * d);
}

static void redistancing_leaves_the_surface(void **state)
{
    (void)state;
    static const double ball[] = {20.3, 20.1, 19.8, 13};
    SkinTarget *t = target_of(&UNIT, 40, fn_ball, ball);
    Band *b = &t->band;
    for (int i = 0; i < b->n; i++)
        for (int c = 0; c < CELLS; c++) {
            float *v = &b->value[(size_t)i * CELLS + (size_t)c];
            double bent = fn_bent(ball, vec3(8 * b->at[i][0] + (c & 7), 8 * b->at[i][1] + (c >> 3 & 7), 8 * b->at[i][2] + (c >> 6))) / 3;
            *v = (float)real_clamp(bent, -1, 1);
        }
    Extent before = band_measure(b);
    for (int k = 0; k < 40; k++) band_redistance(b, 4);
    Extent after = band_measure(b);
    double worst = 0, moved = (cbrt(after.volume) - cbrt(before.volume)) * cbrt(3 / (4 * PI)) * 3;
    for (int i = 0; i < b->n; i++)
        for (int c = 0; c < CELLS; c++) {
            double v = (double)b->value[(size_t)i * CELLS + (size_t)c];
            double d = fn_ball(ball, vec3(8 * b->at[i][0] + (c & 7), 8 * b->at[i][1] + (c >> 3 & 7), 8 * b->at[i][2] + (c >> 6)));
            worst = real_max(worst, fabs(3 * v - real_clamp(d, -3, 3)));
        }
    if (getenv("TWINMESH_TOLD")) print_message("40 times: the surface went %.5f voxels, distances are wrong by %.5f at most\n", moved, worst);
    assert_true(fabs(moved) < 0.005);
    assert_true(worst < 0.1);
    skin_target_free(t);
}

/* What band_update promises, and a grid that is a level set: slope 1, a band of 3 voxels, tiles within. */
static void the_grid_is_a_narrow_band(void **state)
{
    (void)state;
    static const double ball[] = {36.3, 36.1, 35.8, 30};
    const SkinLattice l = {.voxel = 0.5};
    Field f = field_of(72, fn_ball, ball);
    Err err;
    SkinTarget *t = skin_target_field(&l, &f, &err);
    Skin *s = skin_begin(&l, &(SkinSettings){.alpha = 2, .beta = 0.01}, t);
    skin_move(s, t, 4);
    Grid g = grid_of_skin(s);
    assert_true(g.background[0] == 1.5f && g.narrow && g.ntile > 100 && g.nblock > 500);
    int active = 0;
    for (int b = 0; b < g.nblock; b++)
        for (int c = 0; c < GRID_CELLS; c++) {
            float v = g.value[(size_t)b * GRID_CELLS + (size_t)c];
            Vec3 p = vec3(g.origin[b][0] + (c & 7), g.origin[b][1] + (c >> 3 & 7), g.origin[b][2] + (c >> 6));
            double d = v_dist(v_scale(p, 0.5), vec3(36.3, 36.1, 35.8)) - 30;
            assert_true(fabs((double)v - real_clamp(d, -1.5, 1.5)) < 0.03);
            active += fabsf(v) < 1.5f;
        }
    double want = 4 * PI * 60 * 60 * 6; /* samples within 3 voxels */
    assert_true(fabs(active / want - 1) < 0.02);
    assert_true(g.nblock < 4 * want / GRID_CELLS);
    for (int i = 0; i < 2000; i++) {
        Vec3 p = vec3(i % 13 * 6.1, i / 13 % 13 * 6.2, i / 169 * 6.3);
        double d = v_dist(p, vec3(36.3, 36.1, 35.8)) - 30;
        if (fabs(d) > 0.5) assert_int_equal(skin_is_inside(s, p), d < 0);
        int at[3] = {(int)(2 * p.x + 0.5), (int)(2 * p.y + 0.5), (int)(2 * p.z + 0.5)};
        if (fabs(d) > 0.5) assert_int_equal(grid_at(&g, at[0], at[1], at[2], 0) < 0, d < 0);
    }
    grid_free(&g);
    skin_end(s);
    skin_target_free(t);
    field_free(&f);
}

/* --- particles --------------------------------------------------------------------------------------------------------------- */

static void a_particle_is_a_ball_of_its_radius(void **state)
{
    (void)state;
    Err err;
    static const Vec3 place[] = {{10.2, 9.9, 10.4}, {40.1, 10.2, 9.7}};
    static const float radius[] = {6, 4};
    for (int kernel = SKIN_BLOB; kernel <= SKIN_BALL; kernel++) {
        SkinTarget *t = skin_target_points(&UNIT, &(SkinPoints){.n = 2, .place = place, .radius = radius}, (SkinKernel)kernel, NULL, &err);
        Skin *s = skin_begin(&UNIT, &(SkinSettings){.alpha = 2}, t);
        SkinStat stat = skin_move(s, t, 6);
        assert_true(fabs(stat.volume / (4 * PI / 3 * (6 * 6 * 6 + 4 * 4 * 4)) - 1) < 0.02);
        assert_int_equal(components(s), 2);
        assert_true(skin_is_inside(s, place[0]) && skin_is_inside(s, place[1]) && !skin_is_inside(s, vec3(25, 10, 10)));
        skin_end(s);
        skin_target_free(t);
    }
}

/* Solvers that keep particles near the surface alone say by a grid where the rest is. */
static void particles_and_a_grid_are_one_target(void **state)
{
    (void)state;
    Err err;
    static const double ball[] = {20.2, 19.7, 20.4, 13};
    static const Vec3 place[] = {{34, 20, 20}, {20, 20, 20}};
    Field f = field_of(40, fn_ball, ball);
    SkinTarget *t = skin_target_points(&UNIT, &(SkinPoints){.n = 2, .place = place, .common = 5}, SKIN_BALL, &f, &err);
    Skin *s = skin_begin(&UNIT, &(SkinSettings){.alpha = 2}, t);
    skin_move(s, t, 6);
    assert_int_equal(components(s), 1);
    assert_true(skin_is_inside(s, vec3(38, 20, 20)) && skin_is_inside(s, vec3(8, 20, 20)) && skin_is_inside(s, vec3(27, 20, 20)));
    assert_true(!skin_is_inside(s, vec3(34, 28, 20)));
    skin_end(s);
    skin_target_free(t);
    field_free(&f);
}

static void targets_out_of_reach_are_refused(void **state)
{
    (void)state;
    Err err = {0};
    const Vec3 place[] = {{1e9, 0, 0}};
    assert_null(skin_target_points(&UNIT, &(SkinPoints){.n = 1, .place = place, .common = 1}, SKIN_BALL, NULL, &err));
    assert_int_equal(err.code, ERR_RESOURCE);
    const Vec3 near[] = {{0, 0, 0}};
    assert_null(skin_target_points(&(SkinLattice){.voxel = 1e-4}, &(SkinPoints){.n = 1, .place = near, .common = 1}, SKIN_BALL, NULL, &err));
    assert_int_equal(err.code, ERR_RESOURCE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ball_shrinks_under_tension),
        cmocka_unit_test(a_ball_vanishes_under_tension),
        cmocka_unit_test(the_skin_comes_to_rest_on_the_target),
        cmocka_unit_test(the_skin_comes_to_rest_from_elsewhere),
        cmocka_unit_test(volume_and_area_are_kept),
        cmocka_unit_test(levels_of_detail_do_not_pop),
        cmocka_unit_test(a_metamorphosis_changes_topology),
        cmocka_unit_test(what_appears_is_born),
        cmocka_unit_test(an_empty_target_is_followed_too),
        cmocka_unit_test(redistancing_leaves_the_surface),
        cmocka_unit_test(the_grid_is_a_narrow_band),
        cmocka_unit_test(a_particle_is_a_ball_of_its_radius),
        cmocka_unit_test(particles_and_a_grid_are_one_target),
        cmocka_unit_test(targets_out_of_reach_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
