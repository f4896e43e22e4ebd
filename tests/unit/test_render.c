/* Pictures held to what geometry says: cameras, depths, places, normals, identities, motion. */
#include "render/render_priv.h"

#include "base/thread.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

enum { ROUND = 48, RISE = 24, WIDTH = 96, HEIGHT = 72 };
#define ALL ((1u << LAYER_COUNT) - 1)

static void put(float *to, Vec3 v)
{
    to[0] = (float)v.x, to[1] = (float)v.y, to[2] = (float)v.z;
}

/* A unit sphere about the origin: rings around z between two poles. */
static TriMesh sphere(void)
{
    TriMesh m;
    int rings = RISE - 1, t = 0;
    trimesh_init(&m, rings * ROUND + 2, 2 * ROUND * rings, false, false);
    for (int v = 0; v < m.nvert; v++) {
        double up = 3.14159265358979 * (v / ROUND + 1) / RISE, around = 2 * 3.14159265358979 * (v % ROUND) / ROUND;
        Vec3 p = v == m.nvert - 2 ? vec3(0, 0, 1) : v == m.nvert - 1 ? vec3(0, 0, -1) : vec3(sin(up) * cos(around), sin(up) * sin(around), cos(up));
        put(m.pos + 3 * v, p);
        put(m.normal + 3 * v, p);
        m.id[v] = 1000 + 3 * v;
    }
    for (int i = 0; i < ROUND; i++) {
        int j = (i + 1) % ROUND, last = (rings - 1) * ROUND;
        int caps[6] = {m.nvert - 2, i, j, m.nvert - 1, last + j, last + i};
        for (int k = 0; k < 6; k++) m.tri[t++] = caps[k];
        for (int r = 0; r < last; r += ROUND) {
            int quad[6] = {r + i, r + ROUND + i, r + ROUND + j, r + i, r + ROUND + j, r + j};
            for (int k = 0; k < 6; k++) m.tri[t++] = quad[k];
        }
    }
    assert_int_equal(t, 3 * m.ntri);
    return m;
}

/* Turned about z, then moved. */
typedef struct Way {
    double angle;
    Vec3 by;
} Way;

static Vec3 gone(const Way *w, Vec3 p)
{
    double c = cos(w->angle), s = sin(w->angle);
    return v_add(vec3(c * p.x - s * p.y, s * p.x + c * p.y, p.z), w->by);
}

static TriMesh moved_sphere(const Way *w)
{
    TriMesh m = sphere();
    for (int v = 0; v < m.nvert; v++) put(m.pos + 3 * v, gone(w, vertex_at(m.pos, v)));
    return m;
}

static Camera camera_here(void) { return camera_make(vec3(1, -4, 1.5), vec3(0.2, 0, 0), vec3(0, 0, 1), 40, WIDTH, HEIGHT); }

static Picture picture_of(const RenderFrame *f, const RenderLook *look, unsigned layers)
{
    Err err = {0};
    Picture p;
    Renderer *r = renderer_open(&err);
    assert_non_null(r);
    picture_init(&p, f->camera.width, f->camera.height, layers);
    assert_true(render_frame(r, look, f, &p, &err));
    renderer_close(r);
    return p;
}

static const RenderLook plain = {.samples = 4, .cell = 0.3};

static double real_at(const Picture *p, PlaneId id, int i) { return (double)p->plane[id][i].real; }
static bool is_seen(const Picture *p, int i) { return p->plane[PLANE_VERTEX][i].number != PICTURE_NOBODY; }
static Vec3 place_at(const Picture *p, PlaneId first, int i) { return vec3(real_at(p, first, i), real_at(p, first + 1, i), real_at(p, first + 2, i)); }

/* --- cameras ------------------------------------------------------------------------------------------ */

