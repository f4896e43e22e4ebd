/* track.h: the method: a surface followed through a sequence of fields by two meshes.
 *
 * track_frame is one frame of the line  predict -> audit and mend -> alter and relax -> audit and mend -> refine -> untangle:
 * afterwards the mechanical and the geometric mesh of the frame can be taken as TriMesh (what is written is
 * what was audited: positions are rounded to float32 inside). Everything here is deterministic in the fields,
 * settings and thread-count-independent. */
#pragma once
#include "events/change.h"
#include "field/field.h"
#include "mechanics/mechanics.h"
#include "mesh/mesh.h"
#include "mesh/trimesh.h"
#include "refine/refine.h"
#include "track/event.h"

/* Exact: mended at every frame until it is that of the grid. Papers: RR-6128 section 4. None: as it comes. */
typedef enum TopologyKind { TOPOLOGY_EXACT, TOPOLOGY_PAPERS, TOPOLOGY_NONE } TopologyKind;

typedef struct TrackSettings {
    double edge;               /* mean mechanical edge wanted; > 0 */
    bool edge_in_voxels;       /* in voxels of the first frame with a surface, else world units */
    double e_min, e_max;       /* 0.8, 2: collapse below e_min e-hat, split above e_max e-hat (2.5, 2.6.1) */
    double eps_e;              /* 0.1: limit on the change of an edge's length, in e-hat */
    int relax_steps;           /* quasi-static steps a frame; 2 */
    MechanicsSettings mech;    /* mech.rest is set by the tracker */
    double angle_deg;          /* alpha_r; 20; 180: no refinement at all */
    int passes;                /* N_p; 4 */
    double deviation_vox;      /* an edge midpoint farther from the surface than this is refined; 0: off */
    RefineBy refine_by;        /* normals */
    RefineScheme refine_scheme; /* papers */
    double min_aspect;         /* 0: off */
    TopologyKind topology;
    double fps;                /* frames a second, for velocities */
    bool rest;                 /* vertices carry the place where they were at rest */
    bool own_motion;           /* vertices have velocities without a grid of them too, from the surface's and their own motion */
} TrackSettings;

TrackSettings track_defaults(void);

/* A frame's numbers: the report's line. All deterministic but `seconds`. */
typedef struct FrameStat {
    int components, triangles_mechanical, vertices_mechanical, triangles_geometric, vertices_geometric;
    double edge_asked, edge_mean, edge_rest;          /* world units */
    double edges_in_range;                            /* share within [0.5, 2] of edge_asked */
    double min_angle_p5, min_angle_p50;               /* degrees, mechanical */
    int predict_substeps;                             /* fields blended in time */
    int splits, collapses, flips;
    int relax_steps, cg_iterations;
    double cg_residual;                               /* the last step's */
    int projections_lost;
    int inverted_found, inverted_left;                /* mechanical triangles; found before healing */
    int inverted_left_geometric;
    int frozen_vertices;
    int audit_components, audit_euler;                /* of the grid's own isosurface */
    int mend_faults;                                  /* faulty triangles and uncovered cells found after the prediction and after relaxing */
    int mend_patches, replaced_vertices;              /* patches sewn in; vertices that lost their identity to them */
    int remade_components;                            /* of more than 500 triangles, made anew as a whole; sound vertices keep their identities */
    int raw_components;                               /* with reference triangles left as they are: the last resort's last resort */
    int events[EVENT_KINDS];                          /* the counts of the events of each kind, added up */
    int wrong_components;                             /* that differ from the grid after all mending; 0 in exact mode */
    double ids_kept;                                  /* share of last frame's identities that are still there; NaN: there were none */
    double distance_mean_vox, distance_max_vox;       /* geometric triangles' centroids to the surface, by |F| / |grad F| */
    int self_intersections;                           /* pairs of geometric triangles that run through one another, left */
    int flattened;                                    /* midpoints put back on their edges for that reason */
    struct { double predict, alter, relax, audit, mend, refine; } seconds;
} FrameStat;

typedef struct Track Track;

Track *track_open(const TrackSettings *set);
void track_close(Track *tr);

/* What the next frame needs of the frames before, into the store; or out of it into a tracker just opened with the same
 * settings. Reading leaves the store bad where it holds no such thing; the tracker is then good for track_close alone. */
void track_store(Track *tr, Store *s);
/* After reading: the last frame's field and velocity, built again from the same samples and lent as to track_frame. */
void track_remind(Track *tr, const Field *field, const Grid *velocity);

/* Takes the mesh to the field's surface. `velocity` (may be NULL) is the grid of this frame, in world units a second.
 * Both are borrowed, and stay where they are, until the next frame is tracked and carried (they are its "last frame").
 * `frames` is the number of frame intervals since the last call (1, or more after skipped frames; ignored on the first call).
 * False only for what the settings and the field make impossible (Err says it). */
bool track_frame(Track *tr, const Field *field, const Grid *velocity, double frames, FrameStat *stat, Err *err);

/* The same in two steps, of which one tracker may do the first for a frame while another, on another thread, does the second for the
 * frame before. track_solve: the mechanical mesh; what it borrows stays until the next frame but one is solved. track_pass_on: `to`,
 * opened with the same settings, takes over from `from` what completing the frame takes, and nothing else; not under
 * TOPOLOGY_PAPERS, whose rules need the geometric mesh at once. It does so too with one that is as track_store left it, for the
 * next frame's sake. track_complete: the geometric mesh, events and figures; adds to *stat. */
bool track_solve(Track *tr, const Field *field, const Grid *velocity, double frames, FrameStat *stat, Err *err);
void track_pass_on(Track *from, Track *to);
void track_complete(Track *tr, FrameStat *stat);

/* What RR-6128's rules changed in the frame just tracked (TOPOLOGY_PAPERS); the tracker's own until the next frame. */
const ChangeList *track_changes(const Track *tr);

/* The meshes of the frame just tracked; the caller frees them. Velocities are the velocity grid's; without one, where the
 * settings want them, those of the surface: along the outward normal F_t / |grad F| between the last frame's field and this
 * one's, and in the tangent plane the vertex's own way since then (0 for new vertices, and all 0 in the first frame). `open_border` leaves out what closes the surface beyond
 * the grid's active bounding box. Either may be NULL. */
void track_meshes(const Track *tr, bool open_border, TriMesh *mechanical, TriMesh *geometric);

/* What became of the components in the frame just tracked: once a frame; to be freed. */
FrameEvents track_take_events(Track *tr);

/* The vertices of last frame's mesh carried to the field of the frame just tracked, for the last stretch of a run of
 * animated glTF: velocity, then projection, held where that fails. pos, normal: [3*mesh->nvert]. */
void track_carry(const Track *tr, const TriMesh *last, float *pos, float *normal);
