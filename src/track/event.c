/* event.c: links between components told as events, each with its place. */
#include "track/lineage_priv.h"

#include <stdlib.h>
#include <string.h>

#define CONTACT_PAIRS 1e7   /* of vertices, at most about twice as many are looked at for one joint */
#define PLACE_REACH_VOX 8.0 /* a patch farther than this from the two components of a joint has nothing to do with it */

const char *event_kind_name(EventKind kind)
{
    static const char *const name[EVENT_KINDS] = {"blend", "split", "birth", "death", "hole-open", "hole-close", "mend"};
    return name[kind];
}

FrameEvents track_take_events(Track *tr)
{
    FrameEvents e = tr->events;
    tr->events = (FrameEvents){0};
    return e;
}

void events_free(FrameEvents *e)
{
    mem_free(e->before);
    mem_free(e->after);
    mem_free(e->link);
    mem_free(e->event);
    mem_free(e->number);
    mem_free(e->place);
    *e = (FrameEvents){0};
}

static bool event_is_sound(const FrameEvents *e, const FrameEvent *v)
{
    return v->kind < EVENT_KINDS && v->before >= 0 && v->nbefore >= 0 && v->before <= e->nnumber - v->nbefore &&
           v->after >= 0 && v->nafter >= 0 && v->after <= e->nnumber - v->nafter && v->nbefore + v->nafter > 0 &&
           v->place >= 0 && v->nplace >= 1 && v->place <= e->nplace - v->nplace;
}

void events_store(FrameEvents *e, Store *s)
{
    uint8_t first = e->first;
    STORE(s, first);
    STORE(s, e->nbefore);
    STORE(s, e->nafter);
    STORE(s, e->nlink);
    STORE(s, e->nevent);
    STORE(s, e->nnumber);
    STORE(s, e->nplace);
    STORE_ARRAY(s, e->before, e->nbefore);
    STORE_ARRAY(s, e->after, e->nafter);
    STORE_ARRAY(s, e->link, e->nlink);
    STORE_ARRAY(s, e->event, e->nevent);
    STORE_ARRAY(s, e->number, e->nnumber);
    STORE_ARRAY(s, e->place, e->nplace);
    if (!s->reading) return;
    e->first = first;
    for (int i = 0; i < e->nevent && !s->bad; i++) store_expect(s, event_is_sound(e, &e->event[i]));
    if (s->bad) events_free(e);
}

/* --- what is known --------------------------------------------------------------------------------------------------------- */

/* A patch sewn in during the frame. */
typedef struct Sewn {
    Vec3 place, was;      /* in this frame, in the last one */
    int body;             /* after; */
    int vertices, euler;  /* see MendPatch */
    bool whole;           /* the whole component was made anew: its place tells nothing */
    bool used;            /* as the place of a joint */
} Sewn;

typedef struct Teller {
    const Track *tr;
    const Lineage *l;
    FrameEvents *e;
    int nsewn;
    Sewn *sewn;
    int32_t *group;       /* [before->n + after->n] the same for all that is linked: the least index */
    uint8_t *told;        /* [before->n + after->n], at the group's index: its topology changed */
} Teller;

/* The body on each component of the isosurface; NONE: there is none. The caller frees it. */
static int32_t *find_bodies(const Bodies *after, const IsoSurface *iso)
{
    int32_t *body = NEW(int32_t, iso->ncomp);
    for (int k = 0; k < iso->ncomp; k++) body[k] = NONE;
    for (int b = 0; b < after->n; b++) {
        int home = NONE;
        bool sure = false;
        for (int i = after->body[b].start; i < after->body[b].end && !sure; i++) {
            int at = iso_component_at(iso, after->pos[i], &sure);
            if (at == NONE) sure = false;
            else home = at;
        }
        if (home != NONE && body[home] == NONE) body[home] = b;
    }
    return body;
}

static void take_patches(Teller *te, const IsoSurface *iso)
{
    const MendStat *s = &te->tr->mended;
    int32_t *body = find_bodies(te->l->after, iso);
    te->sewn = mem_alloc((size_t)s->npatch, sizeof *te->sewn);
    for (int i = 0; i < s->npatch; i++) {
        const MendPatch *p = &s->patch[i];
        if (p->comp == NONE || body[p->comp] == NONE) continue;
        te->sewn[te->nsewn++] = (Sewn){p->place, lineage_go_back(te->tr, p->place), body[p->comp], p->vertices, p->euler, p->whole, false};
    }
    mem_free(body);
}

static int group_root(int32_t *group, int i)
{
    while (group[i] != i) i = group[i] = group[group[i]];
    return i;
}

