/* The triangle element: stiffness, frame, force, inversion. */
#include "mechanics/mechanics_priv.h"
#include "mechanics_shapes.h"

static const double SIN60 = 0.86602540378443865;

static void stiffness_is_symmetric_with_three_zero_modes(void **state)
{
    (void)state;
    double k[6][6];
    element_stiffness(1000, 0.3, k);
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) assert_near(k[i][j], k[j][i], 1e-10);
    /* two translations and the rotation about u of (0,0) (1,0) (1/2, sin 60) */
    double mode[3][6] = {{1, 0, 1, 0, 1, 0}, {0, 1, 0, 1, 0, 1}, {0, 0, 0, 1, -SIN60, 0.5}};
    for (int m = 0; m < 3; m++)
        for (int i = 0; i < 6; i++) {
            double f = 0;
            for (int j = 0; j < 6; j++) f += k[i][j] * mode[m][j];
            assert_near(f, 0, 1e-10);
        }
    /* LDL^T: with u fixed and v on the x axis no rigid motion is left, three positive pivots; then three zeros */
    int order[6] = {2, 4, 5, 3, 0, 1}, positive = 0;
    for (int s = 0; s < 6; s++) {
        int p = order[s];
        if (fabs(k[p][p]) < 1e-9) continue;
        assert_true(k[p][p] > 0);
        positive++;
        for (int i = 0; i < 6; i++)
            for (int j = 0; j < 6; j++)
                if (i != p && j != p) k[i][j] -= k[i][p] * k[p][j] / k[p][p];
        for (int i = 0; i < 6; i++) k[i][p] = k[p][i] = 0;
    }
    assert_int_equal(positive, 3);
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) assert_near(k[i][j], 0, 1e-9);
}

/* A rest triangle of side `rest` under the symmetric strain eps in its plane, turned (x, y) and moved. */
static void place(double rest, double exx, double eyy, double exy, Vec3 p[3], ElementFrame *turned)
{
    const double x[3] = {0, rest, 0.5 * rest}, y[3] = {0, 0, SIN60 * rest};
    Vec3 ax = v_unit(vec3(1, 2, 2)), ay = v_unit(v_cross(vec3(0.3, -1, 0.2), ax));
    for (int i = 0; i < 3; i++) {
        double u = x[i] + exx * x[i] + exy * y[i], v = y[i] + exy * x[i] + eyy * y[i];
        p[i] = v_add(vec3(5, -7, 3), v_add(v_scale(ax, u), v_scale(ay, v)));
    }
    if (turned) *turned = (ElementFrame){ax, ay};
}

/* Uniform strain: nodal forces are those of the constant stress sigma = D eps, f_i = -area sigma grad N_i. */
static void uniform_strain_gives_constant_stress_forces(void **state)
{
    (void)state;
    const double young = 700, nu = 0.25, rest = 2.5, exx = 0.03, eyy = -0.02, exy = 0.015;
    double d0 = young / (1 - nu * nu), sxx = d0 * (exx + nu * eyy), syy = d0 * (eyy + nu * exx);
    double sxy = d0 * 0.5 * (1 - nu) * 2 * exy;
    double k[6][6], area = 0.5 * rest * rest * SIN60, h = rest * SIN60;
    double gx[3] = {-1 / rest, 1 / rest, 0}, gy[3] = {-0.5 / h, -0.5 / h, 1 / h};
    Vec3 p[3], n[3] = {{0}}, f[3];
    element_stiffness(young, nu, k);
    ElementFrame turned;
    place(rest, exx, eyy, exy, p, &turned);
    int turn;
    ElementFrame fr = element_frame(p, n, false, &turn);
    assert_int_equal(turn, 0);
    assert_near3(fr.x, turned.x, 1e-14);
    assert_near3(fr.y, turned.y, 1e-14);
    element_force(k, rest, &fr, p, f);
    for (int i = 0; i < 3; i++) {
        double fx = -area * (sxx * gx[i] + sxy * gy[i]), fy = -area * (sxy * gx[i] + syy * gy[i]);
        assert_near3(f[i], v_add(v_scale(fr.x, fx), v_scale(fr.y, fy)), 1e-9);
    }
}

