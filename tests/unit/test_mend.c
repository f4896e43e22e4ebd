/* The mend: faults are found where they are, and put right there and nowhere else. */
#include "fields.h"
#include "mesh_shapes.h"
#include "remesh/remesh.h"
#include "topology/fault.h"
#include "topology/mend.h"
#include "topology/sheet.h"

#include <stdlib.h>

#define EDGE 1.5

typedef struct Scene {
    Field field;
    IsoSurface iso;
} Scene;

static void scene_make(Scene *s, int side, FieldFn *fn, const double *k)
{
    s->field = field_from(grid_of(side, fn, k));
    iso_build(&s->iso, &s->field);
}

static void scene_free(Scene *s)
{
    iso_free(&s->iso);
    field_free(&s->field);
}

static MendStat mend(const Scene *s, Mesh *m)
{
    MendStat stat = {0};
    uint8_t *frozen = NEW0(uint8_t, m->nvert);
    mend_mesh(&s->iso, &(MendOptions){EDGE, frozen, true}, m, &stat);
    mem_free(frozen);
    mem_free(stat.patch);
    stat.patch = NULL;
    assert_null(mesh_check(m));
    return stat;
}

/* A coarse mesh of all of the scene's components. */
static Mesh mesh_of(const Scene *s)
{
    Mesh m;
    mesh_init(&m);
    MendStat stat = mend(s, &m);
    assert_true(stat.rounds > 0 && stat.raw == 0);
    return m;
}

/* One to one with the isosurface's components, nothing faulty. */
static void assert_mended(const Scene *s, const Mesh *m)
{
    int32_t comp[4000], partner[32];
    uint8_t mesh_bad[32], iso_bad[32];
    assert_true(m->ntri < 4000);
    int n = mesh_components(m, comp, NULL);
    AuditStat a = audit_match(&s->iso, &(AuditMesh){m->nvert, m->ntri, n, m->pos, m->corner, comp}, true, mesh_bad, iso_bad, partner);
    assert_int_equal(a.wrong_mesh + a.wrong_iso, 0);
    Faults f;
    faults_find(&s->iso, m, NULL, true, &f);
    assert_int_equal(f.strays + f.torn + f.degenerate + f.inverted + f.crossed, 0);
    faults_free(&f);
}

/* Vertices that kept identity and place. */
static int unmoved(const Mesh *before, const Mesh *after)
{
    Map at;
    int n = 0;
    map_init(&at, before->nvert);
    for (int v = 0; v < before->nvert; v++) map_put(&at, (uint64_t)before->id[v], v);
    for (int v = 0; v < after->nvert; v++) {
        int w = map_get(&at, (uint64_t)after->id[v]);
        n += w != NONE && v_dist(before->pos[w], after->pos[v]) == 0;
    }
    map_free(&at);
    return n;
}

static Mesh copy_of(const Mesh *m)
{
    Mesh c;
    mesh_init(&c);
    mesh_append(&c, m->nvert, m->pos, m->id, m->ntri, m->corner);
    c.next_id = m->next_id;
    return c;
}

static const double BALL[] = {17.3, 17.6, 17.8, 10};

static void nothing_wrong_changes_nothing(void **state)
{
    (void)state;
    Scene s;
    scene_make(&s, 36, fn_ball, BALL);
    Mesh m = mesh_of(&s), was = copy_of(&m);
    MendStat stat = mend(&s, &m);
    assert_int_equal(stat.rounds, 0);
    assert_int_equal(unmoved(&was, &m), was.nvert);
    assert_memory_equal(was.corner, m.corner, 3 * (size_t)m.ntri * sizeof *m.corner);
    mesh_free(&m);
    mesh_free(&was);
    scene_free(&s);
}

