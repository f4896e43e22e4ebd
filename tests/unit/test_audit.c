/* The audit: a right mesh passes; every kind of wrong one is found. */
#include "fields.h"
#include "mesh_shapes.h"
#include "topology/audit.h"

/* A ball and a torus apart. */
static double fn_pair(const double *k, Vec3 p) { return real_max(fn_ball(k, p), fn_torus(k + 4, p)); }
static const double PAIR[] = {8, 8, 8, 5, 27, 27, 27, 9, 3.2};
/* The same with a gap in the torus. */
static double fn_cut(const double *k, Vec3 p)
{
    Vec3 d = v_sub(p, vec3(k[4], k[5], k[6]));
    double gap = d.x > 0 ? 3 - fabs(d.y) : -1; /* > 0 within it */
    return real_max(fn_ball(k, p), real_min(fn_torus(k + 4, p), -gap));
}

typedef struct Scene {
    Field field;
    IsoSurface iso;
    Mesh mesh;                 /* of all its components */
    uint8_t mesh_bad[8], iso_bad[8];
    int32_t partner[8];
    int32_t tri_comp[20000];
    int ncomp;
} Scene;

static void scene_make(Scene *s, FieldFn *fn, const double *k, bool mirrored)
{
    Grid g = grid_of(40, fn, k);
    if (mirrored) g.xform = affine_of(vec3(0, 1, 0), vec3(1, 0, 0), vec3(0, 0, 1), vec3(0, 0, 0));
    s->field = field_from(g);
    iso_build(&s->iso, &s->field);
    mesh_init(&s->mesh);
    uint8_t want[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    iso_triangulate(&s->iso, want, &s->mesh, NULL);
}

static void scene_free(Scene *s)
{
    mesh_free(&s->mesh);
    iso_free(&s->iso);
    field_free(&s->field);
}

static AuditStat audit(Scene *s, const Mesh *m)
{
    assert_true(m->ntri < 20000);
    s->ncomp = mesh_components(m, s->tri_comp, NULL);
    AuditMesh a = {m->nvert, m->ntri, s->ncomp, m->pos, m->corner, s->tri_comp};
    memset(s->mesh_bad, 9, sizeof s->mesh_bad);
    memset(s->iso_bad, 9, sizeof s->iso_bad);
    return audit_match(&s->iso, &a, true, s->mesh_bad, s->iso_bad, s->partner);
}

static int comp_of(const Scene *s, Vec3 p)
{
    bool sure;
    return iso_component_at(&s->iso, p, &sure);
}

static Scene scene, other;
static const Vec3 ON_BALL = {8, 8, 13}, ON_TORUS = {27, 36, 30.2};

/* The mesh component that lies on a component of the isosurface: the raw triangles come in its order. */
static void drop_component(Mesh *m, int iso_comp, const IsoSurface *iso)
{
    int32_t *comp = NEW(int32_t, m->ntri), *vert = NEW(int32_t, m->nvert);
    int n = mesh_components(m, comp, vert);
    uint8_t *drop = NEW0(uint8_t, n);
    bool sure;
    for (int v = 0; v < m->nvert; v++)
        if (iso_component_at(iso, m->pos[v], &sure) == iso_comp) drop[vert[v]] = 1;
    mesh_drop_components(m, comp, drop);
    mesh_compact(m, NULL);
    mem_free(comp);
    mem_free(vert);
    mem_free(drop);
}

static void right_mesh_passes(void **state)
{
    (void)state;
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        scene_make(&scene, fn_pair, PAIR, mirrored);
        assert_int_equal(scene.iso.ncomp, 2);
        AuditStat a = audit(&scene, &scene.mesh);
        assert_true(a.wrong_mesh == 0 && a.wrong_iso == 0 && a.euler_errors == 0 && a.size_errors == 0);
        assert_true(!scene.mesh_bad[0] && !scene.mesh_bad[1] && !scene.iso_bad[0] && !scene.iso_bad[1]);
        int32_t *home = NEW(int32_t, scene.mesh.nvert);
        AuditMesh m = {scene.mesh.nvert, scene.mesh.ntri, scene.ncomp, scene.mesh.pos, scene.mesh.corner, scene.tri_comp};
        audit_homes(&scene.iso, &m, home);
        for (int v = 0; v < scene.mesh.nvert; v++) assert_int_equal(home[v], comp_of(&scene, scene.mesh.pos[v]));
        mem_free(home);
        scene_free(&scene);
    }
}

static void missing_component_is_found(void **state)
{
    (void)state;
    scene_make(&scene, fn_pair, PAIR, false);
    int ball = comp_of(&scene, ON_BALL), torus = comp_of(&scene, ON_TORUS);
    assert_true(ball != torus && ball != NONE && torus != NONE);
    drop_component(&scene.mesh, ball, &scene.iso);
    AuditStat a = audit(&scene, &scene.mesh);
    assert_true(a.wrong_mesh == 0 && a.wrong_iso == 1);
    assert_true(scene.iso_bad[ball] && !scene.iso_bad[torus] && !scene.mesh_bad[0]);
    mesh_clear(&scene.mesh); /* and no mesh at all */
    a = audit(&scene, &scene.mesh);
    assert_true(a.wrong_mesh == 0 && a.wrong_iso == 2);
    scene_free(&scene);
}