static void rigid_motion_costs_nothing(void **state)
{
    (void)state;
    double k[6][6];
    Vec3 p[3], n[3] = {{0}}, f[3];
    element_stiffness(1000, 0.3, k);
    place(0.7, 0, 0, 0, p, NULL);
    int turn;
    ElementFrame fr = element_frame(p, n, false, &turn);
    element_force(k, 0.7, &fr, p, f);
    for (int i = 0; i < 3; i++) assert_near(v_len(f[i]), 0, 1e-10);
    /* infinitesimal: a spin about any axis and a shift give no R K R^T d, at rest */
    Vec3 d[3], out[3];
    for (int i = 0; i < 3; i++) d[i] = v_add(v_cross(vec3(0.2, -1, 0.4), p[i]), vec3(1, 2, 3));
    element_apply(k, &fr, d[0], d[1], d[2], out);
    for (int i = 0; i < 3; i++) assert_near(v_len(out[i]), 0, 1e-9);
}

static double energy(double k[6][6], double rest, const Vec3 p[3])
{
    Vec3 n[3] = {{0}};
    int turn;
    ElementFrame fr = element_frame(p, n, false, &turn);
    Vec3 a = v_sub(p[1], p[0]), b = v_sub(p[2], p[0]);
    double d[6] = {0, 0, v_dot(fr.x, a) - rest, v_dot(fr.y, a),
                   v_dot(fr.x, b) - 0.5 * rest, v_dot(fr.y, b) - SIN60 * rest};
    double e = 0;
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++) e += 0.5 * d[i] * k[i][j] * d[j];
    return e;
}

static void force_is_minus_the_gradient_of_energy(void **state)
{
    (void)state;
    const double rest = 1.3, step = 1e-6;
    double k[6][6];
    Vec3 p[3], n[3] = {{0}}, f[3];
    element_stiffness(1000, 0.3, k);
    place(rest, 0.4, -0.2, 0.15, p, NULL);
    int turn;
    ElementFrame fr = element_frame(p, n, false, &turn);
    element_force(k, rest, &fr, p, f);
    double size = 0;
    for (int i = 0; i < 3; i++) size = real_max(size, v_len(f[i]));
    for (int i = 0; i < 3; i++)
        for (int axis = 0; axis < 3; axis++) {
            Vec3 q[3] = {p[0], p[1], p[2]};
            v_set(&q[i], axis, v_get(p[i], axis) + step);
            double up = energy(k, rest, q);
            v_set(&q[i], axis, v_get(p[i], axis) - step);
            assert_near(-(up - energy(k, rest, q)) / (2 * step), v_get(f[i], axis), 1e-7 * size);
        }
}

/* The frame is the triangle's, not its first edge's: the order of the nodes does not matter, and there is no torque. */
static void force_does_not_depend_on_the_first_node(void **state)
{
    (void)state;
    double k[6][6];
    Vec3 p[3], n[3] = {{0}}, f[3], g[3];
    element_stiffness(1000, 0.3, k);
    place(1, 0.6, -0.3, 0.35, p, NULL);
    int turn;
    ElementFrame fr = element_frame(p, n, false, &turn);
    element_force(k, 1, &fr, p, f);
    Vec3 torque = {0};
    for (int i = 0; i < 3; i++) torque = v_add(torque, v_cross(v_sub(p[i], p[0]), f[i]));
    assert_near(v_len(torque), 0, 1e-10);
    Vec3 q[3] = {p[1], p[2], p[0]};
    fr = element_frame(q, n, false, &turn);
    element_force(k, 1, &fr, q, g);
    for (int i = 0; i < 3; i++) assert_near3(g[i], f[(i + 1) % 3], 1e-9);
}

