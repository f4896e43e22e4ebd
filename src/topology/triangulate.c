/* triangulate.c: the loops of the exact isosurface as triangles.
 *
 * A loop of three is a triangle, a plain loop of four two; any other is a fan about a point of its own, and a tunnel has
 * a ring of its own: so no edge but the segments on cell faces is ever shared by two cells, and the mesh is a closed
 * 2-manifold whatever the ambiguous cells do. Its geometry there is rough: it is a topology and a place to start from. */
#include "topology/iso.h"

#define CENTRE_APART_VOX 0.03
#define CENTRE_REACH_VOX 0.4
#define TUNNEL_DRAW 0.25 /* how far a tunnel's ring is drawn towards its axis, off the cell's faces */

/* A point that a loop is a fan about. */
typedef struct Centre {
    int vert, tri, n; /* its number; its fan's first triangle and how many there are, each with a corner of the loop first */
} Centre;

typedef struct Weaver {
    const IsoSurface *iso;
    IsoTriangles *out;
    int capvert, caphome, captri, capcell;
    int ncentre, capcentre;
    Centre *centre;
    int32_t *vert_of;  /* [nedge] */
    int cell, comp;    /* being woven */
} Weaver;

static int add_vert(Weaver *w, Vec3 p)
{
    IsoTriangles *o = w->out;
    RESERVE(o->pos, w->capvert, o->nvert + 1);
    RESERVE(o->home, w->caphome, o->nvert + 1);
    o->pos[o->nvert] = p;
    o->home[o->nvert] = w->comp;
    return o->nvert++;
}

static void add_tri(Weaver *w, int a, int b, int c)
{
    IsoTriangles *o = w->out;
    RESERVE(o->tri, w->captri, 3 * (o->ntri + 1));
    RESERVE(o->cell, w->capcell, o->ntri + 1);
    int32_t *t = o->tri + 3 * o->ntri;
    bool mirrored = w->iso->field->mirrored;
    t[0] = a;
    t[1] = mirrored ? c : b;
    t[2] = mirrored ? b : c;
    o->cell[o->ntri++] = w->cell;
}

static int ring_of(Weaver *w, int loop, int ring[12])
{
    const IsoSurface *iso = w->iso;
    int n = 0;
    for (int k = iso->loop_start[loop]; k < iso->loop_start[loop + 1]; k++) {
        int e = iso->loop_edge[k];
        if (w->vert_of[e] == NONE) w->vert_of[e] = add_vert(w, affine_to_world(&iso->field->xform, iso->edge_pos[e]));
        ring[n++] = w->vert_of[e];
    }
    return n;
}

static Vec3 mean_of(const Weaver *w, int n, const int *ring)
{
    Vec3 m = vec3(0, 0, 0);
    for (int k = 0; k < n; k++) m = v_axpy(m, 1.0 / n, w->out->pos[ring[k]]);
    return m;
}

static void weave_disc(Weaver *w, int loop)
{
    int r[12], n = ring_of(w, loop, r);
    if (n == 3) {
        add_tri(w, r[0], r[1], r[2]);
    } else if (n == 4 && w->iso->loop_plain[loop]) {
        /* no two opposite crossings of a plain quad share a face of the cell: the diagonal is its own. The shorter one. */
        bool turn = v_dist(w->out->pos[r[1]], w->out->pos[r[3]]) < v_dist(w->out->pos[r[0]], w->out->pos[r[2]]);
        add_tri(w, r[turn], r[turn + 1], r[turn + 2]);
        add_tri(w, r[turn], r[turn + 2], r[(turn + 3) & 3]);
    } else {
        int m = add_vert(w, mean_of(w, n, r));
        RESERVE(w->centre, w->capcentre, w->ncentre + 1);
        w->centre[w->ncentre++] = (Centre){m, w->out->ntri, n};
        for (int k = 0; k < n; k++) add_tri(w, r[k], r[(k + 1) % n], m);
    }
}

/* Where b starts, walked backwards, so that it runs along a most closely. */
static int best_turn(const Weaver *w, int na, const int *a, int nb, const int *b)
{
    int best = 0;
    double least = 1e300;
    for (int s = 0; s < nb; s++) {
        double sum = 0;
        for (int i = 0; i < na; i++) sum += v_dist(w->out->pos[a[i]], w->out->pos[b[((s - i * nb / na) % nb + nb) % nb]]);
        if (sum < least) least = sum, best = s;
    }
    return best;
}

