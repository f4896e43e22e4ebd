/* structure.h: what an indexed triangle mesh of any kind is: closed, manifold, oriented or not, and its components.
 *
 * Nothing is taken for granted but that the indices are in range. Triangles that name a vertex twice are counted and left
 * out. A component is what hangs together by edges; a vertex where several umbrellas meet counts once for each of them,
 * so that the Euler characteristic is that of the surface with such vertices cut apart. */
#pragma once
#include "base/base.h"
#include "base/vec.h"

typedef struct MeshComponent {
    int vertices, edges, triangles;
    bool closed;           /* two triangles at every edge */
    double volume;         /* positive: its triangles look outward */
    Vec3 lo, hi;
} MeshComponent;

typedef struct MeshStructure {
    int boundary_edges;       /* of one triangle */
    int nonmanifold_edges;    /* of three or more */
    int misoriented_edges;    /* whose two triangles run along it the same way */
    int nonmanifold_vertices; /* of several umbrellas */
    int repeated_corners;     /* triangles that name a vertex twice */
    int duplicates;           /* triangles over the vertices of another */
    int unreferenced;         /* vertices of no triangle */
    int nedge;
    int32_t (*edge)[2];       /* [nedge] each edge once, the lower vertex first, sorted */
    int32_t *side_edge;       /* [3*ntri] the edge of each half-edge, as mesh.h numbers them; NONE: left out */
    int ncomp;
    MeshComponent *comp;      /* [ncomp] by first triangle */
    int32_t *tri_comp;        /* [ntri] NONE: left out */
} MeshStructure;

void structure_build(MeshStructure *s, int nvert, const Vec3 *pos, int ntri, const int32_t *tri);
void structure_free(MeshStructure *s);

static inline int component_euler(const MeshComponent *c) { return c->vertices - c->edges + c->triangles; }
/* Over all components. */
int structure_euler(const MeshStructure *s);
double structure_volume(const MeshStructure *s);
