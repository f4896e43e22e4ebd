/* The geometric mesh: patterns without T-vertices, parents, criteria, and marks that are remembered. */
#include "fields.h"
#include "mesh_shapes.h"
#include "refine/refine.h"
#include "remesh/remesh.h"
#include "topology/iso.h"

#include <stdlib.h>

typedef struct Scene {
    Field field;
    IsoSurface iso;
    Mesh mesh;
} Scene;

static void scene_make(Scene *s, int n, FieldFn *fn, const double *k, double edge)
{
    s->field = field_of(n, fn, k);
    iso_build(&s->iso, &s->field);
    uint8_t want[4] = {1, 1, 1, 1};
    mesh_init(&s->mesh);
    iso_triangulate(&s->iso, want, &s->mesh, NULL);
    Remesh r;
    remesh_begin(&r, &s->mesh, &s->field, edge, NULL);
    remesh_coarsen(&r, 3);
    remesh_end(&r);
}

static void scene_free(Scene *s)
{
    mesh_free(&s->mesh);
    iso_free(&s->iso);
    field_free(&s->field);
}

static const double BALL[] = {11.3, 11.6, 11.8, 8}, OCTAHEDRON[] = {15.3, 15.6, 15.8, 12}, TORUS[] = {15.3, 15.6, 15.8, 9, 4};

static const struct {
    FieldFn *fn;
    const double *k;
    double edge;
} SHAPES[] = {{fn_ball, BALL, 3}, {fn_octahedron, OCTAHEDRON, 3}, {fn_torus, TORUS, 2.5}};
enum { NSHAPE = 3 };

#define AS_PAPERS REFINE_BY_NORMALS, REFINE_SCHEME_PAPERS, 0
#define AS_RED_GREEN REFINE_BY_NORMALS, REFINE_SCHEME_RED_GREEN, 0

/* One call on a fresh memory. */
static int refine_once(const Scene *s, RefineSettings set, int32_t *next_id, RefinedMesh *out)
{
    Refine memory = {0};
    *out = (RefinedMesh){0};
    int lost = refine_build(&memory, &s->mesh, &s->field, &set, NULL, next_id, out);
    refine_free(&memory);
    return lost;
}

/* No T-vertices: each edge is there twice, once in either direction, so that the triangles close up. */
static void assert_closed(const RefinedMesh *m, int chi)
{
    Map edge;
    map_init(&edge, 3 * m->ntri);
    for (int h = 0; h < 3 * m->ntri; h++) {
        int a = m->tri[h], b = m->tri[he_next(h)];
        assert_true(a >= 0 && a < m->nvert && a != b);
        assert_int_equal(map_put(&edge, key_pair(a, b), h), h);
    }
    for (int h = 0; h < 3 * m->ntri; h++) assert_true(map_get(&edge, key_pair(m->tri[he_next(h)], m->tri[h])) != NONE);
    map_free(&edge);
    assert_int_equal(m->nvert - m->ntri / 2, chi); /* no vertex lies about unused */
}

static void assert_no_copies(const RefinedMesh *m)
{
    Map id;
    map_init(&id, m->nvert);
    for (int v = 0; v < m->nvert; v++) assert_int_equal(map_put(&id, (uint64_t)m->id[v], v), v);
    map_free(&id);
}

static void angle_of_180_copies(void **state)
{
    (void)state;
    Scene s;
    scene_make(&s, 24, fn_ball, BALL, 3);
    RefinedMesh m;
    int32_t next = 12345;
    int lost = refine_once(&s, (RefineSettings){180, 4, 0.001, AS_PAPERS}, &next, &m);
    assert_true(m.nvert == s.mesh.nvert && m.ntri == s.mesh.ntri && next == 12345 && lost == 0);
    assert_memory_equal(m.tri, s.mesh.corner, (size_t)(3 * m.ntri) * sizeof *m.tri);
    for (int v = 0; v < m.nvert; v++) {
        Vec3 p = v_round32(s.mesh.pos[v]);
        assert_memory_equal(&m.pos[v], &p, sizeof p);
        assert_true(m.id[v] == s.mesh.id[v] && m.ends[v][0] == NONE && m.ends[v][1] == NONE);
        assert_near(v_dot(m.normal[v], v_unit(v_sub(p, vec3(11.3, 11.6, 11.8)))), 1, 0.01);
    }
    for (int t = 0; t < m.ntri; t++) assert_int_equal(m.parent[t], t);
    refined_free(&m);
    scene_free(&s);
}

