/* crossings.h: the triangles of a living mesh that run through one another, kept from one question to the next.
 *
 * Between two questions few triangles change, as a rule: a pair of two that are what they were is answered as before, exactly.
 * What a triangle is goes by the identities and places of its corners, so that renumbering, the dead swept out and patches
 * sewn in cost nothing but themselves. The answer is the same as intersect_find's, whatever was asked before. */
#pragma once
#include "mesh/intersect.h"
#include "mesh/mesh.h"

typedef struct Crossings {
    int n, cap;
    TriPair *pair;        /* [n] of the mesh last asked about, sorted */
    int nvert, ntri, cappos, capid, capcorner;
    Vec3 *pos;            /* [nvert] that mesh, */
    int32_t *id;          /* [nvert] */
    int32_t *corner;      /* [3*ntri] NONE at 3t: dead */
} Crossings;

/* Positions must hold float32 values. `c`: zero at first. Returns c->n. */
int crossings_find(Crossings *c, const Mesh *m);
void crossings_free(Crossings *c);