static void find_groups(Teller *te)
{
    const Lineage *l = te->l;
    int n = l->before->n + l->after->n;
    te->group = NEW(int32_t, n);
    te->told = NEW0(uint8_t, n);
    for (int i = 0; i < n; i++) te->group[i] = i;
    for (int i = 0; i < l->nlink; i++) {
        int a = group_root(te->group, l->link[i].a), b = group_root(te->group, l->before->n + l->link[i].b);
        te->group[int_max(a, b)] = int_min(a, b);
    }
    for (int i = 0; i < n; i++) te->group[i] = group_root(te->group, i);
}

static int group_before(const Teller *te, int a) { return te->group[a]; }
static int group_after(const Teller *te, int b) { return te->group[te->l->before->n + b]; }

/* --- writing --------------------------------------------------------------------------------------------------------------- */

static FrameEvent *begin_event(FrameEvents *e, EventKind kind)
{
    RESERVE(e->event, e->capevent, e->nevent + 1);
    FrameEvent *v = &e->event[e->nevent++];
    *v = (FrameEvent){.kind = kind, .before = e->nnumber, .after = e->nnumber, .place = e->nplace};
    return v;
}

static void add_number(FrameEvents *e, int32_t number)
{
    RESERVE(e->number, e->capnumber, e->nnumber + 1);
    e->number[e->nnumber++] = number;
}

/* All of the components before come first. */
static void add_before(Teller *te, FrameEvent *v, int a)
{
    ASSERT(v->nafter == 0);
    add_number(te->e, te->l->before->body[a].number);
    v->nbefore++;
    v->after = te->e->nnumber;
}

static void add_after(Teller *te, FrameEvent *v, int b)
{
    add_number(te->e, te->l->after->body[b].number);
    v->nafter++;
}

static void add_place(Teller *te, FrameEvent *v, Vec3 p)
{
    FrameEvents *e = te->e;
    RESERVE(e->place, e->capplace, e->nplace + 1);
    e->place[e->nplace++] = p;
    v->nplace++;
}

/* --- blends and splits ----------------------------------------------------------------------------------------------------- */

/* Two components that met or parted. */
typedef struct Joint {
    const Bodies *bodies;
    int larger, smaller;
    bool before;          /* they are last frame's */
} Joint;

/* The patch nearest to both, or NONE. */
static int find_patch(const Teller *te, const Joint *j, const uint8_t *on)
{
    double reach = PLACE_REACH_VOX * te->tr->field->voxel, least = 2 * reach;
    int best = NONE;
    for (int i = 0; i < te->nsewn; i++) {
        const Sewn *s = &te->sewn[i];
        if (s->whole || !on[s->body]) continue;
        Vec3 p = j->before ? s->was : s->place;
        double most = real_min(reach, least), d = body_distance(j->bodies, j->smaller, p, most);
        if (d >= most) continue;
        most = real_min(reach, least - d);
        double rest = body_distance(j->bodies, j->larger, p, most);
        if (rest < most) least = d + rest, best = i;
    }
    return best;
}

/* Half way between the nearest vertices of the two, of which some are left out where there are very many. */
static Vec3 find_contact(const Teller *te, const Joint *j)
{
    const Body *smaller = &j->bodies->body[j->smaller];
    double pairs = (double)body_size(j->bodies, j->smaller) * body_size(j->bodies, j->larger), most = 1e300;
    Vec3 from = smaller->centre, to = from;
    for (int i = smaller->start; i < smaller->end; i += 1 + (int)(pairs / CONTACT_PAIRS)) {
        Vec3 near;
        double d = body_nearest(j->bodies, j->larger, j->bodies->pos[i], most, &near);
        if (d < most) most = d, from = j->bodies->pos[i], to = near;
    }
    Vec3 p = v_mid(from, to);
    return j->before ? track_advect(te->tr, p) : p;
}

/* A place for each component but the largest: first the largest of those. on[after->n]: where patches may be. */
static void place_joints(Teller *te, FrameEvent *v, const Bodies *bodies, bool before, int n, int *k, const uint8_t *on)
{
    for (int i = 1; i < n; i++) /* by size, falling; stable */
        for (int j = i; j > 0 && body_size(bodies, k[j - 1]) < body_size(bodies, k[j]); j--) {
            int swap = k[j];
            k[j] = k[j - 1];
            k[j - 1] = swap;
        }
    for (int i = 1; i < n; i++) {
        Joint j = {bodies, k[0], k[i], before};
        int p = find_patch(te, &j, on);
        add_place(te, v, p == NONE ? find_contact(te, &j) : te->sewn[p].place);
        if (p == NONE) continue;
        v->replaced += te->sewn[p].used ? 0 : te->sewn[p].vertices;
        te->sewn[p].used = true;
    }
    v->count = n - 1;
}

