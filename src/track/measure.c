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

/* Of a block of triangles, and of the edges whose first half-edge is theirs. */
typedef struct Sums {
    double length;
    int edges, in_range, inverted;
} Sums;

typedef struct Job {
    const Track *tr;
    double *cosine; /* [ntri] */
    Sums *sums;     /* [blocks] */
} Job;

static void measure_block(void *ctx, int begin, int end)
{
    const Job *job = ctx;
    const Mesh *m = &job->tr->mesh;
    const double edge = job->tr->edge;
    Sums s = {0};
    for (int t = begin; t < end; t++) {
        const int32_t *c = m->corner + 3 * t;
        job->cosine[t] = least_angle_cos(m, t);
        s.inverted += field_triangle_inverted(job->tr->field, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
        for (int h = 3 * t; h < 3 * t + 3; h++) {
            if (h > m->opp[h]) continue;
            double l = mesh_edge_length(m, h);
            s.length += l;
            s.edges++;
            s.in_range += l >= 0.5 * edge && l <= 2 * edge;
        }
    }
    job->sums[begin / GRAIN] = s;
}

static Sums measure_triangles(const Track *tr, double *cosine)
{
    int blocks = (tr->mesh.ntri + GRAIN - 1) / GRAIN;
    Sums all = {0}, *sums = NEW(Sums, blocks);
    parallel_for(tr->mesh.ntri, GRAIN, measure_block, &(Job){tr, cosine, sums});
    for (int b = 0; b < blocks; b++) {
        all.length += sums[b].length;
        all.edges += sums[b].edges;
        all.in_range += sums[b].in_range;
        all.inverted += sums[b].inverted;
    }
    mem_free(sums);
    return all;
}

void track_measure(const Track *tr, FrameStat *stat)
{
    const Mesh *m = &tr->mesh;
    double *cosine = NEW(double, m->ntri);
    Sums all = measure_triangles(tr, cosine);
    stat->min_angle_p5 = angle_percentile(cosine, m->ntri, 0.05);
    stat->min_angle_p50 = angle_percentile(cosine, m->ntri, 0.5);
    stat->inverted_left = all.inverted;
    stat->edge_asked = tr->edge;
    stat->edge_mean = all.edges ? all.length / all.edges : NAN;
    stat->edges_in_range = all.edges ? (double)all.in_range / all.edges : NAN;
    stat->edge_rest = tr->rest_ratio * tr->edge;
    stat->components = tr->ncomp;
    stat->vertices_mechanical = m->nvert;
    stat->triangles_mechanical = m->ntri;
    stat->vertices_geometric = tr->fine.nvert;
    stat->triangles_geometric = tr->fine.ntri;
    mem_free(cosine);
}