static void refined_mesh_is_closed_and_faces_outward(void **state)
{
    (void)state;
    for (int i = 0; i < NSHAPE; i++) {
        Scene s;
        scene_make(&s, 32, SHAPES[i].fn, SHAPES[i].k, SHAPES[i].edge);
        static const RefineSettings set[] = {{20, 4, 0.1, AS_PAPERS}, {10, 1, 0, AS_PAPERS}, {60, 8, 0.02, AS_PAPERS}, {5, 3, 0, AS_PAPERS}, {179, 4, 0.05, AS_PAPERS}};
        for (size_t k = 0; k < sizeof set / sizeof *set; k++) {
            RefinedMesh m;
            int32_t next = s.mesh.next_id;
            refine_once(&s, set[k], &next, &m);
            assert_closed(&m, mesh_euler(&s.mesh, NONE));
            assert_no_copies(&m);
            assert_int_equal(next - s.mesh.next_id, MESH_ID_STEP * (m.nvert - s.mesh.nvert)); /* fresh identities, none wasted */
            for (int v = 0; v < m.nvert; v++) {
                Vec3 p = v_round32(m.pos[v]);
                assert_memory_equal(&p, &m.pos[v], sizeof p);
                assert_near(v_len(m.normal[v]), 1, 1e-12);
                assert_near(field_value(&s.field, m.pos[v], NULL, NULL), 0, 1e-5);
                if (v < s.mesh.nvert) assert_int_equal(m.id[v], s.mesh.id[v]);
                else assert_true(m.id[v] >= s.mesh.next_id && m.ends[v][0] >= 0 && m.ends[v][0] < v && m.ends[v][1] < v);
            }
            assert_int_equal(refine_measure(&m, &s.field).inverted, 0);
            refined_free(&m);
        }
        scene_free(&s);
    }
}

static void children_lie_on_their_parents(void **state)
{
    (void)state;
    for (int i = 0; i < NSHAPE; i++) {
        Scene s;
        scene_make(&s, 32, SHAPES[i].fn, SHAPES[i].k, SHAPES[i].edge);
        RefinedMesh m;
        int32_t next = s.mesh.next_id;
        refine_once(&s, (RefineSettings){20, 4, 0.1, AS_PAPERS}, &next, &m);
        double *area = NEW0(double, s.mesh.ntri), worst = 0;
        for (int t = 0; t < m.ntri; t++) {
            int p = m.parent[t];
            assert_true(p >= 0 && p < s.mesh.ntri && (t == 0 || p >= m.parent[t - 1]));
            Vec3 a[3], b[3];
            for (int k = 0; k < 3; k++) a[k] = s.mesh.pos[s.mesh.corner[3 * p + k]], b[k] = m.pos[m.tri[3 * t + k]];
            Vec3 n = v_unit(v_area2(a[0], a[1], a[2])), c = v_scale(v_add(v_add(b[0], b[1]), b[2]), 1.0 / 3);
            worst = real_max(worst, fabs(v_dot(v_sub(c, a[0]), n)) / SHAPES[i].edge);
            area[p] += v_dot(v_area2(b[0], b[1], b[2]), n) / v_len(mesh_tri_area2(&s.mesh, p));
            for (int k = 0; k < 3; k++) { /* a child's centroid lies over its parent, a little aside at most */
                Vec3 inward = v_unit(v_cross(n, v_sub(a[(k + 1) % 3], a[k])));
                assert_true(v_dot(v_sub(c, a[k]), inward) > -0.5 * SHAPES[i].edge);
            }
        }
        if (getenv("TWINMESH_TOLD")) print_message("shape %d: a child's centroid is up to %.2f edges off its parent's plane\n", i, worst);
        assert_true(worst < (i == 1 ? 1 : 0.25));
        double least = 9, most = 0; /* seen along its normal a parent is covered, but where it cuts off a ridge */
        for (int p = 0; p < s.mesh.ntri; p++) least = real_min(least, area[p]), most = real_max(most, area[p]);
        if (getenv("TWINMESH_TOLD")) print_message("shape %d: children cover %.2f to %.2f of their parent\n", i, least, most);
        assert_true(least > (i == 1 ? 0 : 0.5) && most < (i == 1 ? 4 : 1.5));
        mem_free(area);
        refined_free(&m);
        scene_free(&s);
    }
}

