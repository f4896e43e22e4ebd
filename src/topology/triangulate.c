/* triangulate.c: the loops of the exact isosurface as triangles.
 *
 * A loop of three is a triangle, a plain loop of four two; any other is a fan about a point of its own, and a tunnel has
 * a ring of its own: so no edge but the segments on cell faces is ever shared by two cells, and the mesh is a closed
 * 2-manifold whatever the ambiguous cells do. Its geometry there is rough: it is a topology and a place to start from. */
#include "topology/iso.h"

#define TUNNEL_DRAW 0.25 /* how far a tunnel's ring is drawn towards its axis, off the cell's faces */

typedef struct Weaver {
    const IsoSurface *iso;
    int nvert, capvert, ntri, captri;
    Vec3 *pos;
    int32_t *tri;
    int32_t *vert_of; /* [nedge] */
    int32_t *home;    /* [nvert] component */
    int caphome, comp; /* the component being woven */
} Weaver;

static int add_vert(Weaver *w, Vec3 p)
{
    RESERVE(w->pos, w->capvert, w->nvert + 1);
    RESERVE(w->home, w->caphome, w->nvert + 1);
    w->pos[w->nvert] = p;
    w->home[w->nvert] = w->comp;
    return w->nvert++;
}

static void add_tri(Weaver *w, int a, int b, int c)
{
    RESERVE(w->tri, w->captri, 3 * (w->ntri + 1));
    int32_t *t = w->tri + 3 * w->ntri++;
    bool mirrored = w->iso->field->mirrored;
    t[0] = a;
    t[1] = mirrored ? c : b;
    t[2] = mirrored ? b : c;
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
    for (int k = 0; k < n; k++) m = v_axpy(m, 1.0 / n, w->pos[ring[k]]);
    return m;
}

static void weave_disc(Weaver *w, int loop)
{
    int r[12], n = ring_of(w, loop, r);
    if (n == 3) {
        add_tri(w, r[0], r[1], r[2]);
    } else if (n == 4 && w->iso->loop_plain[loop]) {
        /* no two opposite crossings of a plain quad share a face of the cell: the diagonal is its own. The shorter one. */
        bool turn = v_dist(w->pos[r[1]], w->pos[r[3]]) < v_dist(w->pos[r[0]], w->pos[r[2]]);
        add_tri(w, r[turn], r[turn + 1], r[turn + 2]);
        add_tri(w, r[turn], r[turn + 2], r[(turn + 3) & 3]);
    } else {
        Vec3 c = mean_of(w, n, r);
        field_project(w->iso->field, 1, &c, 0.4 * w->iso->field->voxel, NULL);
        int m = add_vert(w, c);
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
        for (int i = 0; i < na; i++) sum += v_dist(w->pos[a[i]], w->pos[b[((s - i * nb / na) % nb + nb) % nb]]);
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
        Vec3 half = v_mid(w->pos[a[i]], w->pos[b[((s - i * nb / na) % nb + nb) % nb]]);
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

void iso_triangulate(const IsoSurface *iso, const uint8_t *want, Mesh *mesh, int32_t **home)
{
    ASSERT(mesh->ntri == 0);
    Weaver w = {.iso = iso, .vert_of = NEW(int32_t, iso->nedge)};
    for (int e = 0; e < iso->nedge; e++) w.vert_of[e] = NONE;
    for (int l = 0; l < iso->nloop; l++) {
        w.comp = iso_loop_component(iso, l);
        if (!want[w.comp]) continue;
        int mate = iso->loop_mate[l];
        if (mate == NONE) weave_disc(&w, l);
        else if (mate > l) weave_tunnel(&w, l, mate);
    }
    mesh_append(mesh, w.nvert, w.pos, NULL, w.ntri, w.tri);
    mem_free(w.pos);
    mem_free(w.tri);
    mem_free(w.vert_of);
    if (home) *home = w.home;
    else mem_free(w.home);
}
