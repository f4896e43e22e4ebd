/* measure.c: a frame's figures. */
#include "track/track_priv.h"

#include "base/thread.h"

#include <math.h>
#include <time.h>

enum { GRAIN = 1024 };

double track_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The cosine of a triangle's smallest angle: at the corner across its shortest edge. */
static double least_angle_cos(const Mesh *m, int t)
{
    Vec3 p[3];
    double l2[3];
    for (int k = 0; k < 3; k++) p[k] = m->pos[m->corner[3 * t + k]];
    for (int k = 0; k < 3; k++) l2[k] = v_len2(v_sub(p[(k + 1) % 3], p[k]));
    int s = l2[0] <= l2[1] && l2[0] <= l2[2] ? 0 : l2[1] <= l2[2] ? 1 : 2;
    double u = l2[(s + 1) % 3], w = l2[(s + 2) % 3], c = (u + w - l2[s]) / (2 * sqrt(u * w));
    return c <= 1 ? real_max(c, -1) : 1;
}

/* The angle that a share of the triangles have less than, in degrees; they come in another order. */
static double angle_percentile(double *cosine, int n, double share)
{
    return n ? acos(real_select(cosine, n, n - 1 - (int)(share * n))) * 57.29577951308232 : NAN;
}

typedef struct InvertedJob {
    const Track *tr;
    int *count; /* a block */
} InvertedJob;

static void inverted_block(void *ctx, int begin, int end)
{
    InvertedJob *job = ctx;
    const Mesh *m = &job->tr->mesh;
    int n = 0;
    for (int t = begin; t < end; t++)
        n += field_triangle_inverted(job->tr->field, m->pos[m->corner[3 * t]], m->pos[m->corner[3 * t + 1]], m->pos[m->corner[3 * t + 2]]);
    job->count[begin / GRAIN] = n;
}

static int count_inverted(const Track *tr)
{
    int n = 0, blocks = (tr->mesh.ntri + GRAIN - 1) / GRAIN;
    int *count = NEW0(int, blocks);
    parallel_for(tr->mesh.ntri, GRAIN, inverted_block, &(InvertedJob){tr, count});
    for (int b = 0; b < blocks; b++) n += count[b];
    mem_free(count);
    return n;
}

void track_measure(const Track *tr, FrameStat *stat)
{
    const Mesh *m = &tr->mesh;
    double *cosine = NEW(double, m->ntri), sum = 0;
    int edges = 0, in = 0;
    for (int t = 0; t < m->ntri; t++) cosine[t] = least_angle_cos(m, t);
    for (int h = 0; h < 3 * m->ntri; h++) {
        if (h > m->opp[h]) continue;
        double l = mesh_edge_length(m, h);
        sum += l;
        edges++;
        in += l >= 0.5 * tr->edge && l <= 2 * tr->edge;
    }
    stat->min_angle_p5 = angle_percentile(cosine, m->ntri, 0.05);
    stat->min_angle_p50 = angle_percentile(cosine, m->ntri, 0.5);
    stat->inverted_left = count_inverted(tr);
    stat->edge_asked = tr->edge;
    stat->edge_mean = edges ? sum / edges : NAN;
    stat->edges_in_range = edges ? (double)in / edges : NAN;
    stat->edge_rest = tr->rest_ratio * tr->edge;
    stat->components = mesh_components(m, NULL, NULL);
    stat->vertices_mechanical = m->nvert;
    stat->triangles_mechanical = m->ntri;
    stat->vertices_geometric = tr->fine.nvert;
    stat->triangles_geometric = tr->fine.ntri;
    mem_free(cosine);
}
