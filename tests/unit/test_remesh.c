/* Changing triangles without changing topology: coarsening, GI'07 2.5's conditions, healing, guarded moves. */
#include "base/thread.h"
#include "fields.h"
#include "mesh/intersect.h"
#include "mesh_shapes.h"
#include "remesh/remesh.h"
#include "topology/iso.h"

#include <stdlib.h>
#include <string.h>

typedef struct Skin {
    Field field;
    IsoSurface iso;
    Mesh mesh;
    Remesh r;
} Skin;

/* The raw triangles of a grid's isosurface, ready to be changed; homes are kept where asked for. */
static void skin_raw(Skin *s, Grid g, double edge, bool homes)
{
    s->field = field_from(g);
    iso_build(&s->iso, &s->field);
    uint8_t *want = NEW(uint8_t, s->iso.ncomp);
    int32_t *home;
    for (int k = 0; k < s->iso.ncomp; k++) want[k] = 1;
    mesh_init(&s->mesh);
    iso_triangulate(&s->iso, want, &s->mesh, &home);
    remesh_begin(&s->r, &s->mesh, &s->field, edge, homes ? &(Homes){iso_is_home, &s->iso, home} : NULL);
    mem_free(home);
    mem_free(want);
}

static void skin_make(Skin *s, Grid g, double edge, bool homes)
{
    skin_raw(s, g, edge, homes);
    remesh_coarsen(&s->r, 3);
    remesh_remember_lengths(&s->mesh, NULL);
}

static void skin_free(Skin *s)
{
    remesh_end(&s->r);
    mesh_free(&s->mesh);
    iso_free(&s->iso);
    field_free(&s->field);
}

static const double BALL[] = {19.3, 19.6, 19.8, 14}, SMALL[] = {11.3, 11.6, 11.8, 7}, TORUS[] = {19.5, 19.5, 19.5, 12, 5};

static int compare_real(const void *pa, const void *pb)
{
    double a = *(const double *)pa, b = *(const double *)pb;
    return a < b ? -1 : a > b;
}

static double least_angle(const Mesh *m, int t)
{
    double least = 180;
    for (int k = 0; k < 3; k++) {
        Vec3 p = m->pos[m->corner[3 * t + k]], a = v_sub(m->pos[m->corner[3 * t + (k + 1) % 3]], p), b = v_sub(m->pos[m->corner[3 * t + (k + 2) % 3]], p);
        least = real_min(least, 57.29577951308232 * atan2(v_len(v_cross(a, b)), v_dot(a, b)));
    }
    return least;
}

static int inverted_count(const Skin *s)
{
    int n = 0;
    for (int t = 0; t < s->mesh.ntri; t++) {
        const int32_t *c = s->mesh.corner + 3 * t;
        if (!tri_is_dead(&s->mesh, t)) n += field_triangle_inverted(&s->field, s->mesh.pos[c[0]], s->mesh.pos[c[1]], s->mesh.pos[c[2]]);
    }
    return n;
}

/* --- coarsening ---------------------------------------------------------------------------------------------------------- */

static void coarse_mesh_is_even(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        FieldFn *fn;
        const double *k;
        double edge;
        int chi;
    } row[] = {{"ball 1.5", fn_ball, BALL, 1.5, 2}, {"ball 3", fn_ball, BALL, 3, 2}, {"torus 1.5", fn_torus, TORUS, 1.5, 0}, {"torus 2", fn_torus, TORUS, 2, 0}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        Skin s;
        skin_make(&s, grid_of(40, row[i].fn, row[i].k), row[i].edge, false);
        const Mesh *m = &s.mesh;
        assert_mesh(m);
        assert_int_equal(mesh_euler(m, NONE), row[i].chi);
        assert_true(m->deadvert == 0 && m->deadtri == 0);
        double sum = 0, *angle = NEW(double, m->ntri), landed = 0;
        int in = 0;
        for (int h = 0; h < 3 * m->ntri; h++) {
            double l = mesh_edge_length(m, h) / row[i].edge;
            sum += l / (3 * m->ntri);
            in += l >= 0.5 && l <= 2;
            assert_int_equal(m->flag[h], 0);
        }
        for (int t = 0; t < m->ntri; t++) angle[t] = least_angle(m, t);
        for (int v = 0; v < m->nvert; v++) landed = real_max(landed, fabs(field_value(&s.field, m->pos[v], NULL, NULL)));
        qsort(angle, (size_t)m->ntri, sizeof *angle, compare_real);
        double in_range = (double)in / (3 * m->ntri);
        if (getenv("TWINMESH_TOLD"))
            print_message("%s: mean %.3f, angles p5 %.1f p50 %.1f, in range %.4f, off %.1e, %d triangles\n", row[i].name, sum, angle[m->ntri / 20], angle[m->ntri / 2], in_range, landed, m->ntri);
        assert_near(sum, 1, 0.05);
        assert_true(angle[m->ntri / 20] > 30 && in_range >= 0.99);
        assert_true(landed < 2e-6);
        assert_int_equal(inverted_count(&s), 0);
        mem_free(angle);
        skin_free(&s);
    }
}

