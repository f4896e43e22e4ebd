#include "topology/sheet.h"

#include "mesh/nearest.h"

#include <string.h>

#define TAKE_VOX 0.25       /* a vertex within this is taken over rather than a triangle cut */
#define CLEAR_VOX 0.03      /* two vertices are not nearer than this */
#define EDGE_SHARE 0.1      /* a point whose weight at a corner is below this lies on the edge across from it */
#define SIDE_COS 0.2        /* a triangle fits a normal above this cosine */
#define CORRIDOR 0.6        /* a seam keeps within this share of its length from the straight line, */
#define CORRIDOR_VOX 0.5    /* and this many voxels */
#define SNAP 0.12           /* a seam passes a vertex rather than cut an edge nearer to its end */

/* --- building ------------------------------------------------------------------------------------------------------ */

static void make_vert_room(Sheet *s, int n)
{
    if (n <= s->capvert) return;
    s->capvert = mem_capacity(s->capvert, n);
    RESIZE(s->pos, s->capvert);
    RESIZE(s->home, s->capvert);
    RESIZE(s->pin, s->capvert);
    RESIZE(s->out, s->capvert);
}

static void make_tri_room(Sheet *s, int n)
{
    if (n <= s->captri) return;
    s->captri = mem_capacity(s->captri, n);
    RESIZE(s->corner, 3 * (size_t)s->captri);
    RESIZE(s->opp, 3 * (size_t)s->captri);
    RESIZE(s->seam, 3 * (size_t)s->captri);
    RESIZE(s->region, s->captri);
    RESIZE(s->next, s->captri);
    RESIZE(s->cell, s->captri);
}

/* Every half-edge looks for its opposite among those that leave its end. Each vertex is left with one that leaves it. */
static void link_opposites(Sheet *s)
{
    int32_t *more = NEW(int32_t, 3 * s->ntri); /* the next one that leaves the same vertex */
    for (int h = 0; h < 3 * s->ntri; h++) {
        more[h] = s->out[s->corner[h]];
        s->out[s->corner[h]] = h;
    }
    for (int h = 0; h < 3 * s->ntri; h++) {
        int g = s->out[s->corner[he_next(h)]];
        while (g != NONE && s->corner[he_next(g)] != s->corner[h]) g = more[g];
        s->opp[h] = g;
    }
    mem_free(more);
}

/* Leaves from the rim where the umbrella is open, so that turning clockwise meets all of it. */
static void link_vertices(Sheet *s)
{
    for (int h = 0; h < 3 * s->ntri; h++)
        if (s->opp[he_prev(h)] == NONE) s->out[s->corner[h]] = h;
}

void sheet_build(Sheet *s, const IsoSurface *iso, const uint8_t *want_comp, const uint8_t *want_cell)
{
    IsoTriangles t;
    *s = (Sheet){.iso = iso};
    iso_triangles(iso, want_comp, want_cell, &t);
    make_vert_room(s, t.nvert);
    make_tri_room(s, t.ntri);
    s->nvert = s->nbuilt = t.nvert;
    s->ntri = t.ntri;
    for (int v = 0; v < t.nvert; v++) s->pos[v] = t.pos[v], s->home[v] = t.home[v], s->pin[v] = PIN_NONE, s->out[v] = NONE;
    for (int h = 0; h < 3 * t.ntri; h++) s->corner[h] = t.tri[h], s->seam[h] = SEAM_NONE;
    s->first = NEW(int32_t, iso->ncell);
    memset(s->first, 0xff, (size_t)iso->ncell * sizeof *s->first);
    for (int k = t.ntri - 1; k >= 0; k--) {
        s->region[k] = REGION_NONE;
        s->cell[k] = t.cell[k];
        s->next[k] = s->first[t.cell[k]];
        s->first[t.cell[k]] = k;
    }
    iso_triangles_free(&t);
    link_opposites(s);
    link_vertices(s);
}

void sheet_free(Sheet *s)
{
    mem_free(s->pos);
    mem_free(s->home);
    mem_free(s->pin);
    mem_free(s->out);
    mem_free(s->corner);
    mem_free(s->opp);
    mem_free(s->seam);
    mem_free(s->region);
    mem_free(s->next);
    mem_free(s->cell);
    mem_free(s->first);
    *s = (Sheet){0};
}

