/* One cell of the trilinear interpolant: loops, ambiguous faces, tunnels; against brute force. */
#include "mechanics_shapes.h"
#include "topology/cell.h"

#include <stdlib.h>

static Vec3 corner_at(int c) { return vec3(c & 1, c >> 1 & 1, c >> 2); }
static int lower_corner(int e) { return CELL_EDGE_CORNER[e]; }
static int upper_corner(int e) { return CELL_EDGE_CORNER[e] + (1 << (e >> 2)); }
static Vec3 edge_mid(int e) { return v_mid(corner_at(lower_corner(e)), corner_at(upper_corner(e))); }

static void mask_to_values(int mask, double F[8])
{
    for (int c = 0; c < 8; c++) F[c] = mask >> c & 1 ? 1 : -1;
}

/* The outward normal of the face that holds both edges; zero when none does. */
static Vec3 face_of(int e, int f)
{
    for (int axis = 0; axis < 3; axis++)
        for (int side = 0; side < 2; side++) {
            if (v_get(edge_mid(e), axis) != side || v_get(edge_mid(f), axis) != side) continue;
            Vec3 n = vec3(0, 0, 0);
            v_set(&n, axis, side ? 1 : -1);
            return n;
        }
    return vec3(0, 0, 0);
}

/* Every cut edge is in one loop, once; loops run over the cell's faces with the object on their right, as seen from
 * outside the cell. */
static void assert_sound(const double F[8], const CellTopology *t)
{
    int uses[12] = {0}, cut = 0;
    assert_true(t->nloop <= CELL_LOOPS_MAX && t->start[0] == 0);
    for (int l = 0; l < t->nloop; l++) {
        int from = t->start[l], to = t->start[l + 1];
        assert_true(to - from >= 3);
        for (int k = from; k < to; k++) {
            int e = t->edge[k], f = t->edge[k + 1 < to ? k + 1 : from];
            uses[e]++;
            Vec3 face = face_of(e, f), left = v_cross(face, v_sub(edge_mid(f), edge_mid(e)));
            assert_true(v_len(face) > 0);
            int ends[2] = {e, f};
            for (int i = 0; i < 2; i++) {
                int lo = lower_corner(ends[i]), in = F[lo] > 0 ? lo : upper_corner(ends[i]);
                assert_true(v_dot(v_sub(corner_at(in), edge_mid(ends[i])), left) < 0);
            }
        }
    }
    for (int e = 0; e < 12; e++) {
        bool is_cut = (F[lower_corner(e)] > 0) != (F[upper_corner(e)] > 0);
        assert_int_equal(uses[e], is_cut);
        cut += is_cut;
    }
    assert_int_equal(t->start[t->nloop], cut);
    if (t->tunnel[0] == NONE) assert_int_equal(t->tunnel[1], NONE);
    else assert_true(t->tunnel[0] >= 0 && t->tunnel[0] < t->tunnel[1] && t->tunnel[1] < t->nloop);
}

static void all_sign_masks_close(void **state)
{
    (void)state;
    int loops[CELL_LOOPS_MAX + 1] = {0}, tunnels = 0;
    for (int mask = 0; mask < 256; mask++) {
        double F[8];
        mask_to_values(mask, F);
        CellTopology t = cell_topology(F);
        assert_sound(F, &t);
        loops[t.nloop]++;
        if (t.tunnel[0] == NONE) continue;
        /* A corner and the three around the one across from it: the saddles of its faces are 0, so outside; the middle,
         * at 2/8, is inside. */
        assert_int_equal(t.nloop, 2);
        tunnels++;
    }
    assert_int_equal(loops[0], 2);
    assert_int_equal(loops[4], 2); /* the two checkerboards */
    assert_int_equal(tunnels, 8);
}