static void faults_are_found_and_mended_where_they_are(void **state)
{
    (void)state;
    for (int kind = 0; kind < 3; kind++) {
        Scene s;
        scene_make(&s, 36, fn_ball, BALL);
        Mesh m = mesh_of(&s), was = copy_of(&m);
        int v = m.nvert / 2, valence = mesh_valence(&m, v);
        Vec3 centre = vec3(BALL[0], BALL[1], BALL[2]);
        if (kind == 0) m.pos[v] = v_mix(m.pos[v], centre, 0.3);                                       /* off the surface */
        else if (kind == 1) m.pos[v] = v_sub(v_scale(centre, 2), m.pos[v]);                           /* on its other side */
        else m.pos[v] = m.pos[he_to(&m, he_next(m.opp[he_next(m.out[v])]))];                          /* over a neighbour's triangle */
        Faults f;
        faults_find(&s.iso, &m, NULL, false, &f);
        int faulty = 0;
        for (int t = 0; t < m.ntri; t++) faulty += f.tri[t] != 0;
        assert_true(faulty > 0 && faulty <= valence + 1);
        assert_int_equal(f.strays, kind == 0);
        faults_free(&f);
        MendStat stat = mend(&s, &m);
        assert_mended(&s, &m);
        assert_true(stat.whole == 0 && stat.raw == 0);
        assert_true(unmoved(&was, &m) > 0.85 * was.nvert);
        mesh_free(&m);
        mesh_free(&was);
        scene_free(&s);
    }
}

/* --- topology ------------------------------------------------------------------------------------------------------------- */

/* k: centre, the ring's radius, the tube's, and how wide a gap is cut into it. */
static double fn_cut_torus(const double *k, Vec3 p)
{
    Vec3 d = v_sub(p, vec3(k[0], k[1], k[2]));
    double gap = d.x > 0 ? 0.5 * k[5] - fabs(d.y) : -1e3;
    return real_min(fn_torus(k, p), -gap);
}

/* Two balls at k[0] and k[4], and a rod of radius k[8] between them along x. */
static double fn_rod(const double *k, Vec3 p)
{
    double rod = p.x > k[0] && p.x < k[4] ? k[8] - hypot(p.y - k[1], p.z - k[2]) : -1e3;
    return real_max(rod, real_max(fn_ball(k, p), fn_ball(k + 4, p)));
}

/* The mesh of one scene on the isosurface of another that is nearly the same: vertices are landed, the rest is the mend's. */
static void assert_change_is_local(const char *what, int side, FieldFn *from, const double *kf, FieldFn *to, const double *kt, double share)
{
    Scene a, b;
    scene_make(&a, side, from, kf);
    scene_make(&b, side, to, kt);
    Mesh m = mesh_of(&a);
    field_project(&b.field, m.nvert, m.pos, 1.0, NULL);
    for (int v = 0; v < m.nvert; v++) m.pos[v] = v_round32(m.pos[v]);
    Mesh was = copy_of(&m);
    MendStat stat = mend(&b, &m);
    if (getenv("TWINMESH_TOLD")) print_message("%s: %d of %d unmoved, %d rounds, whole %d\n", what, unmoved(&was, &m), was.nvert, stat.rounds, stat.whole);
    assert_mended(&b, &m);
    assert_true(unmoved(&was, &m) >= share * was.nvert);
    mesh_free(&m);
    mesh_free(&was);
    scene_free(&a);
    scene_free(&b);
}

static void topology_changes_are_local(void **state)
{
    (void)state;
    const double apart[] = {12.3, 16.6, 16.8, 7, 30.3, 16.6, 16.8, 7, 0}, joined[] = {12.3, 16.6, 16.8, 7, 30.3, 16.6, 16.8, 7, 1.6};
    const double cut[] = {19.3, 19.6, 19.8, 11, 4, 3}, closed[] = {19.3, 19.6, 19.8, 11, 4, -9};
    assert_change_is_local("blend", 44, fn_rod, apart, fn_rod, joined, 0.6);
    assert_change_is_local("split", 44, fn_rod, joined, fn_rod, apart, 0.6);
    assert_change_is_local("ring closed", 40, fn_cut_torus, cut, fn_cut_torus, closed, 0.6);
    assert_change_is_local("ring opened", 40, fn_cut_torus, closed, fn_cut_torus, cut, 0.6);
}

