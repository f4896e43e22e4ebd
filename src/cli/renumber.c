#include "cli/renumber.h"

#include <stdlib.h>

static int32_t identity_of(Renumber *r, int32_t id)
{
    int fresh = r->next, to = map_put(&r->identity, (uint64_t)id, fresh);
    if (to == fresh && r->next < INT32_MAX) r->next++;
    return to;
}

/* --- components ------------------------------------------------------------------------------------ */

/* The numbers of the components of the frame: the least identity in each, in the chunk and in the sequence. `was`: [nvert] the
 * chunk's identities of the mechanical mesh. */
static void map_numbers(const TriMesh *mech, const int32_t *was, Map *number)
{
    int32_t *comp = NEW(int32_t, mech->nvert);
    int n = trimesh_components(mech, comp);
    int32_t *from = NEW(int32_t, n), *to = NEW(int32_t, n);
    for (int c = 0; c < n; c++) from[c] = to[c] = INT32_MAX;
    for (int v = 0; v < mech->nvert; v++) {
        from[comp[v]] = int_min(from[comp[v]], was[v]);
        to[comp[v]] = int_min(to[comp[v]], mech->id[v]);
    }
    map_init(number, n);
    for (int c = 0; c < n; c++) map_put(number, (uint64_t)from[c], to[c]);
    mem_free(comp);
    mem_free(from);
    mem_free(to);
}

/* Components that are not in the mesh lie behind an open border. */
static void renumber_list(Renumber *r, const Map *number, int n, int32_t *list)
{
    for (int i = 0; i < n; i++) {
        int to = map_get(number, (uint64_t)list[i]);
        list[i] = to != NONE ? to : identity_of(r, list[i]);
    }
}

/* --- events ---------------------------------------------------------------------------------------- */

static int compare_numbers(const void *pa, const void *pb)
{
    int32_t a = *(const int32_t *)pa, b = *(const int32_t *)pb;
    return (a > b) - (a < b);
}

static int compare_pairs(const void *pa, const void *pb)
{
    int first = compare_numbers(pa, pb);
    return first ? first : compare_numbers((const int32_t *)pa + 1, (const int32_t *)pb + 1);
}

static void sort_numbers(int n, int32_t *list)
{
    if (n) qsort(list, (size_t)n, sizeof *list, compare_numbers);
}

typedef struct Rank {
    int kind, number, place;
    FrameEvent event;
} Rank;

static int compare_ranks(const void *pa, const void *pb)
{
    const Rank *a = pa, *b = pb;
    if (a->kind != b->kind) return a->kind < b->kind ? -1 : 1;
    if (a->number != b->number) return a->number < b->number ? -1 : 1;
    return a->place - b->place;
}

/* By kind, then by number, as event.c tells them. */
static void sort_events(FrameEvents *e)
{
    Rank *rank = NEW(Rank, e->nevent);
    for (int i = 0; i < e->nevent; i++) {
        const FrameEvent *v = &e->event[i];
        bool by_after = v->kind == EVENT_BLEND || v->kind == EVENT_BIRTH || v->kind == EVENT_MEND;
        int at = (by_after && v->nafter) || !v->nbefore ? v->after : v->before;
        rank[i] = (Rank){(int)v->kind, e->number[at], i, *v};
    }
    if (e->nevent) qsort(rank, (size_t)e->nevent, sizeof *rank, compare_ranks);
    for (int i = 0; i < e->nevent; i++) e->event[i] = rank[i].event;
    mem_free(rank);
}

static void renumber_events(Renumber *r, const Map *after, FrameEvents *e)
{
    renumber_list(r, &r->number, e->nbefore, e->before);
    renumber_list(r, after, e->nafter, e->after);
    sort_numbers(e->nbefore, e->before);
    sort_numbers(e->nafter, e->after);
    for (int i = 0; i < e->nlink; i++) {
        renumber_list(r, &r->number, 1, &e->link[i][0]);
        renumber_list(r, after, 1, &e->link[i][1]);
    }
    if (e->nlink) qsort(e->link, (size_t)e->nlink, sizeof *e->link, compare_pairs);
    for (int i = 0; i < e->nevent; i++) {
        const FrameEvent *v = &e->event[i];
        renumber_list(r, &r->number, v->nbefore, e->number + v->before);
        renumber_list(r, after, v->nafter, e->number + v->after);
        sort_numbers(v->nbefore, e->number + v->before);
        sort_numbers(v->nafter, e->number + v->after);
    }
    sort_events(e);
}

/* --- a frame --------------------------------------------------------------------------------------- */

static void note_used(Renumber *r, const TriMesh *m)
{
    for (int v = 0; v < m->nvert; v++)
        if (m->id[v] >= r->next) r->next = m->id[v] == INT32_MAX ? INT32_MAX : m->id[v] + 1;
}

static void renumber_meshes(Renumber *r, OutFrame *f, TriMesh *mesh)
{
    TriMesh *mech = &mesh[KIND_MECHANICAL];
    int32_t *was = mech->id;
    Map after;
    mech->id = NEW(int32_t, mech->nvert);
    for (int v = 0; v < mech->nvert; v++) mech->id[v] = identity_of(r, was[v]);
    for (int v = 0; v < mesh[KIND_GEOMETRIC].nvert; v++) mesh[KIND_GEOMETRIC].id[v] = identity_of(r, mesh[KIND_GEOMETRIC].id[v]);
    map_numbers(mech, was, &after);
    renumber_events(r, &after, &f->events);
    map_free(&r->number);
    r->number = after;
    mem_free(was);
}

bool renumber_frame(Renumber *r, OutFrame *f, TriMesh *mesh, Err *err)
{
    if (!r->plain) renumber_meshes(r, f, mesh);
    for (int kind = 0; kind < KIND_COUNT && r->plain; kind++) note_used(r, &mesh[kind]);
    return r->next < INT32_MAX || fail(err, ERR_RESOURCE, "frame %s: there are no more identities for vertices; stitch fewer frames", f->label);
}

void renumber_free(Renumber *r)
{
    map_free(&r->identity);
    map_free(&r->number);
    *r = (Renumber){0};
}
