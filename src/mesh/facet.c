/* facet.c: one pair of triangles. Nondegenerate triangles meet where an edge of one meets the other. */
#include "mesh/facet.h"

#include "mesh/intersect.h"
#include "mesh/orient.h"

static bool is_near_zero(double det, double all) { return !(fabs(det) > ORIENT2_ERROR * all); }

bool triangle_is_collinear(const Vec3 p[3])
{
    for (int axis = 0; axis < 3; axis++)
        if (orient2(p[0], p[1], p[2], axis)) return false;
    return true;
}

bool facet_make(Facet *f, const int32_t v[3], const Vec3 p[3])
{
    Vec3 u = v_sub(p[1], p[0]), w = v_sub(p[2], p[0]);
    double yz = u.y * w.z, zy = u.z * w.y, zx = u.z * w.x, xz = u.x * w.z, xy = u.x * w.y, yx = u.y * w.x;
    *f = (Facet){{p[0], p[1], p[2]}, {v[0], v[1], v[2]}, {yz - zy, zx - xz, xy - yx},
                 {fabs(yz) + fabs(zy), fabs(zx) + fabs(xz), fabs(xy) + fabs(yx)}};
    bool unsure = is_near_zero(f->normal.x, f->all.x) && is_near_zero(f->normal.y, f->all.y) && is_near_zero(f->normal.z, f->all.z);
    return !unsure || !triangle_is_collinear(p);
}

/* orient3 against the facet's plane. */
static int side_of(const Facet *f, Vec3 q)
{
    Vec3 d = v_sub(q, f->p[0]);
    double det = v_dot(d, f->normal);
    double all = fabs(d.x) * f->all.x + fabs(d.y) * f->all.y + fabs(d.z) * f->all.z;
    if (fabs(det) > ORIENT3_ERROR * all) return det > 0 ? 1 : -1;
    return all > 0 ? orient3_exact(f->p[0], f->p[1], f->p[2], q) : 0;
}

/* An axis along which the facet may be looked at flat, and how its corners turn then. */
static int flat_axis(const Facet *f, int *turn)
{
    double x = fabs(f->normal.x), y = fabs(f->normal.y), z = fabs(f->normal.z);
    int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
    for (int k = 0; k < 3; k++, axis = (axis + 1) % 3)
        if ((*turn = orient2(f->p[0], f->p[1], f->p[2], axis))) return axis;
    return 0;
}

/* Both in one plane: they are apart only if the line of one of the facet's edges, or of the segment, parts them. */
static bool flat_segment_meets(const Facet *f, Vec3 p, Vec3 q)
{
    int turn, s[3], axis = flat_axis(f, &turn);
    for (int k = 0; k < 3; k++) {
        Vec3 a = f->p[k], b = f->p[(k + 1) % 3];
        if (turn * orient2(a, b, p, axis) < 0 && turn * orient2(a, b, q, axis) < 0) return false;
        s[k] = orient2(p, q, a, axis);
    }
    return !(s[0] == s[1] && s[1] == s[2] && s[0] != 0);
}

/* The closed segment p q against the closed facet; sp, sq: the ends' sides. */
static bool segment_meets(const Facet *f, Vec3 p, Vec3 q, int sp, int sq)
{
    if (sp * sq > 0) return false;
    if (sp == 0 && sq == 0) return flat_segment_meets(f, p, q);
    int u = orient3(p, q, f->p[0], f->p[1]), v = orient3(p, q, f->p[1], f->p[2]);
    if (u * v < 0) return false;
    int w = orient3(p, q, f->p[2], f->p[0]);
    return u * w >= 0 && v * w >= 0;
}

static bool on_one_side(const Facet *f, const Facet *g, int side[3])
{
    for (int k = 0; k < 3; k++) side[k] = side_of(f, g->p[k]);
    return side[0] == side[1] && side[1] == side[2] && side[0] != 0;
}

static bool an_edge_meets(const Facet *f, const Facet *g, const int side[3])
{
    for (int k = 0; k < 3; k++) {
        int next = (k + 1) % 3;
        if (segment_meets(f, g->p[k], g->p[next], side[k], side[next])) return true;
    }
    return false;
}

static bool strangers_meet(const Facet *f, const Facet *g)
{
    int sf[3], sg[3];
    if (on_one_side(f, g, sg) || on_one_side(g, f, sf)) return false;
    return an_edge_meets(f, g, sg) || an_edge_meets(g, f, sf);
}

/* Corner i of f is corner j of g: a further common point lies on the edge opposite to it in f or in g. */
static bool meet_beyond_vertex(const Facet *f, int i, const Facet *g, int j)
{
    Vec3 f1 = f->p[(i + 1) % 3], f2 = f->p[(i + 2) % 3], g1 = g->p[(j + 1) % 3], g2 = g->p[(j + 2) % 3];
    int sg1 = side_of(f, g1), sg2 = side_of(f, g2);
    if (sg1 * sg2 > 0) return false;
    int sf1 = side_of(g, f1), sf2 = side_of(g, f2);
    if (sf1 * sf2 > 0) return false;
    return segment_meets(f, g1, g2, sg1, sg2) || segment_meets(g, f1, f2, sf1, sf2);
}

/* Corner i of f and corner j of g lie opposite to the common edge. */
static bool folded_flat(const Facet *f, int i, const Facet *g, int j)
{
    int turn;
    if (side_of(f, g->p[j]) != 0) return false;
    int axis = flat_axis(f, &turn);
    return orient2(f->p[(i + 1) % 3], f->p[(i + 2) % 3], g->p[j], axis) == turn;
}

bool facets_intersect(const Facet *f, const Facet *g)
{
    int shared = 0, of = 0, og = 0; /* sums of the shared corners: one's is itself, what is left of 0 + 1 + 2 is the other of two */
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++) {
            int same = f->v[k] == g->v[l]; /* added up without branches: which corner it is cannot be foreseen */
            shared += same;
            of += k * same;
            og += l * same;
        }
    if (shared == 0) return strangers_meet(f, g);
    if (shared == 1) return meet_beyond_vertex(f, of, g, og);
    return shared > 2 || folded_flat(f, 3 - of, g, 3 - og);
}

bool triangles_intersect(const int32_t va[3], const Vec3 pa[3], const int32_t vb[3], const Vec3 pb[3])
{
    Facet f, g;
    Box32 a = box32_of(pa), b = box32_of(pb);
    return box32_meets(&a, &b) && facet_make(&f, va, pa) && facet_make(&g, vb, pb) && facets_intersect(&f, &g);
}
