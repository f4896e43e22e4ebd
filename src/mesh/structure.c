#include "mesh/structure.h"

#include "base/sets.h"

#include <stdlib.h>

/* A triangle's side; a < b. */
typedef struct Side {
    int32_t a, b, half; /* half-edge 3 t + k, as in mesh.h */
} Side;

typedef struct Builder {
    MeshStructure *s;
    int nvert, ntri;
    const Vec3 *pos;
    const int32_t *tri;
    int nside;
    Side *side;         /* [nside] sorted by edge */
    int32_t *first;     /* [nedge + 1] an edge's sides */
    int32_t *part;      /* [ntri] sets of triangles joined by edges */
    int32_t *umbrella;  /* [3*ntri] sets of corners joined around their vertex */
} Builder;

static int compare_sides(const void *pa, const void *pb)
{
    const Side *x = pa, *y = pb;
    if (x->a != y->a) return x->a < y->a ? -1 : 1;
    if (x->b != y->b) return x->b < y->b ? -1 : 1;
    return x->half < y->half ? -1 : x->half > y->half;
}

static int corner_after(int half) { return half % 3 == 2 ? half - 2 : half + 1; }

static void list_sides(Builder *b)
{
    b->side = NEW(Side, 3 * (size_t)b->ntri);
    for (int t = 0; t < b->ntri; t++) {
        const int32_t *v = b->tri + 3 * t;
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
            b->s->repeated_corners++;
            continue;
        }
        for (int k = 0; k < 3; k++) {
            int from = v[k], to = v[(k + 1) % 3];
            b->side[b->nside++] = (Side){int_min(from, to), int_max(from, to), 3 * t + k};
        }
    }
    qsort(b->side, (size_t)b->nside, sizeof *b->side, compare_sides);
}

static void join_umbrellas(Builder *b, const Side *x, const Side *y)
{
    for (int end = 0; end < 2; end++) {
        int v = end ? x->b : x->a;
        int i = b->tri[x->half] == v ? x->half : corner_after(x->half);
        int j = b->tri[y->half] == v ? y->half : corner_after(y->half);
        set_join(b->umbrella, i, j);
    }
}

static void join_edge(Builder *b, const Side *side, int n)
{
    MeshStructure *s = b->s;
    for (int i = 1; i < n; i++) {
        set_join(b->part, side[0].half / 3, side[i].half / 3);
        join_umbrellas(b, &side[0], &side[i]);
    }
    s->boundary_edges += n == 1;
    s->nonmanifold_edges += n > 2;
    s->misoriented_edges += n == 2 && b->tri[side[0].half] == b->tri[side[1].half];
}

static void find_edges(Builder *b)
{
    MeshStructure *s = b->s;
    b->first = NEW(int32_t, (size_t)b->nside + 1);
    s->edge = mem_alloc((size_t)b->nside, sizeof *s->edge);
    s->side_edge = NEW(int32_t, 3 * (size_t)b->ntri);
    for (int h = 0; h < 3 * b->ntri; h++) s->side_edge[h] = NONE;
    for (int i = 0; i < b->nside; i++) {
        const Side *x = &b->side[i];
        if (i == 0 || x[-1].a != x->a || x[-1].b != x->b) {
            s->edge[s->nedge][0] = x->a;
            s->edge[s->nedge][1] = x->b;
            b->first[s->nedge++] = i;
        }
        s->side_edge[x->half] = s->nedge - 1;
    }
    b->first[s->nedge] = b->nside;
}

static void join_edges(Builder *b)
{
    b->part = NEW(int32_t, b->ntri);
    b->umbrella = NEW(int32_t, 3 * (size_t)b->ntri);
    for (int t = 0; t < b->ntri; t++) b->part[t] = t;
    for (int h = 0; h < 3 * b->ntri; h++) b->umbrella[h] = h;
    for (int e = 0; e < b->s->nedge; e++) join_edge(b, b->side + b->first[e], b->first[e + 1] - b->first[e]);
}

static void number_components(Builder *b)
{
    MeshStructure *s = b->s;
    s->tri_comp = NEW(int32_t, b->ntri);
    for (int t = 0; t < b->ntri; t++) { /* a set's root is its least member */
        int root = set_root(b->part, t);
        s->tri_comp[t] = s->side_edge[3 * t] == NONE ? NONE : root == t ? s->ncomp++ : s->tri_comp[root];
    }
    s->comp = NEW(MeshComponent, s->ncomp);
    for (int c = 0; c < s->ncomp; c++)
        s->comp[c] = (MeshComponent){
            .closed = true, .lo = {INFINITY, INFINITY, INFINITY}, .hi = {-INFINITY, -INFINITY, -INFINITY}};
}

