/* The nearest point of a mesh by the tree of boxes against all triangles one by one, and the Hausdorff distance against what is
 * known of shapes and against many samples. */
#include "mesh_shapes.h"
#include "diff/hausdorff.h"
#include "mesh/closest.h"
#include "mesh/nearest.h"

static void expect_near(double got, double want, double slack)
{
    if (!(fabs(got - want) <= slack)) fail_msg("%.17g is not %.17g", got, want);
}

static double nearest_of_all(const Shape *s, Vec3 p)
{
    double best = INFINITY;
    for (int t = 0; t < s->ntri; t++) {
        Vec3 q[3];
        double w[3];
        for (int k = 0; k < 3; k++) q[k] = s->pos[s->tri[3 * t + k]];
        triangle_nearest(p, q, w);
        best = fmin(best, v_dist(p, v_axpy(v_axpy(v_scale(q[0], w[0]), w[1], q[1]), w[2], q[2])));
    }
    return best;
}

static void finds_the_nearest_point(void **state)
{
    (void)state;
    Shape s = shape_torus(23, 11, 3, 1);
    uint64_t seed = 1;
    for (int v = 0; v < s.nvert; v++) s.pos[v] = v_add(s.pos[v], v_scale(shape_noise3(&seed), 0.2));
    ClosestIndex ix;
    closest_build(&ix, s.ntri, s.pos, s.tri);
    for (int i = 0; i < 3000; i++) {
        Vec3 p = v_scale(shape_noise3(&seed), i % 3 == 0 ? 100 : 10);
        ClosestHit hit = closest_find(&ix, p);
        double want = nearest_of_all(&s, p);
        expect_near(sqrt(hit.dist2), want, 1e-12 * (1 + want));
        expect_near(v_dist(hit.point, p), want, 1e-12 * (1 + want));
    }
    closest_free(&ix);
    shape_free(&s);
}

static void few_triangles_and_none(void **state)
{
    (void)state;
    Vec3 pos[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    int32_t tri[3] = {0, 1, 2};
    ClosestIndex ix;
    closest_build(&ix, 0, pos, tri);
    assert_int_equal(closest_find(&ix, pos[0]).tri, NONE);
    closest_free(&ix);
    closest_build(&ix, 1, pos, tri);
    expect_near(closest_find(&ix, vec3(0.2, 0.2, -2)).dist2, 4, 0);
    closest_free(&ix);
}

static Surface surface_of(const Shape *s) { return (Surface){s->nvert, s->ntri, s->pos, s->tri}; }

/* A square of two triangles over one with a tent: the farthest point of the square is no corner of it. */
static void the_farthest_point_may_lie_within(void **state)
{
    (void)state;
    Vec3 flat[4] = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}}, tent[5] = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {2, 2, -3}};
    int32_t two[6] = {0, 1, 2, 0, 2, 3}, four[12] = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4};
    Surface a = {4, 2, flat, two}, b = {5, 4, tent, four};
    FarPoint down = hausdorff_from(&a, &b, 1e-4), up = hausdorff_from(&b, &a, 1e-4);
    double want = 3 * 2 / sqrt(13.0); /* from the middle to a side of the tent */
    expect_near(down.distance, want, 1e-4);
    assert_true(down.most >= want && down.most <= down.distance + 1.01e-4);
    expect_near(down.at.x, 2, 1e-2);
    expect_near(down.at.y, 2, 1e-2);
    expect_near(up.distance, 3, 0);
}

static void no_sample_is_farther(void **state)
{
    (void)state;
    Shape a = shape_torus(20, 9, 3, 1), b = shape_torus(13, 12, 3.1, 0.9);
    Surface sa = surface_of(&a), sb = surface_of(&b);
    FarPoint far = hausdorff_from(&sa, &sb, 1e-3);
    ClosestIndex ix;
    closest_build(&ix, b.ntri, b.pos, b.tri);
    double sampled = 0;
    uint64_t seed = 3;
    for (int i = 0; i < 100000; i++) {
        const int32_t *t = a.tri + 3 * (i % a.ntri);
        double u = shape_noise(&seed) + 0.5, w = shape_noise(&seed) + 0.5;
        if (u + w > 1) u = 1 - u, w = 1 - w;
        Vec3 p = v_axpy(v_axpy(v_scale(a.pos[t[0]], 1 - u - w), u, a.pos[t[1]]), w, a.pos[t[2]]);
        sampled = fmax(sampled, sqrt(closest_find(&ix, p).dist2));
    }
    assert_true(sampled <= far.most && sampled > 0.97 * far.distance);
    expect_near(sqrt(closest_find(&ix, far.at).dist2), far.distance, 1e-12);
    assert_true(far.most <= far.distance + 1.001e-3);
    closest_free(&ix);
    shape_free(&a);
    shape_free(&b);
}

static void the_same_surface_in_other_triangles(void **state)
{
    (void)state;
    enum { N = 12 };
    Vec3 pos[2][(N + 1) * (N + 1)];
    int32_t tri[2][6 * N * N];
    Surface s[2];
    for (int d = 0; d < 2; d++) { /* the other diagonals, and rows apart by other steps */
        for (int i = 0; i <= N; i++)
            for (int j = 0; j <= N; j++) pos[d][i * (N + 1) + j] = vec3(d ? i : N * pow((double)i / N, 1.5), j, 0);
        for (int q = 0; q < N * N; q++) {
            int a = q / N * (N + 1) + q % N, b = a + N + 1, c = b + 1, e = a + 1;
            const int32_t one[6] = {a, b, c, a, c, e}, other[6] = {a, b, e, b, c, e};
            memcpy(tri[d] + 6 * q, d ? one : other, sizeof one);
        }
        s[d] = (Surface){(N + 1) * (N + 1), 2 * N * N, pos[d], tri[d]};
    }
    FarPoint far = hausdorff_from(&s[0], &s[1], 1e-2);
    assert_true(far.distance < 1e-12 && far.most < 0.05);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finds_the_nearest_point),
        cmocka_unit_test(few_triangles_and_none),
        cmocka_unit_test(the_farthest_point_may_lie_within),
        cmocka_unit_test(no_sample_is_farther),
        cmocka_unit_test(the_same_surface_in_other_triangles),
    };
    return cmocka_run_group_tests_name("closest", tests, NULL, NULL);
}