static void a_ray_comes_back_to_its_pixel(void **state)
{
    (void)state;
    Camera c = camera_here();
    for (int i = 0; i < 20; i++) {
        double x = 4.7 * i, y = 70 - 3.1 * i;
        Vec3 p = camera_project(&c, v_axpy(c.eye, 2.5, camera_ray(&c, x, y)));
        assert_true(fabs(p.x - x) < 1e-9 && fabs(p.y - y) < 1e-9 && fabs(p.z - 2.5) < 1e-12);
    }
    Vec3 above = camera_project(&c, vec3(0.2, 0, 0.5));
    assert_true(above.y < 0.5 * HEIGHT && fabs(above.x - 0.5 * WIDTH) < 1e-9);
}

/* How far the mesh reaches in the picture: left, right, top, bottom. */
static void reach_in_picture(const TriMesh *m, const Camera *c, double out[4])
{
    out[0] = out[2] = INFINITY;
    out[1] = out[3] = -INFINITY;
    for (int v = 0; v < m->nvert; v++) {
        Vec3 p = camera_project(c, vertex_at(m->pos, v));
        assert_true(p.z > 0);
        out[0] = fmin(out[0], p.x), out[1] = fmax(out[1], p.x), out[2] = fmin(out[2], p.y), out[3] = fmax(out[3], p.y);
    }
}

static void a_fitted_camera_sees_all_in_the_middle(void **state)
{
    (void)state;
    TriMesh m = moved_sphere(&(Way){0, {7, -3, 5}});
    Fit fit = fit_begin(vec3(1, -2, 3), vec3(0, 0, 1), 30, WIDTH, HEIGHT);
    double at[4];
    fit_add_mesh(&fit, &m);
    Camera c = fit_camera(&fit);
    reach_in_picture(&m, &c, at);
    assert_true(fabs(at[0] + at[1] - WIDTH) < 0.1 && fabs(at[2] + at[3] - HEIGHT) < 0.1);
    assert_true(at[2] > 0 && at[2] < 0.05 * HEIGHT);
    trimesh_free(&m);
}

static void a_turning_camera_sees_all(void **state)
{
    (void)state;
    TriMesh m = moved_sphere(&(Way){0, {7, -3, 5}});
    Vec3 up = vec3(0, 0, 1);
    Fit fit = fit_begin(vec3(1, -2, 3), up, 30, WIDTH, HEIGHT);
    Bounds b = bounds_none();
    bounds_add_mesh(&b, &m);
    Camera first = fit_turning(&fit, &b, up);
    for (int turn = 0; turn < 8; turn++) {
        double at[4];
        Camera c = camera_turned(&first, bounds_centre(&b), up, 45 * turn);
        reach_in_picture(&m, &c, at);
        assert_true(at[0] >= 0 && at[1] <= WIDTH && at[2] >= 0 && at[3] <= HEIGHT);
    }
    trimesh_free(&m);
}

static void any_camera_has_axes(void **state)
{
    (void)state;
    Camera c[3] = {camera_make(vec3(0, 0, 5), vec3(0, 0, 0), vec3(0, 0, 1), 40, 8, 8),
                   camera_make(vec3(0, 5, 0), vec3(0, 0, 0), vec3(0, 1, 0), 40, 8, 8),
                   camera_make(vec3(1, 1, 1), vec3(1, 1, 1), vec3(0, 0, 1), 40, 8, 8)};
    for (int i = 0; i < 3; i++)
        assert_true(fabs(v_len(c[i].right) - 1) < 1e-12 && fabs(v_len(c[i].up) - 1) < 1e-12 && fabs(v_dot(c[i].right, c[i].up)) < 1e-12 &&
                    fabs(v_dot(v_cross(c[i].right, c[i].up), c[i].back) - 1) < 1e-12);
}

/* --- data --------------------------------------------------------------------------------------------- */

