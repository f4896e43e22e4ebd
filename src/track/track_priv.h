/* track_priv.h: the tracker's state, shared inside the module. */
#pragma once
#include "refine/refine.h"
#include "remesh/remesh.h"
#include "topology/iso.h"
#include "track/track.h"

struct Track {
    TrackSettings set;
    double edge;            /* world units; 0 until the first frame with a surface */
    double rest_ratio;      /* e-hat / edge, adapted so that the mean edge is the one asked */
    Mesh mesh;              /* mechanical */
    float *unrest;          /* [mesh.nvert] how far the last step's forces wanted the vertex to go, in edges; 1: not known */
    uint8_t *frozen;        /* [mesh.nvert] 1: at rest under a field at rest: costs nothing in this frame */
    int capcolumn;
    Mechanics mech;
    Refine refine;
    RefinedMesh fine;       /* geometric */
    const Field *field, *last_field;       /* borrowed */
    const Grid *velocity, *last_velocity;  /* borrowed; may be NULL */
    double span_s;          /* seconds between the two */
};

/* --- predict.c ------------------------------------------------------------------------------------------------------ */

/* Where the velocity takes a point from last frame's time to this one's. */
Vec3 track_advect(const Track *tr, Vec3 p);
/* Carries n points from last frame's surface to this one's. Lost ones keep the place they were carried to, off the surface;
 * status as field_project's. Returns how many are lost; *substeps: fields blended in time, 0 when the velocity carried them. */
int track_predict(const Track *tr, int n, Vec3 *p, uint8_t *status, int *substeps);

/* --- relax.c -------------------------------------------------------------------------------------------------------- */

/* One quasi-static step of the mechanical mesh, guarded and landed (GI'07 2.2 to 2.6). */
void track_relax(Track *tr, Remesh *r, FrameStat *stat);

/* --- census.c: which identities survive ---------------------------------------------------------------------------- */

typedef struct Census {
    int n, ncomp;
    int32_t *id, *comp;   /* [n] of each vertex before the frame */
    uint8_t *remade;      /* [ncomp] */
} Census;

void census_take(Census *c, const Mesh *m);
/* A component before the frame counts as remade when one of its vertices is now in a bad component. */
void census_mark_remade(Census *c, const Mesh *m, const int32_t *tri_comp, const uint8_t *mesh_bad);
/* The share of identities still there, of components not remade; NaN when there was none. */
double census_share_kept(const Census *c, const Mesh *m);
void census_free(Census *c);

/* --- measure.c ------------------------------------------------------------------------------------------------------- */

void track_measure(const Track *tr, FrameStat *stat);
double track_clock(void); /* seconds */
