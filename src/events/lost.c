/* lost.c: where the mesh has lost its surface. Meshes that meet faster than a frame can tell need not run through one another:
 * the vertices between them find no surface and stay, one sheet before the other. */
#include "base/hash.h"
#include "base/thread.h"
#include "events/events_priv.h"

enum { GRAIN = 512 };
#define SAME_SHEET 0.25   /* least cosine between the normals of a point and of where it lands */
#define OFF_VOX 0.25      /* a triangle whose middle is nearer than this has not lost it */
#define REACH_EDGES 1.0
#define APART_EDGES 3.0   /* sheets farther apart than this have nothing to do with each other */
#define FACING 0.3        /* least cosine between a sheet's normal and the way to the other */

bool events_can_land(const Field *f, Vec3 p, Vec3 normal, double reach)
{
    Vec3 n;
    if (field_project(f, 1, &p, reach, NULL) != 0) return false;
    field_normals(f, 1, &p, &n);
    return v_dot(n, normal) > SAME_SHEET * v_len(normal);
}

typedef struct LostJob {
    const Mesh *mesh;
    const Field *field;
    double reach;
    int8_t *lost;
} LostJob;

static void lost_block(void *ctx, int begin, int end)
{
    LostJob *job = ctx;
    for (int t = begin; t < end; t++) {
        job->lost[t] = 0;
        if (tri_is_dead(job->mesh, t)) continue;
        Vec3 p = tri_middle(job->mesh, t);
        Vec3 normal = mesh_tri_area2(job->mesh, t), g = field_gradient(job->field, p);
        double F = field_value(job->field, p, NULL, NULL), off = OFF_VOX * job->field->voxel;
        /* near the surface it is lost if it faces the wrong way, elsewhere if it cannot be brought there */
        bool near = F * F < off * off * v_len2(g);
        if (near ? v_dot(g, normal) > 0 : !events_can_land(job->field, p, normal, job->reach)) job->lost[t] = F > 0 ? 1 : -1;
    }
}

void lost_find(const Mesh *m, const Field *f, double edge, int8_t *lost)
{
    parallel_for(m->ntri, GRAIN, lost_block, &(LostJob){m, f, REACH_EDGES * edge, lost});
}

/* --- sheets that face each other ------------------------------------------------------------------------------------------ */

typedef struct Sheets {
    const Surgeon *s;
    const int8_t *lost;
    double cell;
    Map at;                   /* cell: its first triangle's place in `tri` */
    int n;
    int32_t *tri, *next;      /* [n] lost triangles, and the next in the same cell */
    Vec3 *middle, *normal;    /* [n] */
} Sheets;

static uint64_t cell_of(const Sheets *q, Vec3 p, int dx, int dy, int dz)
{
    const double most = 1e6;
    return key_coord((int)real_clamp(floor(p.x / q->cell), -most, most) + dx, (int)real_clamp(floor(p.y / q->cell), -most, most) + dy,
                     (int)real_clamp(floor(p.z / q->cell), -most, most) + dz);
}

static void sheets_init(Sheets *q, const Surgeon *s, const int8_t *lost)
{
    const Mesh *m = s->mesh;
    int n = 0;
    for (int t = 0; t < m->ntri; t++) n += lost[t] != 0;
    *q = (Sheets){.s = s, .lost = lost, .cell = APART_EDGES * s->rules->edge, .tri = NEW(int32_t, n), .next = NEW(int32_t, n),
                  .middle = NEW(Vec3, n), .normal = NEW(Vec3, n)};
    map_init(&q->at, n);
    for (int t = m->ntri - 1; t >= 0; t--) { /* lists begin with the lowest */
        if (!lost[t]) continue;
        int i = q->n++;
        q->tri[i] = t;
        q->middle[i] = tri_middle(m, t);
        q->normal[i] = v_unit(mesh_tri_area2(m, t));
        uint64_t key = cell_of(q, q->middle[i], 0, 0, 0);
        q->next[i] = map_get(&q->at, key);
        if (q->next[i] == NONE) map_put(&q->at, key, i);
        else { /* second place: the head of a cell stays */
            int head = q->next[i];
            q->next[i] = q->next[head];
            q->next[head] = i;
        }
    }
}

static void sheets_free(Sheets *q)
{
    map_free(&q->at);
    mem_free(q->tri);
    mem_free(q->next);
    mem_free(q->middle);
    mem_free(q->normal);
}

/* Inside a body lost sheets look at each other, outside they look apart, and nothing is between them. */
static bool faces(const Sheets *q, int i, int j, double d)
{
    int sign = q->lost[q->tri[i]];
    if (sign != q->lost[q->tri[j]]) return false;
    Vec3 way = v_scale(v_sub(q->middle[j], q->middle[i]), sign);
    if (v_dot(way, q->normal[i]) < FACING * d || v_dot(way, q->normal[j]) > -FACING * d) return false;
    return !tris_are_neighbours(q->s->mesh, q->tri[i], q->tri[j]) && surgeon_holds_way(q->s, q->middle[i], q->middle[j], sign > 0);
}

static int nearest_facing(const Sheets *q, int i)
{
    int best = NONE;
    double nearest = q->cell;
    for (int k = 0; k < 27; k++)
        for (int j = map_get(&q->at, cell_of(q, q->middle[i], k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1)); j != NONE; j = q->next[j]) {
            double d = v_dist(q->middle[i], q->middle[j]);
            if (j == i || d >= nearest || !faces(q, i, j, d)) continue;
            best = j;
            nearest = d;
        }
    return best;
}

int lost_pairs(const Surgeon *s, const int8_t *lost, TriPair **pair, int *cap)
{
    Sheets q;
    int n = 0;
    sheets_init(&q, s, lost);
    for (int i = 0; i < q.n; i++) {
        int j = nearest_facing(&q, i);
        if (j == NONE) continue;
        RESERVE(*pair, *cap, n + 1);
        (*pair)[n++] = (TriPair){int_min(q.tri[i], q.tri[j]), int_max(q.tri[i], q.tri[j])};
    }
    sheets_free(&q);
    return n;
}