static void data_are_those_of_the_sphere(void **state)
{
    (void)state;
    TriMesh m = sphere();
    RenderFrame f = {.mesh = &m, .camera = camera_here()};
    Picture p = picture_of(&f, &plain, ALL);
    int seen = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        Vec3 along = v_unit(camera_ray(&f.camera, i % WIDTH + 0.5, i / WIDTH + 0.5)), to = v_sub(vec3(0, 0, 0), f.camera.eye);
        double closest = v_len(v_axpy(to, -v_dot(to, along), along));
        if (closest > 1.001 || closest < 0.98) assert_int_equal(is_seen(&p, i), closest < 1);
        if (!is_seen(&p, i)) {
            assert_true(real_at(&p, PLANE_Z, i) == (double)PICTURE_FAR && real_at(&p, PLANE_POSITION_X, i) == 0);
            continue;
        }
        seen++;
        Vec3 place = place_at(&p, PLANE_POSITION_X, i), normal = place_at(&p, PLANE_NORMAL_X, i), back = camera_project(&f.camera, place);
        /* facets of 7.5 degrees lie within 0.5 % of the radius */
        assert_true(v_len(place) < 1.0001 && v_len(place) > 0.994);
        assert_true(v_dist(normal, v_unit(place)) < 0.01);
        assert_true(fabs(back.x - (i % WIDTH + 0.5)) < 1e-3 && fabs(back.y - (i / WIDTH + 0.5)) < 1e-3);
        assert_true(fabs(back.z - real_at(&p, PLANE_Z, i)) < 1e-5);
        assert_int_equal(p.plane[PLANE_OBJECT][i].number, 1000);
        uint32_t id = p.plane[PLANE_VERTEX][i].number;
        assert_true(id >= 1000 && id % 3 == 1);
        assert_true(v_dist(vertex_at(m.pos, (int)(id - 1000) / 3), place) < 0.1);
    }
    assert_true(seen > 1000);
    picture_free(&p);
    trimesh_free(&m);
}

static void alpha_is_the_area(void **state)
{
    (void)state;
    TriMesh m = sphere();
    Camera c = camera_make(vec3(0, -10, 0), vec3(0, 0, 0), vec3(0, 0, 1), 15, 64, 64);
    RenderFrame f = {.mesh = &m, .camera = c};
    RenderLook look = {.samples = 64, .cell = 1};
    Picture p = picture_of(&f, &look, 1u << LAYER_BEAUTY);
    double sum = 0, radius = 1 / sqrt(99) / c.pixel; /* of the silhouette: a tangent cone's */
    for (int i = 0; i < 64 * 64; i++) {
        double alpha = real_at(&p, PLANE_A, i);
        sum += alpha;
        assert_true(alpha >= 0 && alpha <= 1 && (alpha > 0 || real_at(&p, PLANE_R, i) == 0));
    }
    assert_true(fabs(sum / (3.14159265 * radius * radius) - 1) < 0.01);
    picture_free(&p);
    trimesh_free(&m);
}

static void a_dent_is_darker(void **state)
{
    (void)state;
    /* a floor with a lid over half of it */
    TriMesh m;
    enum { N = 24 };
    trimesh_init(&m, 2 * N * N, 4 * (N - 1) * (N - 1), false, false);
    for (int v = 0; v < m.nvert; v++) {
        int sheet = v / (N * N), i = v % N, j = v / N % N;
        put(m.pos + 3 * v, vec3(sheet ? i / 2.0 : i, j, 4.0 * sheet));
        put(m.normal + 3 * v, vec3(0, 0, 1));
        m.id[v] = v;
    }
    for (int t = 0, sheet = 0; sheet < 2; sheet++)
        for (int j = 0; j < N - 1; j++)
            for (int i = 0; i < N - 1; i++) {
                int a = sheet * N * N + j * N + i, quad[6] = {a, a + 1, a + N + 1, a, a + N + 1, a + N};
                for (int k = 0; k < 6; k++) m.tri[t++] = quad[k];
            }
    Err err = {0};
    Tracer *tracer = tracer_open(&err);
    assert_true(tracer_load(tracer, &m, &err));
    Camera c = camera_make(vec3(12, -20, 20), vec3(12, 12, 0), vec3(0, 0, 1), 40, 8, 8);
    Studio studio = studio_make(&c);
    float *reach = light_reaching(tracer, &m, m.normal, &studio);
    int under = 12 * N + 4, beside = 12 * N + 22, on = N * N + 12 * N + 12;
    assert_true((double)reach[2 * under + 1] < 0.4 && (double)reach[2 * beside + 1] > 0.6);
    assert_true((double)reach[2 * on + 1] > 0.99 && (double)reach[2 * on] > 0.99);
    mem_free(reach);
    tracer_close(tracer);
    trimesh_free(&m);
}