static void apply_is_minus_the_derivative_of_force_in_a_frozen_frame(void **state)
{
    (void)state;
    double k[6][6];
    Vec3 p[3], n[3] = {{0}}, f0[3], f1[3], out[3];
    element_stiffness(1000, 0.3, k);
    place(1, 0.4, 0.1, -0.2, p, NULL);
    int turn;
    ElementFrame fr = element_frame(p, n, false, &turn);
    Vec3 d[3] = {{0.1, 0.2, -0.1}, {-0.3, 0.1, 0.2}, {0.05, -0.4, 0.3}}, q[3];
    for (int i = 0; i < 3; i++) q[i] = v_add(p[i], d[i]);
    element_force(k, 1, &fr, p, f0);
    element_force(k, 1, &fr, q, f1);
    element_apply(k, &fr, d[0], d[1], d[2], out);
    for (int i = 0; i < 3; i++) assert_near3(v_sub(f0[i], f1[i]), out[i], 1e-10);
}

static void stretched_triangle_pulls_its_vertices_together(void **state)
{
    (void)state;
    double k[6][6];
    Vec3 p[3], n[3] = {{0}}, f[3];
    element_stiffness(1000, 0.3, k);
    for (int squeezed = 0; squeezed < 2; squeezed++) {
        place(1, squeezed ? -0.3 : 0.5, squeezed ? -0.3 : 0.5, 0, p, NULL);
        int turn;
        ElementFrame fr = element_frame(p, n, false, &turn);
        element_force(k, 1, &fr, p, f);
        Vec3 centre = v_scale(v_add(v_add(p[0], p[1]), p[2]), 1.0 / 3);
        for (int i = 0; i < 3; i++) {
            double inward = v_dot(f[i], v_sub(centre, p[i]));
            assert_true(squeezed ? inward < 0 : inward > 0);
        }
    }
}

/* 2.6.2: the vertex over the longest edge is pushed to and through that edge, at any place in the order. */
static void inverted_triangle_is_pushed_through_its_longest_edge(void **state)
{
    (void)state;
    double k[6][6];
    element_stiffness(1000, 0.3, k);
    Vec3 up = vec3(0, 0, 1), n[3] = {up, up, up}, f[3];
    /* clockwise from +z: w lies below the edge u->v instead of above */
    Vec3 tri[3] = {{0, 0, 0}, {1.2, 0, 0}, {0.5, -0.3, 0}};
    for (int shift = 0; shift < 3; shift++) {
        Vec3 p[3] = {tri[shift], tri[(shift + 1) % 3], tri[(shift + 2) % 3]};
        int turn;
        ElementFrame fr = element_frame(p, n, true, &turn);
        assert_int_equal((turn + shift) % 3, 0);
        assert_near3(fr.x, vec3(1, 0, 0), 1e-15);
        assert_near3(fr.y, vec3(0, 1, 0), 1e-15); /* reflected: the triangle's own would be -y */
        Vec3 uvw[3] = {p[turn], p[(turn + 1) % 3], p[(turn + 2) % 3]};
        element_force(k, 1, &fr, uvw, f);
        assert_true(f[2].y > 0);
        assert_true(f[0].y < 0 && f[1].y < 0);
        /* -w^y - w0^y, not w^y - w0^y: stronger than the same triangle told to be sound, which is pushed away */
        double mine = f[2].y;
        fr = element_frame(p, n, false, &turn);
        for (int i = 0; i < 3; i++) uvw[i] = p[(turn + i) % 3];
        element_force(k, 1, &fr, uvw, f);
        Vec3 plain = f[(6 - turn - shift + 2) % 3];
        assert_true(plain.y < 0 && fabs(plain.y) < mine);
    }
}

