/* state.c: what goes from one frame to the next, kept between two runs. */
#include "track/track_priv.h"

static const int64_t FRAMES_MOST = (int64_t)1 << 53; /* what a float64 counts */

static void store_rest(Rest *r, Store *s)
{
    STORE(s, r->now);
    store_expect(s, r->now >= 0 && r->now <= FRAMES_MOST);
    STORE(s, r->nvert);
    STORE_ARRAY(s, r->at, r->nvert);
    r->capat = s->bad ? 0 : r->nvert;
}

/* Where the geometric mesh's vertices were. */
static void store_places(RefinedMesh *f, Store *s)
{
    STORE(s, f->nvert);
    STORE_ARRAY(s, f->id, f->nvert);
    STORE_ARRAY(s, f->pos, f->nvert);
    if (s->bad) f->nvert = 0;
}

void track_store(Track *tr, Store *s)
{
    uint8_t begun = tr->begun;
    STORE(s, begun);
    STORE(s, tr->edge);
    STORE(s, tr->rest_ratio);
    mesh_store(&tr->mesh, s);
    STORE_ARRAY(s, tr->unrest, tr->mesh.nvert);
    STORE(s, tr->next_midpoint);
    STORE(s, tr->last);
    refine_store(&tr->refine, s);
    if (tr->set.rest) store_rest(&tr->rest, s);
    if (tr->set.own_motion) store_places(&tr->fine, s);
    if (!s->reading) return;
    tr->begun = begun;
    tr->capcolumn = tr->mesh.nvert;
    tr->frozen = NEW0(uint8_t, tr->capcolumn);
    tr->moved = NEW0(uint8_t, tr->capcolumn);
    store_expect(s, tr->edge >= 0 && isfinite(tr->edge) && tr->rest_ratio > 0 && isfinite(tr->rest_ratio));
    store_expect(s, !tr->set.rest || tr->rest.nvert == tr->mesh.nvert);
    store_expect(s, tr->next_midpoint > 0 && tr->next_midpoint % MESH_ID_STEP == 1);
    tr->compared = begun;
    if (s->bad || !begun) return;
    track_find_components(tr);
    bodies_take(&tr->bodies, &tr->mesh, tr->ncomp, tr->comp);
}

void track_remind(Track *tr, const Field *field, const Grid *velocity)
{
    tr->field = field;
    tr->velocity = velocity;
}
