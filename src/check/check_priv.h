/* check_priv.h: shared inside the module. */
#pragma once
#include "check/check.h"
#include "mesh/closest.h"
#include "mesh/structure.h"
#include "topology/iso.h"

/* Numbers with weights; a weight of 0 counts for the extremes alone. */
typedef struct Weighed {
    double value, weight;
} Weighed;

typedef struct Spread {
    int n, cap;
    Weighed *item;        /* [n] */
} Spread;

void spread_add(Spread *s, double value, double weight);
/* Before quantiles are asked for. */
void spread_sort(Spread *s);
/* NaN where nothing has a weight. */
double spread_mean(const Spread *s);
/* The least value that at least the share q of the weight does not pass. NaN, here and below, without values. */
double spread_quantile(const Spread *s, double q);
/* Of all values, those without weight too. */
double spread_most(const Spread *s);
void spread_free(Spread *s);

/* A mesh made ready: positions as doubles, triangles of three different vertices, their structure. */
typedef struct Ready {
    const TriMesh *mesh;
    Vec3 *pos;            /* [mesh->nvert] */
    int ntri;
    int32_t *tri;         /* [3*ntri] */
    MeshStructure s;
} Ready;

static inline Vec3 place_of(const float *column, int v)
{
    const float *p = column + 3 * (size_t)v;
    return vec3((double)p[0], (double)p[1], (double)p[2]);
}

struct CheckSurface {
    const Field *field;
    IsoSurface iso;
    IsoTriangles tri;     /* its triangles, world units */
    ClosestIndex index;   /* of them */
};

/* How far a point lies within the active bounding box, voxels; below 0: in the shell around it. */
double depth_of(const Field *f, Vec3 p);

void measure_distances(const CheckSurface *surface, const Ready *r, CheckRow *row);
void measure_quality(const CheckSettings *set, const Field *f, const Ready *r, CheckRow *row);
void measure_normals(const Field *f, const Ready *r, CheckRow *row);

/* --- foot.c --------------------------------------------------------------------------------------- */

#define FOOT_NEAR_VOX 0.05 /* a vertex farther off is off the surface; nearer, the first way down is trusted */
#define FOOT_SEEK_VOX 0.5  /* how far the reference's triangles may be from the surface */

/* From a point to the nearest of the surface, voxels. */
double foot_distance_vox(const CheckSurface *s, Vec3 p);