/* After one pass a triangle is whole or in 2, 3 or 4 pieces, by how many of its edges got a midpoint. */
static void pieces_follow_the_marked_edges(void **state)
{
    (void)state;
    int seen[5] = {0};
    for (int i = 0; i < NSHAPE; i++) {
        Scene s;
        scene_make(&s, 32, SHAPES[i].fn, SHAPES[i].k, SHAPES[i].edge);
        for (int angle = 15; angle <= 35; angle += 10) {
            RefinedMesh m;
            int32_t next = s.mesh.next_id;
            refine_once(&s, (RefineSettings){angle, 1, 0, AS_PAPERS}, &next, &m);
            Map mid;
            map_init(&mid, m.nvert);
            for (int v = s.mesh.nvert; v < m.nvert; v++) map_put(&mid, key_pair(int_min(m.ends[v][0], m.ends[v][1]), int_max(m.ends[v][0], m.ends[v][1])), v);
            int *pieces = NEW0(int, s.mesh.ntri);
            for (int t = 0; t < m.ntri; t++) pieces[m.parent[t]]++;
            for (int p = 0; p < s.mesh.ntri; p++) {
                int marks = 0;
                for (int k = 0; k < 3; k++) {
                    int a = s.mesh.corner[3 * p + k], b = s.mesh.corner[3 * p + (k + 1) % 3];
                    marks += map_get(&mid, key_pair(int_min(a, b), int_max(a, b))) != NONE;
                }
                assert_int_equal(pieces[p], 1 + marks);
                seen[1 + marks]++;
            }
            mem_free(pieces);
            map_free(&mid);
            refined_free(&m);
        }
        scene_free(&s);
    }
    for (int k = 1; k <= 4; k++) assert_true(seen[k] > 10);
}

static void each_pass_adds_and_takes_nothing_away(void **state)
{
    (void)state;
    for (int i = 0; i < NSHAPE; i++) {
        Scene s;
        scene_make(&s, 32, SHAPES[i].fn, SHAPES[i].k, SHAPES[i].edge);
        RefinedMesh last = {0}, m;
        for (int passes = 0; passes <= 5; passes++) {
            int32_t next = s.mesh.next_id;
            refine_once(&s, (RefineSettings){15, passes, 0.05, AS_PAPERS}, &next, &m);
            if (passes == 0) assert_true(m.nvert == s.mesh.nvert && m.ntri == s.mesh.ntri);
            if (passes == 1) assert_true(m.ntri > last.ntri);
            /* in the order of the lower ends */
            for (int v = last.nvert + 1; passes && v < m.nvert; v++)
                assert_true(int_min(m.ends[v][0], m.ends[v][1]) >= int_min(m.ends[v - 1][0], m.ends[v - 1][1]));
            if (passes) {
                assert_true(m.nvert >= last.nvert && m.ntri >= last.ntri);
                assert_memory_equal(m.pos, last.pos, (size_t)last.nvert * sizeof *m.pos);
                assert_memory_equal(m.id, last.id, (size_t)last.nvert * sizeof *m.id);
            }
            refined_free(&last);
            last = m;
        }
        refined_free(&last);
        scene_free(&s);
    }
}

static void deviation_brings_the_distance_down(void **state)
{
    (void)state;
    for (int i = 0; i < NSHAPE; i++) {
        Scene s;
        scene_make(&s, 32, SHAPES[i].fn, SHAPES[i].k, SHAPES[i].edge);
        static const double limit[] = {0, 0.2, 0.1, 0.05};
        double mean = 1e9;
        int tris = 0;
        for (int k = 0; k < 4; k++) {
            RefinedMesh m;
            int32_t next = s.mesh.next_id;
            int lost = refine_once(&s, (RefineSettings){179, 6, limit[k], AS_PAPERS}, &next, &m);
            RefineFigures now = refine_measure(&m, &s.field);
            if (getenv("TWINMESH_TOLD"))
                print_message("shape %d, deviation %.2f: %d triangles, mean %.4f, most %.4f voxels, %d lost\n", i, limit[k], m.ntri, now.mean_vox, now.max_vox, lost);
            if (k == 0) assert_int_equal(m.ntri, s.mesh.ntri);
            else assert_true(now.mean_vox <= mean && m.ntri >= tris);
            if (k && i != 1) assert_true(now.max_vox <= 1.6 * limit[k]); /* edges across the octahedron's ridges may be too short to cut */
            mean = now.mean_vox;
            tris = m.ntri;
            refined_free(&m);
        }
        scene_free(&s);
    }
}

