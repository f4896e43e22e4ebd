/* uncross.c: triangles that run through one another taken apart by the smallest edit that helps: a flip, a move, a collapse.
 * Each edit is judged before it is made, by the crossings of the triangles it takes away and of those it puts in their place. */
#include "remesh/remesh_priv.h"

#include "mesh/facet.h"
#include "mesh/intersect.h"

#include <limits.h>
#include <math.h>

enum { ROUNDS_MAX = 4, PLACES = 16, BLOCK = 64 };
#define REACH 0.6    /* a landing is at most this far from its target, in edges wanted */
#define MARGIN 0.5   /* an edit stays this near to the triangles it changes, in edges wanted */
#define DEVIATION_MAX_VOX 0.2 /* of a triangle's centroid from the surface, unless it was farther before */

typedef struct Box {
    Vec3 lo, hi;
} Box;

typedef struct Corners {
    int32_t v[3];
    Vec3 p[3];
    Box box;
} Corners;

typedef struct Uncross {
    Remesh *r;
    Box *box;              /* [mesh->ntri] of the live triangles, */
    Box *block;            /* and around every BLOCK of them: neighbours by number mostly are neighbours */
    uint8_t *taken;        /* [mesh->ntri] by the edit that is tried */
    Box *edited;           /* [nedited] around each edit made */
    int nedited, capedited;
    Box room;              /* where edits may happen, */
    Crowd near;            /* and the triangles that reach into it */
    int32_t *old;          /* an edit: the triangles it takes away, */
    int nold, capold;
    int before;            /* their crossings; NONE: not counted yet */
    Corners *fresh;        /* and those it puts in their place */
    int nfresh, capfresh;
    Crowd own;             /* an edit's triangles counted so far */
} Uncross;

/* --- boxes --------------------------------------------------------------------------------------------------------------- */

static Vec3 lower(Vec3 a, Vec3 b) { return vec3(real_min(a.x, b.x), real_min(a.y, b.y), real_min(a.z, b.z)); }
static Vec3 upper(Vec3 a, Vec3 b) { return vec3(real_max(a.x, b.x), real_max(a.y, b.y), real_max(a.z, b.z)); }
static Box box_of(const Vec3 p[3]) { return (Box){lower(lower(p[0], p[1]), p[2]), upper(upper(p[0], p[1]), p[2])}; }
static Box box_join(Box a, Box b) { return (Box){lower(a.lo, b.lo), upper(a.hi, b.hi)}; }

static bool boxes_meet(const Box *a, const Box *b)
{
    return (a->lo.x <= b->hi.x) & (b->lo.x <= a->hi.x) & (a->lo.y <= b->hi.y) & (b->lo.y <= a->hi.y) & (a->lo.z <= b->hi.z) & (b->lo.z <= a->hi.z);
}

static bool box_holds(const Box *a, const Box *b)
{
    return (a->lo.x <= b->lo.x) & (b->hi.x <= a->hi.x) & (a->lo.y <= b->lo.y) & (b->hi.y <= a->hi.y) & (a->lo.z <= b->lo.z) & (b->hi.z <= a->hi.z);
}

static Corners corners_of(const Mesh *m, int t)
{
    const int32_t *c = m->corner + 3 * t;
    Corners k = {.v = {c[0], c[1], c[2]}, .p = {m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]}};
    k.box = box_of(k.p);
    return k;
}

static void note_box(Uncross *u, int t)
{
    if (tri_is_dead(u->r->mesh, t)) return;
    u->box[t] = corners_of(u->r->mesh, t).box;
    u->block[t / BLOCK] = box_join(u->block[t / BLOCK], u->box[t]);
}

static void find_boxes(Uncross *u)
{
    const Box none = {vec3(INFINITY, INFINITY, INFINITY), vec3(-INFINITY, -INFINITY, -INFINITY)};
    int n = u->r->mesh->ntri;
    u->box = NEW(Box, n);
    u->block = NEW(Box, n / BLOCK + 1);
    for (int b = 0; b <= n / BLOCK; b++) u->block[b] = none;
    for (int t = 0; t < n; t++) note_box(u, t);
}

