/* lineage.c: which components of this frame come from which of the last. */
#include "track/lineage_priv.h"

#include <stdlib.h>
#include <string.h>

/* A vertex that was predicted onto the wrong surface may be kept there by the mend. A link of so few vertices is such a stray
 * where both components share so many times more with others; where one does not, and most of its vertices are gone, unless
 * the field shows that what it enclosed is there on both sides of the frame (a void that filled up leaves strays behind). */
enum { STRAY_VERTICES = 3, STRAY_RATIO = 4 };
#define REACH_VOX 1.0  /* boxes meet that are at most this far apart, and matter is this near to its surface */
enum { BACK_STEPS = 2 };

/* --- components ------------------------------------------------------------------------------------------------------------ */

typedef struct Rank {
    int32_t number, comp;
} Rank;

static int compare_rank(const void *pa, const void *pb)
{
    int32_t a = ((const Rank *)pa)->number, b = ((const Rank *)pb)->number;
    return (a > b) - (a < b);
}

/* Numbers the components by their least identity; changes comp[nvert] accordingly. */
static void rank_components(Bodies *b, const Mesh *m, int32_t *comp)
{
    Rank *rank = NEW(Rank, b->n);
    int32_t *to = NEW(int32_t, b->n);
    for (int c = 0; c < b->n; c++) rank[c] = (Rank){INT32_MAX, c};
    for (int v = 0; v < m->nvert; v++) rank[comp[v]].number = int_min(rank[comp[v]].number, m->id[v]);
    qsort(rank, (size_t)b->n, sizeof *rank, compare_rank);
    for (int k = 0; k < b->n; k++) {
        to[rank[k].comp] = k;
        b->body[k] = (Body){.number = rank[k].number, .lo = vec3(1e300, 1e300, 1e300), .hi = vec3(-1e300, -1e300, -1e300)};
    }
    for (int v = 0; v < m->nvert; v++) comp[v] = to[comp[v]];
    mem_free(rank);
    mem_free(to);
}

/* Vertices body by body; within one as in the mesh. */
static void sort_vertices(Bodies *b, const Mesh *m, const int32_t *comp)
{
    for (int v = 0; v < m->nvert; v++) b->body[comp[v]].end++;
    for (int k = 0, at = 0; k < b->n; k++) {
        int n = b->body[k].end;
        b->body[k].start = b->body[k].end = at;
        at += n;
    }
    for (int v = 0; v < m->nvert; v++) {
        int i = b->body[comp[v]].end++;
        b->id[i] = m->id[v];
        b->pos[i] = m->pos[v];
    }
}

static void measure_body(const Bodies *b, Body *body)
{
    for (int i = body->start; i < body->end; i++) {
        Vec3 p = b->pos[i];
        body->lo = vec3(real_min(body->lo.x, p.x), real_min(body->lo.y, p.y), real_min(body->lo.z, p.z));
        body->hi = vec3(real_max(body->hi.x, p.x), real_max(body->hi.y, p.y), real_max(body->hi.z, p.z));
        body->centre = v_mix(body->centre, p, 1.0 / (i - body->start + 1));
    }
}

/* Volumes, and V - F / 2: each is closed. */
static void measure_insides(Bodies *b, const Mesh *m, const int32_t *comp)
{
    int32_t *faces = NEW0(int32_t, b->n);
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->corner + 3 * t;
        Body *body = &b->body[comp[c[0]]];
        Vec3 o = b->pos[body->start];
        body->volume += v_dot(v_sub(m->pos[c[0]], o), v_cross(v_sub(m->pos[c[1]], o), v_sub(m->pos[c[2]], o))) / 6;
        faces[comp[c[0]]]++;
    }
    for (int k = 0; k < b->n; k++) b->body[k].euler = body_size(b, k) - faces[k] / 2;
    mem_free(faces);
}

void bodies_take(Bodies *b, const Mesh *m, int ncomp, const int32_t *comp)
{
    int32_t *of = NEW(int32_t, m->nvert);
    for (int v = 0; v < m->nvert; v++) of[v] = comp[m->out[v] / 3];
    *b = (Bodies){ncomp, NEW(Body, ncomp), NEW(int32_t, m->nvert), NEW(Vec3, m->nvert)};
    rank_components(b, m, of);
    sort_vertices(b, m, of);
    for (int k = 0; k < ncomp; k++) measure_body(b, &b->body[k]);
    measure_insides(b, m, of);
    mem_free(of);
}

void bodies_free(Bodies *b)
{
    mem_free(b->body);
    mem_free(b->id);
    mem_free(b->pos);
    *b = (Bodies){0};
}

