/* Scenes: gradients against finite differences, norms, keyframes, the index and the tree against sums over all, bounds,
 * and that sparse sampling misses nothing. */
#include "scene/kernel.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

#include "temp_dir.h"

typedef struct Posed {
    Scene *scene;
    SceneFrame *f;
} Posed;

static Posed posed(const char *text, int64_t frame)
{
    Posed p = {.scene = NEW(Scene, 1)};
    Err err = {0};
    if (!scene_load(temp_write("scene.json", text, strlen(text)), p.scene, &err)) print_message("%s\n", err.text);
    assert_int_equal(err.code, ERR_NONE);
    p.f = scene_frame(p.scene, frame);
    return p;
}

static void unpose(Posed *p)
{
    scene_frame_free(p->f);
    scene_free(p->scene);
    mem_free(p->scene);
}

static uint64_t seed = 1;
static double draw(double low, double high)
{
    seed = hash_mix(seed + 0x9e3779b97f4a7c15ULL);
    return low + (high - low) * (double)(seed >> 11) / 9007199254740992.0;
}
static Vec3 draw_point(double size) { return vec3(draw(-size, size), draw(-size, size), draw(-size, size)); }

static double value_at(const SceneFrame *f, Vec3 p, Vec3 *g)
{
    double F;
    scene_sample(f, 1, &p, &F, g);
    return F;
}

#define HEAD "{\"frames\": [1, 10], \"domain\": [[-2, -2, -2], [2, 2, 2]], \"voxel\": 0.1, \"elements\": ["

static void lone_points_have_their_radius(void **state)
{
    (void)state;
    static const char *const norms[] = {"0.6", "0.8", "1", "2", "4", "10"};
    static const char *const kernels[] = {"inverse-square", "compact"};
    for (int n = 0; n < 6; n++)
        for (int k = 0; k < 2; k++) {
            char text[400];
            snprintf(text, sizeof text, HEAD "{\"points\": [[0.5, 0, 0]], \"radius\": 0.75, \"kernel\": \"%s\", \"norm\": %s}]}", kernels[k], norms[n]);
            Posed p = posed(text, 1);
            double q = strtod(norms[n], NULL), s = 0.75 * pow(3, -1 / q); /* on the diagonal */
            assert_true(fabs(value_at(p.f, vec3(1.25, 0, 0), NULL)) < 1e-12);
            assert_true(fabs(value_at(p.f, vec3(0.5 + s, s, -s), NULL)) < 1e-12);
            assert_true(value_at(p.f, vec3(0.5, 0, 0), NULL) > 0);
            assert_true(value_at(p.f, vec3(1.3, 0, 0), NULL) < 0);
            unpose(&p);
        }
}

/* Every shape, kernel, norm, placement and warp at once or in turn. */
static const char *const SHAPES[] = {
    "\"points\": [[0.1, 0.2, 0.3], [-0.4, 0.2, 0]]",
    "\"segments\": [[[-0.5, 0, 0], [0.5, 0.3, 0.1]], [[0, 0, 0], [0, 0, 0]]]",
    "\"triangles\": [[[-0.5, 0, 0], [0.5, 0.3, 0.1], [0, 0.6, -0.5]]]",
    "\"polyline\": [[-0.5, 0, 0], [0.5, 0.3, 0.1], [0, 0.6, -0.5], [0, -1, 0]]",
};
static const char *const PLACES[] = {
    "",
    ", \"translate\": [0.3, -0.2, 0.1], \"rotate\": [0.5, 0.1, -0.7, 0.3], \"scale\": [0.7, 1.2, 1.5]",
    ", \"rotate\": {\"axis\": [1, 1, 0], \"degrees\": 40}, \"warp\": [{\"twist\": 70, \"axis\": \"x\"}]",
    ", \"warp\": [{\"bend\": 40, \"axis\": \"z\"}, {\"taper\": -0.3, \"axis\": \"y\"}]",
    ", \"scale\": 1.3, \"warp\": [{\"bend\": -50, \"axis\": \"x\"}, {\"twist\": 30, \"axis\": \"y\"}, {\"taper\": 0.4, \"axis\": \"z\"}]",
};

static Posed one_of_all(int shape, int place, int kernel, const char *norm)
{
    static const char *const kernels[] = {"inverse-square", "compact"};
    char text[1000];
    snprintf(text, sizeof text, HEAD "{%s%s, \"radius\": 0.6, \"strength\": 1.5, \"kernel\": \"%s\", \"norm\": %s}]}", SHAPES[shape], PLACES[place], kernels[kernel], norm);
    return posed(text, 1);
}

