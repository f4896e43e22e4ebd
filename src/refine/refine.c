#include "refine/refine_priv.h"

static int count_flat(const Pass *p)
{
    int n = 0;
    for (int i = 0; i < p->nlist; i++) n += p->mid_state[p->list[i]] == MID_FLAT;
    return n;
}

void refine_note(Refine *memory, RefineMark mark)
{
    map_put(&memory->mark_at, key_pair(mark.from, mark.to), memory->nmark);
    RESERVE(memory->mark, memory->capmark, memory->nmark + 1);
    memory->mark[memory->nmark++] = mark;
}

/* Returns whether anything was cut. */
static bool run_pass(Pass *p, Refine *now, int32_t *next_id, int *lost)
{
    int wanted = pass_mark(p);
    if (wanted == 0) return false;
    pass_land(p);
    int landed = pass_drop_lost(p);
    if (p->set->scheme == REFINE_SCHEME_RED_GREEN) pass_close(p);
    pass_withdraw(p);
    int flat = count_flat(p), added = pass_cut(p, now, next_id);
    *lost += p->set->scheme == REFINE_SCHEME_RED_GREEN ? wanted - landed + flat : wanted - added;
    return added > 0;
}

int refine_build(Refine *memory, const Mesh *mech, const Field *field, const RefineSettings *set,
                 const Homes *homes, int32_t *next_id, RefinedMesh *out)
{
    ASSERT(mech->deadvert == 0 && mech->deadtri == 0 && set->passes <= PASSES_MAX);
    const double degree = 0.017453292519943295;
    int lost = 0, passes = set->angle_deg < 180 ? set->passes : 0;
    Refine now = {0};
    Pass p = {.m = out, .field = field, .memory = memory, .homes = homes, .set = set, .first_vert = mech->nvert, .first_id = *next_id,
              .dev_limit = set->deviation_vox, .dev_kept = HYSTERESIS * set->deviation_vox};
    p.cos_limit = cos(set->angle_deg * degree);
    p.cos_kept = cos(HYSTERESIS * set->angle_deg * degree);
    p.turn_limit = set->angle_deg * degree;
    p.turn_kept = HYSTERESIS * p.turn_limit;
    refined_copy(out, mech);
    pass_find_normals(&p);
    map_init(&now.mark_at, memory->nmark);
    if (passes > 0) pass_begin(&p, mech);
    while (p.number < passes && run_pass(&p, &now, next_id, &lost)) p.number++;
    if (p.number > 0) pass_finish(&p);
    pass_free(&p);
    refine_free(memory);
    *memory = now;
    return lost;
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