/* --- an edit tried ------------------------------------------------------------------------------------------------------- */

static void begin_edit(Uncross *u)
{
    for (int i = 0; i < u->nold; i++) u->taken[u->old[i]] = 0;
    u->nold = u->nfresh = 0;
    u->before = NONE;
}

static void take(Uncross *u, int t)
{
    if (u->taken[t]) return;
    RESERVE(u->old, u->capold, u->nold + 1);
    u->old[u->nold++] = t;
    u->taken[t] = 1;
}

static void put(Uncross *u, Corners c)
{
    RESERVE(u->fresh, u->capfresh, u->nfresh + 1);
    c.box = box_of(c.p);
    u->fresh[u->nfresh++] = c;
}

static void put_triangle(Uncross *u, int a, int b, int c)
{
    const Vec3 *p = u->r->mesh->pos;
    put(u, (Corners){.v = {a, b, c}, .p = {p[a], p[b], p[c]}});
}

static void take_ring(Uncross *u, int v)
{
    const Mesh *m = u->r->mesh;
    int h = m->out[v];
    do take(u, h / 3);
    while ((h = he_around(m, h)) != m->out[v]);
}

/* The triangles around v, with v at p under the name `as`; those that hold `without` vanish. */
static void put_ring(Uncross *u, int v, int as, Vec3 p, int without)
{
    const Mesh *m = u->r->mesh;
    int h = m->out[v];
    do {
        int a = he_to(m, h), b = m->corner[he_prev(h)];
        if (a != without && b != without) put(u, (Corners){.v = {as, a, b}, .p = {p, m->pos[a], m->pos[b]}});
    } while ((h = he_around(m, h)) != m->out[v]);
}

/* How often an edit's triangles run through one another and through those around that it leaves; counts no further than `most`. */
static int count_crossings(Uncross *u, const Corners *c, int n, int most)
{
    int count = 0;
    crowd_clear(&u->own);
    for (int i = 0; i < n && count < most; i++) {
        Facet f;
        Box32 box = box32_of(c[i].p);
        if (!facet_make(&f, c[i].v, c[i].p)) continue;
        count += crowd_count(&u->own, &f, &box, NULL, most - count);
        count += count < most ? crowd_count(&u->near, &f, &box, u->taken, most - count) : 0;
        crowd_add(&u->own, &f, &box, NONE);
    }
    return count;
}

typedef struct Harm {
    int inverted;
    double deviation;
} Harm;

static Harm harm_of(const Uncross *u, const Corners *c, int n)
{
    Harm h = {0, DEVIATION_MAX_VOX};
    for (int i = 0; i < n; i++) {
        h.inverted += field_triangle_inverted(u->r->field, c[i].p[0], c[i].p[1], c[i].p[2]);
        h.deviation = real_max(h.deviation, triangle_deviation(u->r->field, c[i].p));
    }
    return h;
}

/* Fewer crossings, no more triangles turned over, none farther from the surface. */
static bool edit_helps(Uncross *u)
{
    for (int i = 0; i < u->nfresh; i++)
        if (!box_holds(&u->room, &u->fresh[i].box) || triangle_is_collinear(u->fresh[i].p)) return false;
    Corners *was = NEW(Corners, u->nold);
    for (int i = 0; i < u->nold; i++) was[i] = corners_of(u->r->mesh, u->old[i]);
    if (u->before == NONE) u->before = count_crossings(u, was, u->nold, INT_MAX);
    bool helps = count_crossings(u, u->fresh, u->nfresh, u->before) < u->before;
    if (helps) {
        Harm before = harm_of(u, was, u->nold), after = harm_of(u, u->fresh, u->nfresh);
        helps = after.inverted <= before.inverted && after.deviation <= before.deviation;
    }
    mem_free(was);
    return helps;
}

