#include "refine/refine_priv.h"

#include "base/thread.h"

static int count_flat(const Pass *p)
{
    int n = 0;
    for (int e = 0; e < p->nedge; e++) n += p->mid_state[e] == MID_FLAT;
    return n;
}

void refine_note(Refine *memory, RefineMark mark)
{
    map_put(&memory->mark_at, key_pair(mark.from, mark.to), memory->nmark);
    RESERVE(memory->mark, memory->capmark, memory->nmark + 1);
    memory->mark[memory->nmark++] = mark;
}

/* Returns whether anything was cut. */
static bool run_pass(Pass *p, Refine *now, int32_t *next_id, RefineStat *stat)
{
    int wanted = pass_mark(p);
    if (wanted == 0) return false;
    pass_land(p);
    int landed = pass_drop_lost(p);
    if (p->set->scheme == REFINE_SCHEME_RED_GREEN) pass_close(p);
    pass_withdraw(p);
    int added = pass_cut(p, now, next_id);
    stat->lost += p->set->scheme == REFINE_SCHEME_RED_GREEN ? wanted - landed + count_flat(p) : wanted - added;
    return added > 0;
}

/* --- figures ------------------------------------------------------------------------------------------------------------------ */

typedef struct MeasureJob {
    const Pass *p;
    double *sum, *max; /* a block */
    int *inverted;     /* a block */
} MeasureJob;

static void sum_edges(void *ctx, int begin, int end)
{
    MeasureJob *job = ctx;
    double sum = 0, max = 0;
    for (int e = begin; e < end; e++) {
        sum += job->p->far_vox[e];
        max = real_max(max, job->p->far_vox[e]);
    }
    job->sum[begin / GRAIN] = sum;
    job->max[begin / GRAIN] = max;
}

static void measure_tris(void *ctx, int begin, int end)
{
    MeasureJob *job = ctx;
    const RefinedMesh *m = job->p->m;
    int n = 0;
    for (int t = begin; t < end; t++) {
        const int32_t *c = m->tri + 3 * t;
        n += field_triangle_inverted(job->p->field, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
    }
    job->inverted[begin / GRAIN] = n;
}

static void measure(Pass *p, RefineStat *stat)
{
    pass_measure(p);
    int edge_blocks = (p->nedge + GRAIN - 1) / GRAIN, tri_blocks = (p->m->ntri + GRAIN - 1) / GRAIN;
    MeasureJob job = {p, NEW(double, edge_blocks), NEW(double, edge_blocks), NEW(int, tri_blocks)};
    parallel_for(p->nedge, GRAIN, sum_edges, &job);
    parallel_for(p->m->ntri, GRAIN, measure_tris, &job);
    double sum = 0;
    for (int b = 0; b < edge_blocks; b++) {
        sum += job.sum[b];
        stat->max_vox = real_max(stat->max_vox, job.max[b]);
    }
    for (int b = 0; b < tri_blocks; b++) stat->inverted += job.inverted[b];
    if (p->nedge) stat->mean_vox = sum / p->nedge;
    mem_free(job.sum);
    mem_free(job.max);
    mem_free(job.inverted);
}

RefineStat refine_build(Refine *memory, const Mesh *mech, const Field *field, const RefineSettings *set,
                        const Homes *homes, int32_t *next_id, RefinedMesh *out)
{
    ASSERT(mech->deadvert == 0 && mech->deadtri == 0);
    const double degree = 0.017453292519943295;
    bool off = set->angle_deg >= 180;
    RefineStat stat = {0};
    refined_copy(out, mech);
    Refine now = {0};
    map_init(&now.mark_at, memory->nmark);
    Pass shape = {.m = out, .field = field, .memory = memory, .homes = homes, .set = set, .dev_limit = set->deviation_vox, .dev_kept = HYSTERESIS * set->deviation_vox};
    shape.cos_limit = cos(set->angle_deg * degree);
    shape.cos_kept = cos(HYSTERESIS * set->angle_deg * degree);
    shape.turn_limit = set->angle_deg * degree;
    shape.turn_kept = HYSTERESIS * shape.turn_limit;
    pass_find_normals(&shape);
    Pass p = shape, before = {0};
    pass_find_edges(&p);
    for (int k = 0; k < set->passes && !off && run_pass(&p, &now, next_id, &stat); k++) {
        pass_free(&before);
        before = p;
        p = shape;
        p.number = k + 1;
        p.before = &before;
        pass_find_edges(&p);
    }
    measure(&p, &stat);
    pass_free(&p);
    pass_free(&before);
    refine_free(memory);
    *memory = now;
    return stat;
}

void refine_free(Refine *memory)
{
    mem_free(memory->mark);
    map_free(&memory->mark_at);
    *memory = (Refine){0};
}

void refine_store(Refine *memory, Store *s)
{
    STORE(s, memory->nmark);
    STORE_ARRAY(s, memory->mark, memory->nmark);
    if (!s->reading) return;
    memory->capmark = memory->nmark = s->bad ? 0 : memory->nmark;
    map_init(&memory->mark_at, memory->nmark);
    for (int i = 0; i < memory->nmark; i++) {
        const RefineMark *mark = &memory->mark[i];
        store_expect(s, mark->id >= 0 && mark->pass >= 0);
        map_put(&memory->mark_at, key_pair(mark->from, mark->to), i);
    }
}