static void one_corner_is_a_triangle_facing_away(void **state)
{
    (void)state;
    double F[8];
    mask_to_values(1, F);
    CellTopology t = cell_topology(F);
    assert_int_equal(t.nloop, 1);
    assert_int_equal(t.start[1], 3);
    Vec3 n = v_area2(edge_mid(t.edge[0]), edge_mid(t.edge[1]), edge_mid(t.edge[2]));
    assert_near3(n, vec3(0.25, 0.25, 0.25), 1e-15);
    mask_to_values(254, F); /* its complement: the other way round */
    t = cell_topology(F);
    n = v_area2(edge_mid(t.edge[0]), edge_mid(t.edge[1]), edge_mid(t.edge[2]));
    assert_near3(n, vec3(-0.25, -0.25, -0.25), 1e-15);
}

static void a_corner_at_zero_is_outside(void **state)
{
    (void)state;
    const double F[8] = {1, 0, 0, 0, 0, 0, 0, 0};
    CellTopology t = cell_topology(F);
    assert_sound(F, &t);
    assert_int_equal(t.nloop, 1);
    const double G[8] = {0, -1, -1, 0, -1, 0, 0, 0};
    assert_int_equal(cell_topology(G).nloop, 0);
}

/* Corners 0 and 3 of the face z = 0 are inside, 1 and 2 not: the saddle's sign joins the one pair or the other. */
static void ambiguous_face_is_decided_by_its_saddle(void **state)
{
    (void)state;
    const struct {
        double in, out;
        int loops;
    } row[] = {{2, -1, 1}, {1, -2, 2}, {1, -1, 2}, {1.0001, -1, 1}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        double F[8];
        for (int c = 0; c < 8; c++) F[c] = c == 0 || c == 3 ? row[i].in : row[i].out;
        CellTopology t = cell_topology(F);
        assert_sound(F, &t);
        assert_true(t.ambiguous);
        assert_int_equal(t.nloop, row[i].loops);
        assert_int_equal(t.tunnel[0], NONE);
    }
    double plain[8];
    mask_to_values(3, plain);
    assert_false(cell_topology(plain).ambiguous);
}

/* Marching cubes' case 4: two corners across the cell. F(m) at the middle is (2 in + 6 out) / 8. */
static void opposite_corners_meet_through_the_body(void **state)
{
    (void)state;
    for (int c = 0; c < 4; c++)
        for (int inside = 0; inside < 2; inside++)
            for (int meet = 0; meet < 2; meet++) {
                double F[8];
                for (int k = 0; k < 8; k++) F[k] = (inside ? 1 : -1) * (k == c || k == 7 - c ? (meet ? 10.0 : 2.0) : -1.0);
                CellTopology t = cell_topology(F);
                assert_sound(F, &t);
                assert_int_equal(t.nloop, 2);
                assert_int_equal(t.tunnel[0], meet ? 0 : NONE);
                assert_int_equal(t.tunnel[1], meet ? 1 : NONE);
                assert_false(t.ambiguous);
            }
}

/* Two loops whose regions meet over a face are no tunnel, however deep the body is. */
static void meeting_over_a_face_is_no_tunnel(void **state)
{
    (void)state;
    const double F[8] = {5, -1, -1, 5, -1, -1, -1, -1};
    CellTopology t = cell_topology(F);
    assert_int_equal(t.nloop, 1);
    assert_int_equal(t.tunnel[0], NONE);
}

/* --- brute force ------------------------------------------------------------------------------------------------------ */

enum { FINEST = 97 };
static uint8_t side[FINEST * FINEST * FINEST];
static int32_t stack[FINEST * FINEST * FINEST];

/* Components of the inside and of the outside on a lattice of n^3 points, joined along its edges. */
static int count_regions(const double F[8], int n)
{
    for (int i = 0; i < n * n * n; i++) {
        double x = (double)(i % n) / (n - 1), y = (double)(i / n % n) / (n - 1), z = (double)(i / (n * n)) / (n - 1);
        double a = F[0] + x * (F[1] - F[0]), b = F[2] + x * (F[3] - F[2]), c = F[4] + x * (F[5] - F[4]), d = F[6] + x * (F[7] - F[6]);
        double lo = a + y * (b - a), hi = c + y * (d - c);
        side[i] = lo + z * (hi - lo) > 0;
    }
    int regions = 0;
    for (int s = 0; s < n * n * n; s++) {
        if (side[s] > 1) continue;
        int depth = 0, kind = side[s];
        stack[depth++] = s;
        side[s] = 2;
        regions++;
        while (depth) {
            int i = stack[--depth], x = i % n, y = i / n % n, z = i / (n * n);
            const int to[6] = {x > 0 ? i - 1 : s, x + 1 < n ? i + 1 : s, y > 0 ? i - n : s, y + 1 < n ? i + n : s,
                               z > 0 ? i - n * n : s, z + 1 < n ? i + n * n : s};
            for (int k = 0; k < 6; k++) {
                if (side[to[k]] != kind) continue;
                side[to[k]] = 2;
                stack[depth++] = to[k];
            }
        }
    }
    return regions;
}

