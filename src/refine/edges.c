/* edges.c: the edges of the mesh that a pass refines. */
#include "refine/refine_priv.h"

#include "base/thread.h"

/* Where an edge landed, or that it found nothing, stays so as long as it is not cut. */
static void take_over_block(void *ctx, int begin, int end)
{
    Pass *p = ctx;
    const Pass *b = p->before;
    for (int e = begin; e < end; e++) {
        int o = p->from[e];
        p->far_vox[e] = o != NONE ? b->far_vox[o] : -1;
        p->was[e] = o != NONE ? b->was[o] : refine_find(p->memory, p->m->id[p->ends[e][0]], p->m->id[p->ends[e][1]]);
        p->mid_state[e] = o != NONE ? b->mid_state[o] : MID_NONE;
        if (p->mid_state[e] == MID_NONE) continue;
        p->mid_pos[e] = b->mid_pos[o];
        p->mid_normal[e] = b->mid_normal[o];
    }
}

/* Edges numbered by their lower vertex, then by first appearance: half-edges go into buckets by lower vertex, where an
 * edge's second half finds its first. */
void pass_find_edges(Pass *p)
{
    RefinedMesh *m = p->m;
    int nhalf = 3 * m->ntri;
    int32_t *start = NEW0(int32_t, m->nvert + 2), *bucket = NEW(int32_t, nhalf);
    for (int h = 0; h < nhalf; h++) start[int_min(m->tri[h], m->tri[h % 3 == 2 ? h - 2 : h + 1]) + 2]++;
    for (int v = 0; v < m->nvert; v++) start[v + 2] += start[v + 1];
    for (int h = 0; h < nhalf; h++) bucket[start[int_min(m->tri[h], m->tri[h % 3 == 2 ? h - 2 : h + 1]) + 1]++] = h;
    p->edge_of = NEW(int32_t, nhalf);
    p->ends = mem_alloc((size_t)nhalf / 2, sizeof *p->ends);
    p->side = mem_alloc((size_t)nhalf / 2, sizeof *p->side);
    p->from = NEW(int32_t, nhalf / 2);
    for (int v = 0; v < m->nvert; v++) {
        int first = p->nedge;
        for (int i = start[v]; i < start[v + 1]; i++) {
            int h = bucket[i], a = m->tri[h], b = m->tri[h % 3 == 2 ? h - 2 : h + 1], top = int_max(a, b), e = first;
            while (e < p->nedge && p->ends[e][1] != top) e++;
            p->edge_of[h] = e;
            int origin = p->before ? p->before->kept_side[h] : NONE; /* one side knows it, or both */
            p->side[e][e < p->nedge] = h / 3;
            if (e == p->nedge) {
                p->ends[e][0] = v;
                p->ends[e][1] = top;
                p->from[p->nedge++] = origin;
            } else if (origin != NONE) p->from[e] = origin;
        }
    }
    ASSERT(2 * p->nedge == nhalf);
    mem_free(start);
    mem_free(bucket);
    p->was = NEW(int32_t, p->nedge);
    p->self = NEW0(uint8_t, p->nedge);
    p->far_vox = NEW(double, p->nedge);
    p->marked = NEW0(uint8_t, p->nedge);
    p->mid_state = NEW(uint8_t, p->nedge);
    p->mid_pos = NEW(Vec3, p->nedge);
    p->mid_normal = NEW(Vec3, p->nedge);
    p->mid = NEW(int32_t, p->nedge);
    p->state = NEW0(uint8_t, m->ntri);
    parallel_for(p->nedge, GRAIN, take_over_block, p);
}

void pass_free(Pass *p)
{
    mem_free(p->ends);
    mem_free(p->side);
    mem_free(p->edge_of);
    mem_free(p->from);
    mem_free(p->was);
    mem_free(p->self);
    mem_free(p->far_vox);
    mem_free(p->marked);
    mem_free(p->mid_state);
    mem_free(p->mid_pos);
    mem_free(p->mid_normal);
    mem_free(p->mid);
    mem_free(p->tri_normal);
    mem_free(p->turn);
    mem_free(p->state);
    mem_free(p->kept_tri);
    mem_free(p->kept_side);
}
