/* speck.c: the mesh of a component too small for the samples to say more than where it is and how large.
 *
 * Marching cubes gives it a dozen slivers. A regular solid of the same mean radius about the same place says as much,
 * with sound triangles: whichever of two tetrahedra and an octahedron has the fewest faces that the field calls inverted. */
#include "topology/speck.h"

/* Radii tried, in voxels, until no face counts as inverted: that is tested a tenth of a voxel to either side, so that on
 * anything smaller it is the field's asymmetry that is measured, not the mesh. */
static const double RADIUS_LEAST_VOX[] = {0.03, 0.1, 0.15, 0.2, 0.25};
enum { RADII = sizeof RADIUS_LEAST_VOX / sizeof *RADIUS_LEAST_VOX, SOLIDS = 3 };

typedef struct Solid {
    int nvert, ntri;
    double corner[6][3]; /* unit length */
    uint8_t tri[8][3];   /* counter-clockwise from outside */
} Solid;

#define T 0.5773502691896258
static const Solid SOLID[SOLIDS] = {
    {4, 4, {{T, T, T}, {T, -T, -T}, {-T, T, -T}, {-T, -T, T}}, {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}},
    {4, 4, {{-T, -T, -T}, {-T, T, T}, {T, -T, T}, {T, T, -T}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}},
    {6, 8, {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
     {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}},
};

/* The mean of a component's crossings and their mean distance from it, index space. */
typedef struct Spot {
    Vec3 centre;
    double radius;
} Spot;

static void find_spots(const IsoSurface *iso, const uint8_t *want, Spot *spot)
{
    int32_t *count = NEW0(int32_t, iso->ncomp);
    for (int k = 0; k < iso->ncomp; k++) spot[k] = (Spot){{0, 0, 0}, 0};
    for (int e = 0; e < iso->nedge; e++) {
        int k = iso->edge_comp[e];
        if (!want[k]) continue;
        spot[k].centre = v_add(spot[k].centre, iso->edge_pos[e]);
        count[k]++;
    }
    for (int k = 0; k < iso->ncomp; k++)
        if (count[k]) spot[k].centre = v_scale(spot[k].centre, 1.0 / count[k]);
    for (int e = 0; e < iso->nedge; e++) {
        int k = iso->edge_comp[e];
        if (want[k]) spot[k].radius += v_dist(iso->edge_pos[e], spot[k].centre) / count[k];
    }
    mem_free(count);
}

static void place(const IsoSurface *iso, const Spot *spot, const Solid *s, double least, Vec3 out[6])
{
    double radius = real_max(spot->radius, least);
    for (int v = 0; v < s->nvert; v++)
        out[v] = affine_to_world(&iso->field->xform, v_axpy(spot->centre, radius, vec3(s->corner[v][0], s->corner[v][1], s->corner[v][2])));
}

/* A cavity faces inwards; a mirrored transform turns once more. */
static void orient(const IsoSurface *iso, int comp, const Solid *s, int32_t tri[24])
{
    bool turn = (iso->comp_volume[comp] < 0) != iso->field->mirrored;
    for (int t = 0; t < s->ntri; t++)
        for (int k = 0; k < 3; k++) tri[3 * t + k] = s->tri[t][turn ? 2 - k : k];
}

static void append_speck(const IsoSurface *iso, int comp, const Spot *spot, Mesh *mesh)
{
    int best = 0, least = 99;
    Vec3 pos[6];
    int32_t tri[24];
    for (int i = 0; i < SOLIDS * RADII && least; i++) {
        const Solid *s = &SOLID[i % SOLIDS];
        int bad = 0;
        place(iso, spot, s, RADIUS_LEAST_VOX[i / SOLIDS], pos);
        orient(iso, comp, s, tri);
        for (int t = 0; t < s->ntri; t++) bad += field_triangle_inverted(iso->field, pos[tri[3 * t]], pos[tri[3 * t + 1]], pos[tri[3 * t + 2]]);
        if (bad < least) least = bad, best = i;
    }
    const Solid *s = &SOLID[best % SOLIDS];
    place(iso, spot, s, RADIUS_LEAST_VOX[best / SOLIDS], pos);
    orient(iso, comp, s, tri);
    mesh_append(mesh, s->nvert, pos, NULL, s->ntri, tri);
}

bool speck_is(const IsoSurface *iso, int comp)
{
    Vec3 d = v_sub(iso->comp_box[comp][1], iso->comp_box[comp][0]);
    return iso->comp_euler[comp] == 2 && d.x < SPECK_VOX && d.y < SPECK_VOX && d.z < SPECK_VOX;
}

void speck_append(const IsoSurface *iso, const uint8_t *want, Mesh *mesh)
{
    Spot *spot = NEW(Spot, iso->ncomp);
    find_spots(iso, want, spot);
    for (int k = 0; k < iso->ncomp; k++)
        if (want[k]) append_speck(iso, k, &spot[k], mesh);
    mem_free(spot);
}