static void triangle_without_area_or_length_is_harmless(void **state)
{
    (void)state;
    double k[6][6];
    element_stiffness(1000, 0.3, k);
    Vec3 up = vec3(0, 0, 1), n[3] = {up, up, up}, f[3];
    int turn;
    /* seen from +z the third side of u->v is left of it: the flat vertex is pushed there */
    Vec3 flat[3] = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}};
    ElementFrame fr = element_frame(flat, n, false, &turn);
    assert_near3(fr.y, vec3(0, 1, 0), 1e-15);
    element_force(k, 1, &fr, flat, f);
    assert_true(f[2].y > 0 && f[0].y < 0);
    /* no normal to ask: any side, but finite and orthonormal */
    Vec3 none[3] = {{0}};
    fr = element_frame(flat, none, true, &turn);
    assert_near(v_len(fr.y), 1, 1e-15);
    assert_near(v_dot(fr.x, fr.y), 0, 1e-15);
    /* two vertices in one place: the frame follows the longest edge */
    Vec3 two[3] = {{0, 0, 0}, {0, 0, 0}, {0, 2, 0}};
    fr = element_frame(two, n, false, &turn);
    assert_near(fabs(fr.x.y), 1, 1e-15);
    /* all three: nothing */
    Vec3 one[3] = {{3, 3, 3}, {3, 3, 3}, {3, 3, 3}};
    fr = element_frame(one, n, true, &turn);
    element_force(k, 1, &fr, one, f);
    for (int i = 0; i < 3; i++) assert_true(v_len(f[i]) == 0);
}

static void spring_force_and_derivative(void **state)
{
    (void)state;
    Vec3 f[2], g[2], out[2], p = vec3(1, 2, 3), q = vec3(2, 0, 5); /* length 3 */
    Spring s = spring_make(100, 2, p, q, f);
    assert_near3(f[0], v_scale(v_unit(v_sub(q, p)), 100), 1e-12); /* stretched by 1: contracts */
    assert_near3(f[1], v_scale(f[0], -1), 0);
    for (int axis = 0; axis < 3; axis++) {
        const double h = 1e-6;
        Vec3 d = vec3(0, 0, 0);
        v_set(&d, axis, 1);
        spring_make(100, 2, p, v_axpy(q, h, d), g);
        spring_apply(&s, vec3(0, 0, 0), d, out);
        assert_near3(v_scale(v_sub(f[1], g[1]), 1 / h), out[1], 1e-3);
    }
    /* compressed: the transverse part is cut off at 0, so that d . out is never negative */
    s = spring_make(100, 10, p, q, f);
    assert_true(v_dot(f[0], v_sub(q, p)) < 0);
    assert_true(s.across == 0);
    s = spring_make(100, 10, p, p, f);
    assert_true(v_len(f[0]) == 0 && s.along == 0);
}

static void edges_are_listed_once(void **state)
{
    (void)state;
    Shape s = shape_sphere(1);
    Map seen = {0};
    int32_t *edge = NEW(int32_t, 6 * s.ntri);
    assert_int_equal(spring_edges(s.ntri, s.tri, &seen, edge), s.ntri * 3 / 2);
    assert_int_equal(spring_edges(1, s.tri, &seen, edge), 3);
    mem_free(edge);
    map_free(&seen);
    shape_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stiffness_is_symmetric_with_three_zero_modes),
        cmocka_unit_test(uniform_strain_gives_constant_stress_forces),
        cmocka_unit_test(rigid_motion_costs_nothing),
        cmocka_unit_test(force_is_minus_the_gradient_of_energy),
        cmocka_unit_test(force_does_not_depend_on_the_first_node),
        cmocka_unit_test(apply_is_minus_the_derivative_of_force_in_a_frozen_frame),
        cmocka_unit_test(stretched_triangle_pulls_its_vertices_together),
        cmocka_unit_test(inverted_triangle_is_pushed_through_its_longest_edge),
        cmocka_unit_test(triangle_without_area_or_length_is_harmless),
        cmocka_unit_test(spring_force_and_derivative),
        cmocka_unit_test(edges_are_listed_once),
    };
    return cmocka_run_group_tests_name("element", tests, NULL, NULL);
}
