#include "topology/fault.h"

#include "base/thread.h"
#include "topology/speck.h"

#include <string.h>

enum { GRAIN = 512, LIMB_CELLS = 6, REACH_CELLS = 2 };
#define OFF_SURFACE_VOX 0.05 /* a vertex farther from the surface, to first order, did not land */
#define FAR_VOX 0.8          /* a triangle whose centroid is farther cuts through, */
#define LEAN_VOX 0.5         /* and one whose centroid is farther leans, as does one whose normal */
#define LEAN_COS 0.3         /* has a cosine below this to the surface's there */
#define CLEAR_COS 0.5        /* above this to the surface's at all corners: it is not inverted; finer than that is measured only for others */
#define SURE_COS 0.9         /* above this at all corners: it follows the surface, if it is short */
#define SHORT_VOX 2.0        /* edges below this: the surface cannot bulge far between such corners, and no cell the triangle passes is far
                              * from theirs and its centroid's */

typedef struct Job {
    const IsoSurface *iso;
    const Mesh *mesh;
    Faults *f;
    Vec3 *inward;  /* [mesh->nvert] inward_at */
    uint8_t *hit;  /* [iso->ncell] a triangle passes through */
} Job;

static void mark_cell(const Job *job, int cell)
{
    if (cell != NONE) __atomic_store_n(&job->hit[cell], 1, __ATOMIC_RELAXED);
}

/* Is p farther than `most` voxels from the surface, where F and its gradient g are known? */
static bool is_off(const Field *f, Vec3 p, double F, Vec3 g, double most)
{
    return !(fabs(F) <= most * f->voxel * v_len(g)) && field_distance_vox(f, p) > most;
}

/* The unit gradient in p's cell; zero where F does not rise along it: in a crack thinner than what inversion is measured over. */
static Vec3 inward_at(const Field *f, Vec3 p, Vec3 n)
{
    double h = INVERTED_VOX * f->voxel;
    return field_value(f, v_axpy(p, h, n), NULL, NULL) > field_value(f, v_axpy(p, -h, n), NULL, NULL) ? n : vec3(0, 0, 0);
}

static void vertex_block(void *ctx, int begin, int end)
{
    Job *job = ctx;
    const IsoSurface *iso = job->iso;
    for (int v = begin; v < end; v++) {
        Vec3 p = job->mesh->pos[v], g;
        double F = field_value(iso->field, p, &g, NULL);
        int cell = iso_cell_near(iso, p), k = cell == NONE ? NONE : iso_loop_component(iso, iso_loop_in(iso, cell, p));
        bool off = k != NONE && !speck_is(iso, k) && is_off(iso->field, p, F, g, OFF_SURFACE_VOX); /* specks' are drawn off it */
        job->f->comp[v] = off ? NONE : k;
        job->inward[v] = inward_at(iso->field, p, v_unit(g));
        mark_cell(job, cell);
    }
}

/* A triangle as the tests of its faults need it. */
typedef struct Tested {
    int t;
    Vec3 corner[3], area, centroid; /* area: twice, along the normal */
    double size;                    /* its length */
    bool is_short;
} Tested;

static Tested tested_of(const Job *job, int t)
{
    const Mesh *m = job->mesh;
    const int32_t *c = m->corner + 3 * t;
    Vec3 p = m->pos[c[0]], q = m->pos[c[1]], r = m->pos[c[2]], area = v_area2(p, q, r);
    double most = SHORT_VOX * job->iso->field->voxel, longest2 = real_max(v_len2(v_sub(q, p)), real_max(v_len2(v_sub(r, q)), v_len2(v_sub(p, r))));
    return (Tested){t, {p, q, r}, area, v_scale(v_add(v_add(p, q), r), 1.0 / 3), v_len(area), longest2 < most * most};
}

static int faults_of(const Job *job, const Tested *a, uint8_t *lean)
{
    const Field *f = job->iso->field;
    const int32_t *c = job->mesh->corner + 3 * a->t, *comp = job->f->comp;
    double least = 1; /* cosine at a corner */
    if (comp[c[0]] == NONE || comp[c[1]] == NONE || comp[c[2]] == NONE) return FAULT_STRAY;
    if (comp[c[0]] != comp[c[1]] || comp[c[0]] != comp[c[2]]) return FAULT_TORN;
    if (!(a->size > 0)) return FAULT_DEGENERATE;
    for (int k = 0; k < 3; k++) least = real_min(least, -v_dot(job->inward[c[k]], a->area) / a->size);
    if (least > SURE_COS && a->is_short) return 0;
    if (least < CLEAR_COS && field_triangle_inverted(f, a->corner[0], a->corner[1], a->corner[2])) return FAULT_INVERTED;
    Vec3 g;
    double F = field_value(f, a->centroid, &g, NULL);
    *lean = is_off(f, a->centroid, F, g, LEAN_VOX) || v_dot(g, a->area) > -LEAN_COS * v_len(g) * a->size;
    return *lean && is_off(f, a->centroid, F, g, FAR_VOX) ? FAULT_FAR : 0;
}

