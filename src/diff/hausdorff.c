#include "diff/hausdorff.h"

#include "base/thread.h"
#include "mesh/closest.h"
#include "mesh/nearest.h"

enum { GRAIN = 256, DEPTH_MOST = 16 };

typedef struct Job {
    const Surface *a, *b;
    const ClosestIndex *index; /* of b */
    double slack;
    ClosestHit *hit;           /* [a->nvert] the nearest to each vertex of a */
    double known;              /* some corner is that far */
    FarPoint *far;             /* a block of triangles */
} Job;

static void corner_block(void *ctx, int begin, int end)
{
    Job *job = ctx;
    for (int v = begin; v < end; v++) job->hit[v] = closest_find(job->index, job->a->pos[v]);
}

static double distance_to_triangle(const Surface *s, int t, Vec3 p)
{
    Vec3 q[3];
    double w[3];
    for (int k = 0; k < 3; k++) q[k] = s->pos[s->tri[3 * t + k]];
    triangle_nearest(p, q, w);
    return v_dist(p, v_axpy(v_axpy(v_scale(q[0], w[0]), w[1], q[1]), w[2], q[2]));
}

/* No point of the triangle p is farther from b: the distance to a triangle is convex, so a corner is where it is
 * greatest. */
static double bound(const Job *job, const Vec3 p[3], const ClosestHit hit[3])
{
    double best = INFINITY;
    for (int k = 0; k < 3; k++) {
        double most = 0;
        for (int i = 0; i < 3; i++)
            most = real_max(most, i == k ? sqrt(hit[i].dist2) : distance_to_triangle(job->b, hit[k].tri, p[i]));
        best = real_min(best, most);
    }
    return best;
}

static void note(FarPoint *far, Vec3 p, const ClosestHit *hit)
{
    double d = sqrt(hit->dist2);
    if (d > far->distance) far->distance = d, far->at = p;
}

/* Looks for points of the triangle that are farther than what is known by more than the slack: halves it across its
 * longest side. */
static void search(const Job *job, const Vec3 p[3], const ClosestHit hit[3], int depth, FarPoint *far)
{
    double most = bound(job, p, hit);
    if (!(most > real_max(far->distance, job->known) + job->slack)) return;
    if (depth == DEPTH_MOST) {
        far->most = real_max(far->most, most);
        return;
    }
    int s = 0; /* from corner s to the next */
    for (int k = 1; k < 3; k++)
        if (v_dist(p[k], p[(k + 1) % 3]) > v_dist(p[s], p[(s + 1) % 3])) s = k;
    int a = s, b = (s + 1) % 3, c = (s + 2) % 3;
    Vec3 m = v_mid(p[a], p[b]);
    ClosestHit at = closest_find(job->index, m);
    note(far, m, &at);
    search(job, (Vec3[3]){p[a], m, p[c]}, (ClosestHit[3]){hit[a], at, hit[c]}, depth + 1, far);
    search(job, (Vec3[3]){m, p[b], p[c]}, (ClosestHit[3]){at, hit[b], hit[c]}, depth + 1, far);
}

static void search_block(void *ctx, int begin, int end)
{
    Job *job = ctx;
    FarPoint far = {0};
    for (int t = begin; t < end; t++) {
        Vec3 p[3];
        ClosestHit hit[3];
        for (int k = 0; k < 3; k++) {
            p[k] = job->a->pos[job->a->tri[3 * t + k]];
            hit[k] = job->hit[job->a->tri[3 * t + k]];
            note(&far, p[k], &hit[k]);
        }
        search(job, p, hit, 0, &far);
    }
    job->far[begin / GRAIN] = far;
}

FarPoint hausdorff_from(const Surface *a, const Surface *b, double slack)
{
    ASSERT(b->ntri > 0 && slack > 0);
    ClosestIndex index;
    int blocks = (a->ntri + GRAIN - 1) / GRAIN;
    Job job = {
        .a = a, .b = b, .index = &index, .slack = slack, .hit = NEW(ClosestHit, a->nvert), .far = NEW(FarPoint, blocks)};
    closest_build(&index, b->ntri, b->pos, b->tri);
    parallel_for(a->nvert, GRAIN, corner_block, &job);
    for (int h = 0; h < 3 * a->ntri; h++) job.known = real_max(job.known, sqrt(job.hit[a->tri[h]].dist2));
    parallel_for(a->ntri, GRAIN, search_block, &job);
    FarPoint far = {0};
    for (int i = 0; i < blocks; i++) {
        far.most = real_max(far.most, job.far[i].most);
        if (job.far[i].distance > far.distance) far.distance = job.far[i].distance, far.at = job.far[i].at;
    }
    far.most = real_max(far.most, far.distance + (a->ntri ? slack : 0));
    closest_free(&index);
    mem_free(job.hit);
    mem_free(job.far);
    return far;
}