/* The same mesh once more: the same triangles over the same identities, and nobody asks for new ones. */
static void calm_surface_keeps_its_connectivity(void **state)
{
    (void)state;
    for (int i = 0; i < NSHAPE; i++) {
        Scene s;
        scene_make(&s, 32, SHAPES[i].fn, SHAPES[i].k, SHAPES[i].edge);
        Refine memory = {0};
        RefinedMesh first = {0}, m = {0}, fresh;
        int32_t next = s.mesh.next_id;
        RefineSettings set = {12, 4, 0, AS_PAPERS};
        refine_build(&memory, &s.mesh, &s.field, &set, NULL, &next, &first);
        int32_t used = next;
        for (int again = 0; again < 3; again++) {
            if (again == 2) set.angle_deg = 15; /* a mark stays above 0.7 of its limit */
            refine_build(&memory, &s.mesh, &s.field, &set, NULL, &next, &m);
            assert_int_equal(m.ntri, first.ntri);
            assert_int_equal(m.nvert, first.nvert);
            assert_int_equal(next, used);
            assert_memory_equal(m.id, first.id, (size_t)m.nvert * sizeof *m.id);
            assert_memory_equal(m.tri, first.tri, (size_t)(3 * m.ntri) * sizeof *m.tri);
        }
        refine_once(&s, set, &next, &fresh); /* without a memory there are fewer */
        assert_true(fresh.ntri < first.ntri);
        refined_free(&fresh);
        refined_free(&first);
        refined_free(&m);
        refine_free(&memory);
        scene_free(&s);
    }
}

/* Marks once forgotten come back under fresh identities. */
static void identities_are_not_used_twice(void **state)
{
    (void)state;
    Scene s;
    scene_make(&s, 24, fn_ball, BALL, 3);
    Refine memory = {0};
    RefinedMesh m = {0};
    int32_t next = s.mesh.next_id;
    RefineSettings on = {15, 3, 0.1, AS_PAPERS}, off = {180, 3, 0, AS_PAPERS};
    refine_build(&memory, &s.mesh, &s.field, &on, NULL, &next, &m);
    int32_t used = next;
    assert_true(used > s.mesh.next_id);
    refine_build(&memory, &s.mesh, &s.field, &off, NULL, &next, &m);
    assert_true(next == used && m.ntri == s.mesh.ntri);
    refine_build(&memory, &s.mesh, &s.field, &on, NULL, &next, &m);
    for (int v = s.mesh.nvert; v < m.nvert; v++) assert_true(m.id[v] >= used);
    assert_no_copies(&m);
    refined_free(&m);
    refine_free(&memory);
    scene_free(&s);
}

/* Midpoints land on their ends' component, however near another is. */
static void midpoints_stay_at_home(void **state)
{
    (void)state;
    Scene s;
    static const double k[] = {8, 14, 14, 5.4, 19.5, 14, 14, 5.4};
    scene_make(&s, 28, fn_two_balls, k, 2.5);
    assert_int_equal(s.iso.ncomp, 2);
    bool sure;
    int32_t *of = NEW(int32_t, s.mesh.nvert), next = s.mesh.next_id;
    for (int v = 0; v < s.mesh.nvert; v++) of[v] = iso_component_at(&s.iso, s.mesh.pos[v], &sure);
    Refine memory = {0};
    RefinedMesh m = {0};
    RefineSettings set = {10, 4, 0.05, AS_PAPERS};
    refine_build(&memory, &s.mesh, &s.field, &set, &(Homes){iso_is_home, &s.iso, of}, &next, &m);
    assert_closed(&m, 4);
    for (int v = s.mesh.nvert; v < m.nvert; v++) {
        int w = v;
        while (m.ends[w][0] != NONE) w = m.ends[w][0];
        assert_true(iso_is_home(&s.iso, of[w], m.pos[v]));
    }
    mem_free(of);
    refined_free(&m);
    refine_free(&memory);
    scene_free(&s);
}

/* --- alternatives to the papers' way ------------------------------------------------------------------------------------- */

static double distance_to_vertices(const RefinedMesh *m, Vec3 p)
{
    double d = INFINITY;
    for (int v = 0; v < m->nvert; v++) d = real_min(d, v_dist(p, m->pos[v]));
    return d;
}

/* The triangle of the longest least edge. */
static int roomiest(const Mesh *m)
{
    int best = 0;
    double room = 0;
    for (int t = 0; t < m->ntri; t++) {
        double least = INFINITY;
        for (int k = 0; k < 3; k++) least = real_min(least, mesh_edge_length(m, 3 * t + k));
        if (least > room) room = least, best = t;
    }
    return best;
}

