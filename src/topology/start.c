#include "topology/start.h"

#include "base/thread.h"
#include "remesh/remesh.h"
#include "topology/audit.h"

#include <math.h>
#include <string.h>

enum {
    CELLS = BRICK_SIDE * BRICK_SIDE * BRICK_SIDE,
    LOOPS_MIN = 60, /* what is smaller is as cheap made from the exact surface */
    GRAIN = 4,
    SIDE = BRICK_SIDE + 1, Y = BRICK_SPAN, Z = BRICK_SPAN * BRICK_SPAN /* samples of a brick's cells in a row, and from one row and layer to the next */
};
#define STEP_EDGES 1.2   /* from one sample of the lattice to the next, in edges; */
#define STEP_MIN_VOX 1.2 /* nearer ones gain nothing, */
#define STEP_MAX_VOX 4.0 /* and what is not known of the field is farther than this from the surface */
#define TURNED_COS 0.3   /* a triangle that faces the field's normals less than this is poor; */
#define POOR_SHARE 0.02  /* a component with a larger share of such triangles is left out */

/* A rotation that brings the axes near to the lattice's diagonals: walls and floors along them are cut into even triangles
 * there, along the lattice's own axes into squares. */
static const double TURN[3][3] = {{2.0 / 3, -1.0 / 3, 2.0 / 3}, {2.0 / 3, 2.0 / 3, -1.0 / 3}, {-1.0 / 3, 2.0 / 3, 2.0 / 3}};

/* --- the lattice's bricks ------------------------------------------------------------------------------------------- */

static void set_lattice(const Field *fine, double step, Field *f)
{
    *f = (Field){.xform = fine->xform, .voxel = step * fine->voxel, .mirrored = fine->mirrored, .sign = 1, .far = fine->far};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            f->xform.m[i][j] = 0;
            for (int k = 0; k < 3; k++) f->xform.m[i][j] += step * fine->xform.m[i][k] * TURN[k][j];
        }
    affine_invert(&f->xform);
}

static void add_brick(Field *f, int *cap, int x, int y, int z)
{
    if (map_put(&f->brick_at, key_coord(x, y, z), f->nbrick) != f->nbrick) return;
    RESERVE(f->origin, *cap, f->nbrick + 1);
    memcpy(f->origin[f->nbrick++], (int[3]){BRICK_SIDE * x, BRICK_SIDE * y, BRICK_SIDE * z}, sizeof *f->origin);
}

static Vec3 cell_middle(const IsoSurface *iso, int cell)
{
    const int *o = iso->field->origin[iso->cell_at[cell] / CELLS], local = iso->cell_at[cell] % CELLS;
    return affine_to_world(&iso->field->xform, vec3(o[0] + (local & 7) + 0.5, o[1] + (local >> 3 & 7) + 0.5, o[2] + (local >> 6) + 0.5));
}

/* All that a crossed cell of the surface touches. */
static void find_bricks(const IsoSurface *iso, double step, Field *f)
{
    const double reach = 0.87 / step; /* half a cell's diagonal, and a little */
    int cap = 0;
    map_init(&f->brick_at, iso->field->ncrossed);
    for (int c = 0; c < iso->ncell; c++) {
        Vec3 p = affine_to_index(&f->xform, cell_middle(iso, c));
        int lo[3], hi[3];
        for (int a = 0; a < 3; a++) {
            lo[a] = (int)floor((v_get(p, a) - reach) / BRICK_SIDE);
            hi[a] = (int)floor((v_get(p, a) + reach) / BRICK_SIDE);
        }
        for (int z = lo[2]; z <= hi[2]; z++)
            for (int y = lo[1]; y <= hi[1]; y++)
                for (int x = lo[0]; x <= hi[0]; x++) add_brick(f, &cap, x, y, z);
    }
}

/* --- their samples ---------------------------------------------------------------------------------------------------- */

typedef struct Job {
    const Field *fine;
    Field *f;
    uint8_t *crossed; /* [f->nbrick] */
} Job;

/* What is not known in a line of samples, `step` apart, is on the side of what is known beside it. */
static void extend_line(float *v, int step, float far)
{
    for (int k = 1; k < SIDE; k++)
        if (isnan(v[k * step]) && !isnan(v[(k - 1) * step])) v[k * step] = v[(k - 1) * step] > 0 ? far : -far;
    for (int k = SIDE - 2; k >= 0; k--)
        if (isnan(v[k * step]) && !isnan(v[(k + 1) * step])) v[k * step] = v[(k + 1) * step] > 0 ? far : -far;
}

static void extend(float *v, float far)
{
    for (int i = 0; i < SIDE * SIDE; i++) extend_line(v + i % SIDE * Y + i / SIDE * Z, 1, far);
    for (int i = 0; i < SIDE * SIDE; i++) extend_line(v + i % SIDE + i / SIDE * Z, Y, far);
    for (int i = 0; i < SIDE * SIDE; i++) extend_line(v + i % SIDE + i / SIDE * Y, Z, far);
}

static void widen_line(float *v, int step)
{
    v[-step] = 2 * v[0] - v[step];
    v[SIDE * step] = 2 * v[(SIDE - 1) * step] - v[(SIDE - 2) * step];
}

