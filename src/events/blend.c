/* blend.c: RR-6128 4.1. Colliding triangles, and lost ones that face each other, are gathered in pieces, and pieces paired by
 * their collisions; of three that meet in one place two are welded in this round, the third in the next. */
#include "base/hash.h"
#include "events/events_priv.h"

#include <stdlib.h>

enum { ATTEMPTS = 3, TURNS_TRIED = 5, PATCH_MOST = 1000 };
#define PATCH_REACH_EDGES 4.0 /* the middle of a patch lands at most this far away */

/* Two mechanical triangles of which geometric triangles collide, and the pieces they lie in. */
typedef struct Collision {
    int32_t a, b;
    int32_t piece_a, piece_b;  /* piece_a <= piece_b */
} Collision;

typedef struct Link {
    int32_t a, b;              /* pieces */
    int count;
} Link;

/* --- who collides with whom --------------------------------------------------------------------------------------------- */

bool tris_are_neighbours(const Mesh *m, int t, int u)
{
    for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++)
            if (m->corner[3 * t + k] == m->corner[3 * u + l]) return true;
    return false;
}

static int compare_collisions(const void *pa, const void *pb)
{
    const Collision *a = pa, *b = pb;
    return a->a != b->a ? (a->a > b->a) - (a->a < b->a) : (a->b > b->b) - (a->b < b->b);
}

/* The mechanical triangles behind the geometric ones that collide. Neighbours that cut into each other are a matter of
 * refinement, not of topology. */
static int find_crossings(const Mesh *m, const RefinedMesh *fine, TriPair **pair, int *cap)
{
    int n = intersect_find(&(TriSoup){fine->ntri, fine->pos, fine->tri}, NULL, pair, cap), kept = 0;
    for (int i = 0; i < n; i++) {
        int a = fine->parent[(*pair)[i].a], b = fine->parent[(*pair)[i].b];
        if (a != b && !tris_are_neighbours(m, a, b)) (*pair)[kept++] = (TriPair){int_min(a, b), int_max(a, b)};
    }
    return kept;
}

static int find_collisions(const Surgeon *s, const RefinedMesh *fine, Collision **out)
{
    TriPair *pair = NULL, *facing = NULL;
    int cap = 0, cap_facing = 0, unique = 0, ncross = fine ? find_crossings(s->mesh, fine, &pair, &cap) : 0;
    int nfacing = lost_pairs(s, s->lost, &facing, &cap_facing), n = ncross + nfacing;
    Collision *c = NEW(Collision, n);
    for (int i = 0; i < n; i++) {
        TriPair p = i < ncross ? pair[i] : facing[i - ncross];
        c[i] = (Collision){p.a, p.b, NONE, NONE};
    }
    mem_free(pair);
    mem_free(facing);
    qsort(c, (size_t)n, sizeof *c, compare_collisions);
    for (int i = 0; i < n; i++)
        if (i == 0 || compare_collisions(&c[i], &c[unique - 1]) != 0) c[unique++] = c[i];
    *out = c;
    return unique;
}

/* Lost triangles that hang together with the region's are of it too. */
static void add_lost(Surgeon *s)
{
    Region *r = &s->region;
    for (int i = 0; i < r->n; i++)
        for (int k = 0; k < 3 && !tri_is_dead(s->mesh, r->tri[i]); k++) {
            int u = s->mesh->opp[3 * r->tri[i] + k] / 3;
            if (u < s->nlost && s->lost[u]) region_add(r, u);
        }
}

/* The collisions' triangles and, grown, their neighbours, in connected pieces. Returns how many. */
static int find_pieces(Surgeon *s, int n, Collision *c, bool grown)
{
    Region *r = &s->region;
    region_clear(r);
    for (int i = 0; i < n; i++) region_add(r, c[i].a), region_add(r, c[i].b);
    add_lost(s);
    if (grown) region_grow(r);
    int32_t *piece = NEW(int32_t, s->mesh->ntri);
    int npiece = region_pieces(r, piece);
    for (int i = 0; i < n; i++) {
        int a = piece[c[i].a], b = piece[c[i].b];
        c[i].piece_a = int_min(a, b);
        c[i].piece_b = int_max(a, b);
    }
    mem_free(piece);
    return npiece;
}

/* Most collisions first. */
static int compare_links(const void *pa, const void *pb)
{
    const Link *a = pa, *b = pb;
    if (a->count != b->count) return a->count < b->count ? 1 : -1;
    return a->a != b->a ? (a->a > b->a) - (a->a < b->a) : (a->b > b->b) - (a->b < b->b);
}

