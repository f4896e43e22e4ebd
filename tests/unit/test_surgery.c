/* Pieces cut out of meshes and sewn up another way: the Euler characteristic and the number of components that follow. */
#include "mesh/surgery.h"
#include "mesh_shapes.h"

static Mesh mesh_of(Shape s)
{
    Mesh m;
    mesh_init(&m);
    mesh_take(&m, s, vec3(0, 0, 0));
    return m;
}

/* All triangles with a corner at which x, of the axis, lies between lo and hi. */
static void add_between(Region *r, int axis, double lo, double hi)
{
    const Mesh *m = r->mesh;
    for (int t = 0; t < m->ntri; t++)
        for (int k = 0; k < 3; k++) {
            double x = v_get(m->pos[m->corner[3 * t + k]], axis);
            if (x > lo && x < hi) region_add(r, t);
        }
}

static void cap_all(Mesh *m, Region *r, const Borders *b)
{
    Vec3 centre[8];
    assert_true(b->n <= 8);
    for (int i = 0; i < b->n; i++) centre[i] = border_centre(m, b, i);
    mesh_erase(m, r);
    for (int i = 0; i < b->n; i++) mesh_cap(m, border_length(b, i), border_halves(b, i), centre[i], m->next_id++);
    assert_mesh(m);
}

static void sphere_is_cut_in_two(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(3));
    Region r;
    Borders b = {0};
    region_init(&r, &m);
    add_between(&r, 0, -0.1, 0.1);
    assert_true(region_unpinch(&r, 1000));
    region_borders(&r, &b);
    assert_true(b.n == 2 && b.npiece == 1);
    cap_all(&m, &r, &b);
    assert_int_equal(mesh_components(&m, NULL, NULL), 2);
    assert_int_equal(mesh_euler(&m, NONE), 4);
    mesh_compact(&m, NULL);
    assert_mesh(&m);
    region_free(&r);
    borders_free(&b);
    mesh_free(&m);
}

/* Across the tube at one side: no more handle. */
static void torus_loses_its_handle(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_torus(24, 10, 3, 1));
    Region r;
    Borders b = {0};
    region_init(&r, &m);
    for (int t = 0; t < m.ntri; t++) {
        Vec3 p = m.pos[m.corner[3 * t]];
        if (p.x > 0 && fabs(p.y) < 0.3) region_add(&r, t);
    }
    assert_true(region_unpinch(&r, 1000));
    region_borders(&r, &b);
    assert_int_equal(b.n, 2);
    cap_all(&m, &r, &b);
    assert_int_equal(mesh_components(&m, NULL, NULL), 1);
    assert_int_equal(mesh_euler(&m, NONE), 2);
    region_free(&r);
    borders_free(&b);
    mesh_free(&m);
}

/* The discs around two poles sewn together, in any turn. */
static void weld_poles(Mesh *m, const Region *r, const Borders *b, int turn)
{
    int32_t matched[64];
    int n = border_length(b, 0);
    assert_true(b->n == 2 && b->npiece == 2 && n == border_length(b, 1) && n <= 64);
    for (int i = 0; i < n; i++) matched[i] = border_halves(b, 1)[(turn + n - i) % n];
    assert_true(mesh_can_weld(m, n, border_halves(b, 0), matched));
    mesh_erase(m, r);
    mesh_weld(m, n, border_halves(b, 0), matched);
    assert_mesh(m);
}

static void spheres_are_welded(void **state)
{
    (void)state;
    for (int turn = 0; turn < 4; turn++) {
        Mesh m;
        Region r;
        Borders b = {0};
        mesh_init(&m);
        mesh_take(&m, shape_sphere(2), vec3(0, 0, 0));
        mesh_take(&m, shape_sphere(2), vec3(2.1, 0, 0));
        region_init(&r, &m);
        add_between(&r, 0, 0.99, 1.11);
        region_grow(&r);
        region_borders(&r, &b);
        weld_poles(&m, &r, &b, turn);
        assert_int_equal(mesh_components(&m, NULL, NULL), 1);
        assert_int_equal(mesh_euler(&m, NONE), 2);
        mesh_compact(&m, NULL);
        assert_mesh(&m);
        region_free(&r);
        borders_free(&b);
        mesh_free(&m);
    }
}

