/* events.h: changes of topology as RR-6128 section 4 handles them: seen on the geometric mesh, made on the mechanical one.
 *
 * Blending: where geometric triangles run through one another, their mechanical triangles and these triangles' neighbours
 * are erased and the two borders welded. Splitting: where midpoints of geometric edges find no surface, the ring of mechanical triangles
 * that a plane through them cuts is erased and both borders are closed. Beyond the report: several of either in one
 * frame; a region whose pieces have grown together is the neck of a split; what met nothing but itself opens a hole.
 *
 * Each call is one round over the mesh it is given: the caller refines again and calls until nothing happens. Afterwards
 * the mesh is closed and manifold, with dead triangles and vertices in it. One thread, but for the search for collisions. */
#pragma once
#include "events/change.h"
#include "refine/refine.h"

typedef struct EventRules {
    double edge;          /* mean mechanical edge, world units */
    int min_split;        /* quasi-critical points that make a split; 4 */
    double angle_deg;     /* the refinement's: edges that it would cut are those whose midpoints are tried */
    double deviation_vox;
} EventRules;

/* `fine` was made from `mesh`, which is compact; events_blend does without (NULL) and then goes by lost triangles alone: those
 * whose middles find no surface either, where another such sheet faces them. Append to `events` what they did. Return how many events. */
int events_blend(Mesh *mesh, const RefinedMesh *fine, const Field *field, const EventRules *rules, ChangeList *events);
int events_split(Mesh *mesh, const RefinedMesh *fine, const Field *field, const EventRules *rules, ChangeList *events);

/* A midpoint that refinement would want, and that projection does not bring to the sheet its edge lies on. */
typedef struct QuasiCritical {
    Vec3 p;
    int32_t tri;          /* mechanical triangle */
} QuasiCritical;

/* Those of the geometric mesh, in the order of its triangles; the caller frees them. Returns how many. */
int events_quasi_critical(const RefinedMesh *fine, const Field *field, const EventRules *rules, QuasiCritical **found);
