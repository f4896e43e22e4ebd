/* seam.h: the same frame tracked twice, by two chunks: which vertices of the one are those of the other.
 *
 * The mechanical vertices are paired first, component by component (the two meshes have the same topology): nearest of all
 * places the components. The midpoints of the geometric meshes are paired among themselves, on the same components. */
#pragma once
#include "base/hash.h"
#include "cli/outputs.h"

typedef struct SeamSide {
    int vertices[2];         /* of the mesh before, and behind the seam */
    int pairs;
    double mean, largest;    /* way between the two of a pair, in mean mechanical edges */
} SeamSide;

typedef struct Seam {
    Map identity;            /* of a vertex behind the seam: that before it, where it has one */
    Map number;              /* of a component, likewise; a component's number is its least identity */
    SeamSide side[KIND_COUNT]; /* all vertices; the geometric mesh's with its mechanical ones */
} Seam;

/* before, behind: [KIND_COUNT]. To be freed. */
void seam_find(const TriMesh *before, const TriMesh *behind, Seam *out);
void seam_free(Seam *s);
