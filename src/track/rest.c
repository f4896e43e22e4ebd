/* rest.c: where on the surface each vertex was at rest, so that a texture sticks.
 *
 * A velocity moves the mesh as it moves the fluid; what the vertices do afterwards within the frame, they do for the triangles'
 * sake, and the texture must not follow: each takes the rest position of the place it has come to. Without a velocity nobody
 * knows the fluid's own way, and the vertices' is the best guess (GI'07's textures): they keep what they have. New vertices
 * take theirs from the mesh before the edits in both cases; beyond it a surface is born, and at rest where it is. */
#include "mesh/nearest.h"
#include "track/track_priv.h"

#include "base/thread.h"

#include <string.h>

enum { GRAIN = 256 };
#define REACH 1.5     /* of a place on the mesh before, in edges */
#define STAYED 1e-6   /* a vertex that moved less did not move, in edges */

void rest_free(Rest *r)
{
    mem_free(r->at);
    mem_free(r->carried);
    mem_free(r->corner);
    mem_free(r->id);
    mem_free(r->was);
    *r = (Rest){0};
}

void rest_copy(Rest *to, const Rest *from)
{
    RESERVE(to->at, to->capat, from->nvert);
    if (from->nvert) memcpy(to->at, from->at, (size_t)from->nvert * sizeof *to->at);
    to->nvert = from->nvert;
    to->now = from->now;
}

void rest_sort(Rest *r, const int32_t *to)
{
    RestPlace *was = NEW(RestPlace, r->nvert);
    memcpy(was, r->at, (size_t)r->nvert * sizeof *was);
    for (int v = 0; v < r->nvert; v++) r->at[to[v]] = was[v];
    mem_free(was);
}

/* All vertices are those the last frame ended with. */
void rest_carry(Track *tr)
{
    Rest *r = &tr->rest;
    const Mesh *m = &tr->mesh;
    ASSERT(r->nvert == m->nvert);
    RESERVE(r->carried, r->capcarried, m->nvert);
    RESERVE(r->id, r->capid, m->nvert);
    RESERVE(r->was, r->capwas, m->nvert);
    RESERVE(r->corner, r->capcorner, 3 * m->ntri);
    r->ncarried = m->nvert;
    r->ntri = m->ntri;
    memcpy(r->carried, m->pos, (size_t)m->nvert * sizeof *m->pos);
    memcpy(r->id, m->id, (size_t)m->nvert * sizeof *m->id);
    memcpy(r->corner, m->corner, 3 * (size_t)m->ntri * sizeof *m->corner);
    memcpy(r->was, r->at, (size_t)m->nvert * sizeof *r->at);
}

/* Places of different frames do not mix: those of the heaviest corner's count. */
static RestPlace blend(const Rest *r, const NearestHit *hit)
{
    const int32_t *c = r->corner + 3 * hit->tri;
    int heaviest = 0;
    for (int k = 1; k < 3; k++)
        if (hit->w[k] > hit->w[heaviest]) heaviest = k;
    RestPlace out = {vec3(0, 0, 0), r->was[c[heaviest]].frame};
    double sum = 0;
    for (int k = 0; k < 3; k++)
        if (r->was[c[k]].frame == out.frame) out.pos = v_axpy(out.pos, hit->w[k], r->was[c[k]].pos), sum += hit->w[k];
    out.pos = v_scale(out.pos, 1 / sum);
    return out;
}

typedef struct Job {
    Track *tr;
    const Map *carried_at;
    NearestIndex index;
} Job;

static void settle_block(void *ctx, int begin, int end)
{
    Job *job = ctx;
    Track *tr = job->tr;
    Rest *r = &tr->rest;
    const double stayed = STAYED * tr->edge;
    for (int v = begin; v < end; v++) {
        Vec3 p = tr->mesh.pos[v], n;
        int old = map_get(job->carried_at, (uint64_t)tr->mesh.id[v]);
        if (old != NONE && (!tr->velocity || v_dist(p, r->carried[old]) <= stayed)) {
            r->at[v] = r->was[old];
            continue;
        }
        field_normals(tr->field, 1, &p, &n);
        NearestHit hit = nearest_find(&job->index, p, n);
        r->at[v] = hit.tri != NONE ? blend(r, &hit) : old != NONE ? r->was[old] : (RestPlace){p, r->now};
    }
}

void rest_settle(Track *tr)
{
    Rest *r = &tr->rest;
    const Mesh *m = &tr->mesh;
    Map carried_at;
    map_init(&carried_at, r->ncarried);
    for (int v = 0; v < r->ncarried; v++) map_put(&carried_at, (uint64_t)r->id[v], v);
    for (int v = 0; v < m->nvert && !tr->velocity; v++) { /* new vertices lie between the old where those are now */
        int old = map_get(&carried_at, (uint64_t)m->id[v]);
        if (old != NONE) r->carried[old] = m->pos[v];
    }
    RESERVE(r->at, r->capat, m->nvert);
    r->nvert = m->nvert;
    Job job = {.tr = tr, .carried_at = &carried_at};
    nearest_build(&job.index, r->ntri, r->carried, r->corner, REACH * tr->edge);
    parallel_for(m->nvert, GRAIN, settle_block, &job);
    nearest_free(&job.index);
    map_free(&carried_at);
    r->ncarried = r->ntri = 0;
}

void rest_refined(const Track *tr, RestPlace *out)
{
    const RefinedMesh *f = &tr->fine;
    for (int v = 0; v < f->nvert; v++) { /* ends come before their midpoints */
        int a = f->ends[v][0], b = f->ends[v][1];
        if (a == NONE) out[v] = tr->rest.at[v];
        else out[v] = (RestPlace){out[a].frame == out[b].frame ? v_mid(out[a].pos, out[b].pos) : out[a].pos, out[a].frame};
    }
}