/* Noise has hundreds of handles and crowded cells: whatever is done to it, its topology stays. */
static void coarsening_keeps_the_topology_of_noise(void **state)
{
    (void)state;
    Skin s;
    skin_raw(&s, grid_of_noise(9, 3, 0), 1.5, true);
    int chi = mesh_euler(&s.mesh, NONE), n = mesh_components(&s.mesh, NULL, NULL), before = s.mesh.ntri, found;
    remesh_coarsen(&s.r, 3);
    assert_mesh(&s.mesh);
    assert_true(s.mesh.ntri < before);
    assert_int_equal(mesh_euler(&s.mesh, NONE), chi);
    assert_int_equal(mesh_components(&s.mesh, NULL, NULL), n);
    remesh_heal(&s.r, NULL, &found);
    remesh_rehome(&s.r, NULL);
    assert_mesh(&s.mesh);
    assert_int_equal(mesh_euler(&s.mesh, NONE), chi);
    skin_free(&s);
}

/* Edges enough for several blocks. */
static void threads_coarsen_the_same(void **state)
{
    (void)state;
    static const int threads[] = {1, 2, 5};
    const double ball[] = {31.3, 31.6, 31.8, 26};
    Skin s[3];
    for (int i = 0; i < 3; i++) {
        thread_set_count(threads[i]);
        skin_make(&s[i], grid_of(64, fn_ball, ball), 1, true);
        thread_shutdown();
        assert_mesh(&s[i].mesh);
        assert_int_equal(mesh_euler(&s[i].mesh, NONE), 2);
        assert_int_equal(s[i].mesh.ntri, s[0].mesh.ntri);
        assert_memory_equal(s[i].mesh.corner, s[0].mesh.corner, 3 * (size_t)s[0].mesh.ntri * sizeof(int32_t));
        assert_memory_equal(s[i].mesh.pos, s[0].mesh.pos, (size_t)s[0].mesh.nvert * sizeof(Vec3));
        assert_memory_equal(s[i].r.home, s[0].r.home, (size_t)s[0].mesh.nvert * sizeof(int32_t));
    }
    thread_set_count(1);
    for (int i = 0; i < 3; i++) skin_free(&s[i]);
}

/* So far from the origin that all vertices are one point, and the blocks' places no integers; the sanitised build would tell. */
static void far_away_nothing_overflows(void **state)
{
    (void)state;
    Grid g = grid_of(40, fn_ball, BALL);
    for (int i = 0; i < 3; i++) g.xform.m[i][i] = 1e-12;
    g.xform.t = vec3(1e12, 1e12, 1e12);
    affine_invert(&g.xform);
    Skin s;
    skin_make(&s, g, 1.5e-12, false);
    assert_mesh(&s.mesh);
    assert_int_equal(mesh_euler(&s.mesh, NONE), 2);
    skin_free(&s);
}

