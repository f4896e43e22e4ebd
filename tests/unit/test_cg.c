/* The filtered conjugate gradient against a dense solve. */
#include "mechanics/mechanics_priv.h"
#include "mechanics_shapes.h"

#include <stdlib.h>

typedef struct Case {
    Shape shape;
    Vec3 *normal, *dx;
    uint8_t *frozen;
    MechanicsSettings set;
    MechanicsProblem prob;
    Mechanics mech;
} Case;

/* A bumpy sphere, stretched, some of it frozen. */
static Case case_make(MechanicsKind kind, bool with_frozen)
{
    Case c = {.shape = shape_sphere(2), .set = mechanics_defaults()};
    uint64_t seed = 7;
    int n = c.shape.nvert;
    c.normal = NEW(Vec3, n);
    c.dx = NEW(Vec3, n);
    c.frozen = NEW0(uint8_t, n);
    for (int v = 0; v < n; v++) {
        c.shape.pos[v] = v_unit(v_axpy(c.shape.pos[v], 0.2, shape_noise3(&seed)));
        c.normal[v] = c.shape.pos[v];
        c.frozen[v] = with_frozen && v % 5 == 0;
    }
    c.set.kind = kind;
    c.set.rest = 0.7 * shape_mean_edge(&c.shape);
    c.set.sharp = false;
    c.set.cg_iterations = 1000;
    c.set.cg_tolerance = 1e-13;
    c.prob = (MechanicsProblem){.nvert = n, .ntri = c.shape.ntri, .pos = c.shape.pos, .tri = c.shape.tri,
                                .normal = c.normal, .frozen = with_frozen ? c.frozen : NULL};
    return c;
}

static void case_free(Case *c)
{
    shape_free(&c->shape);
    mem_free(c->normal);
    mem_free(c->dx);
    mem_free(c->frozen);
    mechanics_free(&c->mech);
}

/* Solves the n x n system a x = b by Gauss with row pivots; b becomes x. */
static void dense_solve(int n, double *a, double *b)
{
    for (int s = 0; s < n; s++) {
        int p = s;
        for (int i = s; i < n; i++)
            if (fabs(a[i * n + s]) > fabs(a[p * n + s])) p = i;
        for (int j = 0; j < n; j++) {
            double t = a[s * n + j];
            a[s * n + j] = a[p * n + j];
            a[p * n + j] = t;
        }
        double t = b[s];
        b[s] = b[p];
        b[p] = t;
        for (int i = s + 1; i < n; i++) {
            double m = a[i * n + s] / a[s * n + s];
            if (m == 0) continue;
            for (int j = s; j < n; j++) a[i * n + j] -= m * a[s * n + j];
            b[i] -= m * b[s];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++) b[i] -= a[i * n + j] * b[j];
        b[i] /= a[i * n + i];
    }
}

/* Two unit vectors across n. */
static void tangents(Vec3 n, Vec3 t[2])
{
    t[0] = v_unit(v_cross(n, fabs(n.x) < 0.6 ? vec3(1, 0, 0) : vec3(0, 1, 0)));
    t[1] = v_cross(n, t[0]);
}

/* The answer in tangent coordinates, two a free vertex: T^T (I + dt K) T y = dt T^T f, column by column. */
static void dense_answer(Case *c, Vec3 *x)
{
    Elastic el = {0};
    elastic_build(&el, &c->set, &c->prob, false);
    int nf = el.nfree, n = 2 * nf;
    double *a = calloc((size_t)n * (size_t)n, sizeof *a), *b = calloc((size_t)n, sizeof *b);
    Vec3 *d = calloc((size_t)nf + 1, sizeof *d);
    for (int v = 0; v < nf; v++) {
        Vec3 t[2], f = elastic_gather(&el, v);
        tangents(c->normal[el.vert[v]], t);
        for (int i = 0; i < 2; i++) b[2 * v + i] = c->set.dt * v_dot(t[i], f);
    }
    for (int j = 0; j < n; j++) {
        Vec3 t[2];
        tangents(c->normal[el.vert[j / 2]], t);
        d[j / 2] = t[j % 2];
        elastic_apply(&el, d, el.nelem, NULL);
        for (int v = 0; v < nf; v++) {
            Vec3 s[2], kd = elastic_gather(&el, v);
            tangents(c->normal[el.vert[v]], s);
            for (int i = 0; i < 2; i++)
                a[(2 * v + i) * n + j] = c->set.dt * v_dot(s[i], kd) + (2 * v + i == j ? 1 : 0);
        }
        d[j / 2] = vec3(0, 0, 0);
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++) assert_near(a[i * n + j], a[j * n + i], 1e-11);
    dense_solve(n, a, b);
    for (int v = 0; v < c->prob.nvert; v++) x[v] = vec3(0, 0, 0);
    for (int v = 0; v < nf; v++) {
        Vec3 t[2];
        tangents(c->normal[el.vert[v]], t);
        x[el.vert[v]] = v_add(v_scale(t[0], b[2 * v]), v_scale(t[1], b[2 * v + 1]));
    }
    elastic_free(&el);
    free(a);
    free(b);
    free(d);
}

