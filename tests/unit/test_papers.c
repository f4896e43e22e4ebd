/* Topology as RR-6128 section 4 handles it: after each event the mesh is closed, manifold and in as many pieces as the field. */
#include "fields.h"
#include "mesh_shapes.h"
#include "track/track.h"

#include <stdlib.h>

typedef struct Run {
    Track *tr;
    Field field[2];
    int frames;
    FrameStat stat;
    int count[CHANGE_MEND + 1]; /* events of each kind, in all frames */
} Run;

static Run run_open(void)
{
    TrackSettings set = track_defaults();
    set.topology = TOPOLOGY_PAPERS;
    return (Run){.tr = track_open(&set)};
}

static void run_close(Run *r)
{
    track_close(r->tr);
    for (int i = 0; i < 2; i++) field_free(&r->field[i]);
}

/* Closed, manifold, and of so many components. */
static void assert_sound(const TriMesh *t, int components)
{
    Mesh m;
    Vec3 *pos = NEW(Vec3, t->nvert);
    Map edge;
    map_init(&edge, 3 * t->ntri);
    for (int h = 0; h < 3 * t->ntri; h++) assert_int_equal(map_put(&edge, key_pair(t->tri[h], t->tri[he_next(h)]), h), h);
    for (int h = 0; h < 3 * t->ntri; h++) assert_true(map_get(&edge, key_pair(t->tri[he_next(h)], t->tri[h])) != NONE);
    map_free(&edge);
    for (int v = 0; v < t->nvert; v++) pos[v] = vec3(t->pos[3 * v], t->pos[3 * v + 1], t->pos[3 * v + 2]);
    mesh_init(&m);
    mesh_append(&m, t->nvert, pos, NULL, t->ntri, t->tri);
    assert_mesh(&m);
    assert_int_equal(mesh_components(&m, NULL, NULL), components);
    mem_free(pos);
    mesh_free(&m);
}

/* A frame; the meshes must be sound. */
static void run_frame(Run *r, Grid g)
{
    static const char *const SAID = "frame %d: %d components of %d, %d triangles, inverted %d, wrong %d, off %.3f/%.3f vox\n";
    int i = r->frames++ % 2;
    Err err = {0};
    field_free(&r->field[i]);
    r->field[i] = field_from(g);
    if (!track_frame(r->tr, &r->field[i], NULL, 1, &r->stat, &err)) fail_msg("%s", err.text);
    const ChangeList *e = track_changes(r->tr);
    const FrameStat *s = &r->stat;
    bool told = getenv("TWINMESH_TOLD");
    if (told) print_message(SAID, r->frames, s->components, s->audit_components, s->triangles_mechanical, s->inverted_left, s->wrong_components, s->distance_mean_vox, s->distance_max_vox);
    for (int k = 0; k < e->n; k++) {
        r->count[e->change[k].kind]++;
        Vec3 p = e->change[k].place;
        if (told) print_message("    %s at %.1f %.1f %.1f, %d vertices\n", change_name(e->change[k].kind), p.x, p.y, p.z, e->change[k].vertices);
    }
    TriMesh mech, fine;
    track_meshes(r->tr, false, &mech, &fine);
    assert_sound(&mech, s->components);
    assert_sound(&fine, s->components);
    trimesh_free(&mech);
    trimesh_free(&fine);
}

/* A frame after which there are as many components as the field has, each of its genus. */
static void run_frame_right(Run *r, Grid g)
{
    run_frame(r, g);
    assert_int_equal(r->stat.components, r->stat.audit_components);
    assert_int_equal(r->stat.wrong_components, 0);
}

/* --- fields: skeletons whose contributions add up, as the papers' ------------------------------------------------------------ */

/* 1 / d^2 of segments (start, end, weight), less the value of the surface; about voxels near it. */
static double fn_skeleton(const double *k, Vec3 p)
{
    double sum = 0;
    int n = (int)*k++;
    for (int i = 0; i < n; i++, k += 7) {
        Vec3 a = vec3(k[0], k[1], k[2]), ab = v_sub(vec3(k[3], k[4], k[5]), a);
        double len2 = v_len2(ab), t = len2 > 0 ? real_clamp(v_dot(v_sub(p, a), ab) / len2, 0, 1) : 0;
        sum += k[6] * k[6] / real_max(v_len2(v_sub(p, v_axpy(a, t, ab))), 0.01);
    }
    return real_clamp(4 * (sum - 1), -10, 10);
}

