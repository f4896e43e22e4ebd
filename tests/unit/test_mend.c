/* The mend: faults are found where they are, and put right there and nowhere else. */
#include "fields.h"
#include "mesh_shapes.h"
#include "remesh/remesh.h"
#include "topology/fault.h"
#include "topology/graft_priv.h"
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
    Crossings known = {0};
    mend_mesh(&s->iso, &(MendOptions){.edge = EDGE, .frozen = frozen, .crossings = &known}, m, &stat);
    crossings_free(&known);
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
    Crossings known = {0};
    faults_find(&s->iso, m, &known, &f);
    crossings_free(&known);
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
        faults_find(&s.iso, &m, NULL, &f);
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

static bool has_triangle(const Mesh *m, const Map *at, const int32_t id[3])
{
    int v[3];
    for (int k = 0; k < 3; k++)
        if ((v[k] = map_get(at, (uint64_t)id[k])) == NONE) return false;
    int h = m->out[v[0]];
    do
        if (he_to(m, h) == v[1] && m->corner[he_prev(h)] == v[2]) return true;
    while ((h = he_around(m, h)) != m->out[v[0]]);
    return false;
}

static bool has_edge(const Map *edges, const Mesh *m, int h)
{
    int v = m->id[he_from(m, h)], w = m->id[he_to(m, h)];
    return map_get(edges, key_pair(int_min(v, w), int_max(v, w))) != NONE;
}

/* The patch's vertices on its border, and those that cutting it out put on edges, are gone again. The edges there are remembered, those far
 * away are not. */
static void what_a_patch_borders_on_stays(void **state)
{
    (void)state;
    Scene s;
    Faults f;
    Map at, edges;
    scene_make(&s, 36, fn_ball, BALL);
    Mesh m = mesh_of(&s), was = copy_of(&m);
    uint8_t none[1] = {0}, speck[1], *near = NEW0(uint8_t, m.nvert);
    faults_find(&s.iso, &m, NULL, &f);
    int h = m.out[m.nvert / 2], faulty = 0, kept = 0, remembered = 0;
    do f.tri[h / 3] = FAULT_FAR;
    while ((h = he_around(&m, h)) != m.out[m.nvert / 2]);
    for (int i = 0; i < 3 * m.ntri; i++) near[m.corner[i]] |= f.tri[i / 3] != 0, faulty += f.tri[i / 3] != 0;
    assert_true(faulty > 0 && s.iso.ncomp == 1);
    MendStat stat = {0};
    graft_patches(&s.iso, &(GraftPlan){.comp = f.comp, .drop = f.tri, .cell = f.cell, .whole = none, .wrong = none, .lean = f.lean, .edge = EDGE}, &m, speck, &edges, &stat);
    assert_int_equal(stat.npatch, 1);
    for (int i = 0; i < 3 * was.ntri; i++) {
        bool sound = !f.tri[i / 3] && !f.tri[was.opp[i] / 3], here = near[he_from(&was, i)] || near[he_to(&was, i)];
        if (sound && here) assert_true(has_edge(&edges, &was, i));
        remembered += has_edge(&edges, &was, i);
    }
    assert_true(remembered < 1.5 * was.ntri); /* of 3 ntri */
    map_init(&at, m.nvert);
    for (int v = 0; v < m.nvert; v++)
        if (!vert_is_dead(&m, v)) map_put(&at, (uint64_t)m.id[v], v);
    for (int t = 0; t < was.ntri; t++) {
        const int32_t *c = was.corner + 3 * t;
        if (near[c[0]] || near[c[1]] || near[c[2]]) continue; /* in the hole */
        kept++;
        assert_true(has_triangle(&m, &at, (int32_t[3]){was.id[c[0]], was.id[c[1]], was.id[c[2]]}));
    }
    assert_true(kept > 0.8 * was.ntri);
    map_free(&at);
    map_free(&edges);
    mem_free(near);
    mem_free(stat.patch);
    faults_free(&f);
    mesh_free(&m);
    mesh_free(&was);
    scene_free(&s);
}

