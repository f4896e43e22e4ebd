#include "topology/cell.h"

const uint8_t CELL_EDGE_CORNER[12] = {0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};

/* Corners of each face, counter-clockwise seen from outside the cell, and the edges between them. */
static const uint8_t FACE_CORNER[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
static const uint8_t FACE_EDGE[6][4] = {{8, 6, 10, 4}, {5, 11, 7, 9}, {0, 9, 2, 8}, {10, 3, 11, 1}, {4, 1, 5, 0}, {2, 7, 3, 6}};

/* Regions of corners: the smallest corner of each stands for it. */
typedef struct Regions {
    uint8_t of[8];
} Regions;

static void join(Regions *r, int a, int b)
{
    uint8_t from = r->of[a], to = r->of[b];
    if (from == to) return;
    if (from < to) { uint8_t s = from; from = to; to = s; }
    for (int c = 0; c < 8; c++)
        if (r->of[c] == from) r->of[c] = to;
}

static Regions corners_apart(void)
{
    Regions r;
    for (int c = 0; c < 8; c++) r.of[c] = (uint8_t)c;
    return r;
}

/* Links the cut edges around one face: next[] leads from the edge where the walk enters the inside to the one where
 * it leaves. */
static void link_face(const double F[8], int face, int8_t next[12], Regions *skin, bool *ambiguous)
{
    const uint8_t *c = FACE_CORNER[face], *e = FACE_EDGE[face];
    bool in[4];
    int inside = 0;
    for (int k = 0; k < 4; k++) inside += in[k] = F[c[k]] > 0;
    if (inside == 2 && in[0] == in[2]) {
        int k = in[0] ? 0 : 1;
        bool joined = F[c[k]] * F[c[k + 2]] > F[c[k + 1]] * F[c[(k + 3) & 3]];
        int lone = joined ? k + 1 : k; /* the loops go around this corner and the one across */
        if (joined) join(skin, c[k], c[k + 2]);
        else join(skin, c[k + 1], c[(k + 3) & 3]);
        for (int j = 0; j < 2; j++, lone += 2) {
            int before = e[(lone + 3) & 3], after = e[lone & 3];
            next[joined ? after : before] = (int8_t)(joined ? before : after);
        }
        *ambiguous = true;
        return;
    }
    int enter = NONE, leave = NONE;
    for (int k = 0; k < 4; k++) {
        if (in[k] == in[(k + 1) & 3]) continue;
        if (in[k]) leave = e[k];
        else enter = e[k];
    }
    if (enter != NONE) next[enter] = (int8_t)leave;
}

/* Do the opposite columns a-c of a stack of bilinear slices meet through a slice's saddle while b and d are on the
 * other side? Columns run from value lo to hi; s turns our side positive. Their product difference is a quadratic in
 * the height t: positive somewhere only at an inner maximum, for at both ends of its interval a cell face decides. */
static bool columns_meet(const double lo[4], const double hi[4], double s)
{
    double d[4];
    for (int k = 0; k < 4; k++) d[k] = hi[k] - lo[k];
    double qa = d[0] * d[2] - d[1] * d[3];
    double qb = lo[0] * d[2] + lo[2] * d[0] - lo[1] * d[3] - lo[3] * d[1];
    if (!(qa < 0)) return false;
    double t = -qb / (2 * qa);
    if (!(t > 0 && t < 1)) return false;
    double v[4];
    for (int k = 0; k < 4; k++) v[k] = s * (lo[k] + t * d[k]);
    return v[0] > 0 && v[2] > 0 && v[1] <= 0 && v[3] <= 0 && v[0] * v[2] > v[1] * v[3];
}

/* The regions of one side once the inside of the cell counts too. */
static Regions join_through(const double F[8], const Regions *skin, bool inside)
{
    static const uint8_t COLUMN[4] = {0, 1, 3, 2};
    Regions r = *skin;
    double s = inside ? 1 : -1;
    for (int k = 0; k < 2; k++) {
        double lo[4], hi[4];
        for (int j = 0; j < 4; j++) {
            lo[j] = F[COLUMN[(k + j) & 3]];
            hi[j] = F[COLUMN[(k + j) & 3] + 4];
        }
        if (!columns_meet(lo, hi, s)) continue;
        int a = COLUMN[k], c = COLUMN[k + 2]; /* each column's end on our side */
        join(&r, (F[a] > 0) == inside ? a : a + 4, (F[c] > 0) == inside ? c : c + 4);
    }
    return r;
}

static void find_tunnel(const double F[8], const Regions *skin, CellTopology *t)
{
    for (int side = 0; side < 2; side++) {
        bool inside = side == 0;
        Regions through = join_through(F, skin, inside);
        for (int i = 1; i < t->nloop; i++)
            for (int j = 0; j < i; j++) {
                int own[2], other[2], loop[2] = {j, i};
                for (int k = 0; k < 2; k++) {
                    int e = t->edge[t->start[loop[k]]], lo = CELL_EDGE_CORNER[e], hi = lo + (1 << (e >> 2));
                    bool lo_own = (F[lo] > 0) == inside;
                    own[k] = lo_own ? lo : hi;
                    other[k] = lo_own ? hi : lo;
                }
                if (skin->of[own[0]] == skin->of[own[1]] || through.of[own[0]] != through.of[own[1]]) continue;
                if (skin->of[other[0]] != skin->of[other[1]]) continue; /* not the loops that face each other */
                t->tunnel[0] = (int8_t)j;
                t->tunnel[1] = (int8_t)i;
            }
    }
}

CellTopology cell_topology(const double F[8])
{
    CellTopology t = {.tunnel = {NONE, NONE}};
    int8_t next[12];
    Regions skin = corners_apart();
    for (int e = 0; e < 12; e++) {
        int lo = CELL_EDGE_CORNER[e], hi = lo + (1 << (e >> 2));
        next[e] = NONE;
        if ((F[lo] > 0) == (F[hi] > 0)) join(&skin, lo, hi);
    }
    for (int f = 0; f < 6; f++) link_face(F, f, next, &skin, &t.ambiguous);
    int n = 0;
    for (int e = 0; e < 12; e++) {
        if (next[e] == NONE) continue;
        for (int k = e; next[k] != NONE;) {
            int to = next[k];
            t.edge[n++] = (uint8_t)k;
            next[k] = NONE;
            k = to;
        }
        t.start[++t.nloop] = (uint8_t)n;
    }
    if (t.nloop > 1) find_tunnel(F, &skin, &t);
    return t;
}