/* --- distances ------------------------------------------------------------------------------------------------------------- */

static double box_distance2(const Body *body, Vec3 p)
{
    double d2 = 0;
    for (int a = 0; a < 3; a++) {
        double out = real_max(real_max(v_get(body->lo, a) - v_get(p, a), v_get(p, a) - v_get(body->hi, a)), 0);
        d2 += out * out;
    }
    return d2;
}

double body_nearest(const Bodies *b, int k, Vec3 p, double most, Vec3 *place)
{
    const Body *body = &b->body[k];
    double limit = most * most, least = limit;
    if (box_distance2(body, p) >= limit) return most;
    for (int i = body->start; i < body->end; i++) {
        double d2 = v_len2(v_sub(b->pos[i], p));
        if (d2 < least) least = d2, *place = b->pos[i];
    }
    return least < limit ? sqrt(least) : most;
}

double body_distance(const Bodies *b, int k, Vec3 p, double most)
{
    Vec3 place;
    return body_nearest(b, k, p, most, &place);
}

/* The body that has the vertex nearest to p, or NONE within `most`. */
static int nearest_body(const Bodies *b, Vec3 p, double most)
{
    int nearest = NONE;
    for (int k = 0; k < b->n; k++) {
        double d = body_distance(b, k, p, most);
        if (d < most) most = d, nearest = k;
    }
    return nearest;
}

Vec3 lineage_go_back(const Track *tr, Vec3 p)
{
    Vec3 q = p;
    for (int k = 0; k < BACK_STEPS && tr->velocity; k++) q = v_sub(p, v_sub(track_advect(tr, q), q));
    return q;
}

/* --- links by identities --------------------------------------------------------------------------------------------------- */

static int compare_link(const void *pa, const void *pb)
{
    const BodyLink *x = pa, *y = pb;
    return x->a != y->a ? x->a - y->a : x->b - y->b;
}

static void add_link(Lineage *l, int a, int b, int shared)
{
    RESERVE(l->link, l->caplink, l->nlink + 1);
    l->link[l->nlink++] = (BodyLink){a, b, shared};
    l->nafter[a]++;
    l->nbefore[b]++;
}

/* at: body before of each identity. */
static void index_before(const Bodies *before, Map *at)
{
    map_init(at, before->n ? before->body[before->n - 1].end : 0);
    for (int k = 0; k < before->n; k++)
        for (int i = before->body[k].start; i < before->body[k].end; i++) map_put(at, (uint64_t)before->id[i], k);
}

static void link_identities(Lineage *l)
{
    const Bodies *after = l->after;
    Map at, link;
    index_before(l->before, &at);
    map_init(&link, after->n);
    for (int b = 0; b < after->n; b++)
        for (int i = after->body[b].start; i < after->body[b].end; i++) {
            int a = map_get(&at, (uint64_t)after->id[i]);
            if (a == NONE) continue;
            int k = map_put(&link, key_pair(a, b), l->nlink);
            if (k == l->nlink) add_link(l, a, b, 0);
            l->link[k].shared++;
        }
    map_free(&at);
    map_free(&link);
}

/* The field has liquid at p where the body enclosed liquid, or air where it is a cavity. */
static bool has_matter(const Field *field, const Body *body, Vec3 p)
{
    if (!field || !field->nbrick) return false;
    bool known, solid = field_value(field, p, NULL, &known) > 0;
    return known && solid == (body->volume > 0);
}

/* Whether what the body enclosed before the frame is still there after it. */
static bool outlives(const Track *tr, const Body *was) { return has_matter(tr->field, was, track_advect(tr, was->centre)); }
/* Whether what the body encloses was there before. */
static bool predates(const Track *tr, const Body *is) { return has_matter(tr->last_field, is, lineage_go_back(tr, is->centre)); }

/* best: the most vertices that either component shares with any other. */
static bool is_stray(const Lineage *l, const Track *tr, BodyLink k, int best_a, int best_b)
{
    int smaller = int_min(body_size(l->before, k.a), body_size(l->after, k.b));
    bool better_a = best_a >= STRAY_RATIO * k.shared, better_b = best_b >= STRAY_RATIO * k.shared;
    if (k.shared > STRAY_VERTICES) return false;
    if (better_a && better_b) return true;
    if (2 * k.shared >= smaller) return false;
    return !((better_a || outlives(tr, &l->before->body[k.a])) && (better_b || predates(tr, &l->after->body[k.b])));
}