/* --- the edits ----------------------------------------------------------------------------------------------------------- */

static bool try_flip(Uncross *u, int h)
{
    Mesh *m = u->r->mesh;
    int g = m->opp[h], a = he_from(m, h), b = he_to(m, h), c = m->corner[he_prev(h)], d = m->corner[he_prev(g)];
    if (!mesh_can_flip(m, h)) return false;
    begin_edit(u);
    take(u, h / 3);
    take(u, g / 3);
    put_triangle(u, d, c, a);
    put_triangle(u, c, d, b);
    if (!edit_helps(u)) return false;
    mesh_flip_edge(m, h);
    return true;
}

/* Its ring is taken. */
static bool try_place(Uncross *u, int v, Vec3 p)
{
    Remesh *r = u->r;
    Vec3 n;
    if (!remesh_land_point(r, v, &p, REACH * r->edge, &n)) return false;
    p = v_round32(p);
    if (v_dot(n, r->normal[v]) <= 0) return false;
    u->nfresh = 0;
    put_ring(u, v, v, p, NONE);
    if (!edit_helps(u)) return false;
    r->mesh->pos[v] = p;
    r->normal[v] = n;
    return true;
}

/* To the neighbours' mean, part of the way, or in the tangent plane around it. */
static bool try_move(Uncross *u, int v)
{
    const Remesh *r = u->r;
    if (!remesh_in_zone(r, v)) return false;
    Vec3 was = r->mesh->pos[v], mean = mesh_ring_mean(r->mesh, v), n = r->normal[v];
    begin_edit(u);
    take_ring(u, v);
    for (int i = 0; i < 3; i++)
        if (try_place(u, v, v_mix(was, mean, 1 - 0.3 * i))) return true;
    for (int i = 0; i < PLACES; i++)
        if (try_place(u, v, remesh_place_around(mean, n, i, 0.15, r->edge))) return true;
    return false;
}

static bool try_collapse(Uncross *u, int h)
{
    Remesh *r = u->r;
    Mesh *m = r->mesh;
    if (m->id[he_from(m, h)] > m->id[he_to(m, h)]) h = m->opp[h]; /* the older identity stays */
    int a = he_from(m, h), b = he_to(m, h);
    if (!remesh_can_collapse(m, h) || (r->zone && (r->zone[a] < ZONE_FRESH || r->zone[b] < ZONE_FRESH))) return false;
    Vec3 place[3] = {m->pos[a], m->pos[b], v_mid(m->pos[a], m->pos[b])}, n;
    remesh_land_point(r, a, &place[2], 0.5 * r->edge, &n);
    place[2] = v_round32(place[2]);
    begin_edit(u);
    take_ring(u, a);
    take_ring(u, b);
    for (int k = 0; k < 3; k++) {
        u->nfresh = 0;
        put_ring(u, a, a, place[k], b);
        put_ring(u, b, a, place[k], a);
        if (!edit_helps(u)) continue;
        mesh_collapse_edge(m, h, place[k]);
        r->normal[a] = remesh_normal_at(r, place[k]);
        return true;
    }
    return false;
}

static void find_room(Uncross *u, const TriPair *pair)
{
    const Mesh *m = u->r->mesh;
    u->room = box_join(u->box[pair->a], u->box[pair->b]);
    for (int i = 0; i < 6; i++) {
        int v = m->corner[3 * (i < 3 ? pair->a : pair->b) + i % 3], h = m->out[v];
        do u->room = box_join(u->room, u->box[h / 3]);
        while ((h = he_around(m, h)) != m->out[v]);
    }
    double d = MARGIN * u->r->edge;
    u->room.lo = v_sub(u->room.lo, vec3(d, d, d));
    u->room.hi = v_add(u->room.hi, vec3(d, d, d));
}