static void check_against_dense(MechanicsKind kind, bool with_frozen)
{
    Case c = case_make(kind, with_frozen);
    Vec3 *x = NEW(Vec3, c.prob.nvert);
    dense_answer(&c, x);
    CgStat st = mechanics_step(&c.mech, &c.set, &c.prob, c.dx);
    assert_true(st.converged && st.residual <= 1e-13 && st.iterations > 3);
    for (int v = 0; v < c.prob.nvert; v++) {
        assert_near3(c.dx[v], x[v], 1e-11);
        assert_near(v_dot(c.dx[v], c.normal[v]), 0, 1e-13);
        if (with_frozen && c.frozen[v]) assert_true(v_len(c.dx[v]) == 0);
    }
    mem_free(x);
    case_free(&c);
}

static void triangles_meet_the_dense_answer(void **state)
{
    (void)state;
    check_against_dense(MECHANICS_FEM, false);
    check_against_dense(MECHANICS_FEM, true);
}

static void springs_meet_the_dense_answer(void **state)
{
    (void)state;
    check_against_dense(MECHANICS_SPRING, false);
    check_against_dense(MECHANICS_SPRING, true);
}

/* The parts of the operator that see each other only through `part`: what one gives the other must be alike. */
static void operator_is_the_sum_of_its_elements(void **state)
{
    (void)state;
    Case c = case_make(MECHANICS_FEM, true);
    Elastic el = {0};
    elastic_build(&el, &c.set, &c.prob, false);
    uint64_t seed = 3;
    Vec3 *d = NEW0(Vec3, el.nfree + 1), *sum = NEW0(Vec3, el.nfree + 1);
    for (int v = 0; v < el.nfree; v++) d[v] = shape_noise3(&seed);
    for (int e = 0; e < el.nelem; e++) {
        Vec3 out[3];
        const int32_t *n = el.node + 3 * e;
        element_apply(el.k, &el.frame[e], d[n[0]], d[n[1]], d[n[2]], out);
        for (int i = 0; i < 3; i++) sum[n[i]] = v_add(sum[n[i]], out[i]);
    }
    elastic_apply(&el, d, el.nelem, NULL);
    for (int v = 0; v < el.nfree; v++) assert_near3(elastic_gather(&el, v), sum[v], 1e-10);
    mem_free(d);
    mem_free(sum);
    elastic_free(&el);
    case_free(&c);
}

static void tolerance_zero_fixes_the_count(void **state)
{
    (void)state;
    Case c = case_make(MECHANICS_FEM, false);
    c.set.cg_tolerance = 0;
    double last = 1;
    static const int counts[] = {0, 2, 10, 300};
    for (int i = 0; i < 4; i++) {
        c.set.cg_iterations = counts[i];
        CgStat st = mechanics_step(&c.mech, &c.set, &c.prob, c.dx);
        assert_int_equal(st.iterations, counts[i]);
        assert_true(st.residual <= last);
        last = st.residual;
        for (int v = 0; v < c.prob.nvert; v++) assert_true(isfinite(v_len2(c.dx[v])));
    }
    assert_true(last < 1e-12);
    c.set.cg_tolerance = 1e-2;
    CgStat st = mechanics_step(&c.mech, &c.set, &c.prob, c.dx);
    assert_true(st.converged && st.residual <= 1e-2 && st.iterations < 60);
    case_free(&c);
}

static void nothing_to_do_is_done_at_once(void **state)
{
    (void)state;
    Case c = case_make(MECHANICS_FEM, true);
    memset(c.frozen, 1, (size_t)c.prob.nvert);
    CgStat st = mechanics_step(&c.mech, &c.set, &c.prob, c.dx);
    assert_int_equal(st.iterations, 0);
    assert_true(st.converged && st.residual == 0);
    for (int v = 0; v < c.prob.nvert; v++) assert_true(v_len(c.dx[v]) == 0);
    MechanicsProblem none = {0};
    st = mechanics_step(&c.mech, &c.set, &none, c.dx);
    assert_true(st.iterations == 0 && st.converged);
    /* a vertex without triangles stays */
    MechanicsProblem lone = {.nvert = 1, .pos = c.shape.pos, .normal = c.normal};
    st = mechanics_step(&c.mech, &c.set, &lone, c.dx);
    assert_true(st.converged && v_len(c.dx[0]) == 0);
    case_free(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_meet_the_dense_answer),
        cmocka_unit_test(springs_meet_the_dense_answer),
        cmocka_unit_test(operator_is_the_sum_of_its_elements),
        cmocka_unit_test(tolerance_zero_fixes_the_count),
        cmocka_unit_test(nothing_to_do_is_done_at_once),
    };
    return cmocka_run_group_tests_name("cg", tests, NULL, NULL);
}
