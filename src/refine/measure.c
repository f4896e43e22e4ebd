/* measure.c: how good a refined mesh is. */
#include "refine/refine_priv.h"

#include "base/thread.h"

typedef struct Job {
    const RefinedMesh *m;
    const Field *field;
    RefineFigures *block; /* mean_vox: the sum */
} Job;

static void measure_block(void *ctx, int begin, int end)
{
    Job *job = ctx;
    const RefinedMesh *m = job->m;
    RefineFigures *s = &job->block[begin / GRAIN];
    Vec3 g[BATCH];
    double F[BATCH];
    for (int first = begin; first < end; first += BATCH) {
        int n = int_min(BATCH, end - first);
        sample_centroids(m, job->field, first, n, F, g);
        for (int i = 0; i < n; i++) {
            const int32_t *c = m->tri + 3 * (first + i);
            double far = far_vox(job->field, F[i], g[i]);
            s->mean_vox += far;
            s->max_vox = real_max(s->max_vox, far);
            s->inverted += field_triangle_inverted(job->field, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
        }
    }
}

RefineFigures refine_measure(const RefinedMesh *m, const Field *field)
{
    int blocks = (m->ntri + GRAIN - 1) / GRAIN;
    Job job = {m, field, NEW0(RefineFigures, blocks)};
    RefineFigures all = {0};
    parallel_for(m->ntri, GRAIN, measure_block, &job);
    for (int b = 0; b < blocks; b++) {
        all.mean_vox += job.block[b].mean_vox;
        all.max_vox = real_max(all.max_vox, job.block[b].max_vox);
        all.inverted += job.block[b].inverted;
    }
    if (m->ntri) all.mean_vox /= m->ntri;
    mem_free(job.block);
    return all;
}