static void nothing_is_pictured_of_nothing(void **state)
{
    (void)state;
    TriMesh m;
    trimesh_init(&m, 0, 0, false, false);
    RenderFrame f = {.mesh = &m, .camera = camera_here(), .before.camera = camera_here(), .after.camera = camera_here()};
    Picture p = picture_of(&f, &plain, ALL);
    for (int i = 0; i < WIDTH * HEIGHT; i++) assert_true(real_at(&p, PLANE_A, i) == 0 && !is_seen(&p, i));
    picture_free(&p);
    trimesh_free(&m);
}

/* --- motion ------------------------------------------------------------------------------------------- */

/* Where what is seen in pixel i has gone to, in pixels to the right and up. */
static void expect_motion(const Picture *p, int i, PlaneId first, const Camera *here, const Camera *there, const Way *way, float known, double most)
{
    Vec3 place = place_at(p, PLANE_POSITION_X, i), a = camera_project(here, place), b = camera_project(there, gone(way, place));
    assert_true(p->plane[first + 2][i].real == known);
    assert_true(fabs(real_at(p, first, i) - (b.x - a.x)) < most);
    assert_true(fabs(real_at(p, first + 1, i) - (a.y - b.y)) < most);
}

static void motion_is_that_of_the_sphere(void **state)
{
    (void)state;
    const Way still = {0}, on = {0.3, {0.25, 0.1, -0.15}}, back = {-0.2, {-0.1, 0.2, 0.3}};
    TriMesh m = moved_sphere(&still), after = moved_sphere(&on), before = moved_sphere(&back);
    Camera c = camera_here();
    RenderFrame f = {.mesh = &m, .camera = c, .before = {&before, camera_turned(&c, vec3(0, 0, 0), vec3(0, 0, 1), -5), -1}, .after = {&after, c, 1}};
    Picture p = picture_of(&f, &plain, ALL);
    int seen = 0;
    double most = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        if (!is_seen(&p, i)) {
            assert_true(p.plane[PLANE_FORWARD_KNOWN][i].real == 0 && real_at(&p, PLANE_BACKWARD_U, i) == 0);
            continue;
        }
        seen++;
        most = fmax(most, fabs(real_at(&p, PLANE_FORWARD_U, i)));
        expect_motion(&p, i, PLANE_FORWARD_U, &c, &c, &on, 1, 1e-3);
        expect_motion(&p, i, PLANE_BACKWARD_U, &c, &f.before.camera, &back, 1, 1e-3);
    }
    assert_true(seen > 1000 && most > 5); /* pixels */
    picture_free(&p);
    trimesh_free(&m);
    trimesh_free(&after);
    trimesh_free(&before);
}

/* One half of the vertices is another's in the next frame, and there is no frame before. */
static void velocities_serve_where_identities_end(void **state)
{
    (void)state;
    const Way on = {0, {0.1, 0, 0.05}}, back = {0, {-0.1, 0, -0.05}};
    TriMesh m = sphere(), after = moved_sphere(&on);
    for (int v = 0; v < m.nvert; v++)
        if (vertex_at(m.pos, v).z < 0) after.id[v] += 1000000;
    m.velocity = NEW(float, 3 * (size_t)m.nvert);
    for (int v = 0; v < m.nvert; v++) put(m.velocity + 3 * v, v_scale(on.by, 24));
    Camera c = camera_here();
    RenderFrame f = {.mesh = &m, .camera = c, .before = {NULL, c, -1.0 / 24}, .after = {&after, c, 1.0 / 24}};
    Picture p = picture_of(&f, &plain, ALL);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        if (!is_seen(&p, i)) continue;
        double z = real_at(&p, PLANE_POSITION_Z, i);
        if (fabs(z) > 0.2) expect_motion(&p, i, PLANE_FORWARD_U, &c, &c, &on, z > 0 ? 1 : 0.5f, 1e-3);
        expect_motion(&p, i, PLANE_BACKWARD_U, &c, &c, &back, 0.5f, 1e-3);
    }
    picture_free(&p);
    trimesh_free(&m);
    trimesh_free(&after);
}