static int find_links(int n, const Collision *c, Link **out)
{
    Map at;
    Link *link = NEW(Link, n);
    int nlink = 0;
    map_init(&at, n);
    for (int i = 0; i < n; i++) {
        int k = map_put(&at, key_pair(c[i].piece_a, c[i].piece_b), nlink);
        if (k == nlink) link[nlink++] = (Link){c[i].piece_a, c[i].piece_b, 0};
        link[k].count++;
    }
    map_free(&at);
    qsort(link, (size_t)nlink, sizeof *link, compare_links);
    *out = link;
    return nlink;
}

/* --- adjusting (4.1): both borders get the same number of edges --------------------------------------------------------- */

typedef struct BorderEdge {
    double length;
    int32_t h;
} BorderEdge;

static int compare_edges(const void *pa, const void *pb)
{
    const BorderEdge *a = pa, *b = pb;
    return a->length != b->length ? (a->length > b->length) - (a->length < b->length) : (a->h > b->h) - (a->h < b->h);
}

/* Collapses the shortest edge of a border that may be. Done while the region is still there: the closed mesh knows what
 * may collapse. */
static bool collapse_one(Surgeon *s, int loop)
{
    int n = border_length(&s->borders, loop);
    BorderEdge *edge = NEW(BorderEdge, n);
    bool done = false;
    for (int i = 0; i < n; i++) {
        edge[i].h = border_halves(&s->borders, loop)[i];
        edge[i].length = mesh_edge_length(s->mesh, edge[i].h);
    }
    qsort(edge, (size_t)n, sizeof *edge, compare_edges);
    for (int i = 0; i < n && !done; i++) {
        int h = edge[i].h;
        if (!(done = mesh_can_collapse(s->mesh, h))) continue;
        mesh_collapse_edge(s->mesh, h, v_mid(s->mesh->pos[he_from(s->mesh, h)], s->mesh->pos[he_to(s->mesh, h)]));
    }
    mem_free(edge);
    return done;
}

static void split_longest(Surgeon *s, int loop)
{
    const int32_t *half = border_halves(&s->borders, loop);
    int best = half[0];
    for (int i = 1; i < border_length(&s->borders, loop); i++)
        if (mesh_edge_length(s->mesh, half[i]) > mesh_edge_length(s->mesh, best)) best = half[i];
    int first = s->mesh->ntri;
    mesh_split_edge(s->mesh, best, v_mid(s->mesh->pos[he_from(s->mesh, best)], s->mesh->pos[he_to(s->mesh, best)]), mesh_fresh_id(s->mesh));
    region_add(&s->region, first + 1); /* the half that lies across the edge */
}

static bool is_pair(const Borders *b) { return b->npiece == 2 && b->n == 2 && b->piece[0] != b->piece[1]; }

/* Where the longer border cannot be shortened further the shorter one gets more edges. */
static bool adjust(Surgeon *s)
{
    Borders *b = &s->borders;
    while (is_pair(b) && border_length(b, 0) != border_length(b, 1)) {
        int longer = border_length(b, 0) > border_length(b, 1) ? 0 : 1, difference = abs(border_length(b, 0) - border_length(b, 1));
        if (!collapse_one(s, longer)) split_longest(s, 1 - longer);
        region_borders(&s->region, b);
        if (is_pair(b) && abs(border_length(b, 0) - border_length(b, 1)) >= difference) return false;
    }
    return is_pair(b);
}

/* --- welding (4.1) -------------------------------------------------------------------------------------------------------- */

/* b's half-edges in the order in which a's meet them, turned by `turn`. */
static void turn_border(int n, const int32_t *b, int turn, int32_t *out)
{
    for (int i = 0; i < n; i++) out[i] = b[(turn + n - i) % n];
}

/* The sum of squared distances of the vertices to be welded, in the plane of normal u. */
static double cost_of_turn(const Mesh *m, int n, const int32_t *a, const int32_t *b, Vec3 u)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        Vec3 d = v_sub(m->pos[he_from(m, a[i])], m->pos[he_to(m, b[i])]);
        sum += v_len2(v_axpy(d, -v_dot(d, u), u));
    }
    return sum;
}

/* The report starts from the nearest pair; that may twist the ring, the least sum over all pairs does not. The best turn that the
 * mesh allows, of the few best. */
static bool choose_turn(const Surgeon *s, int n, const int32_t *a, const int32_t *b, int32_t *matched)
{
    const Mesh *m = s->mesh;
    Vec3 u = v_unit(v_sub(border_centre(m, &s->borders, 0), border_centre(m, &s->borders, 1)));
    double *cost = NEW(double, n);
    bool good = false;
    for (int k = 0; k < n; k++) {
        turn_border(n, b, k, matched);
        cost[k] = cost_of_turn(m, n, a, matched, u);
    }
    for (int tries = 0; tries < int_min(n, TURNS_TRIED) && !good; tries++) {
        int best = 0;
        for (int k = 1; k < n; k++)
            if (cost[k] < cost[best]) best = k;
        cost[best] = INFINITY;
        turn_border(n, b, best, matched);
        good = mesh_can_weld(m, n, a, matched);
    }
    mem_free(cost);
    return good;
}