static void gradients_are_those_of_finite_differences(void **state)
{
    (void)state;
    static const char *const norms[] = {"2", "4", "1.5", "1", "0.7"};
    const double h = 1e-6;
    for (int c = 0; c < 4 * 5 * 2 * 5; c++) {
        Posed p = one_of_all(c % 4, c / 4 % 5, c / 20 % 2, norms[c / 40]);
        int wrong = 0;
        for (int i = 0; i < 40; i++) {
            Vec3 at = draw_point(1.5), g, d;
            double F = value_at(p.f, at, &g);
            for (int a = 0; a < 3; a++) {
                Vec3 low = at, high = at;
                v_set(&low, a, v_get(at, a) - h);
                v_set(&high, a, v_get(at, a) + h);
                v_set(&d, a, (value_at(p.f, high, NULL) - value_at(p.f, low, NULL)) / (2 * h));
            }
            wrong += v_dist(g, d) > 1e-4 * (v_len(g) + fabs(F) + 1);
        }
        if (wrong > 1) print_message("case %d: %d of 40\n", c, wrong); /* one may sit on a ridge */
        assert_true(wrong <= 1);
        unpose(&p);
    }
}

static void bounds_hold(void **state)
{
    (void)state;
    static const char *const norms[] = {"2", "8", "1", "0.6"};
    for (int c = 0; c < 4 * 5 * 2 * 4; c++) {
        Posed p = one_of_all(c % 4, c / 4 % 5, c / 20 % 2, norms[c / 40]);
        for (int i = 0; i < 30; i++) {
            Vec3 centre = draw_point(2);
            double r = draw(0.001, 0.7), low, high;
            scene_bound(p.f, centre, r, &low, &high);
            for (int k = 0; k < 30; k++) {
                Vec3 dir = v_unit(draw_point(1));
                double F = value_at(p.f, v_axpy(centre, r * draw(0, 1), dir), NULL);
                assert_true(F >= low - 1e-9 && F <= high + 1e-9);
            }
        }
        unpose(&p);
    }
}

static void keys_hold_their_ends_and_ease(void **state)
{
    (void)state;
    double frame[] = {10, 20, 40}, value[] = {1, 3, -1}, x;
    Keys k = {3, 1, EASE_LINEAR, frame, value};
    const struct {
        Ease ease;
        double frame, want;
    } at[] = {
        {EASE_LINEAR, 0, 1},  {EASE_LINEAR, 15, 2}, {EASE_LINEAR, 20, 3}, {EASE_LINEAR, 25, 2},      {EASE_LINEAR, 99, -1},
        {EASE_STEP, 19.9, 1}, {EASE_STEP, 20, 3},   {EASE_STEP, 39, 3},   {EASE_STEP, 40, -1},       {EASE_SMOOTH, 15, 2},
        {EASE_SMOOTH, 10, 1}, {EASE_SMOOTH, 99, -1}, {EASE_SMOOTH, 25, 3 - 4 * 0.15625},
    };
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        k.ease = at[i].ease;
        keys_at(&k, at[i].frame, &x);
        assert_true(fabs(x - at[i].want) < 1e-12);
    }
    /* a quarter turn about z from either sign of the quaternion: half of it at half time */
    double turn[] = {1, 0, 0, 0, -sqrt(0.5), 0, 0, -sqrt(0.5)}, q[4];
    Keys r = {2, 4, EASE_LINEAR, frame, turn};
    keys_at(&r, 15, q);
    assert_true(fabs(q[0] - cos(3.14159265358979 / 8)) < 1e-9 && fabs(q[3] - sin(3.14159265358979 / 8)) < 1e-9);
}

static void placement_follows_its_keys(void **state)
{
    (void)state;
    Posed p = posed(HEAD "{\"points\": [[1, 0, 0]], \"radius\": {\"keys\": [[1, 0.2], [3, 0.4]]}, \"scale\": 0.5,"
                         "\"rotate\": {\"axis\": [0, 0, 2], \"degrees\": {\"keys\": [[1, 0], [3, 180]]}},"
                         "\"translate\": {\"keys\": [[1, [0, 0, 1]], [3, [0, 0, 3]]]}}]}", 2);
    /* at frame 2: turned a quarter, half as large, radius 0.3 of the small one */
    assert_true(fabs(value_at(p.f, vec3(0, 0.5 + 0.15, 2), NULL)) < 1e-9);
    unpose(&p);
}

/* The element's plain sum. */
static double sum_of_all(const Posed *p, Vec3 at)
{
    const Element *e = &p->scene->element[0];
    double sum = 0, slope, R = p->f->pose[0].radius;
    Vec3 g;
    for (int i = 0; i < e->npart; i++) sum += kernel_value(e->kernel, norm_square(e->norm, v_sub(at, e->corner[i]), &g) * (1 / (R * R)), &slope);
    return e->strength * sum - p->scene->iso;
}