/* The vertices slide around z while the sphere moves on: their velocities know better. */
static void vertices_that_slide_do_not_tell(void **state)
{
    (void)state;
    const Way on = {0, {0.1, 0.05, 0.05}}, slid = {0.04, on.by};
    TriMesh m = sphere(), after = moved_sphere(&slid);
    m.velocity = NEW(float, 3 * (size_t)m.nvert);
    for (int v = 0; v < m.nvert; v++) {
        /* as if it grew as well: the surface itself says where it is */
        put(m.velocity + 3 * v, v_axpy(v_scale(on.by, 24), 1, vertex_at(m.pos, v)));
        put(after.normal + 3 * v, v_sub(vertex_at(after.pos, v), on.by));
    }
    Camera c = camera_here();
    RenderFrame f = {.mesh = &m, .camera = c, .before = {NULL, c, -1.0 / 24}, .after = {&after, c, 1.0 / 24}};
    Picture p = picture_of(&f, &plain, ALL);
    for (int i = 0; i < WIDTH * HEIGHT; i++)
        if (is_seen(&p, i)) expect_motion(&p, i, PLANE_FORWARD_U, &c, &c, &on, 1, 0.1);
    picture_free(&p);
    trimesh_free(&m);
    trimesh_free(&after);
}

static void indices_are_no_identities(void **state)
{
    (void)state;
    TriMesh m = sphere(), other = sphere();
    for (int v = 0; v < m.nvert; v++) m.id[v] = other.id[v] = v;
    Motion same = motion_find(&m, &(RenderOther){.mesh = &other});
    assert_true(same.known[7] == 1);
    motion_free(&same);
    int32_t first = other.tri[0];
    other.tri[0] = other.tri[1], other.tri[1] = other.tri[2], other.tri[2] = first; /* another file, made anew */
    Motion changed = motion_find(&m, &(RenderOther){.mesh = &other});
    assert_true(changed.known[7] == 0);
    motion_free(&changed);
    trimesh_free(&m);
    trimesh_free(&other);
}

/* --- what lies on the surface --------------------------------------------------------------------------- */

static void edges_between_parents_are_drawn(void **state)
{
    (void)state;
    TriMesh m = sphere();
    m.parent = NEW(int32_t, m.ntri);
    for (int t = 0; t < m.ntri; t++) m.parent[t] = vertex_at(m.pos, m.tri[3 * t]).z + vertex_at(m.pos, m.tri[3 * t + 1]).z + vertex_at(m.pos, m.tri[3 * t + 2]).z > 0;
    uint8_t *drawn = surface_wire(&m, WIRE_PARENTS), *all = surface_wire(&m, WIRE_TRIANGLES);
    int count = 0;
    for (int t = 0; t < m.ntri; t++) {
        assert_int_equal(all[t], 7);
        for (int k = 0; k < 3; k++) count += drawn[t] >> k & 1;
    }
    assert_int_equal(count, 2 * ROUND); /* the equator, from both sides */
    mem_free(drawn);
    mem_free(all);
    mem_free(m.parent);
    m.parent = NULL;
    assert_null(surface_wire(&m, WIRE_PARENTS));
    trimesh_free(&m);
}