/* The components before that component `b` blends. */
static void tell_blend(Teller *te, int b)
{
    const Lineage *l = te->l;
    int n = 0, *k = NEW(int, l->nbefore[b]);
    uint8_t *on = NEW0(uint8_t, l->after->n);
    FrameEvent *v = begin_event(te->e, EVENT_BLEND);
    for (int i = 0; i < l->nlink; i++)
        if (l->link[i].b == b) add_before(te, v, k[n++] = l->link[i].a);
    add_after(te, v, b);
    on[b] = 1;
    place_joints(te, v, l->before, true, n, k, on);
    te->told[group_after(te, b)] = 1;
    mem_free(k);
    mem_free(on);
}

/* The components that component `a` splits into. */
static void tell_split(Teller *te, int a)
{
    const Lineage *l = te->l;
    int n = 0, *k = NEW(int, l->nafter[a]);
    uint8_t *on = NEW0(uint8_t, l->after->n);
    FrameEvent *v = begin_event(te->e, EVENT_SPLIT);
    add_before(te, v, a);
    for (int i = 0; i < l->nlink; i++)
        if (l->link[i].a == a) {
            add_after(te, v, k[n++] = l->link[i].b);
            on[l->link[i].b] = 1;
        }
    place_joints(te, v, l->after, false, n, k, on);
    te->told[group_before(te, a)] = 1;
    mem_free(k);
    mem_free(on);
}

/* --- births and deaths ----------------------------------------------------------------------------------------------------- */

static void tell_birth(Teller *te, int b)
{
    FrameEvent *v = begin_event(te->e, EVENT_BIRTH);
    add_after(te, v, b);
    add_place(te, v, te->l->after->body[b].centre);
    v->replaced = body_size(te->l->after, b);
    v->count = 1;
    te->told[group_after(te, b)] = 1;
}

static void tell_death(Teller *te, int a)
{
    FrameEvent *v = begin_event(te->e, EVENT_DEATH);
    add_before(te, v, a);
    add_place(te, v, te->l->before->body[a].centre);
    v->replaced = body_size(te->l->before, a);
    v->count = 1;
}

/* --- holes ----------------------------------------------------------------------------------------------------------------- */

/* Inside where it was outside, or the other way about. */
static bool is_turned(const Track *tr, const Sewn *s)
{
    double F = field_value(tr->field, s->place, NULL, NULL), was = tr->last_field ? field_value(tr->last_field, s->was, NULL, NULL) : F;
    return (F > 0) != (was > 0);
}

/* The likeliest patch of a group for a hole that nothing else explains yet, or NONE: one whose Euler characteristic says so, else
 * one that is no joint's place, else one where matter came or went, else the largest. */
static int find_hole(const Teller *te, int group, bool opened, bool sure_only)
{
    int best = NONE, best_rank = -1;
    for (int i = 0; i < te->nsewn; i++) {
        const Sewn *s = &te->sewn[i];
        if (s->whole || group_after(te, s->body) != group) continue;
        int rank = 4 * (opened ? s->euler < 0 : s->euler > 0) + 2 * !s->used + is_turned(te->tr, s);
        if (sure_only && rank < 6) continue;
        if (rank > best_rank || (rank == best_rank && s->vertices > te->sewn[best].vertices)) best = i, best_rank = rank;
    }
    return best;
}

/* The centre of the component with most holes. */
static Vec3 centre_of_holes(const Teller *te, int group, bool opened)
{
    const Bodies *b = opened ? te->l->after : te->l->before;
    int best = NONE;
    for (int k = 0; k < b->n; k++)
        if ((opened ? group_after(te, k) : group_before(te, k)) == group && (best == NONE || body_genus(b, k) > body_genus(b, best))) best = k;
    return b->body[best].centre;
}

static void place_holes(Teller *te, FrameEvent *v, int group)
{
    for (int n = 0; n < v->count; n++) {
        int p = find_hole(te, group, v->kind == EVENT_HOLE_OPEN, n > 0);
        if (p == NONE) break;
        add_place(te, v, te->sewn[p].place);
        v->replaced += te->sewn[p].used ? 0 : te->sewn[p].vertices;
        te->sewn[p].used = true;
    }
    if (!v->nplace) add_place(te, v, centre_of_holes(te, group, v->kind == EVENT_HOLE_OPEN));
}

/* gain[group index]: by how much the genus of each group with both sides went up. The caller frees it. */
static int32_t *find_gains(const Teller *te)
{
    const Lineage *l = te->l;
    int32_t *gain = NEW0(int32_t, l->before->n + l->after->n);
    for (int a = 0; a < l->before->n; a++)
        if (l->nafter[a]) gain[group_before(te, a)] -= body_genus(l->before, a);
    for (int b = 0; b < l->after->n; b++)
        if (l->nbefore[b]) gain[group_after(te, b)] += body_genus(l->after, b);
    return gain;
}