/* The loops a and b run opposite ways around the tunnel; a ring m of a's length lies between them. */
static void weave_tunnel(Weaver *w, int loop_a, int loop_b)
{
    int a[12], b[12], m[12], na = ring_of(w, loop_a, a), nb = ring_of(w, loop_b, b), s = best_turn(w, na, a, nb, b);
    Vec3 axis = v_mid(mean_of(w, na, a), mean_of(w, nb, b));
    for (int i = 0; i < na; i++) {
        Vec3 half = v_mid(w->out->pos[a[i]], w->out->pos[b[((s - i * nb / na) % nb + nb) % nb]]);
        m[i] = add_vert(w, v_mix(half, axis, TUNNEL_DRAW));
    }
    for (int i = 0; i < na; i++) {
        int k = (i + 1) % na;
        add_tri(w, a[i], a[k], m[k]);
        add_tri(w, a[i], m[k], m[i]);
    }
    for (int i = 0, j = 0; i < na || j < nb;) { /* step along whichever is behind */
        int at = ((s - j) % nb + nb) % nb;
        if (j == nb || (i < na && (i + 1) * nb <= (j + 1) * na)) {
            add_tri(w, m[i % na], m[(i + 1) % na], b[at]);
            i++;
        } else {
            add_tri(w, b[(at + nb - 1) % nb], b[at], m[i % na]);
            j++;
        }
    }
}

static bool is_apart(const Weaver *w, const Centre *c, Vec3 p)
{
    for (int k = 0; k < c->n; k++)
        if (v_dist(p, w->out->pos[w->out->tri[3 * (c->tri + k)]]) < CENTRE_APART_VOX * w->iso->field->voxel) return false;
    return true;
}

/* The fans' points, at first the means of their loops, land where that leads to no corner. All at once: one by one that would be most
 * of the time. */
static void land_centres(const Weaver *w)
{
    Vec3 *pos = NEW(Vec3, w->ncentre);
    for (int i = 0; i < w->ncentre; i++) pos[i] = w->out->pos[w->centre[i].vert];
    field_project(w->iso->field, w->ncentre, pos, CENTRE_REACH_VOX * w->iso->field->voxel, NULL);
    for (int i = 0; i < w->ncentre; i++)
        if (is_apart(w, &w->centre[i], pos[i])) w->out->pos[w->centre[i].vert] = pos[i];
    mem_free(pos);
}

void iso_triangles(const IsoSurface *iso, const uint8_t *want_comp, const uint8_t *want_cell, IsoTriangles *out)
{
    *out = (IsoTriangles){0};
    Weaver w = {.iso = iso, .out = out, .vert_of = NEW(int32_t, iso->nedge)};
    for (int e = 0; e < iso->nedge; e++) w.vert_of[e] = NONE;
    for (w.cell = 0; w.cell < iso->ncell; w.cell++)
        for (int l = iso->cell_loop[w.cell]; l < iso->cell_loop[w.cell + 1]; l++) {
            w.comp = iso_loop_component(iso, l);
            if (!(want_comp && want_comp[w.comp]) && !(want_cell && want_cell[w.cell])) continue;
            int mate = iso->loop_mate[l];
            if (mate == NONE) weave_disc(&w, l);
            else if (mate > l) weave_tunnel(&w, l, mate);
        }
    land_centres(&w);
    mem_free(w.centre);
    mem_free(w.vert_of);
}

void iso_triangles_free(IsoTriangles *t)
{
    mem_free(t->pos);
    mem_free(t->home);
    mem_free(t->tri);
    mem_free(t->cell);
    *t = (IsoTriangles){0};
}

void iso_triangulate(const IsoSurface *iso, const uint8_t *want, Mesh *mesh, int32_t **home)
{
    ASSERT(mesh->ntri == 0);
    IsoTriangles t;
    iso_triangles(iso, want, NULL, &t);
    mesh_append(mesh, t.nvert, t.pos, NULL, t.ntri, t.tri);
    if (home) {
        *home = t.home;
        t.home = NULL;
    }
    iso_triangles_free(&t);
}