/* Disjoint surface pieces cut the cell into one region more than there are pieces; a tunnel is one piece of two loops. */
static void random_cells_agree_with_brute_force(void **state)
{
    (void)state;
    uint64_t seed = 12;
    int cells = 0, tunnels = 0, wrong = 0, unresolved = 0;
    while (cells < 1500) {
        double F[8];
        for (int c = 0; c < 8; c++) F[c] = 2 * shape_noise(&seed);
        if (cells % 2) F[0] *= 6, F[7] *= 6; /* more tunnels */
        CellTopology t = cell_topology(F);
        assert_sound(F, &t);
        if (t.nloop < 2) continue; /* discs alone are no question */
        cells++;
        tunnels += t.tunnel[0] != NONE;
        int want = 1 + t.nloop - (t.tunnel[0] != NONE);
        if (count_regions(F, 17) == want) continue;
        unresolved++;
        if (count_regions(F, 49) != want && count_regions(F, FINEST) != want) wrong++;
    }
    if (getenv("TWINMESH_TOLD")) print_message("%d cells, %d tunnels, %d not at 17^3, %d wrong\n", cells, tunnels, unresolved, wrong);
    assert_in_range(tunnels, 20, cells);
    assert_true(500 * wrong < cells);
}

/* --- symmetry ----------------------------------------------------------------------------------------------------------- */

static int permuted(int c, const int axis[3])
{
    int d = 0;
    for (int a = 0; a < 3; a++) d |= (c >> axis[a] & 1) << a;
    return d;
}

static void axes_may_be_swapped_and_turned(void **state)
{
    (void)state;
    static const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
    uint64_t seed = 77;
    int tunnels = 0;
    for (int i = 0; i < 3000; i++) {
        double F[8], G[8];
        for (int c = 0; c < 8; c++) F[c] = 2 * shape_noise(&seed);
        if (i % 2) F[2] *= 6, F[5] *= 6;
        CellTopology t = cell_topology(F);
        tunnels += t.tunnel[0] != NONE;
        for (int k = 0; k < 6; k++)
            for (int mirror = 0; mirror < 8; mirror++) {
                for (int c = 0; c < 8; c++) G[permuted(c, order[k]) ^ mirror] = F[c];
                CellTopology u = cell_topology(G);
                assert_int_equal(u.nloop, t.nloop);
                assert_int_equal(u.tunnel[0] != NONE, t.tunnel[0] != NONE);
                assert_int_equal(u.ambiguous, t.ambiguous);
            }
        for (int c = 0; c < 8; c++) G[c] = -F[c]; /* inside out: the same surface */
        CellTopology u = cell_topology(G);
        assert_int_equal(u.nloop, t.nloop);
        assert_int_equal(u.tunnel[0] != NONE, t.tunnel[0] != NONE);
    }
    assert_in_range(tunnels, 20, 3000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_sign_masks_close),
        cmocka_unit_test(one_corner_is_a_triangle_facing_away),
        cmocka_unit_test(a_corner_at_zero_is_outside),
        cmocka_unit_test(ambiguous_face_is_decided_by_its_saddle),
        cmocka_unit_test(opposite_corners_meet_through_the_body),
        cmocka_unit_test(meeting_over_a_face_is_no_tunnel),
        cmocka_unit_test(random_cells_agree_with_brute_force),
        cmocka_unit_test(axes_may_be_swapped_and_turned),
    };
    return cmocka_run_group_tests_name("cell", tests, NULL, NULL);
}
