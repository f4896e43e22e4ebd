/* check.h: figures of a mesh against the field it was made from.
 *
 * What each figure is, figures.def says. The surface is that of the trilinear samples, or the field's exact function where
 * that is known; topology is always that of the samples. Distances are in voxels (world distance by Field.voxel),
 * percentiles by area. Beyond the grid's active bounding box, where the surface is closed by convention, nothing is measured but the
 * mesh itself. Samples are drawn from hashes of their numbers: the same figures on every run, with any number of threads. */
#pragma once
#include "field/field.h"
#include "mesh/trimesh.h"

#include <math.h>

typedef enum CheckFigure {
#define SECTION(heading)
#define FIGURE(id, ...) CHECK_##id,
#include "check/figures.def"
    CHECK_FIGURES
} CheckFigure;

typedef enum CheckBad { CHECK_BAD_PLAIN, CHECK_BAD_HIGH, CHECK_BAD_LOW } CheckBad;

typedef struct CheckFigureSpec {
    const char *name;
    CheckBad bad;
    double limit;         /* NaN: none */
    const char *what;
} CheckFigureSpec;
extern const CheckFigureSpec check_figure[CHECK_FIGURES];

/* Of one mesh of one frame; NaN: not measured, or there was nothing to measure. */
typedef struct CheckRow {
    double value[CHECK_FIGURES];
} CheckRow;

typedef struct CheckSettings {
    double edge;          /* aimed at; 0: the mesh's own mean */
    bool edge_in_voxels;  /* else world units */
    bool open_border;     /* the mesh ends at the border: that is no fault, and its topology is not compared */
    bool quick;           /* neither distances nor self-intersections */
} CheckSettings;

/* What is made of a field once for all meshes that are checked against it. */
typedef struct CheckSurface CheckSurface;

/* The field must outlive it. */
CheckSurface *check_surface_make(const Field *field);
void check_surface_free(CheckSurface *s);

CheckRow check_row_empty(void);
/* All figures of the mesh itself. */
void check_mesh(const CheckSettings *set, const CheckSurface *surface, const TriMesh *mesh, CheckRow *row);
/* Those from one frame to the next. */
void check_motion(const Field *last_field, const TriMesh *last, const Field *field, const TriMesh *mesh, CheckRow *row);
/* Of identities, where there is no frame before. */
void check_ids(const TriMesh *mesh, CheckRow *row);
/* Of a geometric mesh and its mechanical one of `mechanical` triangles. */
void check_parents(const TriMesh *mesh, int mechanical, CheckRow *row);