/* The raw triangles of a cap of a ball, the rest to stay: they are coarsened in their scope. */
static void what_is_not_fresh_stays(void **state)
{
    (void)state;
    Skin s;
    skin_raw(&s, grid_of(40, fn_ball, BALL), 2, false);
    const int before = s.mesh.nvert, first = before * 9 / 10;
    remesh_end(&s.r);
    remesh_begin_confined(&s.r, &s.mesh, &s.field, 2, NULL, first);
    assert_true(s.r.nscope > 0 && s.r.nscope < s.mesh.ntri / 4);
    Vec3 *was = NEW(Vec3, first);
    uint8_t *zone = NEW(uint8_t, first);
    int fixed = 0;
    for (int v = 0; v < first; v++) was[v] = s.mesh.pos[v], zone[v] = s.r.zone[v];
    remesh_coarsen(&s.r, 3);
    assert_mesh(&s.mesh);
    assert_int_equal(mesh_euler(&s.mesh, NONE), 2);
    assert_in_range(s.mesh.nvert, first + 1, first + (before - first) / 2);
    for (int v = 0; v < first; v++) {
        if (zone[v] != ZONE_FIXED) continue;
        assert_memory_equal(&was[v], &s.mesh.pos[v], sizeof was[v]);
        fixed++;
    }
    assert_true(fixed > first * 9 / 10);
    mem_free(was);
    mem_free(zone);
    skin_free(&s);
}

/* --- GI'07 2.5 ------------------------------------------------------------------------------------------------------------- */

/* The longest or shortest edge, and a length between it and the next. */
static int extreme_edge(const Mesh *m, bool longest, double *limit)
{
    int best = NONE;
    double l = 0, next = longest ? 0 : 1e300;
    for (int h = 0; h < 3 * m->ntri; h++) {
        if (h > m->opp[h]) continue;
        double x = mesh_edge_length(m, h);
        if (best == NONE || (longest ? x > l : x < l)) {
            if (best != NONE) next = l;
            l = x, best = h;
        } else if (longest ? x > next : x < next) {
            next = x;
        }
    }
    *limit = 0.5 * (l + next);
    return best;
}

static void set_length(Mesh *m, int h, double l) { m->length[h] = m->length[m->opp[h]] = (float)l; }
static void set_flag(Mesh *m, int h, int flag) { m->flag[h] = m->flag[m->opp[h]] = (uint8_t)flag; }

enum { E = 2 }; /* rest length, voxels: eps is 0.1 of it */

static AlterRules split_above(double limit) { return (AlterRules){E, 0, limit / E, 0.1}; }
static AlterRules collapse_below(double limit) { return (AlterRules){E, limit / E, 1e9, 0.1}; }

static void over_long_edges_are_split_unless_they_shrink(void **state)
{
    (void)state;
    static const struct {
        double was; /* the edge's length after the last step, less its length now, in E */
        int splits;
    } row[] = {{0, 1}, {0.09, 1}, {0.11, 0}, {-0.11, 1}, {-5, 1}, {1e9, 1} /* not known */};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        Skin s;
        double limit;
        skin_make(&s, grid_of(24, fn_ball, SMALL), E, false);
        int h = extreme_edge(&s.mesh, true, &limit), n = s.mesh.nvert, id = s.mesh.next_id;
        double l = mesh_edge_length(&s.mesh, h);
        set_length(&s.mesh, h, row[i].was == 1e9 ? -1 : l + row[i].was * E);
        AlterRules rules = split_above(limit);
        RemeshStat stat = remesh_alter(&s.r, &rules);
        assert_true(stat.splits == row[i].splits && stat.collapses == 0);
        assert_int_equal(s.mesh.nvert, n + row[i].splits);
        if (row[i].splits) {
            assert_int_equal(s.mesh.id[n], id);
            assert_near(field_value(&s.field, s.mesh.pos[n], NULL, NULL), 0, 2e-6); /* landed */
            assert_near(v_len(s.r.normal[n]), 1, 1e-12);
        }
        assert_mesh(&s.mesh);
        skin_free(&s);
    }
}

static void short_edges_are_collapsed_unless_they_stretch(void **state)
{
    (void)state;
    static const struct {
        double was;
        int collapses;
    } row[] = {{0, 1}, {-0.09, 1}, {-0.11, 0}, {0.11, 1}, {1e9, 1}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        Skin s;
        double limit;
        skin_make(&s, grid_of(24, fn_ball, SMALL), E, false);
        int h = extreme_edge(&s.mesh, false, &limit), n = s.mesh.nvert;
        int older = int_min(s.mesh.id[he_from(&s.mesh, h)], s.mesh.id[he_to(&s.mesh, h)]);
        double l = mesh_edge_length(&s.mesh, h);
        set_length(&s.mesh, h, row[i].was == 1e9 ? -1 : l + row[i].was * E);
        AlterRules rules = collapse_below(limit);
        RemeshStat stat = remesh_alter(&s.r, &rules);
        assert_true(stat.splits == 0 && stat.collapses == row[i].collapses);
        remesh_compact(&s.r, NULL);
        assert_int_equal(s.mesh.nvert, n - row[i].collapses);
        int kept = 0;
        for (int v = 0; v < s.mesh.nvert; v++) kept += s.mesh.id[v] == older;
        assert_int_equal(kept, 1); /* of the two the older identity stays */
        assert_mesh(&s.mesh);
        skin_free(&s);
    }
}

