/* alter.c: GI'07 2.5, and the splitting of triangles that are told. */
#include "remesh/remesh_priv.h"

#define DROPLET_VERTICES 40   /* components of fewer vertices keep theirs; their edges collapse only */
#define DROPLET_COLLAPSE 0.35 /* below this share of e_min e-hat, */
#define SPECK_VERTICES 24     /* and with fewer than this not at all */

/* --- the paper's alteration -------------------------------------------------------------------------------------- */

/* This step's changes become next step's locks. */
static void age_flags(Mesh *m)
{
    for (int h = 0; h < 3 * m->ntri; h++) m->flag[h] = m->flag[h] & EDGE_FLAGGED ? EDGE_LOCKED : 0;
}

static bool is_inverted(const Remesh *r, int t)
{
    const int32_t *c = r->mesh->corner + 3 * t;
    return field_triangle_inverted(r->field, r->mesh->pos[c[0]], r->mesh->pos[c[1]], r->mesh->pos[c[2]]);
}

static double change_of(const Mesh *m, int h, double length) { return m->length[h] < 0 ? 0 : length - (double)m->length[h]; }

/* Edges that this step's edits, or the last one's, made are let alone, and those that are on their way back. */
static bool may_split(const Mesh *m, int h, double length, const void *ctx)
{
    const AlterRules *rules = ctx;
    return !m->flag[h] && change_of(m, h, length) > -rules->eps * rules->rest;
}

static bool may_collapse(const Mesh *m, int h, double length, const void *ctx)
{
    const AlterRules *rules = ctx;
    return !m->flag[h] && change_of(m, h, length) < rules->eps * rules->rest;
}

static int alter_split(Remesh *r, const AlterRules *rules)
{
    Mesh *m = r->mesh;
    EdgeEnds *edge;
    int n = remesh_edges_by_length(r, &(EdgeChoice){rules->e_max * rules->rest, 1e300, may_split, rules}, true, &edge), splits = 0;
    for (int i = 0; i < n; i++) {
        int h = remesh_find_edge(m, &edge[i]);
        if (m->flag[h]) continue;
        if (is_inverted(r, h / 3) || is_inverted(r, m->opp[h] / 3)) continue; /* 2.6.1: would make more of them */
        remesh_split(r, h);
        splits++;
    }
    mem_free(edge);
    return splits;
}

/* Vertices of v's component, but counted no further than DROPLET_VERTICES. seen[nvert]: those of it that have this mark, which is of this
 * count alone. */
static int count_vertices(const Mesh *m, int v, int32_t *seen, int32_t mark)
{
    int32_t found[DROPLET_VERTICES] = {v};
    int n = 1;
    seen[v] = mark;
    for (int i = 0; i < n; i++) {
        int h = m->out[found[i]];
        do {
            int w = he_to(m, h);
            if (seen[w] == mark) continue;
            if (n == DROPLET_VERTICES) return n;
            seen[w] = mark;
            found[n++] = w;
        } while ((h = he_around(m, h)) != m->out[found[i]]);
    }
    return n;
}

/* From the middle of the edge that was collapsed; another sheet's surface is not believed. */
static void land_merged(Remesh *r, int v)
{
    Vec3 p = r->mesh->pos[v], n;
    if (!remesh_land_point(r, v, &p, 0.5 * r->edge, &n) || v_dot(n, r->normal[v]) <= 0) return;
    r->mesh->pos[v] = p;
    r->normal[v] = n;
}

static int alter_collapse(Remesh *r, const AlterRules *rules)
{
    Mesh *m = r->mesh;
    EdgeEnds *edge;
    int n = remesh_edges_by_length(r, &(EdgeChoice){-1, rules->e_min * rules->rest, may_collapse, rules}, false, &edge), collapses = 0;
    int32_t *seen = NEW0(int32_t, n ? m->nvert : 0);
    for (int i = 0; i < n; i++) {
        int h = remesh_find_edge(m, &edge[i]);
        if (h == NONE || m->flag[h]) continue;
        int size = count_vertices(m, he_from(m, h), seen, i + 1);
        if (size < SPECK_VERTICES || (size < DROPLET_VERTICES && edge[i].length >= DROPLET_COLLAPSE * rules->e_min * rules->rest)) continue;
        int a = he_from(m, h), b = he_to(m, h);
        if (!remesh_try_collapse(r, h, &LIMITS_EDIT)) continue;
        land_merged(r, vert_is_dead(m, a) ? b : a);
        collapses++;
    }
    mem_free(edge);
    mem_free(seen);
    return collapses;
}

RemeshStat remesh_alter(Remesh *r, const AlterRules *rules)
{
    RemeshStat stat = {0};
    age_flags(r->mesh);
    stat.splits = alter_split(r, rules);
    stat.collapses = alter_collapse(r, rules);
    return stat;
}

/* --- refining ---------------------------------------------------------------------------------------------------- */

int remesh_split_marked(Remesh *r, const uint8_t *mark, double least)
{
    Mesh *m = r->mesh;
    EdgeEnds *edge = NULL;
    int n = 0, cap = 0, ntri = m->ntri, splits = 0;
    for (int t = 0; t < ntri; t++) {
        if (!mark[t]) continue;
        int h = 3 * t;
        for (int k = h + 1; k < 3 * t + 3; k++)
            if (mesh_edge_length(m, k) > mesh_edge_length(m, h)) h = k;
        RESERVE(edge, cap, n + 1);
        edge[n++] = (EdgeEnds){mesh_edge_length(m, h), h, he_from(m, h), he_to(m, h)};
    }
    for (int i = 0; i < n; i++) { /* one that was split for another triangle is gone */
        int h = edge[i].length > least ? remesh_find_edge(m, &edge[i]) : NONE;
        if (h == NONE) continue;
        remesh_split(r, h);
        splits++;
    }
    mem_free(edge);
    return splits;
}
