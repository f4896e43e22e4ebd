/* The exact trilinear isosurface: components, Euler characteristics, volumes, and its triangles. */
#include "fields.h"
#include "mesh_shapes.h"
#include "topology/iso.h"

typedef struct Frame {
    Field field;
    IsoSurface iso;
} Frame;

static void frame_make(Frame *fr, Grid g)
{
    fr->field = field_from(g);
    iso_build(&fr->iso, &fr->field);
}

static void frame_free(Frame *fr)
{
    iso_free(&fr->iso);
    field_free(&fr->field);
}

/* Triangulates the components wanted (NULL: all): a closed manifold whose components are, one to one, those of the
 * isosurface, each with its Euler characteristic. */
static Mesh assert_triangulates(const IsoSurface *iso, const uint8_t *want)
{
    uint8_t *all = NEW(uint8_t, iso->ncomp);
    int32_t *home, nwant = 0;
    for (int k = 0; k < iso->ncomp; k++) nwant += all[k] = want ? want[k] : 1;
    Mesh m;
    mesh_init(&m);
    iso_triangulate(iso, all, &m, &home);
    assert_mesh(&m);
    int32_t *comp = NEW(int32_t, m.nvert), *tri = NEW(int32_t, m.ntri);
    int n = mesh_components(&m, tri, comp);
    assert_int_equal(n, nwant);
    int32_t *of = NEW(int32_t, n), *chi2 = NEW0(int32_t, n);
    for (int c = 0; c < n; c++) of[c] = NONE;
    for (int v = 0; v < m.nvert; v++) {
        if (of[comp[v]] == NONE) of[comp[v]] = home[v];
        assert_int_equal(of[comp[v]], home[v]);
        chi2[comp[v]] += 2;
    }
    for (int t = 0; t < m.ntri; t++) chi2[tri[t]] -= 1; /* F - E = -F / 2 */
    for (int c = 0; c < n; c++) {
        assert_true(all[of[c]]);
        assert_int_equal(chi2[c], 2 * iso->comp_euler[of[c]]);
        for (int d = 0; d < c; d++) assert_int_not_equal(of[c], of[d]);
    }
    mem_free(all);
    mem_free(home);
    mem_free(comp);
    mem_free(tri);
    mem_free(of);
    mem_free(chi2);
    return m;
}

static void components_and_euler_numbers_are_known(void **state)
{
    (void)state;
    const double pi = 3.14159265358979;
    const struct {
        FieldFn *fn;
        double k[8];
        int ncomp, chi[2];
        double volume[2];
    } row[] = {
        {fn_ball, {15.5, 15.2, 15.8, 8}, 1, {2}, {4 * pi / 3 * 512}},
        {fn_torus, {15.5, 15.2, 15.8, 9, 4}, 1, {0}, {2 * pi * pi * 9 * 16}},
        {fn_two_balls, {8, 8, 8, 6, 23, 23, 23, 6}, 2, {2, 2}, {4 * pi / 3 * 216, 4 * pi / 3 * 216}},
        {fn_two_balls, {12, 16, 16, 7, 20, 16, 16, 7}, 1, {2}, {4 * pi / 3 * 343 * 2 - pi / 12 * (4 * 7 + 8) * (14 - 8) * (14 - 8)}},
        {fn_cavity, {15.5, 15.2, 15.8, 10, 5}, 2, {2, 2}, {4 * pi / 3 * 1000, -4 * pi / 3 * 125}},
        {fn_octahedron, {15.3, 15.2, 15.8, 11}, 1, {2}, {4.0 / 3 * 1331}},
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        Frame fr;
        frame_make(&fr, grid_of(32, row[i].fn, row[i].k));
        const IsoSurface *iso = &fr.iso;
        assert_int_equal(iso->ncomp, row[i].ncomp);
        assert_int_equal(iso->tunnels, 0);
        for (int k = 0; k < iso->ncomp; k++) {
            bool turn = iso->ncomp == 2 && (iso->comp_volume[0] < 0 || (row[i].volume[0] == row[i].volume[1] ? false : iso->comp_volume[0] < iso->comp_volume[1]));
            int want = turn ? 1 - k : k;
            assert_int_equal(iso->comp_euler[k], row[i].chi[want]);
            assert_near(iso->comp_volume[k] / row[i].volume[want], 1, 0.05);
        }
        Mesh m = assert_triangulates(iso, NULL);
        double sum = 0;
        for (int k = 0; k < iso->ncomp; k++) sum += iso->comp_volume[k];
        assert_near(mesh_volume(&m) / sum, 1, 0.02);
        mesh_free(&m);
        frame_free(&fr);
    }
}