/* --- subdividing ---------------------------------------------------------------------------------------------------- */

static int add_vert(Sheet *s, Vec3 p, int home)
{
    make_vert_room(s, s->nvert + 1);
    s->pos[s->nvert] = p;
    s->home[s->nvert] = home;
    s->pin[s->nvert] = PIN_NONE;
    s->out[s->nvert] = NONE;
    return s->nvert++;
}

/* A triangle that takes over a part of triangle `of`: same cell, same region. Returns its first half-edge. */
static int add_part(Sheet *s, int of, int a, int b, int c)
{
    make_tri_room(s, s->ntri + 1);
    int t = s->ntri++, v[3] = {a, b, c};
    for (int k = 0; k < 3; k++) s->corner[3 * t + k] = v[k], s->opp[3 * t + k] = NONE, s->seam[3 * t + k] = SEAM_NONE;
    s->region[t] = s->region[of];
    s->cell[t] = s->cell[of];
    s->next[t] = s->next[of];
    s->next[of] = t;
    return 3 * t;
}

static void link_pair(Sheet *s, int h, int g)
{
    s->opp[h] = g;
    if (g != NONE) s->opp[g] = h;
}

/* Slot `to` takes over the edge that slot `from` has. */
static void move_edge(Sheet *s, int to, int from)
{
    s->seam[to] = s->seam[from];
    s->seam[from] = SEAM_NONE;
    link_pair(s, to, s->opp[from]);
    if (s->out[s->corner[to]] == from) s->out[s->corner[to]] = to;
}

static int split_tri(Sheet *s, int t, Vec3 p)
{
    int h = 3 * t, a = s->corner[h], b = s->corner[h + 1], c = s->corner[h + 2];
    int v = add_vert(s, p, s->home[a]);
    int bc = add_part(s, t, b, c, v), ca = add_part(s, t, c, a, v);
    move_edge(s, bc, h + 1);
    move_edge(s, ca, h + 2);
    s->corner[h + 2] = v;
    link_pair(s, h + 1, bc + 2);
    link_pair(s, bc + 1, ca + 2);
    link_pair(s, ca + 1, h + 2);
    s->out[v] = h + 2;
    return v;
}

/* The edge must be inside the sheet and no seam. */
static int split_edge(Sheet *s, int h, Vec3 p)
{
    int g = s->opp[h], b = s->corner[he_next(h)], c = s->corner[he_prev(h)], d = s->corner[he_prev(g)];
    int v = add_vert(s, p, s->home[b]);
    int t = add_part(s, h / 3, v, b, c), u = add_part(s, g / 3, b, v, d);
    if (s->out[b] == g) s->out[b] = u;
    move_edge(s, t + 1, he_next(h));
    move_edge(s, u + 2, he_prev(g));
    s->corner[he_next(h)] = v;
    s->corner[g] = v;
    link_pair(s, t, u);
    link_pair(s, he_next(h), t + 2);
    link_pair(s, he_prev(g), u + 1);
    s->out[v] = t;
    return v;
}

/* --- pinning ---------------------------------------------------------------------------------------------------------- */

static void corners_of(const Sheet *s, int t, Vec3 q[3])
{
    for (int k = 0; k < 3; k++) q[k] = s->pos[s->corner[3 * t + k]];
}

typedef struct Foot {
    int tri;
    double dist2, w[3];
} Foot;

static double excess(double x, double a, double b, double c)
{
    return real_max(0, real_max(real_min(a, real_min(b, c)) - x, x - real_max(a, real_max(b, c))));
}

/* From p to the box around a triangle, squared. */
static double distance2_to_box(Vec3 p, const Vec3 q[3])
{
    return v_len2(vec3(excess(p.x, q[0].x, q[1].x, q[2].x), excess(p.y, q[0].y, q[1].y, q[2].y), excess(p.z, q[0].z, q[1].z, q[2].z)));
}