static void weld(Surgeon *s, int n, const int32_t *a, const int32_t *b)
{
    Mesh *m = s->mesh;
    Vec3 place = v_mid(border_centre(m, &s->borders, 0), border_centre(m, &s->borders, 1));
    int before = mesh_components(m, NULL, NULL), gone = mesh_erase(m, &s->region);
    for (int i = 0; i < n; i++) {
        Vec3 *p = &m->pos[he_from(m, a[i])];
        *p = surgeon_land(s, v_mid(*p, m->pos[he_to(m, b[i])]));
    }
    mesh_weld(m, n, a, b);
    bool joined = mesh_components(m, NULL, NULL) < before;
    change_add(s->events, joined ? CHANGE_BLEND : CHANGE_HOLE_OPEN, place, gone + n);
}

/* Bodies that blend are joined through the contact, and a sheet that is pierced is open there: straight, or by its middle. */
static bool is_joined(const Surgeon *s, Vec3 c0, Vec3 c1, bool inside)
{
    return surgeon_holds_way(s, c0, c1, inside) || (surgeon_holds_way(s, c0, s->contact, inside) && surgeon_holds_way(s, s->contact, c1, inside));
}

/* Do the triangles of the first border's piece look towards the other's? Then what blends are bodies, else it is a sheet. */
static bool faces(const Surgeon *s, Vec3 c0, Vec3 c1)
{
    const Mesh *m = s->mesh;
    Vec3 normal = {0, 0, 0};
    int32_t *piece = NEW(int32_t, m->ntri);
    region_pieces(&s->region, piece);
    for (int i = 0; i < s->region.n; i++) {
        int t = s->region.tri[i];
        if (!tri_is_dead(m, t) && piece[t] == s->borders.piece[0]) normal = v_add(normal, mesh_tri_area2(m, t));
    }
    mem_free(piece);
    return v_dot(normal, v_sub(c1, c0)) > 0;
}

static bool try_weld(Surgeon *s)
{
    if (!is_pair(&s->borders)) return false;
    Vec3 c0 = border_centre(s->mesh, &s->borders, 0), c1 = border_centre(s->mesh, &s->borders, 1);
    if (!is_joined(s, c0, c1, faces(s, c0, c1)) || !adjust(s)) return false;
    int n = border_length(&s->borders, 0);
    int32_t *matched = NEW(int32_t, n);
    const int32_t *a = border_halves(&s->borders, 0);
    bool good = n >= 3 && choose_turn(s, n, a, border_halves(&s->borders, 1), matched);
    if (good) weld(s, n, a, matched);
    mem_free(matched);
    return good;
}

/* --- one place ------------------------------------------------------------------------------------------------------------ */

/* A component all of whose triangles are in the region is swallowed by the other. */
static bool try_swallow(Surgeon *s)
{
    const Borders *b = &s->borders;
    Mesh *m = s->mesh;
    if (b->npiece != 2 || b->n != 1) return false;
    int32_t *piece = NEW(int32_t, m->ntri);
    region_pieces(&s->region, piece);
    Region whole;
    Vec3 centre = {0, 0, 0};
    region_init(&whole, m);
    for (int i = 0; i < s->region.n; i++)
        if (piece[s->region.tri[i]] != b->piece[0]) region_add(&whole, s->region.tri[i]);
    for (int i = 0; i < whole.n; i++) centre = v_axpy(centre, 1.0 / whole.n, tri_middle(m, whole.tri[i]));
    bool joined = is_joined(s, centre, border_centre(m, b, 0), true);
    if (joined) change_add(s->events, CHANGE_BLEND, centre, mesh_erase(m, &whole));
    region_free(&whole);
    mem_free(piece);
    return joined;
}

/* A region that reaches around a neck: the neck is gone if the field says so. */
static bool try_cut(Surgeon *s)
{
    const Borders *b = &s->borders;
    if (b->npiece != 1 || b->n != 2) return false;
    Vec3 *rim = NEW(Vec3, s->region.n);
    int n = 0;
    for (int i = 0; i < s->region.n; i++)
        if (!tri_is_dead(s->mesh, s->region.tri[i])) rim[n++] = tri_middle(s->mesh, s->region.tri[i]);
    bool neck = surgeon_looks_outward(s, v_mid(border_centre(s->mesh, b, 0), border_centre(s->mesh, b, 1)));
    bool severed = (surgeon_disc_inside(s, n, rim) < 0.5) == neck;
    mem_free(rim);
    if (severed) surgeon_cap_all(s);
    return severed;
}