/* GI'07 figure 7c: a small ball stands out of a large one, inside a triangle and away from its centroid. */
static void hernia_is_found_by_the_hessian(void **state)
{
    (void)state;
    double k[] = {31.3, 31.6, 31.8, 24, 0, 0, 0, 1.4};
    Scene s;
    scene_make(&s, 64, fn_ball, k, 8);
    const int32_t *c = s.mesh.corner + 3 * roomiest(&s.mesh);
    Vec3 centre = vec3(k[0], k[1], k[2]), a = s.mesh.pos[c[0]], q = v_axpy(a, 0.2, v_sub(v_add(s.mesh.pos[c[1]], s.mesh.pos[c[2]]), v_scale(a, 2)));
    Vec3 out = v_unit(v_sub(q, centre)), hernia = v_axpy(centre, 24.3, out), top = v_axpy(hernia, 1.4, out);
    k[4] = hernia.x, k[5] = hernia.y, k[6] = hernia.z;
    Field plain = s.field;
    s.field = field_of(64, fn_two_balls, k);
    RefinedMesh m;
    int32_t next = s.mesh.next_id;
    refine_once(&s, (RefineSettings){30, 4, 0, AS_PAPERS}, &next, &m);
    assert_int_equal(m.ntri, s.mesh.ntri); /* nothing is seen */
    refined_free(&m);
    refine_once(&s, (RefineSettings){30, 4, 0, REFINE_BY_HESSIAN, REFINE_SCHEME_PAPERS, 0}, &next, &m);
    if (getenv("TWINMESH_TOLD")) print_message("hernia: %d of %d triangles, its top %.2f voxels from a vertex\n", m.ntri, s.mesh.ntri, distance_to_vertices(&m, top));
    assert_true(m.ntri > s.mesh.ntri + 20 && m.ntri < 2 * s.mesh.ntri); /* cut there, not elsewhere */
    assert_true(distance_to_vertices(&m, top) < 0.8);
    assert_closed(&m, 2);
    refined_free(&m);
    scene_free(&s);
    field_free(&plain);
}

/* The Hessian of a ball is known: the normal turns by an edge's length over the radius. */
static void turn_of_a_ball_is_length_over_radius(void **state)
{
    (void)state;
    static const double k[] = {19.3, 19.6, 19.8, 14};
    Scene s;
    scene_make(&s, 40, fn_ball, k, 3);
    double most = 0;
    for (int h = 0; h < 3 * s.mesh.ntri; h++) most = real_max(most, mesh_edge_length(&s.mesh, h));
    double degrees = most / 14 * 57.29577951308232;
    for (int above = 0; above < 2; above++) {
        RefinedMesh m;
        int32_t next = s.mesh.next_id;
        refine_once(&s, (RefineSettings){(above ? 1.15 : 0.85) * degrees, 1, 0, REFINE_BY_HESSIAN, REFINE_SCHEME_PAPERS, 0}, &next, &m);
        assert_int_equal(m.ntri == s.mesh.ntri, above);
        refined_free(&m);
    }
    scene_free(&s);
}

static double piece_aspect(const Vec3 *pos, const int32_t *c)
{
    double a = v_dist(pos[c[0]], pos[c[1]]), b = v_dist(pos[c[1]], pos[c[2]]), d = v_dist(pos[c[2]], pos[c[0]]);
    return 4 * v_len2(v_area2(pos[c[0]], pos[c[1]], pos[c[2]])) / ((a + b + d) * a * b * d);
}

/* The least aspect of a refined triangle over that of its mechanical one. */
static double worst_share(const Scene *s, const RefinedMesh *m)
{
    double worst = 1;
    for (int t = 0; t < m->ntri; t++)
        worst = real_min(worst, piece_aspect(m->pos, m->tri + 3 * t) / piece_aspect(s->mesh.pos, s->mesh.corner + 3 * m->parent[t]));
    return worst;
}

/* Pass by pass: the edge between the halves of a green triangle never gets a midpoint. */
static void green_triangles_are_never_cut(void **state)
{
    (void)state;
    int greens = 0, replaced = 0;
    for (int i = 0; i < NSHAPE; i++) {
        Scene s;
        scene_make(&s, 32, SHAPES[i].fn, SHAPES[i].k, SHAPES[i].edge);
        Map inner;
        map_init(&inner, 1000);
        for (int passes = 1; passes <= 5; passes++) {
            RefinedMesh m;
            int32_t next = s.mesh.next_id;
            refine_once(&s, (RefineSettings){8, passes, 0.03, AS_RED_GREEN}, &next, &m);
            assert_closed(&m, mesh_euler(&s.mesh, NONE));
            for (int v = s.mesh.nvert; v < m.nvert; v++)
                assert_int_equal(map_get(&inner, key_pair(int_min(m.ends[v][0], m.ends[v][1]), int_max(m.ends[v][0], m.ends[v][1]))), NONE);
            for (int t = 0; t < m.ntri; t++) {
                if (m.green[t] != 1) continue;
                int mid = m.tri[3 * t + 1], c = m.tri[3 * t + 2];
                assert_true(m.green[t + 1] == 2 && m.tri[3 * t + 3] == mid && m.tri[3 * t + 5] == c);
                map_put(&inner, key_pair(int_min(mid, c), int_max(mid, c)), 1);
                greens++;
            }
            for (int t = 0; passes == 5 && t < m.ntri; t++) replaced -= m.green[t] == 1;
            refined_free(&m);
        }
        replaced += inner.count; /* more than the last meshes have: those of earlier passes are gone */
        map_free(&inner);
        scene_free(&s);
    }
    assert_true(greens > 100 && replaced > 50);
}