/* RR-6128 figure 1: two skeleton elements that cross each other: apart, one, apart. */
static void skeletons_cross(void **state)
{
    (void)state;
    Run r = run_open();
    int least = 9;
    for (int f = 0; f <= 16; f++) {
        double z = 10 + 1.5 * f;
        const double k[] = {2, 14, 22, 22, 30, 22, 22, 3, 22, 14, z, 22, 30, z, 3};
        run_frame_right(&r, grid_of(45, fn_skeleton, k));
        least = int_min(least, r.stat.components);
        if (f == 0 || f == 16) assert_int_equal(r.stat.components, 2);
    }
    assert_int_equal(least, 1);
    assert_int_equal(r.count[CHANGE_BLEND], 1);
    assert_int_equal(r.count[CHANGE_SPLIT], 1);
    run_close(&r);
}

static void balls_merge_and_part(void **state)
{
    (void)state;
    Run r = run_open();
    for (int f = 0; f < 13; f++) {
        double x = f < 7 ? f : 12 - f; /* there and back */
        const double k[] = {2, 10 + x, 16, 16, 10 + x, 16, 16, 4, 26 - x, 16, 16, 26 - x, 16, 16, 4};
        run_frame_right(&r, grid_of(37, fn_skeleton, k));
    }
    assert_int_equal(r.count[CHANGE_BLEND], 1);
    assert_int_equal(r.count[CHANGE_SPLIT], 1);
    run_close(&r);
}

/* Three at the corners of a triangle that shrinks: all three meet between one frame and the next. */
static void three_balls_meet(void **state)
{
    (void)state;
    Run r = run_open();
    for (int f = 0; f < 6; f++) {
        double d = 11 - 1.2 * f;
        double k[22] = {3};
        for (int i = 0; i < 3; i++) {
            double a = 2 * 3.14159265358979 * i / 3, *q = k + 1 + 7 * i;
            q[0] = q[3] = 20 + d * cos(a), q[1] = q[4] = 20 + d * sin(a), q[2] = q[5] = 20, q[6] = 4;
        }
        run_frame_right(&r, grid_of(41, fn_skeleton, k));
    }
    assert_int_equal(r.stat.components, 1);
    assert_int_equal(r.count[CHANGE_BLEND], 2);
    run_close(&r);
}

/* A long drop that is three between one frame and the next. */
static void drop_parts_in_three(void **state)
{
    (void)state;
    Run r = run_open();
    for (int f = 0; f < 8; f++) {
        double d = 6.5 + 0.5 * f;
        const double k[] = {3, 22 - d, 14, 14, 22 - d, 14, 14, 3, 22, 14, 14, 22, 14, 14, 3, 22 + d, 14, 14, 22 + d, 14, 14, 3};
        run_frame_right(&r, grid_of(45, fn_skeleton, k));
    }
    assert_int_equal(r.stat.components, 3);
    assert_int_equal(r.count[CHANGE_SPLIT], 2);
    run_close(&r);
}

/* A ball that shrinks to nothing, and one that comes out of it. */
static void balls_come_and_go(void **state)
{
    (void)state;
    Run r = run_open();
    for (int f = 0; f < 9; f++) {
        const double k[] = {9.3, 10.2, 10.4, 5 - 0.8 * f, 22.3, 10.2, 10.4, -2 + 0.9 * f};
        run_frame_right(&r, grid_of(33, fn_two_balls, k));
    }
    assert_int_equal(r.count[CHANGE_BIRTH], 1);
    assert_int_equal(r.count[CHANGE_DEATH], 1);
    assert_int_equal(r.count[CHANGE_BLEND] + r.count[CHANGE_SPLIT], 0);
    run_close(&r);
}

/* Beyond the report: a flat ball becomes a torus and a ball again. The hole is seen once it is about an edge wide. */
static void hole_opens_and_closes(void **state)
{
    (void)state;
    Run r = run_open();
    static const double tube[] = {7, 6.5, 6, 5.5, 5, 4.5, 4, 4.5, 5, 5.5, 6, 6.5, 7};
    for (int f = 0; f < 13; f++) {
        const double k[] = {17.3, 17.6, 17.8, 6, tube[f]};
        run_frame(&r, grid_of(36, fn_torus, k));
        if (f % 6 == 0) assert_int_equal(r.stat.wrong_components, 0);
    }
    assert_int_equal(r.count[CHANGE_HOLE_OPEN], 1);
    assert_int_equal(r.count[CHANGE_HOLE_CLOSE], 1);
    run_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(skeletons_cross),
        cmocka_unit_test(balls_merge_and_part),
        cmocka_unit_test(three_balls_meet),
        cmocka_unit_test(drop_parts_in_three),
        cmocka_unit_test(balls_come_and_go),
        cmocka_unit_test(hole_opens_and_closes),
    };
    return cmocka_run_group_tests_name("papers", tests, NULL, NULL);
}
