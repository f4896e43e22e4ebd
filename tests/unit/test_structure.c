/* What a triangle mesh is, counted: sound ones, and one of each fault. */
#include "mesh_shapes.h"
#include "mesh/structure.h"

static void expect_near(double got, double want, double slack)
{
    if (!(fabs(got - want) <= slack)) fail_msg("%.17g is not %.17g", got, want);
}

/* Two tetrahedra over eight vertices, outward. */
static const Vec3 POS[8] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {5, 0, 1}};
static const int32_t TRI[24] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2, 4, 6, 5, 4, 5, 7, 5, 6, 7, 4, 7, 6};

static MeshStructure structure_of(int nvert, int ntri, const int32_t *tri)
{
    MeshStructure s;
    structure_build(&s, nvert, POS, ntri, tri);
    return s;
}

static int faults(const MeshStructure *s)
{
    return s->boundary_edges + s->nonmanifold_edges + s->misoriented_edges + s->nonmanifold_vertices + s->repeated_corners + s->duplicates + s->unreferenced;
}

static void two_tetrahedra_are_sound(void **state)
{
    (void)state;
    MeshStructure s = structure_of(8, 8, TRI);
    assert_int_equal(faults(&s), 0);
    assert_int_equal(s.ncomp, 2);
    assert_int_equal(s.nedge, 12);
    for (int c = 0; c < 2; c++) {
        assert_int_equal(component_euler(&s.comp[c]), 2);
        assert_true(s.comp[c].closed);
        expect_near(s.comp[c].volume, 1.0 / 6, 1e-15);
        assert_true(s.comp[c].lo.x == 5 * c && s.comp[c].hi.x == 5 * c + 1);
    }
    for (int t = 0; t < 8; t++) assert_int_equal(s.tri_comp[t], t / 4);
    for (int h = 0; h < 24; h++) assert_true(s.edge[s.side_edge[h]][0] == TRI[h] || s.edge[s.side_edge[h]][1] == TRI[h]);
    structure_free(&s);
}

static void a_torus_has_a_handle(void **state)
{
    (void)state;
    Shape t = shape_torus(9, 7, 3, 1);
    MeshStructure s;
    structure_build(&s, t.nvert, t.pos, t.ntri, t.tri);
    assert_int_equal(faults(&s), 0);
    assert_int_equal(structure_euler(&s), 0);
    assert_true(structure_volume(&s) > 0);
    structure_free(&s);
    shape_free(&t);
}

static void each_fault_is_counted(void **state)
{
    (void)state;
    int32_t tri[27];
    MeshStructure s = structure_of(8, 7, TRI); /* a hole */
    assert_true(s.boundary_edges == 3 && faults(&s) == 3 && s.comp[0].closed && !s.comp[1].closed);
    structure_free(&s);

    memcpy(tri, TRI, sizeof TRI);
    tri[0] = 1, tri[2] = 0; /* one triangle turned */
    s = structure_of(8, 8, tri);
    assert_true(s.misoriented_edges == 3 && faults(&s) == 3);
    structure_free(&s);

    memcpy(tri, TRI, sizeof TRI);
    memcpy(tri + 24, (int32_t[3]){1, 0, 2}, 12); /* one twice */
    s = structure_of(8, 9, tri);
    assert_true(s.duplicates == 1 && s.nonmanifold_edges == 3 && !s.comp[0].closed && s.ncomp == 2);
    structure_free(&s);

    memcpy(tri, TRI, sizeof TRI);
    for (int h = 12; h < 24; h++) tri[h] = tri[h] == 4 ? 0 : tri[h]; /* the two share a vertex */
    s = structure_of(8, 8, tri);
    assert_true(s.nonmanifold_vertices == 1 && s.unreferenced == 1 && faults(&s) == 2 && s.ncomp == 2 && structure_euler(&s) == 4);
    structure_free(&s);

    memcpy(tri, TRI, sizeof TRI);
    memcpy(tri + 24, (int32_t[3]){3, 3, 7}, 12);
    s = structure_of(8, 9, tri);
    assert_true(s.repeated_corners == 1 && faults(&s) == 1 && s.tri_comp[8] == NONE && s.side_edge[24] == NONE);
    structure_free(&s);

    s = structure_of(0, 0, NULL);
    assert_true(faults(&s) == 0 && s.ncomp == 0);
    structure_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_tetrahedra_are_sound),
        cmocka_unit_test(a_torus_has_a_handle),
        cmocka_unit_test(each_fault_is_counted),
    };
    return cmocka_run_group_tests_name("structure", tests, NULL, NULL);
}