/* The samples around those of the brick's own cells, which only gradients ask for, go on as these do. */
static void widen(float *v)
{
    for (int i = 0; i < SIDE * SIDE; i++) widen_line(v + i % SIDE * Y + i / SIDE * Z, 1);
    for (int i = 0; i < BRICK_SPAN * SIDE; i++) widen_line(v - 1 + i % BRICK_SPAN + i / BRICK_SPAN * Z, Y);
    for (int i = 0; i < Z; i++) widen_line(v - 1 - Y + i, Z);
}

static void sample_brick(const Job *job, int brick)
{
    const int *o = job->f->origin[brick];
    float *v = job->f->value + (size_t)brick * BRICK_SAMPLES + 1 + Y + Z;
    int known = 0, inside = 0;
    for (int z = 0; z < SIDE; z++)
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) {
                bool is_known;
                double F = field_value(job->fine, affine_to_world(&job->f->xform, vec3(o[0] + x, o[1] + y, o[2] + z)), NULL, &is_known);
                v[x + y * Y + z * Z] = is_known ? (float)F : NAN;
                known += is_known;
            }
    if (known < SIDE * SIDE * SIDE) extend(v, (float)job->fine->far);
    for (int z = 0; z < SIDE; z++)
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++) inside += v[x + y * Y + z * Z] > 0;
    job->crossed[brick] = inside > 0 && inside < SIDE * SIDE * SIDE;
    if (job->crossed[brick]) widen(v);
}

static void sample_block(void *ctx, int begin, int end)
{
    for (int b = begin; b < end; b++) sample_brick(ctx, b);
}

static void keep_crossed(Field *f, const uint8_t *crossed)
{
    int n = 0;
    map_clear(&f->brick_at);
    for (int b = 0; b < f->nbrick; b++) {
        if (!crossed[b]) continue;
        const int *o = memmove(f->origin[n], f->origin[b], sizeof *f->origin);
        memmove(f->value + (size_t)n * BRICK_SAMPLES, f->value + (size_t)b * BRICK_SAMPLES, BRICK_SAMPLES * sizeof *f->value);
        map_put(&f->brick_at, key_coord(o[0] >> 3, o[1] >> 3, o[2] >> 3), n++);
    }
    f->nbrick = f->ncrossed = n;
}

/* The trilinear interpolant on the lattice: its crossed bricks. */
static void sample_lattice(const IsoSurface *iso, double step, Field *f)
{
    set_lattice(iso->field, step, f);
    find_bricks(iso, step, f);
    f->value = mem_alloc((size_t)f->nbrick, BRICK_SAMPLES * sizeof *f->value);
    Job job = {iso->field, f, NEW(uint8_t, f->nbrick)};
    parallel_for(f->nbrick, GRAIN, sample_block, &job);
    keep_crossed(f, job.crossed);
    mem_free(job.crossed);
}

/* --- the mesh --------------------------------------------------------------------------------------------------------- */

static void triangulate(const Field *f, Mesh *mesh)
{
    IsoSurface iso;
    iso_build(&iso, f);
    uint8_t *want = NEW(uint8_t, iso.ncomp);
    for (int k = 0; k < iso.ncomp; k++) want[k] = iso.comp_loops[k] >= LOOPS_MIN;
    iso_triangulate(&iso, want, mesh, NULL);
    mem_free(want);
    iso_free(&iso);
}

static bool is_poor(const Remesh *r, int t)
{
    const int32_t *c = r->mesh->corner + 3 * t;
    Vec3 a = mesh_tri_area2(r->mesh, t), n = v_add(v_add(r->normal[c[0]], r->normal[c[1]]), r->normal[c[2]]);
    return !(v_dot(a, n) >= 3 * TURNED_COS * v_len(a));
}

static void drop_poor(const Remesh *r)
{
    Mesh *m = r->mesh;
    int32_t *comp = NEW(int32_t, m->ntri);
    int n = mesh_components(m, comp, NULL);
    int32_t *all = NEW0(int32_t, n), *poor = NEW0(int32_t, n);
    uint8_t *drop = NEW(uint8_t, n);
    for (int t = 0; t < m->ntri; t++) all[comp[t]]++, poor[comp[t]] += is_poor(r, t);
    for (int k = 0; k < n; k++) drop[k] = poor[k] > POOR_SHARE * all[k];
    mesh_drop_components(m, comp, drop);
    mem_free(comp);
    mem_free(all);
    mem_free(poor);
    mem_free(drop);
}

/* Onto the exact surface, and even there. */
static void settle(const IsoSurface *iso, double edge, Mesh *mesh)
{
    Remesh r;
    field_project(iso->field, mesh->nvert, mesh->pos, edge, NULL);
    int32_t *home = audit_mesh_homes(iso, mesh);
    remesh_begin(&r, mesh, iso->field, edge, &(Homes){iso_is_home, iso, home});
    drop_poor(&r);
    remesh_even(&r);
    remesh_end(&r);
    mem_free(home);
    int32_t *to = NEW(int32_t, mesh->nvert);
    remesh_sort(mesh, iso->field, to);
    mem_free(to);
    for (int v = 0; v < mesh->nvert; v++) mesh->pos[v] = v_round32(mesh->pos[v]);
}

void start_mesh(const IsoSurface *iso, double edge, Mesh *mesh)
{
    ASSERT(mesh->ntri == 0);
    const double step = STEP_EDGES * edge / iso->field->voxel;
    if (iso->ncell == 0 || step < STEP_MIN_VOX) return;
    Field f;
    sample_lattice(iso, real_min(step, STEP_MAX_VOX), &f);
    triangulate(&f, mesh);
    field_free(&f);
    if (mesh->ntri) settle(iso, edge, mesh);
}