static void extra_component_is_found(void **state)
{
    (void)state;
    static const Vec3 place[2] = {{8, 27, 27}, {8, 8, 8}}; /* where nothing is; inside the ball */
    for (int i = 0; i < 2; i++) {
        scene_make(&scene, fn_pair, PAIR, false);
        mesh_take(&scene.mesh, shape_sphere(1), place[i]);
        AuditStat a = audit(&scene, &scene.mesh);
        assert_int_equal(scene.ncomp, 3);
        assert_true(a.wrong_mesh == 1 && a.wrong_iso == 0);
        assert_true(!scene.mesh_bad[0] && !scene.mesh_bad[1] && scene.mesh_bad[2]);
        scene_free(&scene);
    }
}

static void two_on_one_are_not_trusted(void **state)
{
    (void)state;
    scene_make(&scene, fn_pair, PAIR, false);
    int n = scene.mesh.nvert, ball = comp_of(&scene, ON_BALL), torus = comp_of(&scene, ON_TORUS);
    Mesh copy;
    mesh_init(&copy);
    mesh_append(&copy, n, scene.mesh.pos, NULL, scene.mesh.ntri, scene.mesh.corner);
    drop_component(&copy, torus, &scene.iso);
    mesh_append(&scene.mesh, copy.nvert, copy.pos, NULL, copy.ntri, copy.corner);
    AuditStat a = audit(&scene, &scene.mesh);
    assert_true(a.wrong_mesh == 2 && a.wrong_iso == 1 && scene.iso_bad[ball] && !scene.iso_bad[torus] && scene.mesh_bad[2]);
    mesh_free(&copy);
    scene_free(&scene);
}

/* A cut torus in place of the whole one: most of it lies where it should, but it is a ball. */
static void wrong_genus_is_found(void **state)
{
    (void)state;
    scene_make(&scene, fn_pair, PAIR, false);
    scene_make(&other, fn_cut, PAIR, false);
    int torus = comp_of(&scene, ON_TORUS);
    assert_int_equal(scene.iso.comp_euler[torus], 0);
    assert_int_equal(mesh_euler(&other.mesh, NONE), 4);
    AuditStat a = audit(&scene, &other.mesh);
    assert_true(a.euler_errors == 1 && a.wrong_mesh == 1 && a.wrong_iso == 1 && scene.iso_bad[torus]);
    scene_free(&scene);
    scene_free(&other);
}

static void moved_off_the_surface_is_found(void **state)
{
    (void)state;
    static const double by[] = {1.5, 3, 200};
    for (int i = 0; i < 3; i++) {
        scene_make(&scene, fn_pair, PAIR, false);
        for (int v = 0; v < scene.mesh.nvert; v++) scene.mesh.pos[v].x += by[i];
        AuditStat a = audit(&scene, &scene.mesh);
        assert_true(a.wrong_mesh == 2 && a.wrong_iso == 2);
        scene_free(&scene);
    }
}

static void inside_out_is_found(void **state)
{
    (void)state;
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        scene_make(&scene, fn_pair, PAIR, mirrored);
        int32_t *tri = NEW(int32_t, 3 * scene.mesh.ntri);
        for (int h = 0; h < 3 * scene.mesh.ntri; h++) tri[h] = scene.mesh.corner[h - h % 3 + (3 - h % 3) % 3];
        Mesh turned;
        mesh_init(&turned);
        mesh_append(&turned, scene.mesh.nvert, scene.mesh.pos, NULL, scene.mesh.ntri, tri);
        AuditStat a = audit(&scene, &turned);
        assert_true(a.wrong_mesh == 2 && a.wrong_iso == 2 && a.size_errors == 2 && a.euler_errors == 0);
        mem_free(tri);
        mesh_free(&turned);
        scene_free(&scene);
    }
}

/* A ball's mesh that reaches over half of it only. */
static void folded_mesh_is_found(void **state)
{
    (void)state;
    scene_make(&scene, fn_ball, (double[]){20, 20, 20, 14}, false);
    scene_make(&other, fn_ball, (double[]){20, 20, 20, 14}, false);
    for (int v = 0; v < other.mesh.nvert; v++) { /* folded up onto the other half, almost flat */
        Vec3 *p = &other.mesh.pos[v];
        if (p->z < 20) p->z = 40 - p->z;
    }
    AuditStat a = audit(&scene, &other.mesh);
    assert_true(a.wrong_mesh == 1 && a.wrong_iso == 1 && a.size_errors == 1);
    scene_free(&scene);
    scene_free(&other);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(right_mesh_passes),
        cmocka_unit_test(missing_component_is_found),
        cmocka_unit_test(extra_component_is_found),
        cmocka_unit_test(two_on_one_are_not_trusted),
        cmocka_unit_test(wrong_genus_is_found),
        cmocka_unit_test(moved_off_the_surface_is_found),
        cmocka_unit_test(inside_out_is_found),
        cmocka_unit_test(folded_mesh_is_found),
    };
    return cmocka_run_group_tests_name("audit", tests, NULL, NULL);
}
