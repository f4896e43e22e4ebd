/* Which triangles run through one another: the rule case by case, soups against an independent test in integers. */
#include "base/thread.h"
#include "mesh/crossings.h"
#include "mesh/orient.h"
#include "mesh/star.h"
#include "mesh_shapes.h"

#include <stdlib.h>

/* --- the oracle: separating axes in 128-bit integers ---------------------------------------------------------------------- */

__extension__ typedef __int128 Wide;

typedef struct Wide3 {
    Wide x, y, z;
} Wide3;

static Wide3 wide_diff(Vec3 a, Vec3 b) { return (Wide3){(Wide)a.x - (Wide)b.x, (Wide)a.y - (Wide)b.y, (Wide)a.z - (Wide)b.z}; }
static Wide wide_dot(Wide3 a, Wide3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static Wide3 wide_cross(Wide3 a, Wide3 b)
{
    return (Wide3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static bool wide_is_zero(Wide3 a) { return a.x == 0 && a.y == 0 && a.z == 0; }
static Wide3 wide_normal(const Vec3 *t) { return wide_cross(wide_diff(t[1], t[0]), wide_diff(t[2], t[0])); }

static bool parts(Wide3 axis, int na, const Vec3 *a, int nb, const Vec3 *b)
{
    Wide amin = 0, amax = 0, bmin = 0, bmax = 0;
    for (int i = 0; i < na; i++) {
        Wide d = wide_dot(axis, wide_diff(a[i], a[0]));
        if (d < amin) amin = d;
        if (d > amax) amax = d;
    }
    for (int i = 0; i < nb; i++) {
        Wide d = wide_dot(axis, wide_diff(b[i], a[0]));
        if (i == 0 || d < bmin) bmin = d;
        if (i == 0 || d > bmax) bmax = d;
    }
    return amax < bmin || bmax < amin;
}

/* A triangle and a polygon of two or three corners have a point in common. */
static bool oracle_meets(const Vec3 *t, int n, const Vec3 *q)
{
    Wide3 normal = wide_normal(t);
    if (parts(normal, 3, t, n, q)) return false;
    if (n == 3 && parts(wide_normal(q), 3, t, 3, q)) return false;
    for (int i = 0; i < 3; i++) {
        Wide3 e = wide_diff(t[(i + 1) % 3], t[i]);
        if (parts(wide_cross(normal, e), 3, t, n, q)) return false;
        for (int j = 0; j < n; j++) {
            Wide3 f = wide_diff(q[(j + 1) % n], q[j]);
            if (parts(wide_cross(e, f), 3, t, n, q) || parts(wide_cross(normal, f), 3, t, n, q)) return false;
        }
    }
    return true;
}

static bool oracle(const int32_t va[3], const Vec3 a[3], const int32_t vb[3], const Vec3 b[3])
{
    int shared = 0, i = 0, j = 0, si = 0, sj = 0;
    if (wide_is_zero(wide_normal(a)) || wide_is_zero(wide_normal(b))) return false;
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++)
            if (va[k] == vb[l]) shared++, i = k, j = l, si += k, sj += l;
    if (shared == 0) return oracle_meets(a, 3, b);
    if (shared == 3) return true;
    if (shared == 1) {
        Vec3 fa[2] = {a[(i + 1) % 3], a[(i + 2) % 3]}, fb[2] = {b[(j + 1) % 3], b[(j + 2) % 3]};
        return oracle_meets(a, 2, fb) || oracle_meets(b, 2, fa);
    }
    Vec3 u = a[(4 - si) % 3], w = a[(5 - si) % 3];
    Wide3 edge = wide_diff(w, u), na = wide_cross(edge, wide_diff(a[3 - si], u)), nb = wide_cross(edge, wide_diff(b[3 - sj], u));
    return wide_is_zero(wide_cross(na, nb)) && wide_dot(na, nb) > 0;
}

/* --- soups ---------------------------------------------------------------------------------------------------------------- */

static int noise_int(uint64_t *seed, int n) { return (int)((shape_noise(seed) + 0.5) * n); }

/* Corners at whole places from 0 to size - 1, `nvert` vertices for all. */
static Shape soup_of(int ntri, int nvert, int size, uint64_t seed)
{
    Shape s = {.nvert = nvert, .ntri = ntri, .pos = NEW(Vec3, nvert), .tri = NEW(int32_t, 3 * ntri)};
    for (int v = 0; v < nvert; v++) s.pos[v] = vec3(noise_int(&seed, size), noise_int(&seed, size), noise_int(&seed, size));
    for (int t = 0; t < ntri; t++) {
        int32_t *c = s.tri + 3 * t;
        do
            for (int k = 0; k < 3; k++) c[k] = noise_int(&seed, nvert);
        while (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]);
    }
    return s;
}

static void corners(const Shape *s, int t, Vec3 p[3])
{
    for (int k = 0; k < 3; k++) p[k] = s->pos[s->tri[3 * t + k]];
}

static bool pair_is_bad(const Shape *s, int a, int b)
{
    Vec3 p[3], q[3];
    corners(s, a, p);
    corners(s, b, q);
    return oracle(s->tri + 3 * a, p, s->tri + 3 * b, q);
}

static int find_all(const Shape *s, const uint8_t *look, TriPair **pair, int *cap)
{
    return intersect_find(&(TriSoup){s->ntri, s->pos, s->tri}, look, pair, cap);
}

/* The n pairs, against every pair of triangles in order. */
static void assert_all_found(const Shape *s, const uint8_t *look, int n, const TriPair *pair)
{
    int next = 0;
    for (int a = 0; a < s->ntri; a++)
        for (int b = a + 1; b < s->ntri; b++) {
            bool found = next < n && pair[next].a == a && pair[next].b == b;
            bool wanted = (!look || look[a] || look[b]) && pair_is_bad(s, a, b);
            if (found != wanted) fail_msg("triangles %d and %d: %sfound, %swanted", a, b, found ? "" : "not ", wanted ? "" : "not ");
            next += found;
        }
    assert_int_equal(next, n);
}

/* Returns how many pairs there are. */
static int assert_like_brute_force(const Shape *s, const uint8_t *look)
{
    TriPair *pair = NULL;
    int cap = 0, n = find_all(s, look, &pair, &cap);
    assert_all_found(s, look, n, pair);
    mem_free(pair);
    return n;
}

static void soups_of_whole_numbers(void **state)
{
    (void)state;
    static const int size[] = {2, 3, 5, 12, 60};
    for (uint64_t seed = 1; seed <= 4; seed++)
        for (int i = 0; i < 5; i++) {
            Shape s = soup_of(seed % 2 ? 150 : 97, size[i] < 6 ? 300 : 40, size[i], seed);
            assert_true(assert_like_brute_force(&s, NULL) > 50);
            shape_free(&s);
        }
}

static void soups_looked_at_in_part(void **state)
{
    (void)state;
    uint64_t seed = 9;
    Shape s = soup_of(200, 600, 9, 7);
    uint8_t *look = NEW0(uint8_t, s.ntri);
    assert_int_equal(assert_like_brute_force(&s, look), 0);
    for (int t = 0; t < s.ntri; t++) look[t] = noise_int(&seed, 8) == 0;
    assert_true(assert_like_brute_force(&s, look) > 10);
    memset(look, 1, (size_t)s.ntri);
    assert_true(assert_like_brute_force(&s, look) > 100);
    mem_free(look);
    shape_free(&s);
}

/* Corners of 24 bits that are nearly, or exactly, in the plane, on the edge or at the corner of another triangle. */
static void nearly_degenerate_pairs(void **state)
{
    (void)state;
    uint64_t seed = 5;
    int hits = 0, flat = 0;
    const int big = 1 << 22, tries = 60000;
    for (int i = 0; i < tries; i++) {
        Vec3 a[3], b[3];
        for (int k = 0; k < 3; k++) a[k] = vec3(noise_int(&seed, big), noise_int(&seed, big), noise_int(&seed, big));
        for (int k = 0; k < 3; k++) {
            double u = noise_int(&seed, 5) / 4.0, w = noise_int(&seed, 5) / 4.0;
            Vec3 p = v_axpy(v_axpy(a[0], u, v_sub(a[1], a[0])), w, v_sub(a[2], a[0]));
            b[k] = vec3(rint(p.x) + noise_int(&seed, 3) - 1, rint(p.y), rint(p.z));
        }
        const int32_t va[3] = {0, 1, 2}, vb[3] = {3, 4, 5};
        bool is = triangles_intersect(va, a, vb, b);
        assert_int_equal(is, oracle(va, a, vb, b));
        hits += is;
        flat += orient3(a[0], a[1], a[2], b[0]) == 0;
    }
    assert_in_range(hits, tries / 10, tries - tries / 10);
    assert_true(flat > 0);
}

/* Scales at which the products of coordinates span hundreds of bits. */
static void scales_that_differ(void **state)
{
    (void)state;
    Vec3 a = vec3(0x1p60, 0, 0), b = vec3(0, 0x1p60, 0), c = vec3(0, 0, 0), d = vec3(1, 1, 0x1p-100);
    assert_int_equal(orient3(a, b, c, d), 1);
    assert_int_equal(orient3(b, a, c, d), -1);
    d.z = 0;
    assert_int_equal(orient3(a, b, c, d), 0);
    assert_int_equal(orient2(vec3(1, 1, 0), vec3(0x1p30, 0x1p30, 0), vec3(0x1p-40, 0x1p-40, 0), 2), 0);
    assert_int_equal(orient2(vec3(1, 1, 0), vec3(0x1p30, 0x1p30, 0), vec3(0x1p-40, 0x1.000002p-40, 0), 2), 1);
}

/* --- the rule ---------------------------------------------------------------------------------------------------------------- */

static void assert_pair(const int32_t vb[3], const Vec3 b[3], bool wanted)
{
    static const int32_t va[3] = {0, 1, 2};
    static const Vec3 a[3] = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) { /* whichever corner comes first, whichever way round, whichever triangle first */
            int k[3] = {i, (i + 1) % 3, (i + 2) % 3}, l[3] = {j, (j + 1) % 3, (j + 2) % 3};
            int32_t vp[3] = {va[k[0]], va[k[1]], va[k[2]]}, vq[3] = {vb[l[0]], vb[l[2]], vb[l[1]]};
            Vec3 p[3] = {a[k[0]], a[k[1]], a[k[2]]}, q[3] = {b[l[0]], b[l[2]], b[l[1]]};
            assert_int_equal(triangles_intersect(vp, p, vq, q), wanted);
            assert_int_equal(triangles_intersect(vq, q, vp, p), wanted);
        }
}

