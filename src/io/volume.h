/* volume.h: reads one frame's file into plain grids. The formats are a table (format.c): OpenVDB, .npy, .raw.
 *
 * Every size in a file is checked before it is used. A failure is one sentence with the file, what was wrong and
 * the remedy, and leaves nothing behind. */
#pragma once
#include "field/field.h"

typedef enum VolumeClass { VOLUME_UNKNOWN, VOLUME_LEVEL_SET, VOLUME_DENSITY } VolumeClass;

typedef struct VolumeRequest {
    const char *grid;             /* NULL: the only scalar grid, else surface, phi, sdf, density, else an error that lists them */
    const char *velocity;         /* NULL: none wanted */
    int raw_dims[3];              /* .raw: samples in x, y, z; all 0: not given (an error for .raw) */
    const char *raw_type;         /* .raw: u8 i8 u16 i16 f16 f32 f64 (little-endian); NULL: f32 */
    const char *raw_order;        /* "xyz": x fastest (default), "zyx": z fastest */
    double spacing[3], origin[3]; /* .npy and .raw: voxel size (0: 1) and place of sample (0,0,0), world units */
} VolumeRequest;

typedef struct Volume {
    Grid surface;
    char name[256];               /* of the surface's grid; "" for formats without names */
    VolumeClass kind;             /* from the grid's class, else from its name and values */
    bool has_velocity;
    Grid velocity;                /* 3 components, in the file's own units */
} Volume;

bool volume_read(const char *path, const VolumeRequest *request, Volume *out, Err *err);
void volume_free(Volume *v);

/* True for file names the table of formats knows by their ending. */
bool volume_is_known(const char *path);

/* How the surface was chosen: isovalue and side; `why` is a sentence for the log ("level set 'phi': inside below 0"). */
typedef struct SurfaceChoice {
    FieldSpec spec;
    char why[300];
} SurfaceChoice;
/* Level sets: inside below 0. Densities: inside above 0.1, the same in every frame, so that the surface does not jump
 * with a frame's largest value. `iso` and `inside` overrule (iso NaN: not given; inside 0: not given, 1 above,
 * -1 below). */
SurfaceChoice volume_choose_surface(const Volume *v, double iso, int inside);
