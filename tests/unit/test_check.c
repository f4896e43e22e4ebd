/* The figures of meshes whose distances, motion and faults are known. */
#include "fields.h"
#include "check/check.h"

enum { N = 40 };
#define MID 19.3

typedef struct Fixture {
    Field field;
    CheckSurface *surface;
} Fixture;

static Fixture fixture_of(double radius)
{
    const double k[4] = {MID, MID, MID, radius};
    return (Fixture){.field = field_of(N, fn_ball, k)};
}

static void fixture_free(Fixture *f)
{
    check_surface_free(f->surface);
    field_free(&f->field);
}

/* A sphere of a radius, its normals outward. */
static TriMesh sphere_of(int level, double radius)
{
    Shape s = shape_sphere(level);
    TriMesh m;
    trimesh_init(&m, s.nvert, s.ntri, false, false);
    for (int v = 0; v < s.nvert; v++)
        for (int a = 0; a < 3; a++) {
            m.normal[3 * v + a] = (float)v_get(s.pos[v], a);
            m.pos[3 * v + a] = (float)(MID + radius * v_get(s.pos[v], a));
        }
    for (int v = 0; v < s.nvert; v++) m.id[v] = 7 * v;
    memcpy(m.tri, s.tri, 3 * (size_t)s.ntri * sizeof *m.tri);
    shape_free(&s);
    return m;
}

static CheckRow row_of(Fixture *f, const TriMesh *m)
{
    CheckRow row = check_row_empty();
    if (!f->surface) f->surface = check_surface_make(&f->field);
    check_mesh(&(CheckSettings){0}, f->surface, m, &row);
    return row;
}

static void expect(const CheckRow *row, CheckFigure figure, double want, double slack)
{
    double got = row->value[figure];
    if (!(fabs(got - want) <= slack)) fail_msg("%s is %.9g, not %.9g", check_figure[figure].name, got, want);
}

/* The samples of a distance interpolate it to 1/(8 r) of a voxel. */
static void a_shrunken_sphere_is_as_far_as_it_shrank(void **state)
{
    (void)state;
    Fixture f = fixture_of(12);
    TriMesh m = sphere_of(5, 11.5);
    CheckRow row = row_of(&f, &m);
    expect(&row, CHECK_FAULTS, 0, 0);
    expect(&row, CHECK_TOPOLOGY_ERRORS, 0, 0);
    expect(&row, CHECK_SURFACE_COMPONENTS, 1, 0);
    expect(&row, CHECK_SELF_INTERSECTIONS, 0, 0);
    expect(&row, CHECK_TO_SURFACE_MEAN, 0.5, 0.02);
    expect(&row, CHECK_TO_SURFACE_MAX, 0.5, 0.04);
    expect(&row, CHECK_FROM_SURFACE_MEAN, 0.5, 0.02);
    expect(&row, CHECK_FROM_SURFACE_MAX, 0.5, 0.04);
    expect(&row, CHECK_OFF_SURFACE, m.nvert, 0);
    expect(&row, CHECK_NORMALS_P95, 0, 1.5);
    expect(&row, CHECK_INVERTED, 0, 0);
    expect(&row, CHECK_EDGES_ODD, 0, 0);
    trimesh_free(&m);
    fixture_free(&f);
}

static void each_fault_is_found(void **state)
{
    (void)state;
    Fixture f = fixture_of(12);
    TriMesh m = sphere_of(3, 12);
    for (int t = 0; t < m.ntri; t++) { /* inside out */
        int32_t v = m.tri[3 * t];
        m.tri[3 * t] = m.tri[3 * t + 1];
        m.tri[3 * t + 1] = v;
    }
    CheckRow row = row_of(&f, &m);
    expect(&row, CHECK_INWARD, 1, 0);
    expect(&row, CHECK_FAULTS, 1, 0);
    expect(&row, CHECK_INVERTED, m.ntri, 0);
    expect(&row, CHECK_SIZE_ERRORS, 1, 0);
    trimesh_free(&m);

    m = sphere_of(3, 12);
    m.ntri--;
    m.id[3] = m.id[4];
    memcpy(m.pos, m.pos + 3 * 1, 3 * sizeof *m.pos);
    row = row_of(&f, &m);
    expect(&row, CHECK_BOUNDARY_EDGES, 3, 0);
    expect(&row, CHECK_COINCIDENT, 2, 0);
    expect(&row, CHECK_EULER_ERRORS, 1, 0);
    assert_true(row.value[CHECK_SELF_INTERSECTIONS] > 0);
    check_ids(&m, &row);
    expect(&row, CHECK_DUPLICATE_IDS, 1, 0);
    m.ntri = 0; /* vertices alone */
    row = row_of(&f, &m);
    expect(&row, CHECK_MISSING, 1, 0);
    expect(&row, CHECK_UNREFERENCED, m.nvert, 0);
    assert_true(isnan(row.value[CHECK_TO_SURFACE_MEAN]));
    m.ntri = 512;
    memcpy(m.tri, (int32_t[3]){5, 5, 6}, 12);
    row = row_of(&f, &m);
    expect(&row, CHECK_REPEATED_CORNERS, 1, 0);
    trimesh_free(&m);
    fixture_free(&f);
}

