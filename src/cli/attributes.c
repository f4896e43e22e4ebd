#include "cli/attributes.h"

#include "base/thread.h"

#include <stdio.h>

enum { GRAIN = 1024 };

typedef struct SampleJob {
    const float *pos;
    const Grid *grid;
    float **column; /* one a component */
} SampleJob;

static void sample_block(void *ctx, int begin, int end)
{
    const SampleJob *job = ctx;
    for (int v = begin; v < end; v++) {
        const float *p = job->pos + 3 * (size_t)v;
        Vec3 at = vec3((double)p[0], (double)p[1], (double)p[2]);
        if (job->grid->ncomp == 1) {
            job->column[0][v] = (float)grid_scalar(job->grid, at);
            continue;
        }
        Vec3 value = grid_vector(job->grid, at);
        for (int k = 0; k < 3; k++) job->column[k][v] = (float)v_get(value, k);
    }
}

static char *column_name(const char *grid, int ncomp, int k)
{
    char name[300];
    snprintf(name, sizeof name, ncomp == 3 ? "%.280s_%c" : "%.280s", grid, "xyz"[k]);
    return mem_text(name);
}

void attributes_sample(TriMesh *m, int n, const char *const *name, const Grid *grid)
{
    if (n == 0) return;
    RESIZE(m->attr, m->nattr + 3 * n);
    RESIZE(m->attr_name, m->nattr + 3 * n);
    for (int i = 0; i < n; i++) {
        int first = m->nattr;
        for (int k = 0; k < grid[i].ncomp; k++, m->nattr++) {
            m->attr[m->nattr] = NEW(float, m->nvert);
            m->attr_name[m->nattr] = column_name(name[i], grid[i].ncomp, k);
        }
        parallel_for(m->nvert, GRAIN, sample_block, &(SampleJob){m->pos, &grid[i], m->attr + first});
    }
}