static void flagged_edges_wait_for_one_step(void **state)
{
    (void)state;
    for (int longest = 0; longest < 2; longest++) {
        Skin s;
        double limit;
        skin_make(&s, grid_of(24, fn_ball, SMALL), E, false);
        int h = extreme_edge(&s.mesh, longest != 0, &limit);
        set_flag(&s.mesh, h, EDGE_FLAGGED);
        AlterRules rules = longest ? split_above(limit) : collapse_below(limit);
        RemeshStat stat = remesh_alter(&s.r, &rules);
        assert_true(stat.splits + stat.collapses == 0);
        stat = remesh_alter(&s.r, &rules);
        assert_true(stat.splits + stat.collapses == 1);
        skin_free(&s);
    }
}

/* The halves of a split edge may be over-long themselves: they wait as well. */
static void edges_changed_now_are_flagged(void **state)
{
    (void)state;
    Skin s;
    double limit;
    skin_make(&s, grid_of(24, fn_ball, SMALL), E, false);
    extreme_edge(&s.mesh, true, &limit);
    int n = s.mesh.nvert, around[4], k = 0;
    AlterRules rules = split_above(limit), all = split_above(0.01);
    assert_int_equal(remesh_alter(&s.r, &rules).splits, 1);
    for (int h = 0; h < 3 * s.mesh.ntri; h++) {
        bool changed = he_from(&s.mesh, h) == n || he_to(&s.mesh, h) == n;
        assert_int_equal((s.mesh.flag[h] & EDGE_FLAGGED) != 0, changed);
        if (he_from(&s.mesh, h) == n) around[k++] = he_to(&s.mesh, h);
    }
    assert_int_equal(k, 4);
    assert_true(remesh_alter(&s.r, &all).splits > 100);
    assert_mesh(&s.mesh);
    for (k = 0; k < 4; k++) assert_true(find_edge(&s.mesh, n, around[k]) != NONE);
    remesh_alter(&s.r, &all); /* the others wait now, and these do not */
    int still = 0;
    for (k = 0; k < 4; k++) still += find_edge(&s.mesh, n, around[k]) != NONE;
    assert_true(still < 4);
    skin_free(&s);
}

/* --- inverted triangles -------------------------------------------------------------------------------------------------- */

/* Pulls the corner opposite to half-edge h over it: h's triangle turns over. False: not there. */
static bool plant(Skin *s, int h, double how_far)
{
    Mesh *m = &s->mesh;
    int v = m->corner[he_prev(h)];
    Vec3 over = v_mid(m->pos[he_from(m, h)], m->pos[he_to(m, h)]), was = m->pos[v];
    m->pos[v] = v_mix(m->pos[v], over, 1 + how_far);
    assert_int_equal(field_project(&s->field, 1, &m->pos[v], E, NULL), 0);
    field_normals(&s->field, 1, &m->pos[v], &s->r.normal[v]);
    if (inverted_count(s) >= 1) return true;
    m->pos[v] = was;
    return false;
}

static void inverted_triangles_are_not_split(void **state)
{
    (void)state;
    for (int planted = 0; planted < 2; planted++) {
        Skin s;
        double limit;
        skin_make(&s, grid_of(24, fn_ball, SMALL), E, false);
        int h = extreme_edge(&s.mesh, true, &limit);
        if (planted) assert_true(plant(&s, h, 0.3));
        for (int k = 0; k < 3 * s.mesh.ntri; k++) s.mesh.flag[k] = EDGE_FLAGGED; /* all others wait */
        set_flag(&s.mesh, h, 0);
        AlterRules rules = split_above(limit);
        assert_int_equal(remesh_alter(&s.r, &rules).splits, !planted);
        skin_free(&s);
    }
}

