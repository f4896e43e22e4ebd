/* crowd.c: a triangle against a few hundred. */
#include "mesh/facet.h"

void crowd_clear(Crowd *c) { c->n = 0; }

void crowd_free(Crowd *c)
{
    mem_free(c->facet);
    mem_free(c->name);
    mem_free(c->row);
    *c = (Crowd){0};
}

void crowd_add(Crowd *c, const Facet *f, const Box32 *b, int name)
{
    if (c->n == c->cap) {
        c->cap = int_max(4 * BOX_ROW, 2 * c->cap);
        RESIZE(c->facet, c->cap);
        RESIZE(c->name, c->cap);
        RESIZE(c->row, c->cap / BOX_ROW);
    }
    BoxRow *row = &c->row[c->n / BOX_ROW];
    for (int k = 0; c->n % BOX_ROW == 0 && k < BOX_ROW; k++) boxrow_set(row, k, box32_none());
    boxrow_set(row, c->n % BOX_ROW, *b);
    c->facet[c->n] = *f;
    c->name[c->n++] = name;
}

int crowd_count(const Crowd *c, const Facet *f, const Box32 *b, const uint8_t *without, int most)
{
    int count = 0;
    for (int first = 0; first < c->n; first += BOX_ROW) {
        for (unsigned hits = boxrow_test(&c->row[first / BOX_ROW], b); hits;) {
            int k = bits_next(&hits);
            if (without && without[c->name[first + k]]) continue;
            count += facets_intersect(f, &c->facet[first + k]);
            if (count >= most) return count;
        }
    }
    return count;
}
