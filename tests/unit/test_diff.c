/* Two meshes apart by known amounts. */
#include "mechanics_shapes.h"
#include "diff/diff.h"

#include <math.h>

static TriMesh mesh_of(Shape s)
{
    TriMesh m;
    trimesh_init(&m, s.nvert, s.ntri, true, false);
    for (int i = 0; i < 3 * s.nvert; i++) {
        m.pos[i] = m.normal[i] = (float)v_get(s.pos[i / 3], i % 3);
        m.velocity[i] = (float)i;
    }
    for (int v = 0; v < s.nvert; v++) m.id[v] = v;
    memcpy(m.tri, s.tri, 3 * (size_t)s.ntri * sizeof *m.tri);
    shape_free(&s);
    return m;
}

static const DiffSettings EXACT = {0}, NEAR = {.tolerance = 0.01, .normals_deg = 180, .values = INFINITY};

static void one_connectivity(void **state)
{
    (void)state;
    TriMesh a = mesh_of(shape_sphere(3)), b = mesh_of(shape_sphere(3));
    DiffMesh d = diff_meshes(&EXACT, &a, &b);
    assert_true(d.same && d.same_run && d.place == 0 && d.velocity == 0 && d.place_vertex == NONE && isnan(d.value));
    b.pos[3 * 17] += 0.005f;
    d = diff_meshes(&EXACT, &a, &b);
    assert_true(!d.same && d.place_vertex == 17 && fabs(d.place - 0.005) < 1e-7);
    assert_true(diff_meshes(&NEAR, &a, &b).same);
    b.pos[3 * 17] += 0.02f;
    assert_false(diff_meshes(&NEAR, &a, &b).same);

    b.pos[3 * 17] = a.pos[3 * 17];
    memcpy(b.normal + 3 * 9, (float[3]){-a.normal[27], -a.normal[28], -a.normal[29]}, 12);
    d = diff_meshes(&EXACT, &a, &b);
    assert_true(!d.same && fabs(d.normal_deg - 180) < 1e-4 && diff_meshes(&NEAR, &a, &b).same);
    assert_false(diff_meshes(&(DiffSettings){.tolerance = 0.01, .normals_deg = 90, .values = INFINITY}, &a, &b).same);

    memcpy(b.normal + 3 * 9, a.normal + 3 * 9, 12);
    b.velocity[5] += 2;
    assert_true(!diff_meshes(&EXACT, &a, &b).same && diff_meshes(&NEAR, &a, &b).velocity == 2);
    mem_free(b.velocity);
    b.velocity = NULL;
    assert_true(!diff_meshes(&EXACT, &a, &b).same && diff_meshes(&NEAR, &a, &b).same);
    trimesh_free(&a);
    trimesh_free(&b);
}

static void other_triangles(void **state)
{
    (void)state;
    TriMesh a = mesh_of(shape_sphere(4)), b = mesh_of(shape_sphere(3)), none;
    trimesh_init(&none, 0, 0, false, false);
    DiffSettings surface = {.tolerance = 0.02, .normals_deg = 180, .values = INFINITY, .surface = true};
    DiffMesh d = diff_meshes(&NEAR, &a, &b);
    assert_true(!d.same && !d.same_run && d.side[0].components == 1 && d.side[1].euler == 2);
    double sagitta = d.side[0].distance; /* of the coarse sphere's triangles: the fine one's vertices stand on the ball */
    assert_true(sagitta > 0.005 && sagitta < 0.02 && d.side[1].distance < sagitta);
    assert_true(diff_meshes(&surface, &a, &b).same);
    surface.tolerance = 0.5 * sagitta;
    assert_false(diff_meshes(&surface, &a, &b).same);

    d = diff_meshes(&surface, &a, &none);
    assert_true(!d.same && isnan(d.side[0].distance));
    assert_true(diff_meshes(&EXACT, &none, &none).same);
    a.id[4] = 77; /* the same triangles over other identities are another run */
    TriMesh c = mesh_of(shape_sphere(4));
    assert_false(diff_meshes(&NEAR, &a, &c).same);
    surface.tolerance = 0.01;
    assert_true(diff_meshes(&surface, &a, &c).same);
    trimesh_free(&a);
    trimesh_free(&b);
    trimesh_free(&c);
    trimesh_free(&none);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(one_connectivity), cmocka_unit_test(other_triangles)};
    return cmocka_run_group_tests_name("diff", tests, NULL, NULL);
}