static void planted_inverted_triangles_are_healed(void **state)
{
    (void)state;
    Skin s;
    int planted = 0;
    skin_make(&s, grid_of(24, fn_ball, SMALL), E, false);
    for (int h = 0; h < 3 * s.mesh.ntri; h += 7) {
        if (tri_is_dead(&s.mesh, h / 3)) continue;
        if (!plant(&s, h, 0.3 + 0.05 * (h % 9))) continue;
        planted++;
        int found = 0, left = remesh_heal(&s.r, NULL, &found);
        assert_true(found >= 1);
        assert_int_equal(left, 0);
        assert_int_equal(inverted_count(&s), 0);
        assert_mesh(&s.mesh);
        assert_int_equal(mesh_euler(&s.mesh, NONE), 2);
    }
    assert_true(planted > 50);
    int found = 9;
    assert_true(remesh_heal(&s.r, NULL, &found) == 0 && found == 0);
    skin_free(&s);
}

/* --- moves ------------------------------------------------------------------------------------------------------------------ */

static void moves_land_and_those_that_harm_are_taken_back(void **state)
{
    (void)state;
    Skin s;
    skin_make(&s, grid_of(24, fn_ball, SMALL), E, false);
    Mesh *m = &s.mesh;
    Vec3 *to = NEW(Vec3, m->nvert), *was = NEW(Vec3, m->nvert);
    uint8_t *frozen = NEW0(uint8_t, m->nvert);
    uint64_t seed = 5;
    for (int v = 0; v < m->nvert; v++) was[v] = m->pos[v], to[v] = v_axpy(m->pos[v], 0.3, shape_noise3(&seed));
    frozen[3] = 1;
    assert_int_equal(remesh_move(&s.r, to, frozen), 0); /* all get there, on the surface */
    for (int v = 0; v < m->nvert; v++) {
        assert_near(field_value(&s.field, m->pos[v], NULL, NULL), 0, 2e-6);
        assert_true(v == 3 ? v_dist(m->pos[v], was[v]) == 0 : v_dist(m->pos[v], to[v]) < 0.3);
        was[v] = to[v] = m->pos[v];
    }
    /* over the far side of its ring; off the surface; to the other side of the ball */
    int h = m->out[10];
    Vec3 bad[3] = {v_mix(m->pos[10], v_mid(m->pos[he_to(m, h)], m->pos[m->corner[he_prev(h)]]), 1.8),
                   v_mix(vec3(11.3, 11.6, 11.8), m->pos[10], 1.5), v_mix(vec3(11.3, 11.6, 11.8), m->pos[10], -1)};
    for (int i = 0; i < 3; i++) {
        to[10] = bad[i];
        assert_true(remesh_move(&s.r, to, NULL) >= 1);
        assert_near3(m->pos[10], was[10], 1e-12);
        for (int v = 0; v < m->nvert; v++) assert_near3(m->pos[v], was[v], 1e-6); /* a landed point may move by a rounding */
        assert_int_equal(inverted_count(&s), 0);
    }
    mem_free(to);
    mem_free(was);
    mem_free(frozen);
    skin_free(&s);
}

static void smoothing_evens_out(void **state)
{
    (void)state;
    Skin s;
    skin_raw(&s, grid_of(24, fn_ball, SMALL), 1, false); /* marching cubes' slivers */
    double before = 0, after = 0;
    for (int t = 0; t < s.mesh.ntri; t++) before += least_angle(&s.mesh, t) / s.mesh.ntri;
    remesh_smooth(&s.r, 5);
    for (int t = 0; t < s.mesh.ntri; t++) after += least_angle(&s.mesh, t) / s.mesh.ntri;
    assert_true(after > before + 2);
    assert_int_equal(inverted_count(&s), 0);
    for (int v = 0; v < s.mesh.nvert; v++) assert_near(field_value(&s.field, s.mesh.pos[v], NULL, NULL), 0, 1e-3);
    skin_free(&s);
}

/* The p-th least angle of a hundred. */
static double angle_percentile(const Mesh *m, int p)
{
    double *angle = NEW(double, m->ntri), a;
    for (int t = 0; t < m->ntri; t++) angle[t] = least_angle(m, t);
    qsort(angle, (size_t)m->ntri, sizeof *angle, compare_real);
    a = angle[m->ntri * p / 100];
    mem_free(angle);
    return a;
}

