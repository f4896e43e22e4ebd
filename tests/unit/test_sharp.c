/* Sharp features (eq. 4) on a cube and on the ball of the 1-norm, with an analytic landing. */
#include "mechanics/mechanics_priv.h"
#include "mechanics_shapes.h"

typedef enum Solid { CUBE, BALL1 } Solid;

/* F outside positive here: the distance to the nearest face's plane, and that face's outward normal. */
static double solid_distance(Solid solid, Vec3 p, Vec3 *normal)
{
    double a = fabs(p.x), b = fabs(p.y), c = fabs(p.z);
    Vec3 sign = vec3(p.x < 0 ? -1 : 1, p.y < 0 ? -1 : 1, p.z < 0 ? -1 : 1);
    if (solid == BALL1) {
        *normal = v_unit(sign);
        return (a + b + c - 1) / sqrt(3.0);
    }
    *normal = a >= b && a >= c ? vec3(sign.x, 0, 0) : b >= c ? vec3(0, sign.y, 0) : vec3(0, 0, sign.z);
    return real_max(a, real_max(b, c)) - 1;
}

/* The distance along the surface to the nearest ridge. */
static double ridge_distance(Solid solid, Vec3 p)
{
    double a = fabs(p.x), b = fabs(p.y), c = fabs(p.z);
    double least = real_min(a, real_min(b, c)), most = real_max(a, real_max(b, c));
    return solid == CUBE ? 1 - (a + b + c - least - most) : least * sqrt(1.5);
}

static void land(Solid solid, Vec3 *p)
{
    Vec3 n;
    for (int i = 0; i < 40; i++) {
        double d = solid_distance(solid, *p, &n);
        if (fabs(d) < 1e-13) return;
        *p = v_axpy(*p, -d, n);
    }
}

/* A ball blown up to the solid, shaken so that no vertex is on a ridge by symmetry. */
static Shape solid_make(Solid solid)
{
    Shape s = shape_sphere(3);
    uint64_t seed = 11;
    for (int v = 0; v < s.nvert; v++) {
        Vec3 p = v_add(s.pos[v], v_scale(shape_noise3(&seed), 0.05)), c = vec3(0.8, 0.6, 0);
        p = vec3(c.x * p.x - c.y * p.y, c.y * p.x + c.x * p.y, p.z); /* turned against the solid's ridges */
        p = vec3(p.x, c.x * p.y - c.y * p.z, c.y * p.y + c.x * p.z);
        double size = fabs(p.x) + fabs(p.y) + fabs(p.z), a = real_max(fabs(p.x), real_max(fabs(p.y), fabs(p.z)));
        s.pos[v] = v_scale(p, 1 / (solid == BALL1 ? size : a));
    }
    return s;
}

typedef struct Outcome {
    double ridge;    /* mean distance to the ridge of the nearer end of the edges that cross one, in edges */
    double last;     /* longest move of the last step, in edges */
    int inverted;
} Outcome;

static double crossing_mean(Solid solid, const Shape *s)
{
    double sum = 0;
    int count = 0;
    for (int h = 0; h < 3 * s->ntri; h++) {
        Vec3 a = s->pos[s->tri[h]], b = s->pos[s->tri[h % 3 == 2 ? h - 2 : h + 1]], na, nb;
        solid_distance(solid, a, &na);
        solid_distance(solid, b, &nb);
        if (v_dot(na, nb) > 0.9) continue;
        sum += real_min(ridge_distance(solid, a), ridge_distance(solid, b));
        count++;
    }
    return count ? sum / count : 0;
}

