#include "mesh/surgery.h"

#include "base/hash.h"
#include "mesh/mesh_priv.h"

#include <string.h>

/* --- regions ------------------------------------------------------------------------------------------------------------- */

void region_init(Region *r, const Mesh *m) { *r = (Region){.mesh = m}; }

void region_free(Region *r)
{
    mem_free(r->tri);
    mem_free(r->in);
    *r = (Region){0};
}

void region_clear(Region *r)
{
    for (int i = 0; i < r->n; i++) r->in[r->tri[i]] = 0;
    r->n = 0;
}

bool region_has(const Region *r, int t) { return t < r->capin && r->in[t] && !tri_is_dead(r->mesh, t); }

void region_add(Region *r, int t)
{
    if (region_has(r, t)) return;
    if (t >= r->capin) {
        int from = r->capin;
        RESERVE(r->in, r->capin, r->mesh->ntri);
        memset(r->in + from, 0, (size_t)(r->capin - from));
    }
    RESERVE(r->tri, r->cap, r->n + 1);
    r->tri[r->n++] = t;
    r->in[t] = 1;
}

static void add_umbrella(Region *r, int v)
{
    int h = r->mesh->out[v];
    do region_add(r, h / 3);
    while ((h = he_around(r->mesh, h)) != r->mesh->out[v]);
}

void region_grow(Region *r)
{
    for (int i = 0, n = r->n; i < n; i++) {
        int t = r->tri[i];
        for (int k = 0; k < 3 && !tri_is_dead(r->mesh, t); k++) add_umbrella(r, r->mesh->corner[3 * t + k]);
    }
}

/* Stretches of triangles outside the region in the umbrella of v. */
static int count_gaps(const Region *r, int v)
{
    int gaps = 0, h = r->mesh->out[v];
    do {
        int next = he_around(r->mesh, h);
        gaps += region_has(r, h / 3) && !region_has(r, next / 3);
        h = next;
    } while (h != r->mesh->out[v]);
    return gaps;
}

bool region_unpinch(Region *r, int most)
{
    for (int i = 0; i < r->n; i++) { /* what is added is looked at in its turn, and what it changes lies around it */
        int t = r->tri[i];
        for (int k = 0; k < 3 && !tri_is_dead(r->mesh, t); k++) {
            int v = r->mesh->corner[3 * t + k];
            if (count_gaps(r, v) < 2) continue;
            add_umbrella(r, v);
            i = -1;
            break;
        }
        if (r->n > most) return false;
    }
    return true;
}

/* --- borders ------------------------------------------------------------------------------------------------------------- */

void borders_free(Borders *b)
{
    mem_free(b->start);
    mem_free(b->half);
    mem_free(b->piece);
    *b = (Borders){0};
}

static bool is_border(const Region *r, int h) { return !region_has(r, h / 3) && region_has(r, r->mesh->opp[h] / 3); }

/* The border's half-edge after h: around h's end through what is kept. */
static int next_on_border(const Region *r, int h)
{
    h = he_next(h);
    while (!is_border(r, h)) h = he_next(r->mesh->opp[h]);
    return h;
}

static void walk_border(const Region *r, Borders *b, int first, int piece, Map *seen)
{
    int n = b->start[b->n], h = first;
    do {
        RESERVE(b->half, b->caphalf, n + 1);
        b->half[n++] = h;
        map_put(seen, (uint64_t)h, 0);
        h = next_on_border(r, h);
    } while (h != first);
    if (b->n + 2 > b->capstart) {
        b->capstart = 2 * (b->n + 2);
        RESIZE(b->start, b->capstart);
        RESIZE(b->piece, b->capstart);
    }
    b->piece[b->n++] = piece;
    b->start[b->n] = n;
}

int region_pieces(const Region *r, int32_t *piece)
{
    int32_t *stack = NEW(int32_t, r->n);
    int npiece = 0;
    for (int i = 0; i < r->n; i++) piece[r->tri[i]] = NONE;
    for (int i = 0; i < r->n; i++) {
        if (tri_is_dead(r->mesh, r->tri[i]) || piece[r->tri[i]] != NONE) continue;
        int depth = 0;
        stack[depth++] = r->tri[i];
        piece[r->tri[i]] = npiece;
        while (depth) {
            int t = stack[--depth];
            for (int k = 0; k < 3; k++) {
                int u = r->mesh->opp[3 * t + k] / 3;
                if (!region_has(r, u) || piece[u] != NONE) continue;
                piece[u] = npiece;
                stack[depth++] = u;
            }
        }
        npiece++;
    }
    mem_free(stack);
    return npiece;
}