static void index_finds_all_that_reach(void **state)
{
    (void)state;
    static const char *const norms[] = {"2", "1", "10", "0.7"};
    for (int n = 0; n < 4; n++) {
        char text[400];
        snprintf(text, sizeof text, HEAD "{\"points\": {\"random\": 10000, \"seed\": 3, \"box\": [[-1, -1, -1], [1, 1, 1]]}, \"radius\": 0.04, \"kernel\": \"compact\", \"norm\": %s}]}", norms[n]);
        Posed p = posed(text, 1);
        assert_true(p.f->pose[0].index.cell > 0);
        double asked = 0;
        for (int i = 0; i < 200; i++) {
            Vec3 at = draw_point(1.1);
            int count;
            index_at(&p.f->pose[0].index, at, &count);
            asked += count;
            assert_true(value_at(p.f, at, NULL) == sum_of_all(&p, at)); /* in the same order, bit by bit */
        }
        assert_true(asked / 200 < 100); /* a few neighbours, not ten thousand */
        unpose(&p);
    }
}

static void tree_is_wrong_by_no_more_than_it_says(void **state)
{
    (void)state;
    static const char *const tolerance[] = {"1e-2", "1e-4", "1e-6"};
    for (int n = 0; n < 3; n++) {
        char text[400];
        snprintf(text, sizeof text, "{\"tolerance\": %s, %s{\"points\": {\"random\": 3000, \"seed\": 5, \"box\": [[-1, -1, -1], [1, 0, 0.5]]}, \"radius\": 0.01}]}", tolerance[n], HEAD + 1);
        Posed p = posed(text, 1);
        assert_true(p.f->pose[0].tree.nnode > 0);
        for (int i = 0; i < 100; i++) {
            Vec3 at = draw_point(2);
            assert_true(fabs(value_at(p.f, at, NULL) - sum_of_all(&p, at)) <= p.scene->tolerance * p.scene->iso);
        }
        unpose(&p);
    }
}

/* Every sample's sign, against F itself. */
static void blocks_miss_nothing(void **state)
{
    (void)state;
    for (int c = 0; c < 4 * 5 * 2; c++) {
        Posed p = one_of_all(c % 4, c / 4 % 5, c / 20, c % 3 ? "1.2" : "2");
        Grid g;
        Err err;
        grid_init(&g, 1);
        assert_true(scene_fill_grid(p.f, c & 1, &g, &err));
        for (int i = 0; i < 41 * 41 * 41; i++) {
            int at[3] = {i % 41, i / 41 % 41, i / (41 * 41)};
            double F = value_at(p.f, affine_to_world(&g.xform, vec3(at[0], at[1], at[2])), NULL);
            float v = grid_at(&g, at[0], at[1], at[2], 0);
            assert_true((F > 0) == (v < 0) || v == 0);
            if (grid_block(&g, at[0], at[1], at[2])) assert_true(v == (float)-F || v < 0);
        }
        grid_free(&g);
        unpose(&p);
    }
}

static void blocks_are_few(void **state)
{
    (void)state;
    Posed p = posed("{\"frames\": [1, 1], \"domain\": [[-2, -2, -2], [2, 2, 2]], \"voxel\": 0.02, \"elements\": [{\"points\": [[0, 0, 0]], \"radius\": 0.5}]}", 1);
    Grid g;
    Err err;
    grid_init(&g, 1);
    assert_true(scene_fill_grid(p.f, false, &g, &err));
    assert_true(g.nblock > 100 && g.nblock < 800); /* of 17576 */
    assert_true(g.hi[0] == 200 && g.ntile > 0);
    assert_true(grid_at(&g, 100, 100, 100, 0) < -1 && grid_at(&g, 180, 0, 100, 0) == 1);
    grid_free(&g);
    unpose(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lone_points_have_their_radius),
        cmocka_unit_test(gradients_are_those_of_finite_differences),
        cmocka_unit_test(bounds_hold),
        cmocka_unit_test(keys_hold_their_ends_and_ease),
        cmocka_unit_test(placement_follows_its_keys),
        cmocka_unit_test(index_finds_all_that_reach),
        cmocka_unit_test(tree_is_wrong_by_no_more_than_it_says),
        cmocka_unit_test(blocks_miss_nothing),
        cmocka_unit_test(blocks_are_few),
    };
    return cmocka_run_group_tests(tests, temp_open, temp_close);
}
