/* order.c: what lies together on the surface, together in memory.
 *
 * Every stage walks the vertices or the triangles in their order and reads the field there, of which a frame's is larger than any
 * cache. New vertices come last, wherever they are: after fifty frames of a splash that is a fifth of the time. */
#include "remesh/remesh.h"

#include "base/thread.h"

enum { GRAIN = 1024 };
#define STREWN_SHARE 0.05 /* of the vertices may lie behind those in order */

typedef struct Job {
    const Field *field;
    const Mesh *mesh;
    int32_t *key;
} Job;

static void key_block(void *ctx, int begin, int end)
{
    const Job *job = ctx;
    for (int v = begin; v < end; v++) {
        int at[3], brick = field_brick_of(job->field, affine_to_index(&job->field->xform, job->mesh->pos[v]), at);
        job->key[v] = brick == NONE ? job->field->nbrick : brick;
    }
}

bool remesh_is_strewn(const Mesh *m) { return m->nvert - m->nsorted > STREWN_SHARE * m->nvert; }

void remesh_sort(Mesh *m, const Field *field, int32_t *vert_to)
{
    Job job = {field, m, NEW(int32_t, m->nvert)};
    parallel_for(m->nvert, GRAIN, key_block, &job);
    mesh_sort(m, field->nbrick + 1, job.key, vert_to);
    mem_free(job.key);
}