static void drop_strays(Lineage *l, const Track *tr)
{
    int32_t *best_a = NEW0(int32_t, l->before->n), *best_b = NEW0(int32_t, l->after->n);
    int n = 0;
    for (int i = 0; i < l->nlink; i++) {
        BodyLink k = l->link[i];
        best_a[k.a] = int_max(best_a[k.a], k.shared);
        best_b[k.b] = int_max(best_b[k.b], k.shared);
    }
    for (int i = 0; i < l->nlink; i++) {
        BodyLink k = l->link[i];
        if (is_stray(l, tr, k, best_a[k.a], best_b[k.b])) l->nafter[k.a]--, l->nbefore[k.b]--;
        else l->link[n++] = k;
    }
    l->nlink = n;
    mem_free(best_a);
    mem_free(best_b);
}

/* --- links by place -------------------------------------------------------------------------------------------------------- */

typedef struct Meeting {
    int a, b;
    double distance; /* between the centres */
} Meeting;

static int compare_meeting(const void *pa, const void *pb)
{
    const Meeting *x = pa, *y = pb;
    if (x->distance != y->distance) return x->distance < y->distance ? -1 : 1;
    return x->a != y->a ? x->a - y->a : x->b - y->b;
}

static bool boxes_meet(const Body *a, Vec3 motion, const Body *b, double reach)
{
    for (int k = 0; k < 3; k++) {
        double shift = v_get(motion, k);
        if (v_get(a->lo, k) + shift > v_get(b->hi, k) + reach || v_get(a->hi, k) + shift < v_get(b->lo, k) - reach) return false;
    }
    return true;
}

/* Those that share no identity with anything are what is nearest to where they are bound for, one to one: specks are drawn
 * anew in every frame, small drops that moved far are made anew. */
static void link_places(Lineage *l, const Track *tr)
{
    int n = 0, cap = 0;
    Meeting *meeting = NULL;
    for (int a = 0; a < l->before->n; a++) {
        if (l->nafter[a]) continue;
        const Body *was = &l->before->body[a];
        Vec3 motion = v_sub(track_advect(tr, was->centre), was->centre);
        for (int b = 0; b < l->after->n; b++) {
            const Body *is = &l->after->body[b];
            if (l->nbefore[b] || (was->volume > 0) != (is->volume > 0) || !boxes_meet(was, motion, is, REACH_VOX * tr->field->voxel)) continue;
            RESERVE(meeting, cap, n + 1);
            meeting[n++] = (Meeting){a, b, v_dist(v_add(was->centre, motion), is->centre)};
        }
    }
    if (n) qsort(meeting, (size_t)n, sizeof *meeting, compare_meeting);
    for (int i = 0; i < n; i++)
        if (!l->nafter[meeting[i].a] && !l->nbefore[meeting[i].b]) add_link(l, meeting[i].a, meeting[i].b, 0);
    mem_free(meeting);
}

/* --- links by matter ------------------------------------------------------------------------------------------------------- */

/* The nearest of the bodies on the other side of the frame, where p is what was `body`'s centre, or NONE. */
static int find_host(const Track *tr, const Bodies *other, const Body *body, Vec3 p)
{
    return nearest_body(other, p, 0.5 * v_dist(body->lo, body->hi) + REACH_VOX * tr->field->voxel);
}

/* What is lone still vanished or appeared, unless the other frame has liquid where it had liquid (or air for a cavity): then
 * it was swallowed by the component nearest to there, or came off it, and none of its few vertices outlived that. */
static void link_matter(Lineage *l, const Track *tr)
{
    for (int a = 0; a < l->before->n; a++) {
        const Body *was = &l->before->body[a];
        if (l->nafter[a] || !outlives(tr, was)) continue;
        int b = find_host(tr, l->after, was, track_advect(tr, was->centre));
        if (b != NONE) add_link(l, a, b, 0);
    }
    for (int b = 0; b < l->after->n; b++) {
        const Body *is = &l->after->body[b];
        if (l->nbefore[b] || !predates(tr, is)) continue;
        int a = find_host(tr, l->before, is, lineage_go_back(tr, is->centre));
        if (a != NONE) add_link(l, a, b, 0);
    }
}

void lineage_find(Lineage *l, const Track *tr, const Bodies *before, const Bodies *after)
{
    *l = (Lineage){.before = before, .after = after, .nafter = NEW0(int32_t, before->n), .nbefore = NEW0(int32_t, after->n)};
    link_identities(l);
    drop_strays(l, tr);
    link_places(l, tr);
    link_matter(l, tr);
    if (l->nlink) qsort(l->link, (size_t)l->nlink, sizeof *l->link, compare_link);
}

void lineage_free(Lineage *l)
{
    mem_free(l->link);
    mem_free(l->nafter);
    mem_free(l->nbefore);
    *l = (Lineage){0};
}