static void rest_positions_of_two_frames_do_not_mix(void **state)
{
    (void)state;
    TriMesh m = sphere();
    float *column[4];
    static char *name[4] = {"rest_x", "rest_y", "rest_z", "rest_frame"};
    for (int a = 0; a < 4; a++) column[a] = NEW0(float, m.nvert);
    for (int v = 0; v < m.nvert; v++)
        for (int a = 0; a < 3; a++) column[a][v] = m.pos[3 * v + a] + 5;
    m.nattr = 4, m.attr_name = name, m.attr = column;
    Spot s = {.corner = {0, ROUND, ROUND + 1}, .weight = {0.5, 0.25, 0.25}};
    RestColumns rest = surface_rest(&m);
    Vec3 want = v_add(spot_blend(&s, m.pos), vec3(5, 5, 5));
    assert_true(render_has_rest(&m) && v_dist(rest_at(&rest, &m, &s), want) < 1e-6);
    column[3][ROUND] = 2, column[0][ROUND] = 100;
    assert_true(v_dist(rest_at(&rest, &m, &s), want) < 1e-6);
    m.nattr = 0, m.attr_name = NULL, m.attr = NULL;
    for (int a = 0; a < 4; a++) mem_free(column[a]);
    assert_false(render_has_rest(&m));
    trimesh_free(&m);
}

static void missing_and_odd_normals_are_made(void **state)
{
    (void)state;
    TriMesh m = sphere();
    memset(m.normal, 0, 3 * (size_t)m.nvert * sizeof *m.normal);
    float *normal = surface_normals(&m);
    for (int v = 0; v < m.nvert; v++) assert_true(v_dist(vertex_at(normal, v), vertex_at(m.pos, v)) < 0.08);
    mem_free(normal);
    put(m.normal + 15, v_unit(v_add(vertex_at(m.pos, 5), vec3(0.2, 0, 0)))); /* one that is sound */
    put(m.normal + 18, vec3(0, 0, -1));                                      /* and one that is not */
    normal = surface_normals(&m);
    assert_memory_equal(normal + 15, m.normal + 15, 3 * sizeof *normal);
    assert_true(v_dist(vertex_at(normal, 6), vertex_at(m.pos, 6)) < 0.08);
    mem_free(normal);
    trimesh_free(&m);
}

static void columns_are_pasted(void **state)
{
    (void)state;
    Picture wide, narrow;
    uint8_t rgb[6 * 2 * 3];
    picture_init(&wide, 6, 2, 1u << LAYER_BEAUTY);
    picture_init(&narrow, 2, 2, 1u << LAYER_BEAUTY);
    for (int i = 0; i < 4; i++) narrow.plane[PLANE_A][i].real = 1, narrow.plane[PLANE_R][i].real = 0.5f, narrow.plane[PLANE_B][i].real = 2;
    picture_paste(&wide, 2, &narrow);
    picture_to_rgb(&wide, rgb);
    for (int i = 0; i < 12; i++) {
        bool in = i % 6 == 2 || i % 6 == 3;
        assert_int_equal(rgb[3 * i], in ? 188 : 255); /* sRGB of one half */
        assert_int_equal(rgb[3 * i + 1], in ? 0 : 255);
        assert_int_equal(rgb[3 * i + 2], 255);
    }
    picture_free(&wide);
    picture_free(&narrow);
}

int main(void)
{
    thread_set_count(2);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ray_comes_back_to_its_pixel),
        cmocka_unit_test(a_fitted_camera_sees_all_in_the_middle),
        cmocka_unit_test(a_turning_camera_sees_all),
        cmocka_unit_test(any_camera_has_axes),
        cmocka_unit_test(data_are_those_of_the_sphere),
        cmocka_unit_test(alpha_is_the_area),
        cmocka_unit_test(a_dent_is_darker),
        cmocka_unit_test(nothing_is_pictured_of_nothing),
        cmocka_unit_test(motion_is_that_of_the_sphere),
        cmocka_unit_test(velocities_serve_where_identities_end),
        cmocka_unit_test(vertices_that_slide_do_not_tell),
        cmocka_unit_test(indices_are_no_identities),
        cmocka_unit_test(edges_between_parents_are_drawn),
        cmocka_unit_test(rest_positions_of_two_frames_do_not_mix),
        cmocka_unit_test(missing_and_odd_normals_are_made),
        cmocka_unit_test(columns_are_pasted),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    thread_shutdown();
    return failed;
}
