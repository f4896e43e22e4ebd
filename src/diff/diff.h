/* diff.h: how two meshes differ.
 *
 * Of one connectivity (the same triangles over the same identities, in the same order), vertex by vertex. Of two, as surfaces:
 * the Hausdorff distance both ways, and the components and Euler characteristics. */
#pragma once
#include "mesh/trimesh.h"

typedef struct DiffSettings {
    double tolerance;      /* between two places, world units */
    double normals_deg;    /* between two normals; 180: any */
    double values;         /* between two velocities' components, or attributes; INFINITY: any, and none */
    bool surface;          /* other triangles and identities are no difference where surfaces are within the tolerance */
} DiffSettings;

/* One side of a pair of surfaces. */
typedef struct DiffSide {
    int vertices, triangles, components, euler;
    double distance, most; /* the farthest of its points is so far from the other side's surface, at least and at most... */
    double at[3];          /* ...and stands here; NaN where one side has no triangles */
} DiffSide;

typedef struct DiffMesh {
    bool same;             /* within all that was asked */
    bool same_run;         /* one connectivity: then these */
    double place, normal_deg, velocity, value; /* the greatest differences; NaN: not both have it */
    int place_vertex;      /* where the greatest is, NONE: none differ */
    bool same_columns;     /* velocities, parents and attributes are there on both sides or on neither, under the same names */
    int parents;           /* triangles with other parents */
    DiffSide side[2];      /* else these; the counts always */
} DiffMesh;

DiffMesh diff_meshes(const DiffSettings *set, const TriMesh *a, const TriMesh *b);