static void find_near(Uncross *u)
{
    const Mesh *m = u->r->mesh;
    crowd_clear(&u->near);
    for (int b = 0; b * BLOCK < m->ntri; b++) {
        if (!boxes_meet(&u->block[b], &u->room)) continue;
        for (int t = b * BLOCK; t < int_min(m->ntri, (b + 1) * BLOCK); t++) {
            if (tri_is_dead(m, t) || !boxes_meet(&u->box[t], &u->room)) continue;
            Corners c = corners_of(m, t);
            Box32 box = box32_of(c.p);
            Facet f;
            if (facet_make(&f, c.v, c.p)) crowd_add(&u->near, &f, &box, t);
        }
    }
}

/* Whether edits from number `first` on reached into the room. */
static bool room_has_changed(const Uncross *u, int first)
{
    for (int i = first; i < u->nedited; i++)
        if (boxes_meet(&u->edited[i], &u->room)) return true;
    return false;
}

static void note_edit(Uncross *u)
{
    Box all = u->box[u->old[0]];
    for (int i = 0; i < u->nold; i++) all = box_join(all, u->box[u->old[i]]);
    for (int i = 0; i < u->nfresh; i++) all = box_join(all, u->fresh[i].box);
    for (int i = 0; i < u->nold; i++) note_box(u, u->old[i]);
    RESERVE(u->edited, u->capedited, u->nedited + 1);
    u->edited[u->nedited++] = all;
}

static bool uncross_pair(Uncross *u, const TriPair *pair)
{
    const Mesh *m = u->r->mesh;
    int half[6];
    for (int i = 0; i < 6; i++) half[i] = 3 * (i < 3 ? pair->a : pair->b) + i % 3;
    find_near(u);
    for (int i = 0; i < 6; i++)
        if (try_flip(u, half[i])) return true;
    for (int i = 0; i < 6; i++)
        if (try_move(u, m->corner[half[i]])) return true;
    for (int i = 0; i < 6; i++)
        if (try_collapse(u, half[i])) return true;
    return false;
}

static bool still_crosses(const Mesh *m, const TriPair *pair)
{
    if (tri_is_dead(m, pair->a) || tri_is_dead(m, pair->b)) return false;
    Corners a = corners_of(m, pair->a), b = corners_of(m, pair->b);
    return triangles_intersect(a.v, a.p, b.v, b.p);
}

/* One after the other. `was`: those that the round before left, and how many edits there had been then; `now` is to hold those of
 * this. Where nothing has changed since, nothing helps. Returns whether anything did. */
static bool uncross_pairs(Uncross *u, int n, const TriPair *pair, const Map *was, Map *now)
{
    bool helped = false;
    for (int i = 0; i < n; i++) {
        uint64_t key = key_pair(pair[i].a, pair[i].b);
        int since = map_get(was, key);
        if (!still_crosses(u->r->mesh, &pair[i])) continue;
        find_room(u, &pair[i]);
        if (since != NONE && !room_has_changed(u, since)) map_put(now, key, since);
        else if (!uncross_pair(u, &pair[i])) map_put(now, key, u->nedited);
        else helped = true, note_edit(u);
    }
    return helped;
}

int remesh_uncross(Remesh *r, Crossings *c)
{
    Mesh *m = r->mesh;
    int left = 0;
    bool helped = true;
    Map was = {0};
    Uncross u = {.r = r, .taken = NEW0(uint8_t, m->ntri)};
    for (int v = 0; v < m->nvert; v++) m->pos[v] = v_round32(m->pos[v]);
    for (int round = 0; helped && round < ROUNDS_MAX; round++) {
        Map now = {0};
        left = crossings_find(c, m);
        if (left && !u.box) find_boxes(&u);
        helped = uncross_pairs(&u, left, c->pair, &was, &now);
        map_free(&was);
        was = now;
    }
    map_free(&was);
    if (helped) left = crossings_find(c, m);
    mem_free(u.box);
    mem_free(u.block);
    mem_free(u.taken);
    mem_free(u.edited);
    crowd_free(&u.near);
    crowd_free(&u.own);
    mem_free(u.old);
    mem_free(u.fresh);
    return left;
}
