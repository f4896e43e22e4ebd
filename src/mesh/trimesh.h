/* trimesh.h: an indexed triangle mesh as files hold it: float32, columns, no adjacency. */
#pragma once
#include "base/store.h"

typedef struct TriMesh {
    int nvert, ntri;
    float *pos;       /* [3*nvert] world units */
    float *normal;    /* [3*nvert] outward, unit length */
    float *velocity;  /* [3*nvert] world units a second; NULL when not known */
    int32_t *id;      /* [nvert] persistent identity, unique within the mesh */
    int32_t *tri;     /* [3*ntri] counter-clockwise from outside */
    int32_t *parent;  /* [ntri] index of the mechanical triangle; NULL for a mechanical mesh */
    int nattr;
    char **attr_name; /* [nattr] */
    float **attr;     /* [nattr][nvert] */
} TriMesh;

/* Uninitialised columns of the given sizes; velocity and parent only when asked for. */
void trimesh_init(TriMesh *m, int nvert, int ntri, bool with_velocity, bool with_parent);
void trimesh_free(TriMesh *m); /* leaves an empty mesh */
/* Same triangles over the same identities, in the same order. */
bool trimesh_is_same_run(const TriMesh *a, const TriMesh *b);
/* comp[nvert]: which connected part each vertex is of, numbered by first vertex. Returns how many. */
int trimesh_components(const TriMesh *m, int32_t *comp);
/* A mesh into a store, or out of it into one that is zero: its indices are sound, or the store is bad. */
void trimesh_store(TriMesh *m, Store *s);