static void strangers_may_not_even_touch(void **state)
{
    (void)state;
    static const int32_t v[3] = {7, 8, 9};
    assert_pair(v, (Vec3[3]){{1, 1, -1}, {1, 1, 1}, {2, 1, 1}}, true);    /* through the face */
    assert_pair(v, (Vec3[3]){{1, 1, 0}, {1, 1, 1}, {2, 1, 1}}, true);     /* a corner on the face */
    assert_pair(v, (Vec3[3]){{4, 0, 0}, {5, 1, 1}, {5, 1, 2}}, true);     /* corners in one place that are two vertices */
    assert_pair(v, (Vec3[3]){{2, -1, -1}, {2, -1, 1}, {2, 1, 0}}, true);  /* over an edge */
    assert_pair(v, (Vec3[3]){{1, 1, 1}, {1, 1, 2}, {2, 1, 1}}, false);
    assert_pair(v, (Vec3[3]){{1, 1, 0}, {2, 1, 0}, {1, 2, 0}}, true);     /* flat, inside */
    assert_pair(v, (Vec3[3]){{-9, -9, 0}, {20, -9, 0}, {-9, 20, 0}}, true); /* flat, around */
    assert_pair(v, (Vec3[3]){{4, 0, 0}, {8, 0, 0}, {8, 1, 0}}, true);     /* flat, corner to corner */
    assert_pair(v, (Vec3[3]){{3, 3, 0}, {4, 3, 0}, {3, 4, 0}}, false);    /* flat, apart */
    assert_pair(v, (Vec3[3]){{1, 1, 0}, {1, 1, 0}, {2, 1, 1}}, false);    /* no area */
    assert_pair(v, (Vec3[3]){{1, 1, -1}, {1, 1, 1}, {1, 1, 3}}, false);
}