static void measure_box(Builder *b)
{
    for (int h = 0; h < 3 * b->ntri; h++) {
        if (b->s->tri_comp[h / 3] == NONE) continue;
        MeshComponent *c = &b->s->comp[b->s->tri_comp[h / 3]];
        Vec3 p = b->pos[b->tri[h]];
        c->lo = vec3(real_min(c->lo.x, p.x), real_min(c->lo.y, p.y), real_min(c->lo.z, p.z));
        c->hi = vec3(real_max(c->hi.x, p.x), real_max(c->hi.y, p.y), real_max(c->hi.z, p.z));
    }
}

static void count_parts(Builder *b)
{
    MeshStructure *s = b->s;
    int32_t *umbrellas = NEW0(int32_t, b->nvert);
    for (int t = 0; t < b->ntri; t++) {
        if (s->tri_comp[t] == NONE) continue;
        MeshComponent *c = &s->comp[s->tri_comp[t]];
        const int32_t *v = b->tri + 3 * t;
        Vec3 p[3];
        for (int k = 0; k < 3; k++) p[k] = v_sub(b->pos[v[k]], c->lo);
        c->triangles++;
        c->volume += v_dot(p[0], v_cross(p[1], p[2])) / 6;
        for (int k = 0; k < 3; k++) {
            if (set_root(b->umbrella, 3 * t + k) != 3 * t + k) continue;
            c->vertices++;
            umbrellas[v[k]]++;
        }
    }
    for (int e = 0; e < s->nedge; e++) {
        MeshComponent *c = &s->comp[s->tri_comp[b->side[b->first[e]].half / 3]];
        c->edges++;
        if (b->first[e + 1] - b->first[e] != 2) c->closed = false;
    }
    for (int v = 0; v < b->nvert; v++) s->nonmanifold_vertices += umbrellas[v] > 1;
    mem_free(umbrellas);
}

static void count_unreferenced(Builder *b)
{
    uint8_t *seen = NEW0(uint8_t, b->nvert);
    for (int h = 0; h < 3 * b->ntri; h++) seen[b->tri[h]] = 1;
    for (int v = 0; v < b->nvert; v++) b->s->unreferenced += !seen[v];
    mem_free(seen);
}

typedef struct Triple {
    int32_t v[3];
} Triple;

static int compare_triples(const void *pa, const void *pb)
{
    const Triple *x = pa, *y = pb;
    for (int k = 0; k < 3; k++)
        if (x->v[k] != y->v[k]) return x->v[k] < y->v[k] ? -1 : 1;
    return 0;
}

static void count_duplicates(Builder *b)
{
    Triple *list = NEW(Triple, b->ntri);
    int n = 0;
    for (int t = 0; t < b->ntri; t++) {
        const int32_t *v = b->tri + 3 * t;
        int lo = int_min(v[0], int_min(v[1], v[2])), hi = int_max(v[0], int_max(v[1], v[2]));
        if (b->s->tri_comp[t] != NONE) list[n++] = (Triple){{lo, v[0] ^ v[1] ^ v[2] ^ lo ^ hi, hi}};
    }
    qsort(list, (size_t)n, sizeof *list, compare_triples);
    for (int i = 1; i < n; i++) b->s->duplicates += compare_triples(&list[i - 1], &list[i]) == 0;
    mem_free(list);
}

void structure_build(MeshStructure *s, int nvert, const Vec3 *pos, int ntri, const int32_t *tri)
{
    *s = (MeshStructure){0};
    Builder b = {.s = s, .nvert = nvert, .ntri = ntri, .pos = pos, .tri = tri};
    list_sides(&b);
    find_edges(&b);
    join_edges(&b);
    number_components(&b);
    measure_box(&b);
    count_parts(&b);
    count_unreferenced(&b);
    count_duplicates(&b);
    mem_free(b.side);
    mem_free(b.first);
    mem_free(b.part);
    mem_free(b.umbrella);
}

void structure_free(MeshStructure *s)
{
    mem_free(s->edge);
    mem_free(s->side_edge);
    mem_free(s->comp);
    mem_free(s->tri_comp);
    *s = (MeshStructure){0};
}

int structure_euler(const MeshStructure *s)
{
    int sum = 0;
    for (int c = 0; c < s->ncomp; c++) sum += component_euler(&s->comp[c]);
    return sum;
}

double structure_volume(const MeshStructure *s)
{
    double sum = 0;
    for (int c = 0; c < s->ncomp; c++) sum += s->comp[c].volume;
    return sum;
}