/* The field grows by 0.4; of a mesh that grows by 0.5 a tenth is flicker, wherever its vertices slide besides. */
static void flicker_is_what_the_field_does_not_explain(void **state)
{
    (void)state;
    Fixture a = fixture_of(12), b = fixture_of(12.4);
    TriMesh m = sphere_of(4, 12), n = sphere_of(4, 12.5);
    CheckRow row = check_row_empty();
    check_motion(&a.field, &m, &b.field, &n, &row);
    expect(&row, CHECK_FLICKER_MEAN, 0.1, 0.01);
    expect(&row, CHECK_FLICKER_P95, 0.1, 0.02);
    expect(&row, CHECK_MOTION_P50, 0.5, 1e-5);
    expect(&row, CHECK_IDS_KEPT, 1, 0);
    expect(&row, CHECK_TRIANGLES_KEPT, 1, 0);
    for (int v = 0; v < m.nvert; v += 2) n.id[v] = 1000000 + v;
    check_motion(&a.field, &m, &b.field, &n, &row);
    expect(&row, CHECK_IDS_KEPT, 0.5, 0.01);
    assert_true(row.value[CHECK_TRIANGLES_KEPT] < 0.3);
    trimesh_free(&m);
    trimesh_free(&n);
    fixture_free(&a);
    fixture_free(&b);
}

/* Nothing is measured beyond the active bounding box, where the surface is closed by convention. */
static void the_shell_is_left_out(void **state)
{
    (void)state;
    const double k[4] = {0, 10, 10, 9}; /* half of it lies beyond x = 0 */
    Fixture f = {.field = field_of(20, fn_ball, k)};
    TriMesh m = sphere_of(5, 9);
    for (int v = 0; v < m.nvert; v++) { /* a half ball, whose flat side stands a voxel off where the field closes */
        m.pos[3 * v] = fmaxf(m.pos[3 * v] - (float)MID, -1.5f);
        for (int a = 1; a < 3; a++) m.pos[3 * v + a] -= (float)(MID - 10);
    }
    CheckRow row = row_of(&f, &m);
    assert_true(row.value[CHECK_TO_SURFACE_MAX] < 0.1);
    trimesh_free(&m);
    fixture_free(&f);
}

static void parents_are_in_range(void **state)
{
    (void)state;
    TriMesh m;
    CheckRow row = check_row_empty();
    trimesh_init(&m, 0, 4, false, true);
    memcpy(m.parent, (int32_t[4]){0, -1, 8, 7}, 16);
    check_parents(&m, 8, &row);
    expect(&row, CHECK_PARENTS_ODD, 2, 0);
    trimesh_free(&m);
}

static void an_empty_frame(void **state)
{
    (void)state;
    const double k[4] = {MID, MID, MID, -5};
    Fixture f = {.field = field_of(N, fn_ball, k)};
    TriMesh m;
    trimesh_init(&m, 0, 0, false, false);
    CheckRow row = row_of(&f, &m);
    expect(&row, CHECK_FAULTS, 0, 0);
    expect(&row, CHECK_TOPOLOGY_ERRORS, 0, 0);
    trimesh_free(&m);
    fixture_free(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_shrunken_sphere_is_as_far_as_it_shrank),
        cmocka_unit_test(each_fault_is_found),
        cmocka_unit_test(flicker_is_what_the_field_does_not_explain),
        cmocka_unit_test(the_shell_is_left_out),
        cmocka_unit_test(parents_are_in_range),
        cmocka_unit_test(an_empty_frame),
    };
    return cmocka_run_group_tests_name("check", tests, NULL, NULL);
}