static void neighbours_share_a_corner_and_no_more(void **state)
{
    (void)state;
    static const int32_t v[3] = {0, 8, 9};
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {-1, 0, 1}, {0, -1, 1}}, false);
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {2, 2, 1}, {2, 2, 2}}, false);
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {2, 1, 1}, {1, 2, -1}}, true);    /* through the face from the corner on */
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {1, 1, 0}, {1, 1, 2}}, true);     /* an edge lies on the face */
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {9, 9, 0}, {9, 9, 2}}, true);
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {2, 1, 0}, {1, 2, 0}}, true);     /* flat */
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {-2, 1, 0}, {-1, -2, 0}}, false);
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {2, 0, 0}, {3, -2, 0}}, true);    /* edges along each other */
}

static void edge_sharers_are_not_folded(void **state)
{
    (void)state;
    static const int32_t v[3] = {0, 1, 9};
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {4, 0, 0}, {1, -2, 0}}, false);
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {4, 0, 0}, {1, 2, 1}}, false);
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {4, 0, 0}, {1, 2, 0x1p-40}}, false);
    assert_pair(v, (Vec3[3]){{0, 0, 0}, {4, 0, 0}, {1, 2, 0}}, true);
    assert_pair((int32_t[3]){0, 1, 2}, (Vec3[3]){{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, true); /* twice the same */
}

/* --- fans ----------------------------------------------------------------------------------------------------------------- */

/* Vertex 0 at the origin amid a ring of n. */
static Shape fan_of(int n, const Vec3 *ring)
{
    Shape s = {.nvert = n + 1, .ntri = n, .pos = NEW0(Vec3, n + 1), .tri = NEW(int32_t, 3 * n)};
    for (int i = 0; i < n; i++) {
        int32_t *c = s.tri + 3 * i;
        s.pos[i + 1] = ring[i];
        c[i % 3] = 0, c[(i + 1) % 3] = i + 1, c[(i + 2) % 3] = (i + 1) % n + 1;
    }
    return s;
}

/* sure[s->nvert] */
static void find_stars(const Shape *s, uint8_t *sure)
{
    int32_t *all = NEW(int32_t, s->ntri);
    for (int t = 0; t < s->ntri; t++) all[t] = t;
    stars_find(&(TriSoup){s->ntri, s->pos, s->tri}, s->ntri, all, NULL, sure, NULL);
    mem_free(all);
}

/* Whether its middle is sure, in any order of axes, either way round; *bad: how many pairs of its triangles intersect. */
static bool fan_is_sure(const Shape *s, int *bad)
{
    uint8_t sure[32];
    Shape turned = *s;
    turned.pos = NEW(Vec3, s->nvert);
    for (int k = 0; k < 6; k++) {
        for (int v = 0; v < s->nvert; v++) {
            const double x[3] = {s->pos[v].x, s->pos[v].y, s->pos[v].z};
            turned.pos[v] = vec3(x[k % 3], x[(k + (k < 3 ? 1 : 2)) % 3], x[(k + (k < 3 ? 2 : 1)) % 3]);
        }
        bool before = k > 0 && sure[0];
        find_stars(&turned, sure);
        if (k > 0) assert_int_equal(sure[0], before);
    }
    mem_free(turned.pos);
    *bad = assert_like_brute_force(s, NULL);
    if (sure[0]) assert_int_equal(*bad, 0);
    return sure[0];
}

static void fans_that_turn_once_are_sure(void **state)
{
    (void)state;
    static const Vec3 flat[6] = {{4, 0, 0}, {2, 3, 0}, {-2, 3, 0}, {-4, 0, 0}, {-2, -3, 0}, {2, -3, 0}};
    static const Vec3 roof[6] = {{4, 0, -9}, {2, 3, -9}, {-2, 3, -9}, {-4, 0, -9}, {-2, -3, -9}, {2, -3, -9}};
    static const Vec3 saddle[8] = {{4, 0, 5}, {3, 3, 0}, {0, 4, -5}, {-3, 3, 0}, {-4, 0, 5}, {-3, -3, 0}, {0, -4, -5}, {3, -3, 0}};
    static const Vec3 twice[5] = {{10, 0, 0}, {-8, 6, 1}, {3, -10, 2}, {3, 10, 1}, {-8, -6, 0}};
    static const Vec3 cover[8] = {{4, 0, 0}, {0, 4, 1}, {-4, 0, 2}, {0, -4, 3}, {4, 0, 4}, {0, 4, 3}, {-4, 0, 2}, {0, -4, 1}};
    static const Vec3 fold[6] = {{4, 0, 0}, {-2, 3, 0}, {2, 3, 0}, {-4, 0, 0}, {-2, -3, 0}, {2, -3, 0}};
    static const Vec3 sliver[4] = {{4, 0, 0}, {0, 4, 0}, {-4, 0, 0}, {-8, 0, 0}};
    static const struct {
        int n;
        const Vec3 *ring;
        bool sure;
        int bad_least;
    } fan[] = {{6, flat, true, 0}, {6, roof, true, 0}, {8, saddle, true, 0}, {5, twice, false, 1}, {8, cover, false, 1}, {6, fold, false, 1}, {4, sliver, false, 0}};
    for (size_t i = 0; i < sizeof fan / sizeof *fan; i++) {
        Shape s = fan_of(fan[i].n, fan[i].ring);
        int bad;
        assert_int_equal(fan_is_sure(&s, &bad), fan[i].sure);
        assert_true(bad >= fan[i].bad_least);
        if (i == 0) { /* open, and twice the same triangle */
            s.ntri--;
            assert_false(fan_is_sure(&s, &bad));
            for (int k = 0; k < 3; k++) s.tri[3 * s.ntri + k] = s.tri[k];
            s.ntri++;
            assert_false(fan_is_sure(&s, &bad));
        }
        shape_free(&s);
    }
}

static void fans_at_random_are_found_out(void **state)
{
    (void)state;
    uint64_t seed = 3;
    int sure = 0, unsure = 0, pairs = 0;
    for (int i = 0; i < 6000; i++) {
        Vec3 ring[15];
        int n = 3 + i % 12, bad, size = i % 2 ? 3 : 40, turns = 1 + (i % 7 == 0);
        for (int k = 0; k < n; k++) {
            double a = turns * 2 * 3.14159265 * (k + 0.9 * shape_noise(&seed)) / n, r = size + noise_int(&seed, size);
            ring[k] = vec3(rint(r * cos(a)), rint(r * sin(a)), noise_int(&seed, 2 * size) - size);
        }
        Shape s = fan_of(n, ring);
        bool is = fan_is_sure(&s, &bad);
        if (n > 12) assert_false(is);
        sure += is;
        unsure += !is;
        pairs += bad;
        shape_free(&s);
    }
    assert_true(sure > 1000 && unsure > 1000 && pairs > 1000);
}

/* Two fans that touch in their middle alone: they turn twice, and do not intersect. */
static void two_fans_at_a_vertex(void **state)
{
    (void)state;
    static const Vec3 up[4] = {{4, 0, 3}, {0, 4, 3}, {-4, 0, 3}, {0, -4, 3}};
    int bad;
    Shape one = fan_of(4, up), s = {.nvert = 9, .ntri = 8, .pos = NEW0(Vec3, 9), .tri = NEW(int32_t, 24)};
    for (int i = 0; i < 24; i++) s.tri[i] = one.tri[i % 12] + (i >= 12 && one.tri[i % 12] > 0 ? 4 : 0);
    for (int v = 0; v < 4; v++) s.pos[1 + v] = up[v], s.pos[5 + v] = v_scale(up[v], -1);
    assert_true(fan_is_sure(&one, &bad));
    assert_false(fan_is_sure(&s, &bad));
    assert_int_equal(bad, 0);
    shape_free(&one);
    shape_free(&s);
}

/* --- meshes in whole numbers ----------------------------------------------------------------------------------------------- */

/* Closed, the rougher the more it runs through itself. */
static Shape rough_torus(double rough, uint64_t seed)
{
    Shape s = shape_torus(20, 10, 60, 22);
    for (int v = 0; v < s.nvert; v++) {
        Vec3 d = vec3(shape_noise(&seed), shape_noise(&seed), shape_noise(&seed)), p = v_axpy(s.pos[v], rough, d);
        s.pos[v] = vec3(rint(p.x), rint(p.y), rint(p.z));
    }
    return s;
}

static bool share_a_corner(const Shape *s, int t, int u)
{
    for (int k = 0; k < 9; k++)
        if (s->tri[3 * t + k / 3] == s->tri[3 * u + k % 3]) return true;
    return false;
}

/* Of triangles with sure corners alone: as many neighbours behind each as there are. */
static void neighbours_behind_are_counted(void **state)
{
    (void)state;
    uint64_t seed = 8;
    for (int some = 0; some < 3; some++) {
        Shape s = rough_torus(some == 2 ? 16 : 0, 5);
        uint8_t *look = NEW(uint8_t, s.ntri), *sure = NEW(uint8_t, s.nvert), *later = NEW(uint8_t, 3 * s.ntri);
        int32_t *order = NEW(int32_t, s.ntri);
        int counted = 0;
        for (int i = 0; i < s.ntri; i++) {
            int k = noise_int(&seed, i + 1);
            order[i] = order[k], order[k] = i;
            look[i] = noise_int(&seed, 3) == 0;
        }
        stars_find(&(TriSoup){s.ntri, s.pos, s.tri}, s.ntri, order, some ? look : NULL, sure, later);
        for (int i = 0; i < s.ntri; i++) {
            int t = order[i], wanted = 0;
            const uint8_t *l = later + 3 * t;
            bool is_sure = sure[s.tri[3 * t]] && sure[s.tri[3 * t + 1]] && sure[s.tri[3 * t + 2]];
            assert_int_equal(is_sure, l[0] != LATER_UNSURE && l[1] != LATER_UNSURE && l[2] != LATER_UNSURE);
            if (!is_sure) continue;
            for (int j = i + 1; j < s.ntri; j++) wanted += (!some || look[t] || look[order[j]]) && share_a_corner(&s, t, order[j]);
            assert_int_equal(l[0] + l[1] + l[2], wanted);
            counted++;
        }
        assert_true(some == 2 ? counted > 10 && counted < s.ntri : counted == s.ntri);
        mem_free(look);
        mem_free(sure);
        mem_free(later);
        mem_free(order);
        shape_free(&s);
    }
}

static void rough_meshes(void **state)
{
    (void)state;
    static const double rough[] = {0, 6, 16, 50};
    uint64_t seed = 4;
    for (int i = 0; i < 4; i++) {
        Shape s = rough_torus(rough[i], (uint64_t)i + 1);
        uint8_t *look = NEW(uint8_t, s.ntri), *sure = NEW(uint8_t, s.nvert);
        int sures = 0, n = assert_like_brute_force(&s, NULL);
        if (i == 0) assert_int_equal(n, 0);
        if (i == 3) assert_true(n > 100);
        for (int one_in = 2; one_in <= 128; one_in *= 4) {
            for (int t = 0; t < s.ntri; t++) look[t] = noise_int(&seed, one_in) == 0;
            assert_like_brute_force(&s, look);
        }
        find_stars(&s, sure);
        for (int v = 0; v < s.nvert; v++) sures += sure[v];
        if (i == 0) assert_int_equal(sures, s.nvert);
        if (i == 2) assert_in_range(sures, s.nvert / 20, s.nvert - s.nvert / 20);
        mem_free(look);
        mem_free(sure);
        shape_free(&s);
    }
}

/* All but one triangle lie within less than 16 bits can tell of the whole. */
static void one_triangle_far_away(void **state)
{
    (void)state;
    Shape s = soup_of(200, 600, 9, 7);
    int n = assert_like_brute_force(&s, NULL);
    uint8_t *look = NEW0(uint8_t, s.ntri);
    for (int k = 0; k < 3; k++) s.pos[s.tri[k]] = vec3(1 << 22, k << 20, 1 << 22);
    assert_true(assert_like_brute_force(&s, NULL) > n / 2);
    look[0] = look[5] = look[17] = 1;
    assert_like_brute_force(&s, look);
    look[0] = 0; /* it lies outside all that is looked at */
    assert_like_brute_force(&s, look);
    mem_free(look);
    shape_free(&s);
}

/* Asked again after some have moved, to where they were or far out of what there was. */
static void searches_go_on(void **state)
{
    (void)state;
    static const int one_in[] = {1, 40, 60, 1000, 3, 40, 25};
    for (int first = 0; first < 4; first++) {
        uint64_t seed = (uint64_t)first + 6;
        Shape s = rough_torus(16, seed);
        uint8_t *look = NEW(uint8_t, s.ntri), *moved = NEW(uint8_t, s.nvert);
        TriPair *pair = NULL;
        int cap = 0, most = 0;
        PairSearch *search = pair_search_begin(&(TriSoup){s.ntri, s.pos, s.tri});
        for (int round = first; round < 7; round++) {
            for (int v = 0; v < s.nvert; v++)
                if ((moved[v] = noise_int(&seed, one_in[round]) == 0)) {
                    double r = round == 5 ? 400 : 30;
                    Vec3 d = vec3(shape_noise(&seed), shape_noise(&seed), shape_noise(&seed)), p = v_axpy(s.pos[v], r, d);
                    s.pos[v] = vec3(rint(p.x), rint(p.y), rint(p.z));
                }
            for (int t = 0; t < s.ntri; t++) look[t] = moved[s.tri[3 * t]] | moved[s.tri[3 * t + 1]] | moved[s.tri[3 * t + 2]];
            int n = pair_search_find(search, look, &pair, &cap);
            assert_all_found(&s, look, n, pair);
            most = int_max(most, n);
        }
        assert_true(most > 20);
        pair_search_end(search);
        mem_free(pair);
        mem_free(look);
        mem_free(moved);
        shape_free(&s);
    }
}

/* --- meshes ---------------------------------------------------------------------------------------------------------------- */

static Mesh two_spheres(double apart)
{
    Mesh m;
    mesh_init(&m);
    mesh_take(&m, shape_sphere(3), vec3(0, 0, 0));
    mesh_take(&m, shape_sphere(3), vec3(apart, 0.03, 0.05));
    for (int v = 0; v < m.nvert; v++) m.pos[v] = v_round32(m.pos[v]);
    return m;
}

static void spheres_meet_along_a_circle(void **state)
{
    (void)state;
    TriPair *pair = NULL, *again = NULL;
    int cap = 0, cap2 = 0;
    Mesh m = two_spheres(1.7);
    TriSoup s = {m.ntri, m.pos, m.corner};
    int n = intersect_find(&s, NULL, &pair, &cap);
    assert_true(n > 20);
    for (int i = 0; i < n; i++) assert_true(pair[i].a < m.ntri / 2 && pair[i].b >= m.ntri / 2);
    thread_set_count(4);
    assert_int_equal(intersect_find(&s, NULL, &again, &cap2), n);
    assert_memory_equal(pair, again, (size_t)n * sizeof *pair);
    thread_shutdown();
    thread_set_count(1);
    for (int i = 0; i < n; i++) /* the dead are not there */
        for (int k = 0; k < 3; k++) m.corner[3 * pair[i].a + k] = NONE;
    assert_int_equal(intersect_find(&s, NULL, &pair, &cap), 0);
    mesh_free(&m);
    m = two_spheres(2.2);
    assert_int_equal(intersect_find(&(TriSoup){m.ntri, m.pos, m.corner}, NULL, &pair, &cap), 0);
    assert_int_equal(intersect_find(&(TriSoup){0, NULL, NULL}, NULL, &pair, &cap), 0);
    mesh_free(&m);
    mem_free(pair);
    mem_free(again);
}

/* A move, a flip, a collapse, or the dead swept out; the mesh stays a manifold whatever it runs through. */
static void edit_somewhere(Mesh *m)
{
    int v = rand() % m->nvert, h = rand() % (3 * m->ntri);
    if (!vert_is_dead(m, v)) m->pos[v] = v_round32(v_mix(m->pos[v], mesh_ring_mean(m, v), 3));
    if (!tri_is_dead(m, h / 3) && rand() % 2 && mesh_can_flip(m, h)) mesh_flip_edge(m, h);
    if (!tri_is_dead(m, h / 3) && rand() % 2 && mesh_can_collapse(m, h)) mesh_collapse_edge(m, h, m->pos[he_from(m, h)]);
    if (rand() % 3 == 0) mesh_compact(m, NULL);
}

/* However the mesh changed in between, what is known of it is what a search of all finds. */
static void what_is_known_is_what_is_found(void **state)
{
    (void)state;
    Crossings known = {0};
    TriPair *pair = NULL;
    int cap = 0, most = 0;
    srand(7);
    Mesh m = two_spheres(1.7);
    for (int round = 0; round < 200; round++) {
        if (round == 150) mesh_free(&m), m = two_spheres(1.6); /* the same identities, elsewhere */
        for (int k = round % 4; k > 0; k--) edit_somewhere(&m);
        int n = intersect_find(&(TriSoup){m.ntri, m.pos, m.corner}, NULL, &pair, &cap);
        assert_int_equal(crossings_find(&known, &m), n);
        assert_int_equal(known.n, n);
        if (n) assert_memory_equal(known.pair, pair, (size_t)n * sizeof *pair);
        most = int_max(most, n);
    }
    assert_true(most > 100);
    mesh_clear(&m);
    assert_int_equal(crossings_find(&known, &m), 0);
    crossings_free(&known);
    mesh_free(&m);
    mem_free(pair);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(strangers_may_not_even_touch),
        cmocka_unit_test(neighbours_share_a_corner_and_no_more),
        cmocka_unit_test(edge_sharers_are_not_folded),
        cmocka_unit_test(soups_of_whole_numbers),
        cmocka_unit_test(soups_looked_at_in_part),
        cmocka_unit_test(nearly_degenerate_pairs),
        cmocka_unit_test(scales_that_differ),
        cmocka_unit_test(fans_that_turn_once_are_sure),
        cmocka_unit_test(fans_at_random_are_found_out),
        cmocka_unit_test(two_fans_at_a_vertex),
        cmocka_unit_test(neighbours_behind_are_counted),
        cmocka_unit_test(rough_meshes),
        cmocka_unit_test(one_triangle_far_away),
        cmocka_unit_test(searches_go_on),
        cmocka_unit_test(spheres_meet_along_a_circle),
        cmocka_unit_test(what_is_known_is_what_is_found),
    };
    return cmocka_run_group_tests_name("intersect", tests, NULL, NULL);
}
