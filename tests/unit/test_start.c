/* A first mesh from a coarser lattice: sound where the lattice shows the surface, none where it does not. */
#include "fields.h"
#include "topology/audit.h"
#include "topology/start.h"

#define EDGE 1.5

static const double BALL[] = {21.3, 20.7, 22.1, 14};

/* A box around the ball. */
static double fn_cavern(const double *k, Vec3 p)
{
    double wall = 19.4 - real_max(fabs(p.x - k[0]), real_max(fabs(p.y - k[1]), fabs(p.z - k[2])));
    return real_min(wall, -fn_ball(k, p));
}

static double fn_sheet(const double *k, Vec3 p) { return real_min(fn_ball(k, p), 0.3 - fabs(p.x + 0.3 * p.y - 26)); } /* thin */

static Mesh start(const Field *f, double edge)
{
    IsoSurface iso;
    Mesh m;
    iso_build(&iso, f);
    mesh_init(&m);
    start_mesh(&iso, edge, &m);
    iso_free(&iso);
    assert_null(mesh_check(&m));
    assert_int_equal(m.deadtri + m.deadvert, 0);
    return m;
}

/* Components as the isosurface's, each of its Euler characteristic and size. */
static void assert_matches(const Field *f, const Mesh *m, int ncomp)
{
    int32_t *comp = NEW(int32_t, m->ntri), partner[8];
    uint8_t mesh_bad[8], iso_bad[8];
    IsoSurface iso;
    iso_build(&iso, f);
    assert_int_equal(iso.ncomp, ncomp);
    assert_int_equal(mesh_components(m, comp, NULL), ncomp);
    AuditStat a = audit_match(&iso, &(AuditMesh){m->nvert, m->ntri, ncomp, m->pos, m->corner, comp}, true, mesh_bad, iso_bad, partner);
    assert_int_equal(a.wrong_mesh + a.wrong_iso, 0);
    iso_free(&iso);
    mem_free(comp);
}

static double mean_edge(const Mesh *m)
{
    double sum = 0;
    for (int h = 0; h < 3 * m->ntri; h++) sum += mesh_edge_length(m, h);
    return sum / (3 * m->ntri);
}

static void a_ball_is_started(void **state)
{
    (void)state;
    for (double edge = EDGE; edge < 4; edge *= 2) {
        Field f = field_of(44, fn_ball, BALL);
        Mesh m = start(&f, edge);
        assert_matches(&f, &m, 1);
        assert_float_equal(mean_edge(&m), edge, (float)(0.12 * edge));
        for (int v = 0; v < m.nvert; v++) assert_true(field_distance_vox(&f, m.pos[v]) < 1e-4);
        for (int t = 0; t < m.ntri; t++) {
            const int32_t *c = m.corner + 3 * t;
            assert_false(field_triangle_inverted(&f, m.pos[c[0]], m.pos[c[1]], m.pos[c[2]]));
        }
        for (int v = 0, last = 0; v < m.nvert; v++) { /* brick by brick */
            int at[3], brick = field_brick_of(&f, affine_to_index(&f.xform, m.pos[v]), at);
            assert_in_range(brick, last, f.ncrossed - 1);
            last = brick;
        }
        mesh_free(&m);
        field_free(&f);
    }
}

/* Far inside and outside nothing is known of the field: no surface comes of that. */
static void what_is_far_from_the_surface_stays_whole(void **state)
{
    (void)state;
    for (double edge = 2; edge < 5; edge += 1.4) {
        Field f = field_of(96, fn_ball, (double[]){47, 48, 49, 41});
        Mesh m = start(&f, edge);
        assert_matches(&f, &m, 1);
        mesh_free(&m);
        field_free(&f);
    }
}

/* Sharp walls, and triangles that face inwards. Mirrored as well. */
static void a_cavern_is_started(void **state)
{
    (void)state;
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        Grid g = grid_of(44, fn_cavern, BALL);
        g.xform = affine_of(vec3(0, mirrored ? -2 : 2, 0), vec3(0, 0, 2), vec3(2, 0, 0), vec3(5, -7, 11));
        Field f = field_from(g);
        Mesh m = start(&f, 2 * EDGE);
        assert_matches(&f, &m, 2);
        mesh_free(&m);
        field_free(&f);
    }
}

static void what_the_lattice_does_not_show_is_left_out(void **state)
{
    (void)state;
    Field ball = field_of(44, fn_ball, BALL), sheet = field_of(44, fn_sheet, (double[]){22, 22, 22, 18}), drop = field_of(12, fn_ball, (double[]){5, 6, 5, 1.5});
    const struct { const Field *f; double edge; } CASE[] = {{&ball, 0.9}, {&sheet, EDGE}, {&drop, EDGE}};
    for (size_t i = 0; i < sizeof CASE / sizeof *CASE; i++) {
        Mesh m = start(CASE[i].f, CASE[i].edge);
        assert_int_equal(m.ntri, 0);
        mesh_free(&m);
    }
    field_free(&ball);
    field_free(&sheet);
    field_free(&drop);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ball_is_started),
        cmocka_unit_test(what_is_far_from_the_surface_stays_whole),
        cmocka_unit_test(a_cavern_is_started),
        cmocka_unit_test(what_the_lattice_does_not_show_is_left_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