/* A full grid closes at its border, in whichever frame of reference. */
static void borders_close(void **state)
{
    (void)state;
    float v[125];
    for (int i = 0; i < 125; i++) v[i] = 1;
    Grid g;
    grid_init(&g, 1);
    grid_from_dense(&g, v, (int[3]){5, 5, 5});
    Frame fr;
    frame_make(&fr, g);
    assert_true(fr.iso.ncomp == 1 && fr.iso.comp_euler[0] == 2);
    Mesh m = assert_triangulates(&fr.iso, NULL);
    assert_near(mesh_volume(&m), 125, 9); /* half a voxel beyond, its edges cut */
    mesh_free(&m);
    frame_free(&fr);
}

/* Outward in the world whatever the transform's handedness. */
static void triangles_face_outward_in_the_world(void **state)
{
    (void)state;
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        Grid g = grid_of(20, fn_ball, (double[]){9.5, 9.5, 9.5, 6});
        g.xform = affine_of(vec3(mirrored ? -0.5 : 0.5, 0, 0), vec3(0.1, 0.5, 0), vec3(0, 0, 0.25), vec3(3, 4, 5));
        Frame fr;
        frame_make(&fr, g);
        Mesh m = assert_triangulates(&fr.iso, NULL);
        assert_near(mesh_volume(&m) / (4 * 3.14159265358979 / 3 * 216 * 0.0625), 1, 0.05);
        for (int t = 0; t < m.ntri; t++)
            assert_false(field_triangle_inverted(&fr.field, m.pos[m.corner[3 * t]], m.pos[m.corner[3 * t + 1]], m.pos[m.corner[3 * t + 2]]));
        mesh_free(&m);
        frame_free(&fr);
    }
}

static void noise_is_triangulated_exactly(void **state)
{
    (void)state;
    int ambiguous = 0, tunnels = 0, genus = 0;
    for (uint64_t seed = 1; seed <= 12; seed++) {
        Frame fr;
        frame_make(&fr, grid_of_noise(12, seed, 0));
        Mesh m = assert_triangulates(&fr.iso, NULL);
        double sum = 0;
        for (int k = 0; k < fr.iso.ncomp; k++) {
            sum += fr.iso.comp_volume[k];
            assert_true(fr.iso.comp_euler[k] <= 2 && fr.iso.comp_euler[k] % 2 == 0);
            genus += 1 - fr.iso.comp_euler[k] / 2;
        }
        assert_true(sum > 0 && mesh_volume(&m) > 0);
        ambiguous += fr.iso.ambiguous_cells;
        tunnels += fr.iso.tunnels;
        mesh_free(&m);
        frame_free(&fr);
    }
    assert_true(ambiguous > 1000 && tunnels > 20 && genus > 100);
}

/* Integer noise: a third of the samples lie at the isovalue, and count as outside. */
static void samples_at_the_isovalue_do_no_harm(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 8; seed++) {
        Grid g = grid_of_noise(10, seed, 2 + (int)(seed % 3)), h = grid_of_noise(10, seed, 2 + (int)(seed % 3));
        for (int i = 0; i < h.nblock * GRID_CELLS; i++)
            if (h.value[i] == 0) h.value[i] = -1e-6f;
        Frame fr, almost;
        frame_make(&fr, g);
        frame_make(&almost, h);
        Mesh m = assert_triangulates(&fr.iso, NULL);
        for (int v = 0; v < m.nvert; v++) assert_true(isfinite(v_len2(m.pos[v])));
        for (int e = 0; e < fr.iso.nedge; e++) { /* no two crossings coincide */
            Vec3 p = fr.iso.edge_pos[e];
            int between = 0;
            for (int a = 0; a < 3; a++) between += v_get(p, a) != floor(v_get(p, a));
            assert_int_equal(between, 1);
        }
        assert_int_equal(fr.iso.nedge, almost.iso.nedge);
        mesh_free(&m);
        frame_free(&fr);
        frame_free(&almost);
    }
}