static Outcome relax(Solid solid, bool sharp, int steps)
{
    Shape s = solid_make(solid);
    Vec3 *normal = NEW(Vec3, s.nvert), *dx = NEW(Vec3, s.nvert), *tri_normal = NEW(Vec3, s.ntri);
    uint8_t *inverted = NEW(uint8_t, s.ntri);
    double edge = shape_mean_edge(&s);
    MechanicsSettings set = mechanics_defaults();
    set.rest = edge / 1.4;
    set.cg_iterations = 10;
    set.cg_tolerance = 0;
    set.sharp = sharp;
    Mechanics mech = {0};
    Outcome out = {0};
    for (int step = 0; step < steps; step++) {
        for (int v = 0; v < s.nvert; v++) solid_distance(solid, s.pos[v], &normal[v]);
        out.inverted = 0;
        for (int t = 0; t < s.ntri; t++) {
            const int32_t *c = s.tri + 3 * t;
            Vec3 p[3] = {s.pos[c[0]], s.pos[c[1]], s.pos[c[2]]}, n = v_area2(p[0], p[1], p[2]);
            solid_distance(solid, v_scale(v_add(v_add(p[0], p[1]), p[2]), 1.0 / 3), &tri_normal[t]);
            inverted[t] = v_dot(n, normal[c[0]]) < 0 && v_dot(n, normal[c[1]]) < 0 && v_dot(n, normal[c[2]]) < 0;
            out.inverted += inverted[t];
        }
        MechanicsProblem prob = {.nvert = s.nvert, .ntri = s.ntri, .pos = s.pos, .tri = s.tri, .normal = normal,
                                 .tri_normal = tri_normal, .inverted = inverted};
        mechanics_step(&mech, &set, &prob, dx);
        out.last = 0;
        for (int v = 0; v < s.nvert; v++) {
            out.last = real_max(out.last, v_len(dx[v]) / edge);
            s.pos[v] = v_add(s.pos[v], dx[v]);
            land(solid, &s.pos[v]);
        }
    }
    out.ridge = crossing_mean(solid, &s) / edge;
    mechanics_free(&mech);
    mem_free(normal);
    mem_free(dx);
    mem_free(tri_normal);
    mem_free(inverted);
    shape_free(&s);
    return out;
}

static void check_ridges(Solid solid)
{
    Outcome without = relax(solid, false, 20), with = relax(solid, true, 20);
    print_message("    ridge distance %.2g edges (unconstrained %.2g), last move %.2g (%.2g)\n", with.ridge,
                  without.ridge, with.last, without.last);
    assert_true(without.ridge > 0.05);
    assert_true(with.ridge < 0.02 * without.ridge);
    assert_int_equal(with.inverted, 0);
    /* the skin comes to rest; without the constraint it hops from face to face for ever */
    assert_true(with.last < 0.5 && with.last < 0.5 * without.last);
}

static void vertices_move_to_the_ridges_of_a_cube(void **state)
{
    (void)state;
    check_ridges(CUBE);
}

static void vertices_move_to_the_ridges_of_the_1_norm_ball(void **state)
{
    (void)state;
    check_ridges(BALL1);
}

/* A smooth field has no sharp vertices: the same bytes with the constraint and without. */
static void smooth_vertices_are_untouched(void **state)
{
    (void)state;
    Shape s = shape_sphere(3);
    Vec3 *on = NEW(Vec3, s.nvert), *off = NEW(Vec3, s.nvert), *m = NEW(Vec3, s.ntri);
    for (int t = 0; t < s.ntri; t++) {
        const int32_t *c = s.tri + 3 * t;
        m[t] = v_unit(v_add(v_add(s.pos[c[0]], s.pos[c[1]]), s.pos[c[2]]));
    }
    MechanicsSettings set = mechanics_defaults();
    set.rest = 0.5 * shape_mean_edge(&s);
    MechanicsProblem prob = {.nvert = s.nvert, .ntri = s.ntri, .pos = s.pos, .tri = s.tri, .normal = s.pos,
                             .tri_normal = m};
    Mechanics mech = {0};
    set.sharp = true;
    mechanics_step(&mech, &set, &prob, on);
    set.sharp = false;
    mechanics_step(&mech, &set, &prob, off);
    assert_memory_equal(on, off, (size_t)s.nvert * sizeof *on);
    mechanics_free(&mech);
    mem_free(on);
    mem_free(off);
    mem_free(m);
    shape_free(&s);
}

/* Eq. 4 is 0 where every triangle already faces as its field: even the eight triangles of an octahedral droplet, whose
 * vertices stay free in their tangent planes. */
