/* Projection (GI'07 eq. 3): onto the trilinear surface, within reach, on the right side. */
#include "fields.h"

static double on_sphere_by(const Field *f, Vec3 p) { return fabs(field_value(f, p, NULL, NULL)); }

static void points_land_on_the_trilinear_surface(void **state)
{
    (void)state;
    enum { N = 1300, MADE = 3 }; /* more than two blocks of work */
    const Field field[MADE] = {
        field_of(32, fn_ball, (double[]){15.3, 16.1, 15.8, 9}),
        field_of(32, fn_torus, (double[]){15.3, 16.1, 15.8, 9, 3.5}),
        field_of(32, fn_octahedron, (double[]){15.3, 16.1, 15.8, 11}),
    };
    static Vec3 p[N], q[N];
    static uint8_t status[N];
    for (int k = 0; k < MADE; k++) {
        const Field *f = &field[k];
        uint64_t seed = 9;
        int n = 0;
        while (n < N) { /* within two voxels of the surface */
            Vec3 x = v_axpy(vec3(15.5, 15.5, 15.5), 28, shape_noise3(&seed));
            if (fabs(field_value(f, x, NULL, NULL)) < 2) p[n++] = x;
        }
        memcpy(q, p, sizeof p);
        int lost = field_project(f, N, q, 3.5, status), counted = 0;
        for (int i = 0; i < N; i++) {
            counted += status[i] != LANDED;
            if (status[i] == LANDED) assert_true(on_sphere_by(f, q[i]) < 2e-6 && v_dist(p[i], q[i]) <= 3.5);
            else assert_memory_equal(&p[i], &q[i], sizeof *p);
        }
        assert_int_equal(lost, counted);
        assert_true(lost <= (k == 2 ? 3 : 0)); /* 1-norm: near the edges the gradient turns */
        Vec3 alone = p[N - 1];
        assert_int_equal(field_project(f, 1, &alone, 3.5, NULL), 0);
        assert_memory_equal(&alone, &q[N - 1], sizeof alone);
    }
    for (int k = 0; k < MADE; k++) {
        Field f = field[k];
        field_free(&f);
    }
}

/* Whatever is on its way beside it, and whatever the reach of that. */
static void each_point_has_its_own_reach(void **state)
{
    (void)state;
    enum { N = 77 }; /* more than go together */
    Field f = field_of(24, fn_torus, (double[]){11.3, 12.1, 11.8, 6, 3});
    Vec3 p[N], q[N];
    double reach[N];
    uint8_t status[N];
    uint64_t seed = 5;
    int lost = 0;
    for (int i = 0; i < N; i++) {
        q[i] = p[i] = v_axpy(vec3(11.5, 11.5, 11.5), 18, shape_noise3(&seed));
        reach[i] = 0.1 * (i % 40);
    }
    field_project_each(&f, N, q, reach, status);
    for (int i = 0; i < N; i++) {
        uint8_t alone;
        lost += field_project(&f, 1, &p[i], reach[i], &alone);
        assert_int_equal(status[i], alone);
        assert_memory_equal(&p[i], &q[i], sizeof *p);
    }
    assert_in_range(lost, 10, N - 10);
    field_free(&f);
}

static void a_landed_point_stays(void **state)
{
    (void)state;
    Field f = field_of(24, fn_ball, (double[]){12, 12, 12, 8});
    Vec3 p = vec3(15, 17, 13);
    assert_int_equal(field_project(&f, 1, &p, 5, NULL), 0);
    Vec3 again = p;
    assert_int_equal(field_project(&f, 1, &again, 1e-3, NULL), 0);
    assert_true(v_dist(p, again) < 1e-7);
    field_free(&f);
}

static void out_of_reach_is_lost(void **state)
{
    (void)state;
    Field f = field_of(24, fn_ball, (double[]){12, 12, 12, 6});
    const struct {
        Vec3 p;
        double reach;
        int lost;
    } row[] = {
        {{21, 12, 12}, 2.9, 1}, {{21, 12, 12}, 3.1, 0},   /* three voxels outside */
        {{15, 12, 12}, 2.9, 1}, {{15, 12, 12}, 3.1, 0},   /* and inside */
        {{12, 12, 12}, 1, 1},                              /* the centre: no gradient */
        {{500, 12, 12}, 1e9, 1}, {{NAN, 12, 12}, 1, 1},    /* far off, nowhere */
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        Vec3 p = row[i].p;
        uint8_t status = 9;
        assert_int_equal(field_project(&f, 1, &p, row[i].reach, &status), row[i].lost);
        assert_int_equal(status, row[i].lost ? LANDING_LOST : LANDED);
        if (row[i].lost) assert_memory_equal(&p, &row[i].p, sizeof p);
    }
    field_free(&f);
}