/* Vertices shaken in their tangent planes: moves alone mend the poorest triangles, and what is held stays. */
static void poor_triangles_are_improved_in_place(void **state)
{
    (void)state;
    Skin s;
    uint64_t seed = 5;
    skin_make(&s, grid_of(40, fn_ball, BALL), 2, false);
    Mesh *m = &s.mesh;
    for (int v = 0; v < m->nvert; v++) m->pos[v] = v_axpy(m->pos[v], 1.1, vec3(shape_noise(&seed), shape_noise(&seed), shape_noise(&seed)));
    field_project(&s.field, m->nvert, m->pos, 1, NULL);
    double before = angle_percentile(m, 5);
    int32_t *corner = NEW(int32_t, 3 * m->ntri);
    uint8_t *held = NEW0(uint8_t, m->nvert);
    memcpy(corner, m->corner, 3 * (size_t)m->ntri * sizeof *corner);
    held[7] = 1;
    Vec3 was = m->pos[7];
    remesh_improve(&s.r, held);
    double after = angle_percentile(m, 5);
    if (getenv("TWINMESH_TOLD")) print_message("5th percentile of the least angle: %.1f to %.1f\n", before, after);
    assert_true(after > before + 4);
    assert_memory_equal(corner, m->corner, 3 * (size_t)m->ntri * sizeof *corner);
    assert_true(v_dist(was, m->pos[7]) == 0);
    mem_free(corner);
    mem_free(held);
    skin_free(&s);
}

/* Each marked triangle loses its longest edge, once even where two share it; the midpoint is on the surface. */
static void marked_triangles_are_split(void **state)
{
    (void)state;
    Skin s;
    skin_make(&s, grid_of(40, fn_ball, BALL), 3, false);
    Mesh *m = &s.mesh;
    int ntri = m->ntri, nvert = m->nvert;
    uint8_t *mark = NEW0(uint8_t, ntri);
    mark[4] = mark[20] = 1;
    assert_int_equal(remesh_split_marked(&s.r, mark, 100), 0);
    int n = remesh_split_marked(&s.r, mark, 1);
    assert_true(n == 1 || n == 2);
    assert_int_equal(m->nvert, nvert + n);
    assert_int_equal(m->ntri, ntri + 2 * n);
    assert_null(mesh_check(m));
    for (int v = nvert; v < m->nvert; v++) assert_true(fabs(v_dist(m->pos[v], vec3(BALL[0], BALL[1], BALL[2])) - BALL[3]) < 0.05);
    mem_free(mark);
    skin_free(&s);
}

static int crossings(const Mesh *m)
{
    TriPair *pair = NULL;
    int cap = 0, n = intersect_find(&(TriSoup){m->ntri, m->pos, m->corner}, NULL, &pair, &cap);
    mem_free(pair);
    return n;
}

/* Vertices pushed along the ball far over their neighbours: every fold is undone, where it is. */
static void crossed_triangles_are_taken_apart(void **state)
{
    (void)state;
    Skin s;
    skin_make(&s, grid_of(40, fn_ball, BALL), 3, false);
    Mesh *m = &s.mesh;
    int planted = 0;
    for (int v = 0; v < m->nvert; v += 29) {
        Vec3 to = m->pos[he_to(m, m->out[he_to(m, m->out[v])])]; /* two edges away */
        Vec3 p = v_mix(m->pos[v], to, 0.85);
        if (field_project(&s.field, 1, &p, 2, NULL) == 0) m->pos[v] = p, planted++;
    }
    Vec3 *was = NEW(Vec3, m->nvert);
    for (int v = 0; v < m->nvert; v++) was[v] = m->pos[v] = v_round32(m->pos[v]);
    int nvert = m->nvert, before = crossings(m);
    assert_true(planted > 5 && before > planted);
    Crossings known = {0};
    assert_int_equal(remesh_uncross(&s.r, &known), 0);
    assert_int_equal(crossings(m), 0);
    crossings_free(&known);
    assert_mesh(m);
    int edited = 0;
    for (int v = 0; v < nvert; v++) {
        if (vert_is_dead(m, v)) continue;
        assert_true(fabs(v_dist(m->pos[v], vec3(BALL[0], BALL[1], BALL[2])) - BALL[3]) < 0.05);
        edited += v_dist(m->pos[v], was[v]) > 0;
    }
    assert_true(edited <= 3 * planted); /* all others stayed */
    mem_free(was);
    skin_free(&s);
}

