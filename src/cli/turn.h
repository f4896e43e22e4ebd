/* turn.h: meshes as the program that receives them has space: another axis up, another unit. */
#pragma once
#include "mesh/trimesh.h"

typedef enum UpAxis { UP_AS_IT_IS = -1, UP_Y, UP_Z } UpAxis;

typedef struct Turn {
    UpAxis up;    /* UP_Y: of z upwards make y; UP_Z: of y upwards make z; a quarter turn about x */
    double scale; /* units of the receiver's to one of the grid's */
} Turn;

/* n vectors in place; unit vectors with a scale of 1. */
void turn_vectors(const Turn *t, double scale, int n, float *v);
/* The mesh with places, normals and velocities of its own, turned; the other columns are the caller's mesh's. */
TriMesh turn_mesh(const Turn *t, const TriMesh *m);
/* Frees what is the turned mesh's own. */
void turn_free(TriMesh *turned);