/* A sheet of 0.8 voxels: central differences see both sides at once. */
static void thin_sheet_is_landed_on_from_its_own_side(void **state)
{
    (void)state;
    Field f = field_of(16, fn_slab, (double[]){8, 0.4});
    uint64_t seed = 4;
    for (int i = 0; i < 200; i++) {
        double side = i % 2 ? 1 : -1, off = 0.05 + 1.2 * (0.5 + shape_noise(&seed));
        Vec3 p = vec3(7.5 + 6 * shape_noise(&seed), 7.5 + 6 * shape_noise(&seed), 8 + side * off), was = p;
        assert_int_equal(field_project(&f, 1, &p, 1, NULL), fabs(off - 0.4) > 1 ? 1 : 0);
        if (fabs(off - 0.4) > 1) continue;
        assert_near3(p, vec3(was.x, was.y, 8 + side * 0.4), 1e-6);
    }
    Vec3 middle = vec3(7.2, 7.3, 8); /* either side will do */
    assert_int_equal(field_project(&f, 1, &middle, 1, NULL), 0);
    assert_near(fabs(middle.z - 8), 0.4, 1e-6);
    field_free(&f);
}

static void blends_land_between(void **state)
{
    (void)state;
    Field a = field_of(32, fn_ball, (double[]){15.5, 15.5, 15.5, 6}), b = field_of(32, fn_ball, (double[]){15.5, 15.5, 15.5, 9});
    uint64_t seed = 8;
    for (int i = 0; i <= 60; i++) {
        double t = (i % 5) / 4.0;
        Vec3 d = v_unit(shape_noise3(&seed)), p = v_axpy(vec3(15.5, 15.5, 15.5), 7.2, d);
        assert_int_equal(field_project_blend(&a, &b, t, 1, &p, 4, NULL), 0);
        double Fa = field_value(&a, p, NULL, NULL), Fb = field_value(&b, p, NULL, NULL);
        assert_true(fabs((1 - t) * Fa + t * Fb) < 0.011); /* a place to go on from */
        assert_near(v_dist(p, vec3(15.5, 15.5, 15.5)), 6 + 3 * t, 0.1);
    }
    field_free(&a);
    field_free(&b);
}

static void blend_is_the_field_that_is_known(void **state)
{
    (void)state;
    Field a = field_of(96, fn_ball, (double[]){12, 12, 12, 6}), b = field_of(96, fn_ball, (double[]){80, 80, 80, 6});
    Vec3 p[2] = {vec3(12, 12, 19), vec3(80, 80, 73)};
    assert_int_equal(field_project_blend(&a, &b, 0.1, 2, p, 2, NULL), 0);
    assert_near3(p[0], vec3(12, 12, 18), 1e-6);
    assert_near3(p[1], vec3(80, 80, 74), 1e-6);
    field_free(&a);
    field_free(&b);
}

static void world_units_scale_the_reach(void **state)
{
    (void)state;
    Grid g = grid_of(24, fn_ball, (double[]){12, 12, 12, 6});
    g.xform = affine_of(vec3(0.01, 0, 0), vec3(0, 0.01, 0), vec3(0, 0, -0.01), vec3(1, 2, 3));
    Field f = field_from(g);
    Vec3 q = affine_to_world(&f.xform, vec3(20, 12, 12)), p = q;
    assert_int_equal(field_project(&f, 1, &p, 0.019, NULL), 1);
    assert_int_equal(field_project(&f, 1, &p, 0.021, NULL), 0);
    assert_near3(affine_to_index(&f.xform, p), vec3(18, 12, 12), 1e-6);
    field_free(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_land_on_the_trilinear_surface),
        cmocka_unit_test(each_point_has_its_own_reach),
        cmocka_unit_test(a_landed_point_stays),
        cmocka_unit_test(out_of_reach_is_lost),
        cmocka_unit_test(thin_sheet_is_landed_on_from_its_own_side),
        cmocka_unit_test(blends_land_between),
        cmocka_unit_test(blend_is_the_field_that_is_known),
        cmocka_unit_test(world_units_scale_the_reach),
    };
    return cmocka_run_group_tests_name("project", tests, NULL, NULL);
}
