/* Rest positions: what --rest writes sticks to what moves. */
#include "fields.h"
#include "mesh/nearest.h"
#include "mesh_shapes.h"
#include "track/track.h"

#include <stdlib.h>

enum { N = 40 };
static const double BALL[] = {19.3, 19.6, 19.8, 13};
#define TURN 0.1 /* radians a frame, about z through the ball's centre */

/* The velocity of a rotation and a translation, in world units a second at 24 frames a second. */
static Grid velocity_of(double turn, const double *centre, Vec3 shift)
{
    float *v = NEW(float, 3 * N * N * N);
    for (int i = 0; i < N * N * N; i++) {
        double x = i % N - centre[0], y = i / N % N - centre[1];
        v[3 * i] = (float)(24 * (-turn * y + shift.x));
        v[3 * i + 1] = (float)(24 * (turn * x + shift.y));
        v[3 * i + 2] = (float)(24 * shift.z);
    }
    Grid g;
    grid_init(&g, 3);
    grid_from_dense(&g, v, (int[3]){N, N, N});
    mem_free(v);
    return g;
}

static Vec3 turned(Vec3 p, const double *centre, double angle)
{
    double x = p.x - centre[0], y = p.y - centre[1], c = cos(angle), s = sin(angle);
    return vec3(centre[0] + c * x - s * y, centre[1] + s * x + c * y, p.z);
}

static Vec3 point_of(const TriMesh *m, int v) { return vec3(m->pos[3 * v], m->pos[3 * v + 1], m->pos[3 * v + 2]); }

static Vec3 rest_of(const TriMesh *m, int v)
{
    assert_true(m->nattr >= 4);
    assert_string_equal(m->attr_name[0], "rest_x");
    assert_string_equal(m->attr_name[3], "rest_frame");
    return vec3(m->attr[0][v], m->attr[1][v], m->attr[2][v]);
}

/* How far rest positions are from where the motion says the vertices came from: mean and most, in voxels. */
typedef struct Slip {
    double mean, most;
    int first_frame; /* vertices at rest in the first frame */
} Slip;

static Slip slip_of(const TriMesh *m, const double *centre, double angle, Vec3 shift)
{
    Slip s = {0};
    for (int v = 0; v < m->nvert; v++) {
        double d = v_dist(rest_of(m, v), turned(v_sub(point_of(m, v), shift), centre, -angle));
        s.mean += d / m->nvert;
        s.most = real_max(s.most, d);
        s.first_frame += m->attr[3][v] == 0;
    }
    return s;
}

typedef struct Run {
    Track *tr;
    Field field[2];
    Grid velocity[2];
    int n;
    TriMesh mech, fine;
} Run;

static void run_frame(Run *r, Grid g, const Grid *velocity)
{
    int i = r->n++ % 2;
    FrameStat stat;
    Err err;
    field_free(&r->field[i]);
    grid_free(&r->velocity[i]);
    trimesh_free(&r->mech);
    trimesh_free(&r->fine);
    r->field[i] = field_from(g);
    if (velocity) r->velocity[i] = *velocity;
    assert_true(track_frame(r->tr, &r->field[i], velocity ? &r->velocity[i] : NULL, 1, &stat, &err));
    track_meshes(r->tr, false, &r->mech, &r->fine);
}

static Run run_open(void)
{
    TrackSettings set = track_defaults();
    set.rest = true;
    return (Run){.tr = track_open(&set)};
}

static void run_close(Run *r)
{
    track_close(r->tr);
    for (int i = 0; i < 2; i++) field_free(&r->field[i]), grid_free(&r->velocity[i]);
    trimesh_free(&r->mech);
    trimesh_free(&r->fine);
}

static void tell(const char *what, Slip s, int n)
{
    if (getenv("TWINMESH_TOLD")) print_message("%s: slip mean %.4f, most %.4f voxels; %d of %d at rest in the first frame\n", what, s.mean, s.most, s.first_frame, n);
}

/* The field does not change at all: only the velocity tells that the ball turns. */
static void rest_positions_turn_with_a_ball(void **state)
{
    (void)state;
    Run r = run_open();
    for (int f = 0; f <= 16; f++) {
        Grid v = velocity_of(TURN, BALL, vec3(0, 0, 0));
        run_frame(&r, grid_of(N, fn_ball, BALL), &v);
    }
    Slip coarse = slip_of(&r.mech, BALL, 16 * TURN, vec3(0, 0, 0)), fine = slip_of(&r.fine, BALL, 16 * TURN, vec3(0, 0, 0));
    tell("mechanical", coarse, r.mech.nvert);
    tell("geometric", fine, r.fine.nvert);
    assert_true(coarse.mean < 0.05 && coarse.most < 0.25);
    assert_true(fine.mean < 0.05 + 0.04 && fine.most < 0.25); /* lifted off the surface by so much */
    assert_int_equal(coarse.first_frame, r.mech.nvert);
    run_close(&r);
}