/* Marching cubes' case 4 with corners that meet through the cell's body: one component by its tunnel, two without. */
static void tunnel_joins_two_corners(void **state)
{
    (void)state;
    for (int meet = 0; meet < 2; meet++) {
        float v[64];
        for (int i = 0; i < 64; i++) v[i] = -1;
        v[1 + 4 * (1 + 4 * 1)] = v[2 + 4 * (2 + 4 * 2)] = meet ? 10 : 2;
        Grid g;
        grid_init(&g, 1);
        grid_from_dense(&g, v, (int[3]){4, 4, 4});
        Frame fr;
        frame_make(&fr, g);
        assert_int_equal(fr.iso.tunnels, meet);
        assert_int_equal(fr.iso.ncomp, meet ? 1 : 2);
        for (int k = 0; k < fr.iso.ncomp; k++) assert_int_equal(fr.iso.comp_euler[k], 2);
        Mesh m = assert_triangulates(&fr.iso, NULL);
        assert_true(mesh_volume(&m) > 0);
        mesh_free(&m);
        frame_free(&fr);
    }
}

static void components_can_be_chosen(void **state)
{
    (void)state;
    Frame fr;
    frame_make(&fr, grid_of(32, fn_cavity, (double[]){15.5, 15.2, 15.8, 10, 5}));
    int hollow = fr.iso.comp_volume[0] < 0 ? 0 : 1;
    uint8_t want[2] = {0, 0};
    want[hollow] = 1;
    Mesh m = assert_triangulates(&fr.iso, want);
    assert_true(mesh_volume(&m) < 0);
    for (int v = 0; v < m.nvert; v++) assert_near(v_dist(m.pos[v], vec3(15.5, 15.2, 15.8)), 5, 0.2);
    mesh_free(&m);
    want[hollow] = 0;
    mesh_init(&m);
    iso_triangulate(&fr.iso, want, &m, NULL);
    assert_true(m.nvert == 0 && m.ntri == 0);
    mesh_free(&m);
    frame_free(&fr);
}

static void points_are_told_their_component(void **state)
{
    (void)state;
    Frame fr;
    frame_make(&fr, grid_of(32, fn_two_balls, (double[]){8, 8, 8, 6, 23, 23, 23, 6}));
    bool sure;
    int a = iso_component_at(&fr.iso, vec3(8, 8, 14), &sure);
    assert_true(sure);
    int b = iso_component_at(&fr.iso, vec3(23, 17, 23), &sure);
    assert_true(sure && a != b && a >= 0 && b >= 0);
    assert_int_equal(iso_component_at(&fr.iso, vec3(8, 8, 8), &sure), NONE);
    assert_int_equal(iso_component_at(&fr.iso, vec3(-500, 8, 1e12), &sure), NONE);
    assert_true(iso_is_home(&fr.iso, a, vec3(2, 8, 8)));
    assert_false(iso_is_home(&fr.iso, b, vec3(2, 8, 8)));
    assert_true(iso_cell_at(&fr.iso, vec3(8.5, 8.5, 13.9)) != NONE);
    assert_int_equal(iso_cell_at(&fr.iso, vec3(8.5, 8.5, 11.5)), NONE);
    int32_t *home;
    Mesh m;
    mesh_init(&m);
    iso_triangulate(&fr.iso, (const uint8_t[2]){1, 1}, &m, &home);
    for (int v = 0; v < m.nvert; v++) assert_int_equal(iso_component_at(&fr.iso, m.pos[v], &sure), home[v]);
    mem_free(home);
    mesh_free(&m);
    frame_free(&fr);
}

static void no_surface_has_no_components(void **state)
{
    (void)state;
    Frame fr;
    frame_make(&fr, grid_of(8, fn_ball, (double[]){4, 4, 4, -1}));
    bool sure;
    assert_true(fr.iso.ncomp == 0 && fr.iso.nedge == 0 && fr.iso.ncell == 0);
    assert_int_equal(iso_component_at(&fr.iso, vec3(4, 4, 4), &sure), NONE);
    Mesh m;
    mesh_init(&m);
    iso_triangulate(&fr.iso, NULL, &m, NULL);
    assert_int_equal(m.ntri, 0);
    mesh_free(&m);
    frame_free(&fr);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(components_and_euler_numbers_are_known),
        cmocka_unit_test(borders_close),
        cmocka_unit_test(triangles_face_outward_in_the_world),
        cmocka_unit_test(noise_is_triangulated_exactly),
        cmocka_unit_test(samples_at_the_isovalue_do_no_harm),
        cmocka_unit_test(tunnel_joins_two_corners),
        cmocka_unit_test(components_can_be_chosen),
        cmocka_unit_test(points_are_told_their_component),
        cmocka_unit_test(no_surface_has_no_components),
    };
    return cmocka_run_group_tests_name("iso", tests, NULL, NULL);
}
