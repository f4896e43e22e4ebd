/* Fields whose function is known: landings on F = 0, the samples' word on topology, ridges, a tracked scene. */
#include "scene/scene.h"
#include "track/track.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

#include "temp_dir.h"

typedef struct Known {
    Scene *scene;
    SceneFrame *frame;
    Grid grid;
    Field field;
} Known;

static Known known_at(Scene *scene, int64_t number)
{
    Known k = {.scene = scene, .frame = scene_frame(scene, number)};
    Err err;
    grid_init(&k.grid, 1);
    assert_true(scene_fill_grid(k.frame, false, &k.grid, &err));
    assert_true(field_build(&k.field, &k.grid, &(FieldSpec){0, true}, &err));
    k.field.exact = scene_exact(k.frame);
    return k;
}

static void known_free(Known *k)
{
    field_free(&k->field);
    grid_free(&k->grid);
    scene_frame_free(k->frame);
}

static Scene load(const char *element, const char *voxel)
{
    char text[1000];
    Scene s;
    Err err = {0};
    snprintf(text, sizeof text, "{\"frames\": [1, 6], \"domain\": [[-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]], \"voxel\": %s, \"elements\": [%s]}", voxel, element);
    if (!scene_load(temp_write("scene.json", text, strlen(text)), &s, &err)) print_message("%s\n", err.text);
    assert_int_equal(err.code, ERR_NONE);
    return s;
}

/* Points around the surface, by the radius of a ball. */
static int shell(Vec3 *p, int n, double radius)
{
    for (int i = 0; i < n; i++) {
        double t = 2.399963 * i, z = 1 - 2 * (i + 0.5) / n, r = sqrt(1 - z * z);
        p[i] = v_scale(vec3(r * cos(t), r * sin(t), z), radius * (1 + 0.05 * sin(7.0 * i)));
    }
    return n;
}

static void points_land_on_the_function(void **state)
{
    (void)state;
    Scene s = load("{\"points\": [[0.02, 0, 0]], \"radius\": 0.8}", "0.15");
    Known k = known_at(&s, 1);
    Vec3 p[500], q[500], n[500];
    int count = shell(p, 500, 0.8);
    memcpy(q, p, sizeof p);
    assert_int_equal(field_project(&k.field, count, p, 0.5, NULL), 0);
    field_normals(&k.field, count, p, n);
    k.field.exact.sample = NULL;
    assert_int_equal(field_project(&k.field, count, q, 0.5, NULL), 0);
    double exact = 0, samples = 0;
    int off = 0;
    for (int i = 0; i < count; i++) {
        double d = fabs(v_dist(p[i], vec3(0.02, 0, 0)) - 0.8);
        off += d > 1e-9; /* where the function runs through a cell that the samples do not cross */
        exact += d;
        samples += fabs(v_dist(q[i], vec3(0.02, 0, 0)) - 0.8);
        if (d < 1e-9) assert_true(v_dist(n[i], v_unit(v_sub(p[i], vec3(0.02, 0, 0)))) < 1e-9);
    }
    assert_true(off < count / 20);
    assert_true(exact < 0.1 * samples);
    known_free(&k);
    scene_free(&s);
}

/* Two balls a third of a voxel apart in one cell: the function says two, the samples may say one, and they decide. */
static void samples_decide(void **state)
{
    (void)state;
    Scene s = load("{\"points\": [[-0.52, 0.03, 0.02], [0.52, 0.03, 0.02]], \"radius\": 0.5, \"kernel\": \"compact\"}", "0.11");
    Known k = known_at(&s, 1);
    for (int i = 0; i < 200; i++) {
        Vec3 p = vec3(-0.15 + 0.0015 * i, 0.03 + 0.002 * (i % 13), 0.02), g;
        bool known;
        if (field_project(&k.field, 1, &p, 0.3, NULL) != 0) continue;
        Vec3 r = v_round32(p);
        field_value(&k.field, r, &g, &known);
        assert_true(known && field_distance_vox(&k.field, r) < 1e-4);
    }
    known_free(&k);
    scene_free(&s);
}

/* A point of the ||.||_1 ball's ridge stays there, though the samples cut the ridge off. */
static void ridges_hold(void **state)
{
    (void)state;
    Scene s = load("{\"points\": [[0, 0, 0]], \"radius\": 1, \"norm\": 1, \"rotate\": {\"axis\": [1, 2, 3], \"degrees\": 25}}", "0.1");
    Known k = known_at(&s, 1);
    int stay = 0, all = 0;
    double back[3][3];
    for (int c = 0; c < 3; c++) { /* the columns of the rotation, by the ridges' own corners */
        double half = 25 * 3.14159265358979323846 / 360, w = cos(half), l = sqrt(14.0);
        Vec3 a = v_scale(vec3(1 / l, 2 / l, 3 / l), sin(half)), e = vec3(c == 0, c == 1, c == 2);
        Vec3 t = v_scale(v_cross(a, e), 2), r = v_add(v_axpy(e, w, t), v_cross(a, t));
        back[0][c] = r.x, back[1][c] = r.y, back[2][c] = r.z;
    }
    for (int i = 5; i < 95; i++) {
        Vec3 p = mat_mul((const double(*)[3])back, vec3(0.01 * i, 1 - 0.01 * i, 0)), was = p;
        all++;
        if (field_project(&k.field, 1, &p, 0.2, NULL) == 0) stay += v_dist(p, was) < 1e-6;
    }
    assert_true(stay > 0.7 * all);
    known_free(&k);
    scene_free(&s);
}

/* Frame by frame: the samples' topology, vertices on the function. */
static void a_tracked_scene_keeps_both(void **state)
{
    (void)state;
    Scene s = load("{\"points\": [[0.8, 0, 0], [-0.8, 0, 0]], \"radius\": 0.35, \"scale\": {\"keys\": [[1, [1, 1, 1]], [6, [0.75, 1.1, 1]]]}}", "0.1");
    TrackSettings set = track_defaults();
    Track *tr = track_open(&set);
    Known k[6];
    for (int f = 0; f < 6; f++) {
        FrameStat stat = {0};
        Err err;
        TriMesh m;
        k[f] = known_at(&s, f + 1);
        assert_true(track_frame(tr, &k[f].field, NULL, 1, &stat, &err));
        assert_int_equal(stat.wrong_components, 0);
        assert_int_equal(stat.inverted_left, 0);
        track_meshes(tr, false, &m, NULL);
        int on = 0;
        for (int v = 0; v < m.nvert; v++) {
            Vec3 p = vec3(m.pos[3 * v], m.pos[3 * v + 1], m.pos[3 * v + 2]), g;
            double F;
            scene_sample(k[f].frame, 1, &p, &F, &g);
            on += fabs(F) < 1e-5 * v_len(g);
        }
        assert_true(on > 0.9 * m.nvert);
        trimesh_free(&m);
    }
    track_close(tr);
    for (int f = 0; f < 6; f++) known_free(&k[f]);
    scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_land_on_the_function),
        cmocka_unit_test(samples_decide),
        cmocka_unit_test(ridges_hold),
        cmocka_unit_test(a_tracked_scene_keeps_both),
    };
    return cmocka_run_group_tests(tests, temp_open, temp_close);
}
