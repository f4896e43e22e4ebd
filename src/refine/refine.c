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
    const Pass *p;    /* the last */
    RefineStat *stat; /* a block; mean_vox: the sum */
} MeasureJob;

/* What the last pass knows of the distance of the edge that half-edge h now is; < 0: nothing. */
static double known_far(const Pass *p, int h)
{
    int e = p->kept_side ? p->kept_side[h] : p->edge_of[h];
    return e != NONE ? p->far_vox[e] : -1;
}

static void add_far(RefineStat *stat, double far)
{
    stat->mean_vox += far;
    stat->max_vox = real_max(stat->max_vox, far);
}

static void measure_batch(const Field *f, int n, const Vec3 *mid, RefineStat *stat)
{
    Vec3 g[BATCH];
    double F[BATCH];
    if (n > 0) field_sample(f, n, mid, F, g);
    for (int i = 0; i < n; i++) add_far(stat, far_vox(f, F[i], g[i]));
}

/* Each edge where its half-edge goes up. */
static void measure_block(void *ctx, int begin, int end)
{
    MeasureJob *job = ctx;
    const RefinedMesh *m = job->p->m;
    RefineStat stat = {0};
    Vec3 mid[BATCH];
    int n = 0;
    for (int t = begin; t < end; t++) {
        const int32_t *c = m->tri + 3 * t;
        stat.inverted += field_triangle_inverted(job->p->field, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
        for (int k = 0; k < 3; k++) {
            int a = c[k], b = c[(k + 1) % 3];
            if (a > b) continue;
            double far = known_far(job->p, 3 * t + k);
            if (far >= 0) add_far(&stat, far);
            else mid[n++] = v_mid(m->pos[a], m->pos[b]);
            if (n < BATCH) continue;
            measure_batch(job->p->field, n, mid, &stat);
            n = 0;
        }
    }
    measure_batch(job->p->field, n, mid, &stat);
    job->stat[begin / GRAIN] = stat;
}

static void measure(const Pass *p, RefineStat *stat)
{
    int ntri = p->m->ntri, blocks = (ntri + GRAIN - 1) / GRAIN;
    MeasureJob job = {p, NEW(RefineStat, blocks)};
    parallel_for(ntri, GRAIN, measure_block, &job);
    for (int b = 0; b < blocks; b++) {
        stat->mean_vox += job.stat[b].mean_vox;
        stat->max_vox = real_max(stat->max_vox, job.stat[b].max_vox);
        stat->inverted += job.stat[b].inverted;
    }
    if (ntri) stat->mean_vox /= 1.5 * ntri;
    mem_free(job.stat);
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
    /* of what the last pass leaves, the edges are not wanted */
    while (p.number < set->passes && !off && run_pass(&p, &now, next_id, &stat) && p.number + 1 < set->passes) {
        pass_free(&before);
        before = p;
        p = shape;
        p.number = before.number + 1;
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
