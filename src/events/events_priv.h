/* events_priv.h: what blending and splitting share. */
#pragma once
#include "events/events.h"
#include "mesh/intersect.h"
#include "mesh/surgery.h"

typedef struct Surgeon {
    Mesh *mesh;
    const Field *field;
    const EventRules *rules;
    ChangeList *events;
    Region region;
    Borders borders;
    int nlost;            /* triangles when lost[] was made */
    int8_t *lost;         /* blending: lost_find's */
    Vec3 contact;         /* blending: the mean middle of the triangles that collide */
} Surgeon;

void surgeon_init(Surgeon *s, Mesh *mesh, const Field *field, const EventRules *rules, ChangeList *events);
void surgeon_free(Surgeon *s);

/* Makes the region one that can be sewn: no pinches, no islands; finds its borders. False: it is out of proportion. */
bool surgeon_prepare(Surgeon *s);
/* The field must bear out what the meshes show; the report trusts the meshes, which on splashes collide and miss the surface
 * in many places where nothing happens. */

/* Whether all of the way from a to b is inside, or all of it outside. */
bool surgeon_holds_way(const Surgeon *s, Vec3 a, Vec3 b, bool inside);
/* The share of the disc that spans a ring of points that is inside. */
double surgeon_disc_inside(const Surgeon *s, int n, const Vec3 *rim);
/* Whether the region's triangles look away from p: around a neck, not around a hole. */
bool surgeon_looks_outward(const Surgeon *s, Vec3 p);
/* p on the surface where it is near. */
Vec3 surgeon_land(const Surgeon *s, Vec3 p);
/* Erases the region and closes each of its borders at its centre, landed. Records a split, or a hole closed. */
void surgeon_cap_all(Surgeon *s);

/* Whether p's projection comes, within reach, to a sheet that faces along `normal`. Not the plain Newton iteration of eq. 2,
 * as the report's is: where a cache's F bends sharply, as at its walls, that fails on sound surfaces too. */
bool events_can_land(const Field *f, Vec3 p, Vec3 normal, double reach);
static inline Vec3 tri_middle(const Mesh *m, int t)
{
    const int32_t *c = m->corner + 3 * t;
    return v_scale(v_add(v_add(m->pos[c[0]], m->pos[c[1]]), m->pos[c[2]]), 1.0 / 3);
}
/* Have they a vertex in common? */
bool tris_are_neighbours(const Mesh *m, int t, int u);

/* lost[ntri]: triangles whose middles have no surface near them; 1: inside, -1: outside. */
void lost_find(const Mesh *m, const Field *f, double edge, int8_t *lost);
/* For each lost triangle the nearest lost one that it faces, with nothing between them. Grows *pair; returns how many. */
int lost_pairs(const Surgeon *s, const int8_t *lost, TriPair **pair, int *cap);