static void vertices_at_rest_are_where_they_are(void **state)
{
    (void)state;
    Run r = run_open();
    run_frame(&r, grid_of(N, fn_ball, BALL), NULL);
    for (int v = 0; v < r.mech.nvert; v++) assert_true(v_dist(rest_of(&r.mech, v), point_of(&r.mech, v)) < 1e-5);
    run_close(&r);
}

/* Splits as the ball grows: new vertices are at rest between the old, and none is born later. */
static void new_vertices_are_at_rest_between_the_old(void **state)
{
    (void)state;
    Run r = run_open();
    int n = 0;
    for (int f = 0; f <= 8; f++) {
        const double k[] = {19.3, 19.6, 19.8, 8 + f};
        run_frame(&r, grid_of(N, fn_ball, k), NULL);
        if (f == 0) n = r.mech.nvert;
    }
    assert_true(r.mech.nvert > 2 * n);
    double most = 0;
    for (int v = 0; v < r.mech.nvert; v++) { /* the same direction from the centre, on the first ball */
        Vec3 c = vec3(BALL[0], BALL[1], BALL[2]), rest = v_sub(rest_of(&r.mech, v), c);
        most = real_max(most, v_dist(v_scale(v_unit(v_sub(point_of(&r.mech, v), c)), 8), rest));
        assert_true(r.mech.attr[3][v] == 0);
    }
    if (getenv("TWINMESH_TOLD")) print_message("grown: off by %.3f voxels at most\n", most);
    assert_true(most < 2.5); /* the vertices' own slide over eight frames */
    run_close(&r);
}

static void what_is_born_later_is_at_rest_then(void **state)
{
    (void)state;
    static const double both[] = {10, 10, 10, 5, 30, 30, 30, 5};
    Run r = run_open();
    run_frame(&r, grid_of(N, fn_ball, both), NULL);
    run_frame(&r, grid_of(N, fn_ball, both), NULL);
    run_frame(&r, grid_of(N, fn_two_balls, both), NULL);
    int born = 0;
    for (int v = 0; v < r.mech.nvert; v++) {
        bool second = point_of(&r.mech, v).x > 20;
        assert_true(r.mech.attr[3][v] == (second ? 2 : 0));
        born += second;
    }
    assert_true(born > 20);
    run_close(&r);
}

static void nearest_points_are_those_of_all_triangles(void **state)
{
    (void)state;
    Shape s = shape_sphere(3);
    NearestIndex ix;
    uint64_t seed = 7;
    nearest_build(&ix, s.ntri, s.pos, s.tri, 0.3);
    for (int i = 0; i < 500; i++) {
        Vec3 p = v_scale(v_unit(vec3(shape_noise(&seed), shape_noise(&seed), shape_noise(&seed))), 1 + 0.3 * shape_noise(&seed));
        NearestHit hit = nearest_find(&ix, p, p);
        double best = INFINITY;
        for (int t = 0; t < s.ntri; t++) {
            Vec3 q[3] = {s.pos[s.tri[3 * t]], s.pos[s.tri[3 * t + 1]], s.pos[s.tri[3 * t + 2]]};
            double w[3];
            triangle_nearest(p, q, w);
            assert_true(w[0] >= 0 && w[1] >= 0 && w[2] >= 0 && fabs(w[0] + w[1] + w[2] - 1) < 1e-9);
            best = real_min(best, v_len2(v_sub(p, v_axpy(v_axpy(v_scale(q[0], w[0]), w[1], q[1]), w[2], q[2]))));
        }
        assert_true(hit.tri != NONE && hit.dist2 == best);
    }
    assert_int_equal(nearest_find(&ix, vec3(1, 0, 0), vec3(-1, 0, 0)).tri, NONE); /* looks away */
    assert_int_equal(nearest_find(&ix, vec3(3, 0, 0), vec3(1, 0, 0)).tri, NONE);  /* beyond reach */
    nearest_free(&ix);
    shape_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rest_positions_turn_with_a_ball),
        cmocka_unit_test(vertices_at_rest_are_where_they_are),
        cmocka_unit_test(new_vertices_are_at_rest_between_the_old),
        cmocka_unit_test(what_is_born_later_is_at_rest_then),
        cmocka_unit_test(nearest_points_are_those_of_all_triangles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