/* Red pieces are like their whole, and green ones its halves: with passes the papers' scheme grows slim triangles, red-green none. */
static void red_green_bounds_angles(void **state)
{
    (void)state;
    Scene s;
    scene_make(&s, 32, fn_torus, TORUS, 2.5);
    for (int passes = 3; passes <= 6; passes++) {
        double share[2];
        for (int scheme = 0; scheme < 2; scheme++) {
            RefinedMesh m;
            int32_t next = s.mesh.next_id;
            refine_once(&s, (RefineSettings){12, passes, 0.02, REFINE_BY_NORMALS, (RefineScheme)scheme, 0}, &next, &m);
            share[scheme] = worst_share(&s, &m);
            if (getenv("TWINMESH_TOLD")) print_message("%d passes, scheme %d: %d triangles, least aspect %.3f of its mechanical one's\n", passes, scheme, m.ntri, share[scheme]);
            refined_free(&m);
        }
        assert_true(share[1] > 0.4 && share[1] > share[0]);
    }
    scene_free(&s);
}

static void red_green_marks_are_remembered(void **state)
{
    (void)state;
    Scene s;
    scene_make(&s, 32, fn_torus, TORUS, 2.5);
    Refine memory = {0};
    RefinedMesh first = {0}, m = {0};
    int32_t next = s.mesh.next_id;
    RefineSettings set = {12, 4, 0, AS_RED_GREEN};
    refine_build(&memory, &s.mesh, &s.field, &set, NULL, &next, &first);
    int32_t used = next;
    for (int again = 0; again < 2; again++) {
        if (again == 1) set.angle_deg = 13;
        refine_build(&memory, &s.mesh, &s.field, &set, NULL, &next, &m);
        assert_true(m.ntri == first.ntri && m.nvert == first.nvert && next == used);
        assert_memory_equal(m.id, first.id, (size_t)m.nvert * sizeof *m.id);
        assert_memory_equal(m.tri, first.tri, (size_t)(3 * m.ntri) * sizeof *m.tri);
    }
    refined_free(&first);
    refined_free(&m);
    refine_free(&memory);
    scene_free(&s);
}

/* No piece is slimmer than asked, unless its mechanical triangle is; nor slimmer than that then. */
static void aspect_is_respected(void **state)
{
    (void)state;
    for (int i = 0; i < NSHAPE; i++) {
        Scene s;
        scene_make(&s, 32, SHAPES[i].fn, SHAPES[i].k, SHAPES[i].edge);
        int slim[2] = {0, 0}, tris[2];
        static const double limit[] = {0, 0.6};
        for (int k = 0; k < 2; k++) {
            RefinedMesh m;
            int32_t next = s.mesh.next_id;
            refine_once(&s, (RefineSettings){10, 4, 0.05, REFINE_BY_NORMALS, REFINE_SCHEME_PAPERS, limit[k]}, &next, &m);
            for (int t = 0; t < m.ntri; t++) {
                Vec3 whole[3];
                for (int c = 0; c < 3; c++) whole[c] = v_round32(s.mesh.pos[s.mesh.corner[3 * m.parent[t] + c]]);
                slim[k] += piece_aspect(m.pos, m.tri + 3 * t) < real_min(0.6, piece_aspect(whole, (const int32_t[]){0, 1, 2})) - 1e-12;
            }
            tris[k] = m.ntri;
            assert_closed(&m, mesh_euler(&s.mesh, NONE));
            refined_free(&m);
        }
        if (getenv("TWINMESH_TOLD")) print_message("shape %d: %d of %d triangles under 0.6 without the limit, %d of %d with it\n", i, slim[0], tris[0], slim[1], tris[1]);
        assert_true(slim[0] > 50 && tris[1] > s.mesh.ntri);
        assert_int_equal(slim[1], 0);
        scene_free(&s);
    }
}

/* --- off the surface, to be nearer to it ---------------------------------------------------------------------------------- */