static void gather(Surgeon *s, const Link *link, int n, const Collision *c)
{
    region_clear(&s->region);
    for (int i = 0; i < n; i++) {
        if (c[i].piece_a != link->a || c[i].piece_b != link->b) continue;
        if (!tri_is_dead(s->mesh, c[i].a)) region_add(&s->region, c[i].a);
        if (!tri_is_dead(s->mesh, c[i].b)) region_add(&s->region, c[i].b);
    }
    Vec3 sum = {0, 0, 0};
    for (int i = 0; i < s->region.n; i++) sum = v_add(sum, tri_middle(s->mesh, s->region.tri[i]));
    if (s->region.n) s->contact = v_scale(sum, 1.0 / s->region.n);
    add_lost(s);
}

/* Where the borders will not be sewn, a wider region's may. */
static bool handle_link(Surgeon *s, const Link *link, int n, const Collision *c)
{
    gather(s, link, n, c);
    for (int k = 0; k < ATTEMPTS && s->region.n; k++) {
        region_grow(&s->region);
        if (!surgeon_prepare(s)) return false;
        if (try_swallow(s) || try_cut(s) || try_weld(s)) return true;
    }
    return false;
}

/* --- patches -------------------------------------------------------------------------------------------------------------- */

/* A disc that met nothing but itself, or lost its surface with no other sheet before it, is no event: a fold, or the skin of a
 * finger that has drawn back. It is erased and its border closed. */
static bool try_patch(Surgeon *s)
{
    const Borders *b = &s->borders;
    Mesh *m = s->mesh;
    region_grow(&s->region);
    if (!surgeon_prepare(s) || b->npiece != 1 || b->n != 1 || s->region.n > PATCH_MOST || border_length(b, 0) < 3) return false;
    Vec3 p = border_centre(m, b, 0);
    if (field_project(s->field, 1, &p, s->rules->edge * PATCH_REACH_EDGES, NULL) != 0) return false;
    mesh_erase(m, &s->region);
    mesh_cap(m, border_length(b, 0), border_halves(b, 0), v_round32(p), mesh_fresh_id(m));
    return true;
}

static void patch_lost(Surgeon *s)
{
    for (int t = 0; t < s->nlost; t++) {
        if (!s->lost[t] || tri_is_dead(s->mesh, t)) continue;
        region_clear(&s->region);
        region_add(&s->region, t);
        add_lost(s);
        for (int i = 0; i < s->region.n; i++) s->lost[s->region.tri[i]] = 0;
        try_patch(s);
    }
}

/* --- a round -------------------------------------------------------------------------------------------------------------- */

static int drop_dead(const Mesh *m, int n, Collision *c)
{
    int kept = 0;
    for (int i = 0; i < n; i++)
        if (!tri_is_dead(m, c[i].a) && !tri_is_dead(m, c[i].b)) c[kept++] = c[i];
    return kept;
}

/* Each piece takes part in one event at most. What a piece has with nothing but itself may be patched. */
static int handle_links(Surgeon *s, int n, Collision *c, bool grown)
{
    Link *link;
    int done = 0, npiece = find_pieces(s, n, c, grown), nlink = find_links(n, c, &link);
    uint8_t *used = NEW0(uint8_t, npiece);
    for (int i = 0; i < nlink; i++) {
        int a = link[i].a, b = link[i].b;
        if (used[a] || used[b]) continue;
        bool handled = handle_link(s, &link[i], n, c);
        done += handled;
        if (!handled && a == b && grown) {
            gather(s, &link[i], n, c);
            handled = s->region.n && try_patch(s);
        }
        if (handled) used[a] = used[b] = 1;
    }
    mem_free(used);
    mem_free(link);
    return done;
}

int events_blend(Mesh *mesh, const RefinedMesh *fine, const Field *field, const EventRules *rules, ChangeList *events)
{
    Collision *collision;
    Surgeon s;
    surgeon_init(&s, mesh, field, rules, events);
    s.nlost = mesh->ntri;
    s.lost = NEW(int8_t, s.nlost);
    lost_find(mesh, field, rules->edge, s.lost);
    int n = find_collisions(&s, fine, &collision), done = handle_links(&s, n, collision, true);
    if (done == 0) { /* in a crumpled sheet all that collides hangs together with its surroundings; taken apart some may be sewn */
        n = drop_dead(mesh, n, collision);
        done = handle_links(&s, n, collision, false);
    }
    patch_lost(&s);
    mem_free(collision);
    surgeon_free(&s);
    return done;
}