static void reset_borders(Borders *b)
{
    if (b->capstart == 0) {
        b->capstart = 8;
        RESIZE(b->start, b->capstart);
        RESIZE(b->piece, b->capstart);
    }
    b->n = b->start[0] = 0;
}

void region_borders(const Region *r, Borders *b)
{
    Map seen;
    int32_t *piece = NEW(int32_t, r->mesh->ntri);
    map_init(&seen, r->n);
    reset_borders(b);
    b->npiece = region_pieces(r, piece);
    for (int i = 0; i < r->n; i++) {
        int t = r->tri[i];
        if (tri_is_dead(r->mesh, t)) continue;
        for (int k = 0; k < 3; k++) {
            int h = r->mesh->opp[3 * t + k];
            if (is_border(r, h) && map_get(&seen, (uint64_t)h) == NONE) walk_border(r, b, h, piece[t], &seen);
        }
    }
    map_free(&seen);
    mem_free(piece);
}

Vec3 border_centre(const Mesh *m, const Borders *b, int loop)
{
    Vec3 sum = {0, 0, 0};
    for (int i = b->start[loop]; i < b->start[loop + 1]; i++) sum = v_add(sum, m->pos[he_from(m, b->half[i])]);
    return v_scale(sum, 1.0 / border_length(b, loop));
}

/* --- islands ------------------------------------------------------------------------------------------------------------- */

/* What is kept beside half-edge h, as far as it is connected. False: that is more than `most` triangles. */
static bool flood_island(const Region *r, int h, int most, Region *island)
{
    region_clear(island);
    region_add(island, h / 3);
    for (int i = 0; i < island->n; i++)
        for (int k = 0; k < 3; k++) {
            int u = r->mesh->opp[3 * island->tri[i] + k] / 3;
            if (!region_has(r, u)) region_add(island, u);
            if (island->n > most) return false;
        }
    return true;
}

/* Of the borders of its piece; of several, the first. */
static bool is_longest(const Borders *b, int loop)
{
    int length = border_length(b, loop);
    for (int i = 0; i < b->n; i++)
        if (b->piece[i] == b->piece[loop] && border_length(b, i) >= length + (i > loop)) return i == loop;
    return true;
}

void region_fill_islands(Region *r, int most)
{
    Borders b = {0};
    Region island;
    region_init(&island, r->mesh);
    region_borders(r, &b);
    for (int i = 0; i < b.n; i++) {
        if (is_longest(&b, i) || !flood_island(r, border_halves(&b, i)[0], most, &island)) continue;
        for (int k = 0; k < island.n; k++) region_add(r, island.tri[k]);
    }
    region_free(&island);
    borders_free(&b);
}

/* --- surgery ------------------------------------------------------------------------------------------------------------- */

static void link_pair(Mesh *m, int h, int g)
{
    m->opp[h] = g;
    m->opp[g] = h;
    m->length[h] = m->length[g] = -1;
    m->flag[h] |= EDGE_FLAGGED;
    m->flag[g] |= EDGE_FLAGGED;
}

static void kill_vert(Mesh *m, int v)
{
    m->out[v] = NONE;
    m->deadvert++;
}