static void balanced_triangles_are_nearer(void **state)
{
    (void)state;
    for (int i = 0; i < NSHAPE; i++) {
        Scene s;
        RefinedMesh m;
        scene_make(&s, 32, SHAPES[i].fn, SHAPES[i].k, SHAPES[i].edge);
        int32_t next = s.mesh.next_id;
        int lifted = 0;
        refine_once(&s, (RefineSettings){20, 4, 0.1, AS_PAPERS}, &next, &m);
        RefineFigures before = refine_measure(&m, &s.field);
        Vec3 *landed = refine_balance(&m, &s.field);
        RefineFigures after = refine_measure(&m, &s.field);
        for (int v = 0; v < m.nvert; v++) {
            Vec3 p = v_round32(m.pos[v]);
            assert_memory_equal(&p, &m.pos[v], sizeof p);
            assert_near(field_value(&s.field, landed[v], NULL, NULL), 0, 1e-5);
            assert_true(v_dist(m.pos[v], landed[v]) <= 0.0401);
            lifted += v_dist(m.pos[v], landed[v]) > 0;
        }
        if (getenv("TWINMESH_TOLD")) print_message("shape %d: %d of %d vertices lifted, mean %.4f -> %.4f voxels\n", i, lifted, m.nvert, before.mean_vox, after.mean_vox);
        assert_true(after.mean_vox <= (i == 1 ? 1 : 0.6) * before.mean_vox); /* the octahedron is flat */
        assert_int_equal(after.inverted, 0);
        mem_free(landed);
        refined_free(&m);
        scene_free(&s);
    }
}

/* --- triangles that run through one another ------------------------------------------------------------------------------ */

