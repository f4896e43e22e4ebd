#include "cli/rejoin.h"

#include <string.h>

#define REACH 1.5 /* in edges */

/* False where the mesh has no rest positions. */
static bool find_columns(const TriMesh *m, float *column[4])
{
    static const char *const name[4] = {"rest_x", "rest_y", "rest_z", "rest_frame"};
    int found = 0;
    for (int k = 0; k < 4; k++)
        for (int a = 0; a < m->nattr; a++)
            if (strcmp(m->attr_name[a], name[k]) == 0) {
                column[k] = m->attr[a];
                found++;
                break;
            }
    return found == 4;
}

static Vec3 place(const TriMesh *m, int v)
{
    const float *p = m->pos + 3 * (size_t)v;
    return vec3((double)p[0], (double)p[1], (double)p[2]);
}

void rejoin_begin(Rejoin *r, TriMesh *mesh, int64_t frames)
{
    *r = (Rejoin){.frames = frames, .mesh = *mesh};
    *mesh = (TriMesh){0};
    const TriMesh *m = &r->mesh;
    if (!find_columns(m, r->rest)) r->rest[0] = NULL;
    r->pos = NEW(Vec3, m->nvert);
    for (int v = 0; v < m->nvert; v++) r->pos[v] = place(m, v);
    double sum = 0;
    for (int h = 0; h < 3 * m->ntri; h++) sum += v_dist(r->pos[m->tri[h]], r->pos[m->tri[h % 3 == 2 ? h - 2 : h + 1]]);
    r->edge = m->ntri ? sum / (3 * m->ntri) : 1;
    nearest_build(&r->index, m->ntri, r->pos, m->tri, REACH * r->edge);
}

/* As rest.c blends: places of different frames do not mix. */
static void blend(const Rejoin *r, const NearestHit *hit, float *const column[4], int v)
{
    const int32_t *c = r->mesh.tri + 3 * hit->tri;
    int heaviest = 0;
    for (int k = 1; k < 3; k++)
        if (hit->w[k] > hit->w[heaviest]) heaviest = k;
    float frame = r->rest[3][c[heaviest]];
    double sum = 0, at[3] = {0};
    for (int k = 0; k < 3; k++) {
        if (r->rest[3][c[k]] != frame) continue;
        for (int a = 0; a < 3; a++) at[a] += hit->w[k] * (double)r->rest[a][c[k]];
        sum += hit->w[k];
    }
    for (int a = 0; a < 3; a++) column[a][v] = (float)(at[a] / sum);
    column[3][v] = frame;
}

void rejoin_apply(const Rejoin *r, TriMesh *m)
{
    float *column[4];
    if (r->plain || !find_columns(m, column)) return;
    for (int v = 0; v < m->nvert; v++) {
        Vec3 p = vec3((double)column[0][v], (double)column[1][v], (double)column[2][v]), up = vec3(0, 0, 1);
        bool is_first = column[3][v] == 0;
        column[3][v] += (float)r->frames;
        if (!is_first || !r->rest[0]) continue; /* at rest later */
        /* The place lies on the surface: its own sheet is nearer than the next, whichever way they look. */
        NearestHit hit = nearest_find(&r->index, p, up), other = nearest_find(&r->index, p, v_scale(up, -1));
        if (hit.tri == NONE || (other.tri != NONE && other.dist2 < hit.dist2)) hit = other;
        if (hit.tri != NONE) blend(r, &hit, column, v);
    }
}

void rejoin_free(Rejoin *r)
{
    nearest_free(&r->index);
    mem_free(r->pos);
    trimesh_free(&r->mesh);
    *r = (Rejoin){0};
}