static void look_in_cell(const Sheet *s, int cell, Vec3 p, Vec3 n, int comp, bool patches_only, Foot *best)
{
    for (int t = s->first[cell]; t != NONE; t = s->next[t]) {
        if (s->home[s->corner[3 * t]] != comp || (patches_only && s->region[t] == REGION_NONE)) continue;
        Vec3 q[3];
        double w[3];
        corners_of(s, t, q);
        if (distance2_to_box(p, q) > best->dist2) continue;
        Vec3 a = v_area2(q[0], q[1], q[2]);
        if (v_dot(a, n) < SIDE_COS * v_len(a)) continue;
        triangle_nearest(p, q, w);
        double far = v_len2(v_sub(p, v_axpy(v_axpy(v_scale(q[0], w[0]), w[1], q[1]), w[2], q[2])));
        if (!(far < best->dist2)) continue;
        *best = (Foot){t, far, {w[0], w[1], w[2]}};
    }
}

static Foot find_foot(const Sheet *s, Vec3 p, Vec3 n, int comp, double reach, bool patches_only)
{
    Foot best = {.tri = NONE, .dist2 = reach * reach};
    int cell = iso_cell_near(s->iso, p);
    for (int k = 0; cell != NONE && k < 27; k++) {
        int c = iso_cell_beside(s->iso, cell, k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        if (c != NONE) look_in_cell(s, c, p, n, comp, patches_only, &best);
    }
    return best;
}

int sheet_around(const Sheet *s, int v, int h)
{
    int g = s->opp[h];
    if (g == NONE) return NONE;
    g = he_next(g);
    return g == s->out[v] ? NONE : g;
}

/* May v move to p without turning a triangle over? */
static bool can_take(const Sheet *s, int v, Vec3 p)
{
    for (int h = s->out[v]; h != NONE; h = sheet_around(s, v, h)) {
        Vec3 b = s->pos[s->corner[he_next(h)]], c = s->pos[s->corner[he_prev(h)]];
        if (v_dot(v_area2(s->pos[v], b, c), v_area2(p, b, c)) <= 0) return false;
    }
    return true;
}

int sheet_pin(Sheet *s, int pin, Vec3 p, Vec3 n, int comp, double reach, double apart, bool patches_only)
{
    Foot f = find_foot(s, p, n, comp, reach, patches_only);
    if (f.tri == NONE) return NONE;
    int most = 0, least = 0, v;
    for (int k = 0; k < 3; k++) {
        int u = s->corner[3 * f.tri + k];
        if (s->pin[u] != PIN_NONE && v_dist(s->pos[u], p) < apart) return NONE;
        if (f.w[k] > f.w[most]) most = k;
        if (f.w[k] < f.w[least]) least = k;
    }
    v = s->corner[3 * f.tri + most];
    int edge = he_next(3 * f.tri + least);
    if (s->pin[v] == PIN_NONE && v_dist(s->pos[v], p) < TAKE_VOX * s->iso->field->voxel && can_take(s, v, p)) s->pos[v] = p;
    else if (v_dist(s->pos[v], p) < CLEAR_VOX * s->iso->field->voxel) return NONE;
    else if (f.w[least] >= EDGE_SHARE) v = split_tri(s, f.tri, p);
    else if (s->opp[edge] != NONE && s->seam[edge] == SEAM_NONE) v = split_edge(s, edge, p);
    else return NONE;
    s->pin[v] = pin;
    return v;
}

/* --- seams ------------------------------------------------------------------------------------------------------------ */

static double distance_to_segment(Vec3 p, Vec3 a, Vec3 b)
{
    Vec3 d = v_sub(b, a);
    double l2 = v_len2(d), t = l2 > 0 ? real_clamp(v_dot(v_sub(p, a), d) / l2, 0, 1) : 0;
    return v_dist(p, v_axpy(a, t, d));
}

/* The half-edge from a to b, or NONE. */
static int find_half_edge(const Sheet *s, int a, int b)
{
    for (int h = s->out[a]; h != NONE; h = sheet_around(s, a, h))
        if (s->corner[he_next(h)] == b) return h;
    return NONE;
}

static Vec3 fan_normal(const Sheet *s, int v)
{
    Vec3 n = vec3(0, 0, 0);
    for (int h = s->out[v]; h != NONE; h = sheet_around(s, v, h)) n = v_add(n, v_area2(s->pos[v], s->pos[s->corner[he_next(h)]], s->pos[s->corner[he_prev(h)]]));
    return v_unit(n);
}

static bool is_free(const Sheet *s, int v) { return s->pin[v] == PIN_NONE; }

/* The half-edge across from v where the plane through it leaves its fan towards `aim`, away from `prev`; *at: where on that edge. */
static int find_exit(const Sheet *s, int v, int prev, Vec3 aim, Vec3 plane, double *at)
{
    int exit = NONE;
    double best = prev == NONE ? 0 : -2;
    Vec3 forth = v_unit(v_sub(aim, s->pos[v]));
    for (int h = s->out[v]; h != NONE; h = sheet_around(s, v, h)) {
        int p = s->corner[he_next(h)], q = s->corner[he_prev(h)];
        double sp = v_dot(v_sub(s->pos[p], aim), plane), sq = v_dot(v_sub(s->pos[q], aim), plane);
        if (p == prev || q == prev || (sp >= 0) == (sq >= 0)) continue;
        Vec3 x = v_mix(s->pos[p], s->pos[q], sp / (sp - sq));
        double ahead = v_dot(v_unit(v_sub(x, s->pos[v])), forth);
        if (ahead <= best) continue;
        best = ahead;
        exit = he_next(h);
        *at = sp / (sp - sq);
    }
    return exit;
}

/* Follows the sheet's section by the plane through a and b that stands on it, and cuts the edges in its way. Returns how many
 * vertices are between a and b, or NONE where a seam or the rim is in the way. */
static int walk_straight(Sheet *s, int a, int b, double corridor, int cap, int32_t *path)
{
    Vec3 aim = s->pos[b], plane = v_unit(v_cross(v_sub(aim, s->pos[a]), v_add(fan_normal(s, a), fan_normal(s, b))));
    int v = a, prev = NONE, n = 0;
    for (;;) {
        int last = find_half_edge(s, v, b);
        if (last != NONE && s->opp[last] != NONE && s->seam[last] == SEAM_NONE) return n;
        double t = 0;
        int e = find_exit(s, v, prev, aim, plane, &t), next;
        if (e == NONE || n == cap) return NONE;
        int p = s->corner[e], q = s->corner[he_next(e)], to_p = he_prev(e);
        if (t < SNAP && is_free(s, p) && s->opp[to_p] != NONE) next = p;
        else if (t > 1 - SNAP && is_free(s, q) && s->opp[he_next(e)] != NONE) next = q;
        else if (s->opp[e] == NONE || s->seam[e] != SEAM_NONE) return NONE;
        else next = split_edge(s, e, v_mix(s->pos[p], s->pos[q], real_clamp(t, SNAP, 1 - SNAP)));
        if (distance_to_segment(s->pos[next], s->pos[a], aim) > corridor) return NONE;
        for (int k = 0; k < n; k++)
            if (path[k] == next) return NONE;
        path[n++] = next;
        prev = v;
        v = next;
    }
}

/* Is there an edge from each vertex of the path to the next, and no seam on it? */
static bool is_open(const Sheet *s, int a, int b, int n, const int32_t *path)
{
    for (int i = 0; i <= n; i++) {
        int h = find_half_edge(s, i ? path[i - 1] : a, i < n ? path[i] : b);
        if (h == NONE || s->opp[h] == NONE || s->seam[h] != SEAM_NONE) return false;
    }
    return true;
}

int sheet_trace(Sheet *s, int seam, int a, int b, int cap, int32_t *path)
{
    double corridor = CORRIDOR * v_dist(s->pos[a], s->pos[b]) + CORRIDOR_VOX * s->iso->field->voxel;
    int n = walk_straight(s, a, b, corridor, cap, path);
    if (n == NONE || !is_open(s, a, b, n, path)) return NONE; /* it cut itself */
    for (int i = 0; i < n; i++) s->pin[path[i]] = PIN_SEAM;
    for (int i = 0; i <= n; i++) {
        int h = find_half_edge(s, i ? path[i - 1] : a, i < n ? path[i] : b);
        s->seam[h] = 2 * seam;
        s->seam[s->opp[h]] = 2 * seam + 1;
    }
    return n;
}

void sheet_split_chords(Sheet *s)
{
    for (int t = 0; t < s->ntri; t++) /* the parts are looked at in their turn */
        for (int h = 3 * t; h < 3 * t + 3; h++) {
            int a = s->corner[h], b = s->corner[he_next(h)];
            if (s->region[t] == REGION_NONE || s->seam[h] != SEAM_NONE || s->pin[a] == PIN_NONE || s->pin[b] == PIN_NONE) continue;
            split_edge(s, h, v_mid(s->pos[a], s->pos[b]));
        }
}