/* The middle of an edge, rounded, is the corner of the flat triangle below it. */
static void pieces_laid_flat_keep_an_area(void **state)
{
    (void)state;
    Scene s;
    scene_make(&s, 24, fn_ball, (const double[]){11.3, 11.6, 11.8, 7}, 1.5);
    Vec3 pos[] = {{0, 1, 0}, {2, 1 + 0x1p-23, 0}, {1, 1, 0}, {0.5, 0, 0.2}, {0.5, 2, 0.2}, {0.5, 1, 0.3}, {1, 1, 0.5}};
    int32_t ends[][2] = {{NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {0, 1}};
    int32_t tri[] = {0, 6, 2, 6, 1, 2, 3, 4, 5}, parent[] = {0, 0, 1};
    RefinedMesh m = {.nvert = 7, .ntri = 3, .pos = pos, .ends = ends, .tri = tri, .parent = parent};
    Crossings none = {.ntri = 2};
    int flattened;
    assert_int_equal(refine_untangle(&m, &s.field, NULL, &none, &flattened), 0);
    assert_int_equal(flattened, 1);
    assert_true(pos[6].z > 0 && pos[6].z < 0.01);
    for (int t = 0; t < 3; t++) assert_true(v_len2(v_area2(pos[tri[3 * t]], pos[tri[3 * t + 1]], pos[tri[3 * t + 2]])) > 0);
    scene_free(&s);
}

/* A triangle whose plane rises by the last bit of float32 above another one. The middle of its edge is rounded down: half of it lies in
 * the other's plane then, and on it. */
static void rounded_middles_are_kept_apart(void **state)
{
    (void)state;
    static const double k[] = {13.3, 13.6, 13.8, 8};
    const double y = 0.4375, up = ldexp(1, -25);
    Vec3 pos[7] = {{0, y, 0}, {1, y + up, 0}, {0.5, y, 1}, {0.35, y, 0.05}, {0.45, y, 0.05}, {0.4, y, 0.15}, {0.5, y, 0}}, normal[7];
    int32_t ends[7][2] = {{NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {0, 1}};
    int32_t tri[] = {0, 6, 2, 6, 1, 2, 3, 4, 5}, parent[] = {0, 0, 1}, coarse[] = {0, 1, 2, 3, 4, 5};
    RefinedMesh m = {.nvert = 7, .ntri = 3, .pos = pos, .normal = normal, .ends = ends, .tri = tri, .parent = parent};
    Crossings none = {.ntri = 2};
    TriPair *pair = NULL;
    int cap = 0, flattened;
    Scene s;
    for (int v = 0; v < 7; v++) pos[v] = v_round32(pos[v]), normal[v] = vec3(0, 1, 0);
    assert_int_equal(intersect_find(&(TriSoup){2, pos, coarse}, NULL, &pair, &cap), 0);
    assert_int_equal(intersect_find(&(TriSoup){3, pos, tri}, NULL, &pair, &cap), 1);
    scene_make(&s, 28, fn_ball, k, 1.5);
    assert_int_equal(refine_untangle(&m, &s.field, NULL, &none, &flattened), 0);
    assert_true(pos[6].y == y + up);
    mem_free(pair);
    scene_free(&s);
}

/* A triangle with a corner lifted by 1, and another one between where its farther half is and where it would be if that corner landed. */
static void corners_of_flat_triangles_land(void **state)
{
    (void)state;
    Scene s;
    scene_make(&s, 24, fn_ball, (const double[]){11.3, 11.6, 11.8, 7}, 1.5);
    Vec3 pos[] = {{0, 0, 0}, {4, 1, 0}, {0, 0, 4}, {1.5, 0.3, 0.3}, {1.5, 0.45, 0.3}, {1.6, 0.3, 0.4}, {2, 0.5, 0}, {2, 0.5, 2}, {0, 0, 2}};
    int32_t ends[][2] = {{NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {NONE, NONE}, {0, 1}, {1, 2}, {0, 2}};
    int32_t tri[] = {0, 6, 8, 6, 1, 7, 8, 7, 2, 6, 7, 8, 3, 4, 5}, parent[] = {0, 0, 0, 0, 1};
    Vec3 landed[9], normal[9];
    RefinedMesh m = {.nvert = 9, .ntri = 5, .pos = pos, .normal = normal, .ends = ends, .tri = tri, .parent = parent};
    Crossings none = {.ntri = 2};
    int flattened;
    memcpy(landed, pos, sizeof pos);
    for (int v = 0; v < 9; v++) normal[v] = vec3(0, 1, 0);
    landed[1].y = 0;
    assert_int_equal(refine_untangle(&m, &s.field, landed, &none, &flattened), 0);
    for (int v = 0; v < 9; v++) assert_true(v / 3 == 1 || pos[v].y == 0);
    scene_free(&s);
}

static void crossing_pieces_are_laid_flat(void **state)
{
    (void)state;
    static const double k[] = {13.3, 13.6, 13.8, 8};
    Scene s;
    Refine memory = {0};
    RefinedMesh m = {0};
    int32_t next_id = 1 << 20;
    int flattened;
    scene_make(&s, 28, fn_ball, k, 1.5);
    Crossings none = {.ntri = s.mesh.ntri};
    refine_build(&memory, &s.mesh, &s.field, &(RefineSettings){5, 2, 0, AS_PAPERS}, NULL, &next_id, &m);
    assert_int_equal(refine_untangle(&m, &s.field, NULL, &none, &flattened), 0);
    assert_int_equal(flattened, 0);
    int v = m.nvert - 1, a = m.ends[v][0], b = m.ends[v][1];
    assert_true(a != NONE);
    m.pos[v] = v_round32(v_axpy(m.pos[v], -17, m.normal[v])); /* out on the other side */
    assert_int_equal(refine_untangle(&m, &s.field, NULL, &none, &flattened), 0);
    assert_true(flattened > 0 && flattened < m.nvert / 2);
    Vec3 mid = v_round32(v_mid(m.pos[a], m.pos[b]));
    assert_true(v_dist(m.pos[v], mid) == 0);
    Vec3 *landed = NEW(Vec3, m.nvert); /* of one that was lifted it is enough that it lands */
    memcpy(landed, m.pos, (size_t)m.nvert * sizeof *landed);
    Vec3 normal = m.normal[a];
    m.pos[a] = v_round32(v_axpy(m.pos[a], -17, normal));
    m.normal[a] = v_scale(normal, -1);
    assert_int_equal(refine_untangle(&m, &s.field, landed, &none, &flattened), 0);
    assert_int_equal(flattened, 0);
    assert_memory_equal(m.pos, landed, (size_t)m.nvert * sizeof *landed);
    assert_near(v_dot(m.normal[a], normal), 1, 1e-6);
    mem_free(landed);
    refined_free(&m);
    refine_free(&memory);
    scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(angle_of_180_copies),
        cmocka_unit_test(refined_mesh_is_closed_and_faces_outward),
        cmocka_unit_test(children_lie_on_their_parents),
        cmocka_unit_test(pieces_follow_the_marked_edges),
        cmocka_unit_test(each_pass_adds_and_takes_nothing_away),
        cmocka_unit_test(deviation_brings_the_distance_down),
        cmocka_unit_test(calm_surface_keeps_its_connectivity),
        cmocka_unit_test(identities_are_not_used_twice),
        cmocka_unit_test(midpoints_stay_at_home),
        cmocka_unit_test(crossing_pieces_are_laid_flat),
        cmocka_unit_test(rounded_middles_are_kept_apart),
        cmocka_unit_test(corners_of_flat_triangles_land),
        cmocka_unit_test(balanced_triangles_are_nearer),
        cmocka_unit_test(pieces_laid_flat_keep_an_area),
        cmocka_unit_test(hernia_is_found_by_the_hessian),
        cmocka_unit_test(turn_of_a_ball_is_length_over_radius),
        cmocka_unit_test(green_triangles_are_never_cut),
        cmocka_unit_test(red_green_bounds_angles),
        cmocka_unit_test(red_green_marks_are_remembered),
        cmocka_unit_test(aspect_is_respected),
    };
    return cmocka_run_group_tests_name("refine", tests, NULL, NULL);
}