static void births_deaths_and_swallowed_droplets(void **state)
{
    (void)state;
    Scene pair, one;
    const double two[] = {12.3, 16.6, 16.8, 7, 30.3, 16.6, 16.8, 4, 0}, single[] = {12.3, 16.6, 16.8, 7, -90, 16.6, 16.8, 4, 0};
    scene_make(&pair, 44, fn_rod, two);
    scene_make(&one, 44, fn_rod, single);
    Mesh m = mesh_of(&one), was = copy_of(&m);
    mend(&pair, &m); /* a birth */
    assert_mended(&pair, &m);
    assert_int_equal(unmoved(&was, &m), was.nvert);
    mend(&one, &m); /* a death */
    assert_mended(&one, &m);
    assert_int_equal(unmoved(&was, &m), was.nvert);
    mesh_take(&m, shape_sphere(1), vec3(12.3, 16.6, 22.8)); /* a droplet that the ball took in: across its surface */
    mend(&one, &m);
    assert_mended(&one, &m);
    assert_true(unmoved(&was, &m) > 0.7 * was.nvert);
    mesh_free(&m);
    mesh_free(&was);
    scene_free(&pair);
    scene_free(&one);
}

/* --- the sheet ------------------------------------------------------------------------------------------------------------ */

/* A ring of pins around a ball's cap: the patch inside is a disc, the one outside as well; together they are all of it. */
static void seams_bound_patches(void **state)
{
    (void)state;
    enum { PINS = 24 };
    Scene s;
    scene_make(&s, 36, fn_ball, BALL);
    for (int turn = 0; turn < 2; turn++) {
        Sheet sheet;
        uint8_t want[1] = {1}, *kept = NEW0(uint8_t, s.iso.ncell), *conflict = NEW0(uint8_t, s.iso.ncell);
        int32_t pin[PINS], path[32];
        int nregion, inside = 0;
        sheet_build(&sheet, &s.iso, want, NULL);
        for (int i = 0; i < PINS; i++) {
            double a = 2 * 3.14159265358979 * i / PINS;
            Vec3 n = v_unit(vec3(cos(a), sin(a), 1)), p = v_axpy(vec3(BALL[0], BALL[1], BALL[2]), BALL[3], n);
            assert_int_equal(field_project(&s.field, 1, &p, 1, NULL), 0);
            pin[i] = sheet_pin(&sheet, i, p, n, 0, 0.5, 0, false);
            assert_true(pin[i] != NONE && v_dist(sheet.pos[pin[i]], p) < 1e-12);
        }
        for (int i = 0; i < PINS; i++) {
            int a = pin[i], b = pin[(i + 1) % PINS];
            assert_true(sheet_trace(&sheet, i, turn ? b : a, turn ? a : b, 32, path) != NONE);
        }
        assert_int_equal(sheet_fill(&sheet, kept, conflict, &nregion), 0);
        assert_int_equal(nregion, 1);
        int edges = 0, border = 0, verts = 0;
        uint8_t *seen = NEW0(uint8_t, sheet.nvert);
        for (int h = 0; h < 3 * sheet.ntri; h++) {
            if (sheet.region[h / 3] == REGION_NONE) continue;
            inside += h % 3 == 0;
            *(sheet.seam[h] == SEAM_NONE ? &edges : &border) += 1;
            verts += !seen[sheet.corner[h]];
            seen[sheet.corner[h]] = 1;
        }
        assert_int_equal(verts - edges / 2 - border + inside, 1);
        assert_true((inside < sheet.ntri / 3) == (turn == 1)); /* the patch is to the right */
        mem_free(seen);
        mem_free(kept);
        mem_free(conflict);
        sheet_free(&sheet);
    }
    scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_wrong_changes_nothing),
        cmocka_unit_test(faults_are_found_and_mended_where_they_are),
        cmocka_unit_test(topology_changes_are_local),
        cmocka_unit_test(births_deaths_and_swallowed_droplets),
        cmocka_unit_test(seams_bound_patches),
    };
    return cmocka_run_group_tests_name("mend", tests, NULL, NULL);
}