/* An octahedron's faces pass well below a ball of radius 1.5, those of a mesh of edges of that length close to a larger one. */
static void triangles_that_cut_corners_lean(void **state)
{
    (void)state;
    const double tight[] = {9.3, 9.6, 9.8, 1.5};
    for (int kind = 0; kind < 2; kind++) {
        Scene s;
        Mesh m;
        Faults f;
        scene_make(&s, kind == 0 ? 20 : 36, fn_ball, kind == 0 ? tight : BALL);
        if (kind == 0) {
            mesh_init(&m);
            mesh_take(&m, shape_sphere(0), vec3(tight[0], tight[1], tight[2]));
            field_project(&s.field, m.nvert, m.pos, 1.0, NULL);
        } else m = mesh_of(&s);
        faults_find(&s.iso, &m, NULL, &f);
        assert_int_equal(f.strays + f.torn + f.inverted, 0);
        int leaning = 0;
        for (int t = 0; t < m.ntri; t++) leaning += f.lean[t];
        assert_true(kind == 0 ? leaning > m.ntri / 2 : leaning == 0);
        faults_free(&f);
        mesh_free(&m);
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

/* A lens with a hole through it; its radius below 0: without one. */
static double fn_lens(const double *k, Vec3 p)
{
    double r = hypot(p.x - k[0], p.y - k[1]), d = k[3] - hypot(r, 4 * (p.z - k[2]));
    return real_min(0.4 * d, r - k[4]);
}

static void topology_changes_are_local(void **state)
{
    (void)state;
    const double apart[] = {12.3, 16.6, 16.8, 7, 30.3, 16.6, 16.8, 7, 0}, joined[] = {12.3, 16.6, 16.8, 7, 30.3, 16.6, 16.8, 7, 1.6};
    const double cut[] = {19.3, 19.6, 19.8, 11, 4, 3}, closed[] = {19.3, 19.6, 19.8, 11, 4, -9};
    const double whole[] = {19.3, 19.6, 19.8, 15, -9}, pierced[] = {19.3, 19.6, 19.8, 15, 0.9}; /* narrower than triangles: none is faulty */
    assert_change_is_local("pierced", 40, fn_lens, whole, fn_lens, pierced, 0.8);
    assert_change_is_local("healed", 40, fn_lens, pierced, fn_lens, whole, 0.8);
    assert_change_is_local("blend", 44, fn_rod, apart, fn_rod, joined, 0.6);
    assert_change_is_local("split", 44, fn_rod, joined, fn_rod, apart, 0.6);
    assert_change_is_local("ring closed", 40, fn_cut_torus, cut, fn_cut_torus, closed, 0.6);
    assert_change_is_local("ring opened", 40, fn_cut_torus, closed, fn_cut_torus, cut, 0.6);
}

/* Two balls that a rod joins now, and something seen to lean at the one's end of it alone: the other's is found from there. */
static void what_is_looked_at_grows(void **state)
{
    (void)state;
    const double apart[] = {12.3, 16.6, 16.8, 7, 30.3, 16.6, 16.8, 7, 0}, joined[] = {12.3, 16.6, 16.8, 7, 30.3, 16.6, 16.8, 7, 1.6};
    Scene a, b;
    scene_make(&a, 44, fn_rod, apart);
    scene_make(&b, 44, fn_rod, joined);
    Mesh m = mesh_of(&a);
    field_project(&b.field, m.nvert, m.pos, 1.0, NULL);
    Mesh was = copy_of(&m);
    int32_t *comp = NEW0(int32_t, m.nvert);
    uint8_t *drop = NEW0(uint8_t, m.ntri), *lean = NEW0(uint8_t, m.ntri), *cell = NEW0(uint8_t, b.iso.ncell), whole[1] = {0}, wrong[1] = {1}, speck[1];
    for (int t = 0; t < m.ntri; t++) lean[t] = v_dist(m.pos[m.corner[3 * t]], vec3(19.3, 16.6, 16.8)) < 2;
    MendStat stat = {0};
    assert_int_equal(b.iso.ncomp, 1);
    graft_patches(&b.iso, &(GraftPlan){.comp = comp, .drop = drop, .cell = cell, .whole = whole, .wrong = wrong, .locally = true, .lean = lean, .edge = EDGE}, &m, speck, NULL, &stat);
    mesh_compact(&m, NULL);
    assert_null(mesh_check(&m));
    assert_int_equal(mesh_components(&m, NULL, NULL), 1);
    assert_int_equal(m.nvert - m.ntri / 2, 2);
    assert_true(unmoved(&was, &m) > 0.8 * was.nvert);
    mem_free(comp);
    mem_free(drop);
    mem_free(lean);
    mem_free(cell);
    mem_free(stat.patch);
    mesh_free(&m);
    mesh_free(&was);
    scene_free(&a);
    scene_free(&b);
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

/* Half-edges of the sheet's triangles that hang together with triangle t without a seam between them are marked; returns their
 * Euler characteristic. */
static int euler_within_seams(const Sheet *s, int t, uint8_t *mark)
{
    int32_t *stack = NEW(int32_t, s->ntri);
    uint8_t *seen = NEW0(uint8_t, s->nvert);
    int n = 0, verts = 0, edges2 = 0, tris = 0;
    stack[n++] = t;
    mark[t] = 1;
    while (n) {
        t = stack[--n];
        tris++;
        for (int h = 3 * t; h < 3 * t + 3; h++) {
            verts += !seen[s->corner[h]];
            seen[s->corner[h]] = 1;
            edges2 += s->seam[h] == SEAM_NONE ? 1 : 2;
            if (s->seam[h] != SEAM_NONE || mark[s->opp[h] / 3]) continue;
            mark[s->opp[h] / 3] = 1;
            stack[n++] = s->opp[h] / 3;
        }
    }
    mem_free(stack);
    mem_free(seen);
    return verts - edges2 / 2 + tris;
}

/* A ring of pins around a ball's cap: the seams between them are closed and cut the ball into two discs. */
static void seams_cut_the_sheet(void **state)
{
    (void)state;
    enum { PINS = 24 };
    Scene s;
    Sheet sheet;
    scene_make(&s, 36, fn_ball, BALL);
    uint8_t want[1] = {1};
    int32_t pin[PINS], path[32];
    sheet_build(&sheet, &s.iso, want, NULL);
    for (int i = 0; i < PINS; i++) {
        double a = 2 * 3.14159265358979 * i / PINS;
        Vec3 n = v_unit(vec3(cos(a), sin(a), 1)), p = v_axpy(vec3(BALL[0], BALL[1], BALL[2]), BALL[3], n);
        assert_int_equal(field_project(&s.field, 1, &p, 1, NULL), 0);
        pin[i] = sheet_pin(&sheet, i, p, n, 0, 0.5, 0, false);
        assert_true(pin[i] != NONE && v_dist(sheet.pos[pin[i]], p) < 1e-12);
    }
    for (int i = 0; i < PINS; i++) {
        Vec3 a = sheet.pos[pin[i]], b = sheet.pos[pin[(i + 1) % PINS]];
        int n = sheet_trace(&sheet, i, pin[i], pin[(i + 1) % PINS], 32, path);
        assert_true(n != NONE);
        for (int k = 0; k < n; k++) assert_true(v_dist(sheet.pos[path[k]], v_mid(a, b)) < 0.6 * v_dist(a, b) + 0.2);
    }
    uint8_t *mark = NEW0(uint8_t, sheet.ntri);
    int cap = 0, rest = 0, inner = NONE;
    for (int h = 0; h < 3 * sheet.ntri && inner == NONE; h++)
        if (sheet.seam[h] != SEAM_NONE && !(sheet.seam[h] & 1)) inner = h / 3; /* to the left: the cap */
    assert_int_equal(euler_within_seams(&sheet, inner, mark), 1);
    for (int t = 0; t < sheet.ntri; t++) cap += mark[t];
    assert_true(cap < sheet.ntri / 3);
    while (mark[rest]) rest++;
    assert_int_equal(euler_within_seams(&sheet, rest, mark), 1);
    for (int t = 0; t < sheet.ntri; t++) assert_true(mark[t]);
    mem_free(mark);
    sheet_free(&sheet);
    scene_free(&s);
}

/* A fan around vertex 0 on the sheet, all around: triangle i from spoke rim[i] to rim[i + 1]. Seam k is the spoke to vertex 2 k + 1. */
static void make_fan(Sheet *s, const int *rim)
{
    *s = (Sheet){.nvert = 9, .ntri = 8, .home = NEW0(int32_t, 9), .pin = NEW0(int32_t, 9), .out = NEW0(int32_t, 9), .corner = NEW(int32_t, 24),
                 .opp = NEW(int32_t, 24), .seam = NEW(int32_t, 24), .region = NEW0(int32_t, 8)};
    for (int i = 0; i < 8; i++) {
        const int corner[3] = {0, rim[i], rim[(i + 1) % 8]}, opp[3] = {3 * ((i + 7) % 8) + 2, NONE, 3 * ((i + 1) % 8)};
        for (int k = 0; k < 3; k++) s->corner[3 * i + k] = corner[k], s->opp[3 * i + k] = opp[k], s->seam[3 * i + k] = SEAM_NONE;
    }
    for (int i = 0; i < 8; i++)
        if (rim[i] % 2) s->seam[3 * i] = rim[i] - 1, s->seam[s->opp[3 * i]] = rim[i];
}

/* A piece that comes to vertex 0 twice, between two holes. On the sheet it may do so with the spokes in another order, each with the right
 * side: sewn together two umbrellas would share the vertex. */
static void order_around_a_vertex_is_kept(void **state)
{
    (void)state;
    static const int RIM[2][8] = {{1, 2, 3, 4, 5, 6, 7, 8}, {1, 2, 7, 4, 5, 6, 3, 8}};
    for (int twisted = 0; twisted < 2; twisted++) {
        Mesh m;
        Vec3 pos[10];
        int32_t tri[48];
        pos[0] = vec3(0, 0, 1), pos[9] = vec3(0, 0, -1);
        for (int i = 0; i < 8; i++) {
            int a = i + 1, b = (i + 1) % 8 + 1;
            pos[a] = vec3(cos(0.785398 * i), sin(0.785398 * i), 0);
            memcpy(tri + 3 * i, (int32_t[3]){0, a, b}, 3 * sizeof *tri);
            memcpy(tri + 24 + 3 * i, (int32_t[3]){9, b, a}, 3 * sizeof *tri);
        }
        mesh_init(&m);
        mesh_append(&m, 10, pos, NULL, 16, tri);
        IsoSurface iso = {.ncomp = 1};
        uint8_t sound[1] = {1}, patch[2] = {0, 1}, around[16];
        int32_t label[16] = {0, 0, LABEL_HOLE, LABEL_HOLE, 0, 0, LABEL_HOLE, LABEL_HOLE}, pinned[10], seam_of[48];
        int32_t piece_of[16] = {0}, region_of[8] = {0, 0, 1, 1, 0, 0, 1, 1}, euler2[2] = {0};
        Seam seam[4];
        Graft g = {.iso = &iso, .mesh = &m, .label = label, .nlabel = 1, .pinned = pinned, .seam = seam, .nseam = 4, .seam_of = seam_of,
                   .piece = {1, piece_of, euler2}, .region = {2, region_of, euler2}, .sound = sound, .patch = patch};
        make_fan(&g.sheet, RIM[twisted]);
        for (int v = 0; v < 10; v++) pinned[v] = v == 0 ? 0 : NONE;
        for (int h = 0; h < 48; h++) seam_of[h] = NONE;
        for (int k = 0; k < 4; k++) {
            int h = 6 * k; /* from 0 to 2 k + 1 */
            seam[k] = (Seam){h, 0, 2 * k + 1, 0, 0, false};
            seam_of[h] = seam_of[m.opp[h]] = k;
        }
        assert_int_equal(graft_find_twisted(&g, around), twisted);
        for (int t = 0; t < 16; t++) assert_int_equal(around[t], twisted && t < 8);
        sheet_free(&g.sheet);
        mesh_free(&m);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_wrong_changes_nothing),
        cmocka_unit_test(faults_are_found_and_mended_where_they_are),
        cmocka_unit_test(what_a_patch_borders_on_stays),
        cmocka_unit_test(triangles_that_cut_corners_lean),
        cmocka_unit_test(topology_changes_are_local),
        cmocka_unit_test(what_is_looked_at_grows),
        cmocka_unit_test(births_deaths_and_swallowed_droplets),
        cmocka_unit_test(seams_cut_the_sheet),
        cmocka_unit_test(order_around_a_vertex_is_kept),
    };
    return cmocka_run_group_tests_name("mend", tests, NULL, NULL);
}
