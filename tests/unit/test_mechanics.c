/* Whole steps: what the skin does. */
#include "mechanics/mechanics.h"
#include "base/thread.h"
#include "mechanics_shapes.h"

#include <sys/wait.h>
#include <unistd.h>

static const Vec3 UP = {0, 0, 1};

static Vec3 *normals_up(int n)
{
    Vec3 *normal = NEW(Vec3, n);
    for (int v = 0; v < n; v++) normal[v] = UP;
    return normal;
}

static double area_up(const Vec3 *pos, const int32_t *c) { return v_area2(pos[c[0]], pos[c[1]], pos[c[2]]).z; }

static int flag_inverted(int ntri, const int32_t *tri, const Vec3 *pos, uint8_t *inverted)
{
    int count = 0;
    for (int t = 0; t < ntri; t++) count += inverted[t] = area_up(pos, tri + 3 * t) < 0;
    return count;
}

/* Steps until no triangle of a plane mesh is inverted, at most `most`. */
static int steps_to_recover(int nvert, int ntri, const int32_t *tri, Vec3 *pos, const uint8_t *frozen, bool tell,
                            int most)
{
    MechanicsSettings set = mechanics_defaults();
    Mechanics mech = {0};
    Vec3 *normal = normals_up(nvert), *dx = NEW(Vec3, nvert);
    uint8_t *inverted = NEW0(uint8_t, ntri);
    MechanicsProblem prob = {.nvert = nvert, .ntri = ntri, .pos = pos, .tri = tri, .normal = normal,
                             .inverted = tell ? inverted : NULL, .frozen = frozen};
    int step = 0;
    while (flag_inverted(ntri, tri, pos, inverted) > 0 && step < most) {
        mechanics_step(&mech, &set, &prob, dx);
        for (int v = 0; v < nvert; v++) pos[v] = v_add(pos[v], dx[v]);
        step++;
    }
    if (flag_inverted(ntri, tri, pos, inverted) > 0) step = most + 1;
    mechanics_free(&mech);
    mem_free(normal);
    mem_free(dx);
    mem_free(inverted);
    return step;
}

static void lone_inverted_triangle_recovers_within_two_steps(void **state)
{
    (void)state;
    const int32_t tri[3] = {0, 1, 2};
    uint64_t seed = 5;
    for (int i = 0; i < 200; i++) {
        Vec3 pos[3], kept[3];
        for (int v = 0; v < 3; v++) {
            pos[v] = v_scale(shape_noise3(&seed), 3);
            pos[v].z = 0;
        }
        if (area_up(pos, tri) > 0) {
            Vec3 p = pos[0];
            pos[0] = pos[1];
            pos[1] = p;
        }
        memcpy(kept, pos, sizeof kept);
        assert_true(steps_to_recover(3, 1, tri, pos, NULL, true, 2) <= 2);
        assert_true(steps_to_recover(3, 1, tri, kept, NULL, false, 20) > 20); /* untold it is happy as it is */
    }
}

/* A vertex of a sheet pushed over its neighbours, up to one and a half edges away; the rim is frozen. */
static void folded_sheet_recovers_within_two_steps(void **state)
{
    (void)state;
    const int n = 8;
    for (int i = 0; i < 24; i++) {
        Shape s = shape_sheet(n, n);
        uint8_t *frozen = NEW0(uint8_t, s.nvert);
        for (int y = 0; y <= n; y++)
            for (int x = 0; x <= n; x++) frozen[y * (n + 1) + x] = x == 0 || y == 0 || x == n || y == n;
        Vec3 *centre = &s.pos[n / 2 * (n + 1) + n / 2];
        double angle = 0.26 * i, size = 1.05 + 0.02 * i;
        *centre = v_add(*centre, vec3(size * cos(angle), size * sin(angle), 0));
        int steps = steps_to_recover(s.nvert, s.ntri, s.tri, s.pos, frozen, true, 2);
        assert_true(steps >= 1 && steps <= 2);
        mem_free(frozen);
        shape_free(&s);
    }
}

static void stretched_patch_contracts(void **state)
{
    (void)state;
    for (int kind = MECHANICS_FEM; kind <= MECHANICS_SPRING; kind++) {
        Shape s = shape_sheet(6, 6);
        Vec3 *normal = normals_up(s.nvert), *dx = NEW(Vec3, s.nvert), *f = NEW(Vec3, s.nvert);
        MechanicsSettings set = mechanics_defaults();
        set.kind = (MechanicsKind)kind;
        set.rest = 0.8;
        MechanicsProblem prob = {.nvert = s.nvert, .ntri = s.ntri, .pos = s.pos, .tri = s.tri, .normal = normal};
        Mechanics mech = {0};
        mechanics_forces(&mech, &set, &prob, f);
        Vec3 sum = {0};
        double before = shape_mean_edge(&s), work = 0;
        for (int v = 0; v < s.nvert; v++) sum = v_add(sum, f[v]);
        assert_near3(sum, vec3(0, 0, 0), 1e-9);
        mechanics_step(&mech, &set, &prob, dx);
        for (int v = 0; v < s.nvert; v++) {
            work += v_dot(f[v], dx[v]);
            s.pos[v] = v_add(s.pos[v], dx[v]);
        }
        assert_true(work > 0);
        assert_true(shape_mean_edge(&s) < before - 0.01 && shape_mean_edge(&s) > 0.8);
        /* at rest nothing moves */
        set.rest = 1;
        Shape rest = shape_sheet(6, 6);
        prob.pos = rest.pos;
        mechanics_step(&mech, &set, &prob, dx);
        for (int v = 0; v < s.nvert; v++) assert_near(v_len(dx[v]), 0, 1e-12);
        mechanics_free(&mech);
        mem_free(normal);
        mem_free(dx);
        mem_free(f);
        shape_free(&s);
        shape_free(&rest);
    }
}