static void triangle_block(void *ctx, int begin, int end)
{
    Job *job = ctx;
    for (int t = begin; t < end; t++) {
        Tested a = tested_of(job, t);
        job->f->lean[t] = 0;
        job->f->tri[t] = (uint8_t)faults_of(job, &a, &job->f->lean[t]);
        if (a.is_short) mark_cell(job, iso_cell_at(job->iso, a.centroid));
        else iso_mark_cells(job->iso, a.corner[0], a.corner[1], a.corner[2], job->hit);
    }
}

/* --- coverage -------------------------------------------------------------------------------------------------------- */

static bool any_beside(const IsoSurface *iso, int cell, const uint8_t *mask)
{
    for (int k = 0; k < 27; k++) {
        int c = iso_cell_beside(iso, cell, k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        if (c != NONE && mask[c]) return true;
    }
    return false;
}

static void cell_block(void *ctx, int begin, int end)
{
    Job *job = ctx;
    for (int c = begin; c < end; c++) job->f->cell[c] = !job->hit[c] && !any_beside(job->iso, c, job->hit);
}

/* Clusters of uncovered cells too small for a limb are forgiven. Returns the cells of the others. */
static int keep_limbs(const IsoSurface *iso, uint8_t *uncovered)
{
    if (!memchr(uncovered, 1, (size_t)iso->ncell)) return 0;
    int32_t *stack = NEW(int32_t, iso->ncell);
    uint8_t *seen = NEW0(uint8_t, iso->ncell);
    int kept = 0;
    for (int s = 0; s < iso->ncell; s++) {
        if (!uncovered[s] || seen[s]) continue;
        int n = 0, at = 0;
        stack[n++] = s;
        seen[s] = 1;
        while (at < n) {
            int cell = stack[at++];
            for (int k = 0; k < 27; k++) {
                int c = iso_cell_beside(iso, cell, k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
                if (c == NONE || !uncovered[c] || seen[c]) continue;
                seen[c] = 1;
                stack[n++] = c;
            }
        }
        if (n >= LIMB_CELLS) kept += n;
        else
            for (int i = 0; i < n; i++) uncovered[stack[i]] = 0;
    }
    mem_free(stack);
    mem_free(seen);
    return kept;
}

/* Triangles near a limb that has none are where it must be sewn on. */
static void drop_beside(const IsoSurface *iso, const Mesh *m, Faults *f)
{
    if (f->uncovered == 0) return;
    uint8_t *near = NEW0(uint8_t, iso->ncell);
    for (int c = 0; c < iso->ncell; c++)
        if (f->cell[c]) iso_mark_beside(iso, c, REACH_CELLS, near);
    for (int v = 0; v < m->nvert; v++) {
        int c = iso_cell_near(iso, m->pos[v]), h = m->out[v];
        if (c == NONE || !near[c]) continue;
        do f->tri[h / 3] |= FAULT_FAR;
        while ((h = he_around(m, h)) != m->out[v]);
    }
    mem_free(near);
}

static void find_crossings(const Mesh *m, Crossings *c, Faults *f)
{
    f->crossed = crossings_find(c, m);
    for (int i = 0; i < f->crossed; i++) f->tri[c->pair[i].a] |= FAULT_CROSSED, f->tri[c->pair[i].b] |= FAULT_CROSSED;
}

void faults_find(const IsoSurface *iso, const Mesh *mesh, Crossings *crossings, Faults *f)
{
    *f = (Faults){.comp = NEW(int32_t, mesh->nvert), .tri = NEW(uint8_t, mesh->ntri), .lean = NEW(uint8_t, mesh->ntri), .cell = NEW(uint8_t, iso->ncell)};
    Job job = {iso, mesh, f, NEW(Vec3, mesh->nvert), NEW0(uint8_t, iso->ncell)};
    parallel_for(mesh->nvert, GRAIN, vertex_block, &job);
    parallel_for(mesh->ntri, GRAIN, triangle_block, &job);
    parallel_for(iso->ncell, GRAIN, cell_block, &job);
    mem_free(job.inward);
    mem_free(job.hit);
    f->uncovered = keep_limbs(iso, f->cell);
    drop_beside(iso, mesh, f);
    if (crossings) find_crossings(mesh, crossings, f);
    for (int v = 0; v < mesh->nvert; v++) f->strays += f->comp[v] == NONE;
    for (int t = 0; t < mesh->ntri; t++) {
        f->torn += f->tri[t] == FAULT_TORN;
        f->inverted += f->tri[t] == FAULT_INVERTED;
        f->far += f->tri[t] == FAULT_FAR;
        f->degenerate += f->tri[t] == FAULT_DEGENERATE;
        f->any += f->tri[t] != 0;
    }
    f->any += f->uncovered;
}

void faults_free(Faults *f)
{
    mem_free(f->comp);
    mem_free(f->tri);
    mem_free(f->lean);
    mem_free(f->cell);
    *f = (Faults){0};
}