static void aligned_triangles_need_no_correction(void **state)
{
    (void)state;
    Shape s = shape_sphere(0);
    Vec3 m[8], x[7] = {{0}};
    for (int t = 0; t < 8; t++) {
        const int32_t *c = s.tri + 3 * t;
        m[t] = v_unit(v_add(v_add(s.pos[c[0]], s.pos[c[1]]), s.pos[c[2]]));
    }
    MechanicsSettings set = mechanics_defaults();
    MechanicsProblem prob = {.nvert = 6, .ntri = 8, .pos = s.pos, .tri = s.tri, .normal = s.pos, .tri_normal = m};
    Elastic el = {0};
    Sharp sh = {0};
    elastic_build(&el, &set, &prob, false);
    sharp_build(&sh, &el);
    assert_int_equal(sh.nvert, 6);
    assert_int_equal(sh.kind[0], SHARP_ROUND);
    sharp_correct(&sh, &el, x);
    for (int v = 0; v < 6; v++) assert_near(v_len(x[v]), 0, 1e-15);
    /* one vertex pulled out along a face: drawn back towards the planes of the others */
    x[0] = vec3(0.2, 0, 0);
    Vec3 before = x[0];
    sharp_correct(&sh, &el, x);
    assert_true(x[0].x < before.x);
    sharp_free(&sh);
    elastic_free(&el);
    shape_free(&s);
}

/* A roof, ridge along y, one vertex on it: slides along y only; with an inverted triangle beside it, freely. */
static void ridge_vertex_slides_along_the_ridge(void **state)
{
    (void)state;
    Vec3 pos[7] = {{0, 0, 1}, {0, -1, 1}, {1, -0.5, 0}, {1, 0.5, 0}, {0, 1, 1}, {-1, 0.5, 0}, {-1, -0.5, 0}};
    int32_t tri[18];
    Vec3 normal[7], m[6];
    uint8_t inverted[6] = {0}, frozen[7] = {0, 1, 1, 1, 1, 1, 1};
    double half = sqrt(0.5);
    for (int t = 0; t < 6; t++) {
        tri[3 * t] = 0;
        tri[3 * t + 1] = 1 + t;
        tri[3 * t + 2] = 1 + (t + 1) % 6;
        m[t] = vec3(t < 3 ? half : -half, 0, half);
    }
    for (int v = 0; v < 7; v++) normal[v] = vec3(half, 0, half);
    MechanicsSettings set = mechanics_defaults();
    set.sharp = true;
    MechanicsProblem prob = {.nvert = 7, .ntri = 6, .pos = pos, .tri = tri, .normal = normal, .tri_normal = m,
                             .inverted = inverted, .frozen = frozen};
    Elastic el = {0};
    Sharp sh = {0};
    elastic_build(&el, &set, &prob, false);
    sharp_build(&sh, &el);
    assert_int_equal(sh.nvert, 1);
    assert_int_equal(sh.kind[0], SHARP_RIDGE);
    Sym3 s = sharp_filter(&sh, 0, normal[0]);
    assert_near3(sym_mul(&s, vec3(1, 2, 3)), vec3(0, 2, 0), 1e-15);
    inverted[2] = 1;
    sharp_build(&sh, &el);
    assert_int_equal(sh.nvert, 0);
    s = sharp_filter(&sh, 0, normal[0]);
    assert_near3(sym_mul(&s, vec3(1, 2, 3)), vec3(-1, 2, 1), 1e-15);
    sharp_free(&sh);
    elastic_free(&el);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vertices_move_to_the_ridges_of_a_cube),
        cmocka_unit_test(vertices_move_to_the_ridges_of_the_1_norm_ball),
        cmocka_unit_test(smooth_vertices_are_untouched),
        cmocka_unit_test(aligned_triangles_need_no_correction),
        cmocka_unit_test(ridge_vertex_slides_along_the_ridge),
    };
    return cmocka_run_group_tests_name("sharp", tests, NULL, NULL);
}
