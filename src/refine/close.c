/* close.c: red-green refinement: marks spread until every triangle is whole, red, or green. */
#include "refine/refine_priv.h"

/* The edge between a green triangle's halves is never cut: it goes. */
static bool take_inner_mark(Pass *p, const Whole *w)
{
    if (w->ntri == 1) return false;
    uint8_t *inner = &p->marked[p->edge_of[3 * w->tri[0] + 1]];
    bool was = *inner;
    *inner = 0;
    return was;
}

/* Returns whether marks were added. */
static bool close_one(Pass *p, const Whole *w)
{
    bool inner = take_inner_mark(p, w);
    if (!inner && whole_is_closed(w, whole_marks(p, w))) return false;
    for (int i = 3; i <= 5; i++)
        if (w->edge[i] != NONE) p->marked[w->edge[i]] = 1;
    return true;
}

void pass_close(Pass *p)
{
    for (bool again = true; again;) {
        again = false;
        for (int t = 0; t < p->ntri; t++) {
            Whole w = whole_of(p, t);
            again = close_one(p, &w) || again;
        }
    }
    pass_list_marked(p);
    pass_land(p);
    for (int i = 0; i < p->nlist; i++)
        if (p->mid_state[p->list[i]] == MID_LOST) pass_flatten(p, p->list[i]);
}