static void tell_holes(Teller *te, EventKind kind, const int32_t *gain)
{
    const Lineage *l = te->l;
    int sign = kind == EVENT_HOLE_OPEN ? 1 : -1;
    for (int g = 0; g < l->before->n; g++) { /* a group's index is that of a component before */
        if (sign * gain[g] <= 0) continue;
        FrameEvent *v = begin_event(te->e, kind);
        for (int a = 0; a < l->before->n; a++)
            if (group_before(te, a) == g) add_before(te, v, a);
        for (int b = 0; b < l->after->n; b++)
            if (group_after(te, b) == g) add_after(te, v, b);
        v->count = sign * gain[g];
        place_holes(te, v, g);
        te->told[g] = 1;
    }
}

/* --- mends ----------------------------------------------------------------------------------------------------------------- */

static void tell_mend(Teller *te, int b)
{
    const Lineage *l = te->l;
    int largest = NONE, n = 0, vertices = 0;
    for (int i = 0; i < te->nsewn; i++) {
        if (te->sewn[i].body != b) continue;
        if (largest == NONE || te->sewn[i].vertices > te->sewn[largest].vertices) largest = i;
        vertices += te->sewn[i].vertices;
        n++;
    }
    if (n == 0) return;
    FrameEvent *v = begin_event(te->e, EVENT_MEND);
    for (int i = 0; i < l->nlink; i++)
        if (l->link[i].b == b) add_before(te, v, l->link[i].a);
    add_after(te, v, b);
    add_place(te, v, te->sewn[largest].place);
    v->replaced = vertices;
    v->count = n;
}

/* --- all of it ------------------------------------------------------------------------------------------------------------- */

/* By kind, then by number. */
static void tell_events(Teller *te)
{
    const Lineage *l = te->l;
    int32_t *gain = find_gains(te);
    for (int b = 0; b < l->after->n; b++)
        if (l->nbefore[b] > 1) tell_blend(te, b);
    for (int a = 0; a < l->before->n; a++)
        if (l->nafter[a] > 1) tell_split(te, a);
    for (int b = 0; b < l->after->n; b++)
        if (!l->nbefore[b]) tell_birth(te, b);
    for (int a = 0; a < l->before->n; a++)
        if (!l->nafter[a]) tell_death(te, a);
    tell_holes(te, EVENT_HOLE_OPEN, gain);
    tell_holes(te, EVENT_HOLE_CLOSE, gain);
    for (int b = 0; b < l->after->n; b++)
        if (!te->told[group_after(te, b)]) tell_mend(te, b);
    mem_free(gain);
}

static void tell_components(FrameEvents *e, const Lineage *l)
{
    e->nbefore = l->before->n;
    e->nafter = l->after->n;
    e->nlink = l->nlink;
    RESIZE(e->before, e->nbefore);
    RESIZE(e->after, e->nafter);
    RESIZE(e->link, e->nlink);
    for (int a = 0; a < e->nbefore; a++) e->before[a] = l->before->body[a].number;
    for (int b = 0; b < e->nafter; b++) e->after[b] = l->after->body[b].number;
    for (int i = 0; i < e->nlink; i++) {
        e->link[i][0] = e->before[l->link[i].a];
        e->link[i][1] = e->after[l->link[i].b];
    }
}

void track_find_no_events(Track *tr)
{
    const Bodies *b = &tr->bodies;
    Lineage l = {.before = b, .after = b, .nlink = b->n, .link = NEW(BodyLink, b->n)};
    for (int k = 0; k < b->n; k++) l.link[k] = (BodyLink){k, k, body_size(b, k)};
    tr->events.first = false;
    tr->events.nevent = tr->events.nnumber = tr->events.nplace = 0;
    tell_components(&tr->events, &l);
    mem_free(l.link);
}

void track_find_events(Track *tr, FrameStat *stat)
{
    FrameEvents *e = &tr->events;
    Bodies after;
    Lineage l;
    bodies_take(&after, &tr->mesh, tr->ncomp, tr->comp);
    lineage_find(&l, tr, &tr->bodies, &after);
    Teller te = {.tr = tr, .l = &l, .e = e};
    e->first = !tr->compared;
    e->nevent = e->nnumber = e->nplace = 0;
    tell_components(e, &l);
    find_groups(&te);
    take_patches(&te, &tr->iso);
    if (!e->first) tell_events(&te);
    for (int i = 0; i < e->nevent; i++) stat->events[e->event[i].kind] += e->event[i].count;
    mem_free(te.sewn);
    mem_free(te.group);
    mem_free(te.told);
    lineage_free(&l);
    bodies_free(&tr->bodies);
    tr->bodies = after;
    tr->compared = true;
}