static void stretched_spring_contracts(void **state)
{
    (void)state;
    /* one triangle, edges 1.5, 1.5 and 3, rest 1: all pull */
    Vec3 pos[3] = {{0, 0, 0}, {3, 0, 0}, {1.5, 1, 0}}, normal[3] = {UP, UP, UP}, dx[3];
    const int32_t tri[3] = {0, 1, 2};
    const uint8_t frozen[3] = {1, 0, 1};
    MechanicsSettings set = mechanics_defaults();
    set.kind = MECHANICS_SPRING;
    MechanicsProblem prob = {.nvert = 3, .ntri = 1, .pos = pos, .tri = tri, .normal = normal, .frozen = frozen};
    Mechanics mech = {0};
    mechanics_step(&mech, &set, &prob, dx);
    assert_true(dx[1].x < -0.3 && dx[1].x > -2);
    assert_true(v_len(dx[0]) == 0 && v_len(dx[2]) == 0);
    mechanics_free(&mech);
}

/* --- spheres ------------------------------------------------------------------------------------- */

typedef struct Ball {
    Shape shape;
    Vec3 *normal, *dx;
    uint8_t *frozen;
    MechanicsSettings set;
} Ball;

/* A sphere of radius `size` whose vertices are shaken along it by 0.4 of an edge. */
static Ball ball_make(int level, double size)
{
    Ball b = {.shape = shape_sphere(level), .set = mechanics_defaults()};
    uint64_t seed = 2;
    double edge = shape_mean_edge(&b.shape);
    b.normal = NEW(Vec3, b.shape.nvert);
    b.dx = NEW(Vec3, b.shape.nvert);
    b.frozen = NEW0(uint8_t, b.shape.nvert);
    for (int v = 0; v < b.shape.nvert; v++) {
        b.normal[v] = v_unit(v_axpy(b.shape.pos[v], 0.8 * edge, shape_noise3(&seed)));
        b.shape.pos[v] = v_scale(b.normal[v], size);
    }
    b.set.rest = edge / 1.4 * size;
    return b;
}

static void ball_free(Ball *b)
{
    shape_free(&b->shape);
    mem_free(b->normal);
    mem_free(b->dx);
    mem_free(b->frozen);
}

static MechanicsProblem ball_problem(const Ball *b)
{
    return (MechanicsProblem){.nvert = b->shape.nvert, .ntri = b->shape.ntri, .pos = b->shape.pos, .tri = b->shape.tri,
                              .normal = b->normal, .frozen = b->frozen};
}

/* The spread of the edges: standard deviation over mean. */
static double edge_spread(const Shape *s)
{
    double mean = shape_mean_edge(s), sum = 0;
    for (int h = 0; h < 3 * s->ntri; h++) {
        double l = v_dist(s->pos[s->tri[h]], s->pos[s->tri[h % 3 == 2 ? h - 2 : h + 1]]);
        sum += (l - mean) * (l - mean);
    }
    return sqrt(sum / (3 * s->ntri)) / mean;
}

static void relaxing_sphere_settles(void **state)
{
    (void)state;
    for (int kind = MECHANICS_FEM; kind <= MECHANICS_SPRING; kind++) {
        Ball b = ball_make(3, 1);
        b.set.kind = (MechanicsKind)kind;
        Mechanics mech = {0};
        MechanicsProblem prob = ball_problem(&b);
        double edge = shape_mean_edge(&b.shape), before = edge_spread(&b.shape), longest = 0;
        for (int step = 0; step < 30; step++) {
            mechanics_step(&mech, &b.set, &prob, b.dx);
            longest = 0;
            for (int v = 0; v < prob.nvert; v++) {
                longest = real_max(longest, v_len(b.dx[v]));
                assert_near(v_dot(b.dx[v], b.normal[v]), 0, 1e-12);
                b.normal[v] = b.shape.pos[v] = v_unit(v_add(b.shape.pos[v], b.dx[v]));
            }
            assert_true(longest < 2 * edge);
        }
        assert_true(longest < 1e-4 * edge); /* at rest */
        assert_true(edge_spread(&b.shape) < 0.5 * before);
        mechanics_free(&mech);
        ball_free(&b);
    }
}

