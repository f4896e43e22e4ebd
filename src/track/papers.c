/* papers.c: the topology of RR-6128 section 4 instead of the exact one: events as the meshes show them, births and deaths as
 * the frame's isosurface does. */
#include "topology/mend.h"
#include "track/track_priv.h"

enum { ROUNDS_MOST = 5, MIN_SPLIT = 4, LEFTOVER_MOST = 12 };
#define DEAD_SHARE 0.5  /* a component of which less than this share of vertices lies on the surface is dead */
#define ON_VOX 0.05     /* a vertex nearer to the surface than this lies on it */

int track_papers_rounds(void) { return ROUNDS_MOST; }

static EventRules rules_of(const Track *tr)
{
    return (EventRules){tr->edge, MIN_SPLIT, tr->set.angle_deg, tr->set.deviation_vox};
}

int track_papers_events(Track *tr)
{
    EventRules rules = rules_of(tr);
    int n = events_blend(&tr->mesh, &tr->fine, tr->field, &rules, &tr->changes);
    if (n) return n; /* the splits are looked for on a mesh that is refined again */
    return events_split(&tr->mesh, &tr->fine, tr->field, &rules, &tr->changes);
}

int track_papers_rejoin(Track *tr)
{
    EventRules rules = rules_of(tr);
    return events_blend(&tr->mesh, NULL, tr->field, &rules, &tr->changes);
}

/* on[nvert]: which vertices lie on the surface. */
static void find_landed(const Track *tr, uint8_t *on)
{
    const Mesh *m = &tr->mesh;
    double *F = NEW(double, m->nvert), near = ON_VOX * tr->field->voxel;
    Vec3 *g = NEW(Vec3, m->nvert);
    field_sample(tr->field, m->nvert, m->pos, F, g);
    for (int v = 0; v < m->nvert; v++) on[v] = F[v] * F[v] < near * near * v_len2(g[v]);
    mem_free(F);
    mem_free(g);
}

/* What is counted of each component of the mesh. */
typedef struct Tally {
    int n;
    int32_t *tri, *vert;  /* [mesh->ntri], [mesh->nvert] component */
    int32_t *count;       /* [n] vertices */
    Vec3 *centre;         /* [n] */
    uint8_t *drop;        /* [n] */
} Tally;

static Tally tally_take(const Mesh *m)
{
    Tally t = {.tri = NEW(int32_t, m->ntri), .vert = NEW(int32_t, m->nvert)};
    t.n = mesh_components(m, t.tri, t.vert);
    t.count = NEW0(int32_t, t.n);
    t.centre = NEW0(Vec3, t.n);
    t.drop = NEW0(uint8_t, t.n);
    for (int v = 0; v < m->nvert; v++)
        if (t.vert[v] != NONE) t.count[t.vert[v]]++;
    for (int v = 0; v < m->nvert; v++)
        if (t.vert[v] != NONE) t.centre[t.vert[v]] = v_axpy(t.centre[t.vert[v]], 1.0 / t.count[t.vert[v]], m->pos[v]);
    return t;
}

/* Drops what is marked. Returns how many components. */
static int tally_drop(Tally *t, Track *tr)
{
    int dead = 0;
    for (int c = 0; c < t->n; c++) {
        if (!t->drop[c]) continue;
        dead++;
        change_add(&tr->changes, CHANGE_DEATH, t->centre[c], t->count[c]);
    }
    if (dead) mesh_drop_components(&tr->mesh, t->tri, t->drop);
    mem_free(t->tri);
    mem_free(t->vert);
    mem_free(t->count);
    mem_free(t->centre);
    mem_free(t->drop);
    return dead;
}

int track_papers_deaths(Track *tr)
{
    const Mesh *m = &tr->mesh;
    Tally t = tally_take(m);
    uint8_t *on = NEW(uint8_t, m->nvert);
    int32_t *landed = NEW0(int32_t, t.n);
    find_landed(tr, on);
    for (int v = 0; v < m->nvert; v++)
        if (t.vert[v] != NONE) landed[t.vert[v]] += on[v];
    for (int c = 0; c < t.n; c++) t.drop[c] = landed[c] < DEAD_SHARE * t.count[c];
    mem_free(on);
    mem_free(landed);
    return tally_drop(&t, tr);
}

int track_papers_leftovers(Track *tr, const IsoSurface *iso)
{
    const Mesh *m = &tr->mesh;
    Tally t = tally_take(m);
    int32_t *home = NEW(int32_t, m->nvert), *of = NEW(int32_t, t.n), *largest = NEW(int32_t, iso->ncomp);
    audit_homes(iso, &(AuditMesh){m->nvert, m->ntri, t.n, m->pos, m->corner, t.tri}, home);
    for (int v = 0; v < m->nvert; v++) of[t.vert[v]] = home[v];
    for (int k = 0; k < iso->ncomp; k++) largest[k] = NONE;
    for (int c = 0; c < t.n; c++)
        if (of[c] != NONE && (largest[of[c]] == NONE || t.count[c] > t.count[largest[of[c]]])) largest[of[c]] = c;
    for (int c = 0; c < t.n; c++) t.drop[c] = t.count[c] <= LEFTOVER_MOST && (of[c] == NONE || largest[of[c]] != c);
    mem_free(home);
    mem_free(of);
    mem_free(largest);
    return tally_drop(&t, tr);
}

/* want[ncomp]: components of the isosurface on which no vertex and no triangle's middle lies. */
static int find_bare(const Track *tr, const IsoSurface *iso, uint8_t *want)
{
    const Mesh *m = &tr->mesh;
    int bare = 0;
    bool sure;
    for (int k = 0; k < iso->ncomp; k++) want[k] = 1;
    for (int v = 0; v < m->nvert; v++) {
        int k = vert_is_dead(m, v) ? NONE : iso_component_at(iso, m->pos[v], &sure);
        if (k != NONE) want[k] = 0;
    }
    for (int k = 0; k < iso->ncomp; k++) bare += want[k];
    return bare;
}

int track_papers_births(Track *tr, const IsoSurface *iso)
{
    Mesh *m = &tr->mesh;
    uint8_t *want = NEW(uint8_t, iso->ncomp), *one = NEW0(uint8_t, iso->ncomp);
    int born = find_bare(tr, iso, want);
    for (int k = 0; k < iso->ncomp && born; k++) {
        if (!want[k]) continue;
        one[k] = 1;
        int first = m->nvert;
        mend_append(iso, one, tr->edge, m);
        if (m->nvert > first) change_add(&tr->changes, CHANGE_BIRTH, m->pos[first], m->nvert - first);
        one[k] = 0;
    }
    mem_free(want);
    mem_free(one);
    return born;
}
