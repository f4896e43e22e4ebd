/* edit.c: split, collapse, flip. In the comments h runs a -> b in triangle (a, b, c), its opposite g runs b -> a in
 * triangle (b, a, d). */
#include "mesh/mesh_priv.h"

static void link_pair(Mesh *m, int h, int g)
{
    m->opp[h] = g;
    m->opp[g] = h;
}

static void mark_changed(Mesh *m, int h)
{
    int g = m->opp[h];
    m->length[h] = m->length[g] = -1;
    m->flag[h] |= EDGE_FLAGGED;
    m->flag[g] |= EDGE_FLAGGED;
}

/* Half-edge slot `to` takes over the neighbour, length and flags that slot `from` has. */
static void move_edge(Mesh *m, int to, int from)
{
    m->length[to] = m->length[from];
    m->flag[to] = m->flag[from];
    link_pair(m, to, m->opp[from]);
}

int mesh_split_edge(Mesh *m, int h, Vec3 p, int32_t id)
{
    int g = m->opp[h], b = he_to(m, h), c = m->corner[he_prev(h)], d = m->corner[he_prev(g)];
    int v = mesh_add_vert(m, p, id);
    int t = 3 * mesh_add_tri(m, v, b, c); /* beside (a, v, c) */
    int s = 3 * mesh_add_tri(m, b, v, d); /* beside (v, a, d) */
    m->corner[he_next(h)] = v;
    m->corner[g] = v;
    move_edge(m, t + 1, he_next(h));
    move_edge(m, s + 2, he_prev(g));
    link_pair(m, t, s);
    link_pair(m, he_next(h), t + 2);
    link_pair(m, he_prev(g), s + 1);
    m->out[v] = t;
    m->out[b] = t + 1;
    mark_changed(m, h);
    mark_changed(m, t);
    mark_changed(m, he_next(h));
    mark_changed(m, he_prev(g));
    return v;
}

bool mesh_can_collapse(const Mesh *m, int h)
{
    int a = he_from(m, h), b = he_to(m, h), g = m->opp[h];
    int c = m->corner[he_prev(h)], d = m->corner[he_prev(g)];
    /* an end of valence three would make the triangle behind it double */
    if (c == d || mesh_valence(m, c) <= 3 || mesh_valence(m, d) <= 3) return false;
    int k = m->out[b];
    do { /* c and d are neighbours of both, and nobody else may be */
        int w = he_to(m, k);
        if (w != a && w != c && w != d && mesh_find_edge(m, a, w) != NONE) return false;
    } while ((k = he_around(m, k)) != m->out[b]);
    return true;
}

static void kill_tri(Mesh *m, int h)
{
    for (int k = 0; k < 3; k++) m->corner[h - h % 3 + k] = NONE;
    m->deadtri++;
}

void mesh_collapse_edge(Mesh *m, int h, Vec3 p)
{
    int a = he_from(m, h), b = he_to(m, h), g = m->opp[h];
    int c = m->corner[he_prev(h)], d = m->corner[he_prev(g)];
    int cb = m->opp[he_next(h)], ac = m->opp[he_prev(h)], da = m->opp[he_next(g)], bd = m->opp[he_prev(g)];
    int k = m->out[b];
    do {
        int next = he_around(m, k); /* reads opposites only: corners may change */
        m->corner[k] = a;
        k = next;
    } while (k != m->out[b]);
    link_pair(m, cb, ac);
    link_pair(m, da, bd);
    kill_tri(m, h);
    kill_tri(m, g);
    m->out[b] = NONE;
    m->deadvert++;
    m->out[a] = ac;
    m->out[c] = cb;
    m->out[d] = da;
    m->pos[a] = p;
    k = m->out[a];
    do mark_changed(m, k);
    while ((k = he_around(m, k)) != m->out[a]);
}

bool mesh_can_flip(const Mesh *m, int h)
{
    int g = m->opp[h], c = m->corner[he_prev(h)], d = m->corner[he_prev(g)];
    return c != d && mesh_valence(m, he_from(m, h)) > 3 && mesh_valence(m, he_to(m, h)) > 3 && mesh_find_edge(m, c, d) == NONE;
}

void mesh_flip_edge(Mesh *m, int h)
{
    int g = m->opp[h], a = he_from(m, h), b = he_to(m, h);
    int bc = he_next(h), ca = he_prev(h), ad = he_next(g), db = he_prev(g);
    int c = m->corner[ca], d = m->corner[db];
    /* the quad a d b c keeps its border: slot by slot (d, c, a) and (c, d, b) */
    int o_bc = m->opp[bc], o_ca = m->opp[ca], o_ad = m->opp[ad], o_db = m->opp[db];
    m->corner[h] = d, m->corner[bc] = c, m->corner[ca] = a;
    m->corner[g] = c, m->corner[ad] = d, m->corner[db] = b;
    int slot[4] = {bc, ca, ad, db}, outer[4] = {o_ca, o_ad, o_db, o_bc};
    for (int k = 0; k < 4; k++) {
        link_pair(m, slot[k], outer[k]);
        m->length[slot[k]] = m->length[outer[k]];
        m->flag[slot[k]] = m->flag[outer[k]];
    }
    m->out[a] = ca, m->out[b] = db, m->out[c] = bc, m->out[d] = h;
    mark_changed(m, h);
}
