/* Pairs of vertices, and what a seam makes of them. */
#include "cli/rejoin.h"
#include "cli/seam.h"
#include "mesh/pair.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

/* --- pairs ----------------------------------------------------------------------------------------- */

enum { MOST = 400 };
typedef struct Points {
    int n;
    float pos[3 * MOST], normal[3 * MOST];
    int32_t group[MOST];
} Points;

static void add(Points *p, double x, double y, double z, double up, int group)
{
    float at[3] = {(float)x, (float)y, (float)z}, n[3] = {0, 0, (float)up};
    memcpy(p->pos + 3 * p->n, at, sizeof at);
    memcpy(p->normal + 3 * p->n, n, sizeof n);
    p->group[p->n++] = group;
}

static int pair(const Points *a, const Points *b, double reach, int32_t *partner)
{
    return pair_vertices(&(PairSide){a->n, a->pos, a->normal, a->group}, &(PairSide){b->n, b->pos, b->normal, b->group}, reach, partner);
}

/* A row where the nearest take each other's only partner: all but one of the shorter must move up. */
static void test_left_over(void **state)
{
    (void)state;
    Points a = {0}, b = {0};
    int32_t partner[MOST];
    for (int i = 0; i < 20; i++) add(&a, i, 0, 0, 1, 0);
    for (int i = 0; i < 20; i++) add(&b, i + 0.9, 0, 0, 1, 0); /* the last can reach 19 alone, whom 18 is nearest to */
    assert_int_equal(pair(&a, &b, 1.0, partner), 20);
    for (int i = 0; i < 20; i++) assert_int_equal(partner[i], i);
    assert_int_equal(pair(&b, &a, 0.2, partner), 19);
    assert_int_equal(partner[0], NONE);
}

/* Fewer on one side: as many pairs as that side has vertices, each with its own partner. */
static void test_unequal(void **state)
{
    (void)state;
    static Points a, b;
    int32_t partner[MOST];
    uint8_t taken[MOST] = {0};
    for (int i = 0; i < 144; i++) add(&a, i % 12, i / 12, 0, 1, 3);
    for (int i = 0; i < 121; i++) add(&b, 1.1 * (i % 11) + 0.3 * sin(i), 1.1 * (i / 11) + 0.3 * cos(3 * i), 0, 1, 3);
    assert_int_equal(pair(&a, &b, 2, partner), 121);
    for (int i = 0; i < 121; i++) assert_int_equal(taken[partner[i]]++, 0);
    assert_int_equal(pair(&a, &a, 2, partner), 144);
    for (int i = 0; i < 144; i++) assert_int_equal(partner[i], i); /* nobody leaves a place of his own */
}

static void test_sheets_and_groups(void **state)
{
    (void)state;
    Points a = {0}, b = {0};
    int32_t partner[MOST];
    add(&a, 0, 0, 0, 1, 0);
    add(&a, 0, 0, 0.1, -1, 0);   /* the other side of a thin sheet */
    add(&a, 5, 0, 0, 1, 1);
    add(&a, 9, 0, 0, 1, NONE);
    add(&b, 0, 0, 0.09, 1, 0);
    add(&b, 5, 0, 0, 1, 2);
    add(&b, 9, 0, 0, 1, NONE);
    add(&b, NAN, INFINITY, 1e30, 1, 0);
    assert_int_equal(pair(&a, &b, 1, partner), 1);
    assert_int_equal(partner[0], 0);
    assert_int_equal(partner[1], NONE);
    assert_int_equal(partner[2], NONE);
    assert_int_equal(partner[3], NONE);
}

/* --- seams ----------------------------------------------------------------------------------------- */

/* An octahedron about (x, 0, 0), cut in 4 `times` times on the sphere, appended. */
static void add_ball(TriMesh *m, double x, int times, int first_id)
{
    static const int8_t corner[8][3] = {{1, 1, 1}, {-1, 1, 1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, -1}, {1, -1, -1}};
    int n = 1 << times;
    Map at;
    map_init(&at, 0);
    for (int o = 0; o < 8; o++)
        for (int i = 0; i < n; i++)
            for (int j = 0; j < 2 * (n - i) - 1; j++) {
                int a = j / 2, turned = j % 2, row[3][2] = {{i + turned, a}, {i, a + 1}, {i + 1, a + turned}};
                if (turned) row[0][0] = i + 1, row[0][1] = a;
                int32_t tri[3];
                for (int k = 0; k < 3; k++) {
                    int u = row[k][0], w = row[k][1], r = n - u - w;
                    int q[3] = {corner[o][0] * u, corner[o][1] * w, corner[o][2] * r};
                    int v = map_put(&at, key_coord(q[0], q[1], q[2]), m->nvert);
                    if (v == m->nvert) {
                        double l = sqrt((double)(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]));
                        RESIZE(m->pos, 3 * (v + 1));
                        RESIZE(m->normal, 3 * (v + 1));
                        RESIZE(m->id, v + 1);
                        for (int c = 0; c < 3; c++) {
                            m->normal[3 * v + c] = (float)(q[c] / l);
                            m->pos[3 * v + c] = (float)(q[c] / l + (c == 0 ? x : 0));
                        }
                        m->id[v] = first_id + v;
                        m->nvert++;
                    }
                    tri[k] = v;
                }
                bool flip = corner[o][0] * corner[o][1] * corner[o][2] < 0;
                RESIZE(m->tri, 3 * (m->ntri + 1));
                m->tri[3 * m->ntri] = tri[0];
                m->tri[3 * m->ntri + 1] = tri[flip ? 2 : 1];
                m->tri[3 * m->ntri + 2] = tri[flip ? 1 : 2];
                m->ntri++;
            }
    map_free(&at);
}