static void frozen_vertices_stay(void **state)
{
    (void)state;
    Ball b = ball_make(3, 1);
    int moved = 0;
    for (int v = 0; v < b.shape.nvert; v++) b.frozen[v] = b.shape.pos[v].z < 0.3;
    Mechanics mech = {0};
    MechanicsProblem prob = ball_problem(&b);
    mechanics_step(&mech, &b.set, &prob, b.dx);
    for (int v = 0; v < b.shape.nvert; v++) {
        if (b.frozen[v]) assert_true(v_len(b.dx[v]) == 0);
        else moved += v_len(b.dx[v]) > 1e-6;
    }
    assert_true(moved > b.shape.nvert / 4);
    mechanics_free(&mech);
    ball_free(&b);
}

static void world_units_do_not_matter(void **state)
{
    (void)state;
    const double scales[2] = {1000, 1024};
    for (int kind = MECHANICS_FEM; kind <= MECHANICS_SPRING; kind++)
        for (int i = 0; i < 2; i++) {
            Ball a = ball_make(3, 1), b = ball_make(3, scales[i]);
            a.set.kind = b.set.kind = (MechanicsKind)kind;
            Mechanics mech = {0};
            MechanicsProblem pa = ball_problem(&a), pb = ball_problem(&b);
            CgStat sa = mechanics_step(&mech, &a.set, &pa, a.dx), sb = mechanics_step(&mech, &b.set, &pb, b.dx);
            assert_int_equal(sa.iterations, sb.iterations);
            for (int v = 0; v < pa.nvert; v++) {
                Vec3 want = v_scale(a.dx[v], scales[i]);
                assert_near3(b.dx[v], want, i == 0 ? 1e-9 : 0); /* by a power of two: to the bit */
            }
            mechanics_free(&mech);
            ball_free(&a);
            ball_free(&b);
        }
}

/* A step whose sharp vertices, frozen vertices and springs all take part; the same scratch for all. */
static uint64_t steps_hash(void)
{
    uint64_t hash = 0;
    Mechanics mech = {0};
    for (int round = 0; round < 4; round++) {
        Ball b = ball_make(5 - round, 1);
        Vec3 *m = NEW(Vec3, b.shape.ntri);
        for (int t = 0; t < b.shape.ntri; t++) {
            const int32_t *c = b.shape.tri + 3 * t;
            Vec3 mid = v_add(v_add(b.shape.pos[c[0]], b.shape.pos[c[1]]), b.shape.pos[c[2]]);
            m[t] = mid.z > 0.9 ? vec3(1, 0, 0) : v_unit(mid);
        }
        for (int v = 0; v < b.shape.nvert; v++) b.frozen[v] = b.shape.pos[v].x < -0.5;
        b.set.kind = round % 2 ? MECHANICS_SPRING : MECHANICS_FEM;
        b.set.sharp = true;
        MechanicsProblem prob = ball_problem(&b);
        prob.tri_normal = m;
        mechanics_step(&mech, &b.set, &prob, b.dx);
        for (int v = 0; v < b.shape.nvert; v++)
            for (int axis = 0; axis < 3; axis++) {
                double x = v_get(b.dx[v], axis);
                uint64_t bits;
                memcpy(&bits, &x, sizeof bits);
                hash = hash_mix(hash ^ bits) + 1;
            }
        mem_free(m);
        ball_free(&b);
    }
    mechanics_free(&mech);
    return hash;
}

static void same_bytes_for_any_number_of_threads(void **state)
{
    (void)state;
    uint64_t alone = steps_hash();
    static const int counts[] = {2, 3};
    for (int i = 0; i < 2; i++) {
        int ends[2];
        assert_int_equal(pipe(ends), 0);
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0) {
            thread_set_count(counts[i]);
            uint64_t hash = steps_hash();
            thread_shutdown();
            bool sent = write(ends[1], &hash, sizeof hash) == (ssize_t)sizeof hash;
            _exit(sent ? 0 : 1);
        }
        uint64_t hash = 0;
        int status = 1;
        close(ends[1]);
        assert_int_equal(read(ends[0], &hash, sizeof hash), sizeof hash);
        close(ends[0]);
        assert_int_equal(waitpid(child, &status, 0), child);
        assert_int_equal(status, 0);
        assert_true(hash == alone);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lone_inverted_triangle_recovers_within_two_steps),
        cmocka_unit_test(folded_sheet_recovers_within_two_steps),
        cmocka_unit_test(stretched_patch_contracts),
        cmocka_unit_test(stretched_spring_contracts),
        cmocka_unit_test(relaxing_sphere_settles),
        cmocka_unit_test(frozen_vertices_stay),
        cmocka_unit_test(world_units_do_not_matter),
        cmocka_unit_test(same_bytes_for_any_number_of_threads),
    };
    return cmocka_run_group_tests_name("mechanics", tests, NULL, NULL);
}
