/* remesh.h: changing the mechanical mesh's triangles without changing its topology.
 *
 * Everything here is split, collapse (under the link condition), flip and guarded moves, so each component keeps its
 * Euler characteristic whatever happens. Two uses: GI'07 2.5's alteration of a tracked mesh, and the coarsening of a
 * frame's exact marching-cubes surface to the wanted edge length.
 *
 * A guard stands before each edit: no triangle may turn away from the surface's outward normals (2.6.1: no collapse
 * that inverts) or become a needle, unless it was worse before. One thread at a time; lands points in parallel. */
#pragma once
#include "field/field.h"
#include "field/homes.h"
#include "base/hash.h"
#include "mesh/crossings.h"

enum { ZONE_FIXED, ZONE_MOVES, ZONE_FRESH }; /* stays; may move; may be collapsed as well */

typedef struct Remesh {
    Mesh *mesh;
    const Field *field;
    Vec3 *normal;  /* [mesh->nvert] outward unit normals of the field at the vertices, kept through edits */
    int32_t *home; /* [mesh->nvert] kept through edits; NULL: no vertex is bound */
    uint8_t *zone; /* [mesh->nvert] ZONE_..., kept through edits: what coarsening and smoothing may do; NULL: ZONE_FRESH everywhere */
    int32_t *scope; /* [nscope] what is looked at: triangles that touch the zone, or what moved, and those around them; and all from scope_end on.
                     * NULL: all */
    int nscope, scope_end;
    int cap;
    double edge;   /* mean edge length wanted, world units */
    Homes homes;
} Remesh;

typedef struct RemeshStat {
    int splits, collapses, flips;
} RemeshStat;

/* Borrows mesh and field; computes the normals. `homes` may be NULL. */
void remesh_begin(Remesh *r, Mesh *mesh, const Field *field, double edge, const Homes *homes);
/* The same, with coarsening and smoothing confined to the vertices from `first` on, and movement to them and the neighbours they have
 * now; normals are known around those. */
void remesh_begin_confined(Remesh *r, Mesh *mesh, const Field *field, double edge, const Homes *homes, int first);
void remesh_end(Remesh *r);
/* Sweeps the dead out of the mesh, its normals and homes along; vert_to as mesh_compact's. */
void remesh_compact(Remesh *r, int32_t *vert_to);

/* Puts the vertices of a compact mesh in the order of the field's bricks, and the triangles in that of their vertices; vert_to as mesh_sort's. */
void remesh_sort(Mesh *m, const Field *field, int32_t *vert_to);
/* Whether so many vertices have come since that it is worth its time again. */
bool remesh_is_strewn(const Mesh *m);

/* GI'07 2.5. Edges flagged by the step before are left alone and lose their flag; edges changed now get it. */
typedef struct AlterRules {
    double rest;         /* e-hat, world units */
    double e_min, e_max; /* collapse below e_min e-hat unless stretching, split above e_max e-hat unless shrinking */
    double eps;          /* epsilon_e: a change of length below eps e-hat is none */
} AlterRules;
RemeshStat remesh_alter(Remesh *r, const AlterRules *rules);

/* Alters and flips edges only around the vertices that are not held[mesh->nvert], until the mesh is compacted: those that have moved since
 * that was last done. */
void remesh_narrow(Remesh *r, const uint8_t *held);

/* Splits the longest edge of each triangle of mark[mesh->ntri], where it is longer than `least`, at its landed midpoint: flat
 * triangles come nearer to the surface. Returns how many. */
int remesh_split_marked(Remesh *r, const uint8_t *mark, double least);

/* Flips edges whose two triangles gain at least `gain` in their lesser quality (1 is equilateral). Beyond the paper:
 * split and collapse alone leave valences of four and eight behind. Returns how many. */
int remesh_flip(Remesh *r, double gain);

/* Flips edges that are not wanted to ones that are, where the guards allow it: wanted has key_pair(lesser id, greater id). */
int remesh_flip_towards(Remesh *r, const Map *wanted);

/* Moves every vertex to target[v] and lands it on the surface; a vertex whose move would harm a triangle around it, or
 * that finds no surface, stays where it was. `frozen` (may be NULL): vertices that do not move. Returns how many stayed
 * against their will. */
int remesh_move(Remesh *r, const Vec3 *target, const uint8_t *frozen);

/* Moves the corners of poor triangles, one by one, to where the poorest around them is better, but for those held (may be NULL). */
void remesh_improve(Remesh *r, const uint8_t *held);

/* Steps of tangential smoothing: each vertex halfway towards its neighbours' mean. */
void remesh_smooth(Remesh *r, int steps);

/* Marching cubes' small triangles brought to the wanted edge length, and evened in so many rounds. Leaves the mesh compact, without
 * flags. */
RemeshStat remesh_coarsen(Remesh *r, int rounds);

/* Triangles of about the edge length wanted made more even. Leaves the mesh compact, without flags. */
void remesh_even(Remesh *r);

/* Inverted triangles (2.6) flipped, collapsed or moved away as far as possible, but for those whose corners are all frozen
 * (may be NULL) or outside the zone. found: how many there were. Returns how many are left. */
int remesh_heal(Remesh *r, const uint8_t *frozen, int *found);

/* Vertices that are off the surface, or not on their own component's, moved beside a neighbour or collapsed into one, but for
 * the frozen (may be NULL). Without homes nothing is known and nothing done. Returns how many are left astray. */
int remesh_rehome(Remesh *r, const uint8_t *frozen);

/* Rounds positions to float32 and takes triangles that run through one another apart, by flips, moves and collapses of their own
 * edges and corners, as long as each leaves fewer crossings, turns nothing over and strays no farther from the surface. The
 * mesh may hold dead triangles afterwards. Returns how many pairs are left; `c` knows them. */
int remesh_uncross(Remesh *r, Crossings *c);

/* Remembers each edge's length as the last step's; with held[mesh->nvert] not NULL those of which an end is not held. */
void remesh_remember_lengths(Mesh *mesh, const uint8_t *held);