int mesh_erase(Mesh *m, const Region *r)
{
    int killed = 0;
    for (int i = 0; i < r->n; i++) /* first everyone's way out, while the corners still stand */
        for (int k = 0; k < 3; k++) {
            int h = 3 * r->tri[i] + k, v = tri_is_dead(m, r->tri[i]) ? NONE : m->corner[h];
            if (v == NONE || vert_is_dead(m, v) || !region_has(r, m->out[v] / 3)) continue;
            int g = h;
            do g = he_around(m, g);
            while (g != h && region_has(r, g / 3));
            if (g != h) m->out[v] = g;
            else kill_vert(m, v), killed++;
        }
    for (int i = 0; i < r->n; i++) {
        int t = r->tri[i];
        if (tri_is_dead(m, t)) continue;
        for (int k = 0; k < 3; k++)
            if (m->opp[3 * t + k] != NONE && !region_has(r, m->opp[3 * t + k] / 3)) m->opp[m->opp[3 * t + k]] = NONE;
    }
    for (int i = 0; i < r->n; i++) {
        int t = r->tri[i];
        if (tri_is_dead(m, t)) continue;
        for (int k = 0; k < 3; k++) m->corner[3 * t + k] = NONE;
        m->deadtri++;
    }
    return killed;
}

int mesh_cap(Mesh *m, int n, const int32_t *border, Vec3 p, int32_t id)
{
    ASSERT(n >= 3);
    int c = mesh_add_vert(m, p, id), first = m->ntri;
    for (int i = 0; i < n; i++) {
        int from = he_from(m, border[i]), to = he_to(m, border[i]);
        int t = mesh_add_tri(m, to, from, c);
        link_pair(m, 3 * t, border[i]);
    }
    for (int i = 0; i < n; i++) /* the next half-edge starts where this one ends: edge (to, c) is its (c, to) */
        link_pair(m, 3 * (first + i) + 2, 3 * (first + (i + 1) % n) + 1);
    m->out[c] = 3 * first + 2;
    return c;
}

enum { FAN_MOST = 64 };

/* The vertices around the start of half-edge `leave`, from its end to the start of `enter`, through what is kept. Returns how
 * many, or NONE: too many. */
static int list_fan(const Mesh *m, int leave, int enter, int32_t *ring)
{
    int n = 0, h = leave;
    ring[n++] = he_to(m, h);
    for (;;) {
        int in = he_prev(h);
        if (n == FAN_MOST) return NONE;
        ring[n++] = he_from(m, in);
        if (in == enter) return n;
        h = m->opp[in];
    }
}

/* Around the vertex that a[i] starts from and b[i] ends at once they are one. */
static bool ring_is_sound(const Mesh *m, int n, const int32_t *a, const int32_t *b, int i, const Map *onto)
{
    int last = (i + n - 1) % n, x = he_from(m, a[i]);
    int32_t ring[2 * FAN_MOST];
    int na = list_fan(m, a[i], a[last], ring);
    if (na == NONE) return false;
    int nb = list_fan(m, b[last], b[i], ring + na);
    if (nb == NONE) return false;
    int all = na + nb - 2; /* the two ends of b's fan are those of a's */
    for (int j = na; j < na + nb; j++) {
        int to = map_get(onto, (uint64_t)ring[j]);
        if (to != NONE) ring[j] = to;
    }
    for (int j = na; j < all; j++) ring[j] = ring[j + 1];
    if (all < 3) return false;
    for (int j = 0; j < all; j++) {
        if (ring[j] == x) return false;
        for (int k = j + 1; k < all; k++)
            if (ring[j] == ring[k]) return false;
    }
    return true;
}

bool mesh_can_weld(const Mesh *m, int n, const int32_t *a, const int32_t *b)
{
    Map onto;
    bool sound = n >= 3;
    map_init(&onto, n);
    for (int i = 0; i < n; i++) map_put(&onto, (uint64_t)he_to(m, b[i]), he_from(m, a[i]));
    for (int i = 0; i < n && sound; i++) sound = map_get(&onto, (uint64_t)he_from(m, a[i])) == NONE;
    for (int i = 0; i < n && sound; i++) sound = ring_is_sound(m, n, a, b, i, &onto);
    map_free(&onto);
    return sound;
}

void mesh_weld(Mesh *m, int n, const int32_t *a, const int32_t *b)
{
    for (int i = 0; i < n; i++) {
        int x = he_from(m, a[i]), y = he_to(m, b[i]), h = he_next(b[i]);
        for (;;) {
            m->corner[h] = x;
            if (m->opp[h] == NONE) break;
            h = he_next(m->opp[h]);
        }
        kill_vert(m, y);
        m->out[x] = a[i];
    }
    for (int i = 0; i < n; i++) link_pair(m, a[i], b[i]);
}