static void pierced_sphere_is_a_torus(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(3));
    Region r;
    Borders b = {0};
    region_init(&r, &m);
    add_between(&r, 0, 0.99, 2);
    add_between(&r, 0, -2, -0.99);
    region_borders(&r, &b);
    weld_poles(&m, &r, &b, 0);
    assert_int_equal(mesh_components(&m, NULL, NULL), 1);
    assert_int_equal(mesh_euler(&m, NONE), 0);
    region_free(&r);
    borders_free(&b);
    mesh_free(&m);
}

static bool has_double_edge(const Mesh *m)
{
    Map edge;
    bool twice = false;
    map_init(&edge, 3 * m->ntri);
    for (int h = 0; h < 3 * m->ntri; h++)
        if (!tri_is_dead(m, h / 3) && map_put(&edge, key_pair(he_from(m, h), he_to(m, h)), h) != h) twice = true;
    map_free(&edge);
    return twice;
}

/* On a small sphere the two borders are near each other: in some turns edges would come to join the same vertices. */
static void what_would_be_double_is_not_welded(void **state)
{
    (void)state;
    int refused = 0;
    for (int turn = 0; turn < 4; turn++) {
        Mesh m = mesh_of(shape_sphere(1));
        Region r;
        Borders b = {0};
        int32_t matched[4];
        region_init(&r, &m);
        add_between(&r, 0, 0.99, 2);
        add_between(&r, 0, -2, -0.99);
        region_borders(&r, &b);
        assert_true(b.n == 2 && border_length(&b, 0) == 4 && border_length(&b, 1) == 4);
        for (int i = 0; i < 4; i++) matched[i] = border_halves(&b, 1)[(turn + 4 - i) % 4];
        bool can = mesh_can_weld(&m, 4, border_halves(&b, 0), matched);
        mesh_erase(&m, &r);
        mesh_weld(&m, 4, border_halves(&b, 0), matched);
        assert_int_equal(can, !has_double_edge(&m));
        refused += !can;
        region_free(&r);
        borders_free(&b);
        mesh_free(&m);
    }
    assert_in_range(refused, 1, 3);
}

/* Two triangles that touch at a vertex only: all around it comes in. */
static void pinches_are_filled(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(2));
    Region r;
    Borders b = {0};
    region_init(&r, &m);
    int h = m.out[0], g = he_around(&m, he_around(&m, h));
    region_add(&r, h / 3);
    region_add(&r, g / 3);
    assert_true(region_unpinch(&r, 100));
    assert_int_equal(r.n, mesh_valence(&m, 0));
    region_borders(&r, &b);
    assert_true(b.n == 1 && border_length(&b, 0) == mesh_valence(&m, 0));
    region_clear(&r);
    add_between(&r, 2, -0.1, 0.1);
    assert_false(region_unpinch(&r, 3));
    region_free(&r);
    borders_free(&b);
    mesh_free(&m);
}

static void islands_are_filled(void **state)
{
    (void)state;
    Mesh m = mesh_of(shape_sphere(3));
    Region r;
    Borders b = {0};
    region_init(&r, &m);
    add_between(&r, 0, 0.8, 2);
    int whole = r.n, pole = 0;
    region_clear(&r);
    for (int v = 0; v < m.nvert; v++)
        if (m.pos[v].x > m.pos[pole].x) pole = v;
    add_between(&r, 0, 0.8, m.pos[pole].x - 1e-9);
    region_borders(&r, &b);
    assert_true(r.n < whole + 1);
    region_fill_islands(&r, 50);
    region_borders(&r, &b);
    assert_true(b.n == 1 && r.n == whole);
    region_free(&r);
    borders_free(&b);
    mesh_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere_is_cut_in_two),
        cmocka_unit_test(torus_loses_its_handle),
        cmocka_unit_test(spheres_are_welded),
        cmocka_unit_test(pierced_sphere_is_a_torus),
        cmocka_unit_test(what_would_be_double_is_not_welded),
        cmocka_unit_test(pinches_are_filled),
        cmocka_unit_test(islands_are_filled),
    };
    return cmocka_run_group_tests_name("surgery", tests, NULL, NULL);
}