/* The geometric mesh is the mechanical one, but that it names parents. */
static void make_twins(TriMesh mesh[KIND_COUNT], double x0, double x1, int times, int first_id)
{
    memset(mesh, 0, KIND_COUNT * sizeof *mesh);
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        add_ball(&mesh[kind], x0, times, first_id);
        add_ball(&mesh[kind], x1, times, first_id);
    }
    TriMesh *fine = &mesh[KIND_GEOMETRIC];
    fine->parent = NEW(int32_t, fine->ntri);
    for (int t = 0; t < fine->ntri; t++) fine->parent[t] = t;
}

static void free_twins(TriMesh mesh[KIND_COUNT])
{
    for (int kind = 0; kind < KIND_COUNT; kind++) trimesh_free(&mesh[kind]);
}

static void test_seam(void **state)
{
    (void)state;
    TriMesh before[KIND_COUNT], behind[KIND_COUNT];
    Seam seam;
    make_twins(before, 0, 2.05, 3, 1000);
    make_twins(behind, 2.05, 0, 3, 7); /* the components the other way about */
    assert_int_equal(before[0].nvert, 2 * 258);
    seam_find(before, behind, &seam);
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        assert_int_equal(seam.side[kind].pairs, 2 * 258);
        assert_true(seam.side[kind].largest < 1e-6);
    }
    for (int v = 0; v < behind[0].nvert; v++)
        assert_int_equal(map_get(&seam.identity, (uint64_t)behind[0].id[v]), 1000 + (v + 258) % 516);
    assert_int_equal(map_get(&seam.number, 7), 1000 + 258);
    assert_int_equal(map_get(&seam.number, 7 + 258), 1000);
    seam_free(&seam);
    free_twins(behind);
    make_twins(behind, 0, 2.05, 2, 0); /* coarser */
    seam_find(before, behind, &seam);
    assert_int_equal(seam.side[0].pairs, 2 * 66);
    assert_int_equal(map_get(&seam.number, 0), 1000);
    seam_free(&seam);
    free_twins(before);
    free_twins(behind);
}

/* --- rest positions -------------------------------------------------------------------------------- */

static void add_rest(TriMesh *m, double shift, float frame)
{
    static const char *const name[4] = {"rest_x", "rest_y", "rest_z", "rest_frame"};
    m->nattr = 4;
    m->attr = NEW(float *, 4);
    m->attr_name = NEW(char *, 4);
    for (int k = 0; k < 4; k++) {
        m->attr_name[k] = mem_text(name[k]);
        m->attr[k] = NEW(float, m->nvert);
        for (int v = 0; v < m->nvert; v++) m->attr[k][v] = k == 3 ? frame : m->pos[3 * v + k] + (k == 0 ? (float)shift : 0);
    }
}

static void test_rest(void **state)
{
    (void)state;
    Rejoin r;
    TriMesh before = {0}, behind = {0}, later = {0};
    add_ball(&before, 0, 4, 0);
    add_rest(&before, -10, 2);  /* was at rest 10 away, in the sequence's frame 2 */
    add_ball(&behind, 0, 3, 0);
    add_rest(&behind, 0, 0);    /* at rest where it is, in the chunk's first frame */
    add_ball(&later, 0, 3, 0);
    add_rest(&later, 0, 5);     /* born 5 frames into the chunk */
    rejoin_begin(&r, &before, 20);
    rejoin_apply(&r, &behind);
    rejoin_apply(&r, &later);
    for (int v = 0; v < behind.nvert; v++) {
        assert_true(behind.attr[3][v] == 2 && later.attr[3][v] == 25);
        assert_true(later.attr[0][v] == later.pos[3 * v]);
        for (int k = 0; k < 3; k++) assert_true(fabsf(behind.attr[k][v] - behind.pos[3 * v + k] + (k == 0 ? 10 : 0)) < 0.02f);
    }
    rejoin_free(&r);
    trimesh_free(&behind);
    trimesh_free(&later);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_left_over),
        cmocka_unit_test(test_unequal),
        cmocka_unit_test(test_sheets_and_groups),
        cmocka_unit_test(test_seam),
        cmocka_unit_test(test_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