static void meshes_without_crossings_are_left_alone(void **state)
{
    (void)state;
    Skin s;
    skin_make(&s, grid_of(40, fn_ball, BALL), 3, false);
    Mesh *m = &s.mesh;
    for (int v = 0; v < m->nvert; v++) m->pos[v] = v_round32(m->pos[v]);
    Mesh was;
    mesh_init(&was);
    mesh_append(&was, m->nvert, m->pos, m->id, m->ntri, m->corner);
    Crossings known = {0};
    assert_int_equal(remesh_uncross(&s.r, &known), 0);
    crossings_free(&known);
    assert_memory_equal(m->pos, was.pos, (size_t)m->nvert * sizeof *m->pos);
    assert_memory_equal(m->corner, was.corner, 3 * (size_t)m->ntri * sizeof *m->corner);
    mesh_free(&was);
    skin_free(&s);
}

static void flips_mend_valences(void **state)
{
    (void)state;
    Skin s;
    skin_make(&s, grid_of(24, fn_ball, SMALL), E, false);
    int flipped = 0;
    for (int h = 0; h < 3 * s.mesh.ntri && flipped < 10; h += 11)
        if (mesh_can_flip(&s.mesh, h)) mesh_flip_edge(&s.mesh, h), flipped++;
    int chi = mesh_euler(&s.mesh, NONE), back = 0, now;
    while ((now = remesh_flip(&s.r, 0.05)) > 0 && back < 1000) back += now;
    assert_true(back >= 8 && back < 100); /* it ends by itself */
    assert_mesh(&s.mesh);
    assert_int_equal(mesh_euler(&s.mesh, NONE), chi);
    skin_free(&s);
}

/* --- homes ------------------------------------------------------------------------------------------------------------------ */

static void strays_are_brought_home(void **state)
{
    (void)state;
    Skin s;
    skin_make(&s, grid_of(28, fn_two_balls, (double[]){8, 14, 14, 5.5, 20, 14, 14, 5.5}), 1.5, true);
    Mesh *m = &s.mesh;
    int v = 0;
    for (int w = 0; w < m->nvert; w++) /* the one nearest to the other ball */
        if (m->pos[w].x < 14 && m->pos[w].x > m->pos[v].x) v = w;
    int id = m->id[v];
    assert_int_equal(remesh_rehome(&s.r, NULL), 0);
    static const Vec3 astray[2] = {{14.5, 14, 14}, {14, 14, 14}}; /* on the other; on none */
    for (int i = 0; i < 2; i++) {
        m->pos[v] = astray[i];
        assert_int_equal(remesh_rehome(&s.r, NULL), 0);
        assert_mesh(m);
        if (vert_is_dead(m, v)) break; /* collapsed into a neighbour: as well */
        assert_int_equal(m->id[v], id);
        assert_true(iso_is_home(&s.iso, s.r.home[v], m->pos[v]) && m->pos[v].x < 14);
        assert_near(field_value(&s.field, m->pos[v], NULL, NULL), 0, 2e-6);
    }
    skin_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coarse_mesh_is_even),
        cmocka_unit_test(coarsening_keeps_the_topology_of_noise),
        cmocka_unit_test(threads_coarsen_the_same),
        cmocka_unit_test(far_away_nothing_overflows),
        cmocka_unit_test(what_is_not_fresh_stays),
        cmocka_unit_test(over_long_edges_are_split_unless_they_shrink),
        cmocka_unit_test(short_edges_are_collapsed_unless_they_stretch),
        cmocka_unit_test(flagged_edges_wait_for_one_step),
        cmocka_unit_test(edges_changed_now_are_flagged),
        cmocka_unit_test(inverted_triangles_are_not_split),
        cmocka_unit_test(planted_inverted_triangles_are_healed),
        cmocka_unit_test(moves_land_and_those_that_harm_are_taken_back),
        cmocka_unit_test(smoothing_evens_out),
        cmocka_unit_test(poor_triangles_are_improved_in_place),
        cmocka_unit_test(marked_triangles_are_split),
        cmocka_unit_test(crossed_triangles_are_taken_apart),
        cmocka_unit_test(meshes_without_crossings_are_left_alone),
        cmocka_unit_test(flips_mend_valences),
        cmocka_unit_test(strays_are_brought_home),
    };
    return cmocka_run_group_tests_name("remesh", tests, NULL, NULL);
}
