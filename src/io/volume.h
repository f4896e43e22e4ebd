/* volume.h: reads one frame's file into plain grids. The formats are a table (format.c): OpenVDB, NanoVDB, .npy, .raw,
 * NRRD, Mantaflow's .uni, OpenEXR. The same samples give the same grid from each of them.
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
    /* Dense formats (all but .vdb and .nvdb): voxel size and place of sample (0,0,0), world units. They overrule what the
     * file says of itself; without both 1 and 0. */
    double spacing[3];            /* 0: not given */
    double origin[3];
    bool has_origin;
    int nattribute;
    const char *const *attribute; /* [nattribute] further grids, scalars or vectors */
} VolumeRequest;

typedef struct Volume {
    Grid surface;
    char name[256];               /* of the surface's grid; "" for formats without names */
    VolumeClass kind;             /* from the grid's class, else from its name and values */
    bool has_velocity;
    Grid velocity;                /* 3 components, in the file's own units */
    int nattribute;
    Grid *attribute;              /* [nattribute] 1 or 3 components, in the order of the request */
} Volume;

bool volume_read(const char *path, const VolumeRequest *request, Volume *out, Err *err);
void volume_free(Volume *v);

/* True for file names the table of formats knows by their ending. */
bool volume_is_known(const char *path);

/* --- a file's grids one by one, for those who look around in it ----------------------------------- */

typedef struct VolumeEntry {
    char name[256];      /* "" where the format has no names; nothing unprintable */
    char type[64];       /* "float", "half", "vec3s", ... */
    char grid_class[32]; /* "level set", "fog volume", "staggered" or ""; of .vdb once it is loaded */
    int ncomp;           /* 1 or 3; 0: holds no real numbers and cannot be loaded */
} VolumeEntry;

typedef struct VolumeFile VolumeFile;

/* NULL with a sentence. Path and request are borrowed until volume_close. */
VolumeFile *volume_open(const char *path, const VolumeRequest *request, Err *err);
void volume_close(VolumeFile *f);
const char *volume_format_name(const VolumeFile *f);
int volume_count(const VolumeFile *f);
const VolumeEntry *volume_entry(const VolumeFile *f, int i);
/* The grid that the request's `grid` means, or NONE with a sentence. */
int volume_choose(const VolumeFile *f, Err *err);
/* Reads a grid into an empty one of its number of components. */
bool volume_load(VolumeFile *f, int i, Grid *out, Err *err);
/* What the entry's class says of it, else its name and values. */
VolumeClass volume_class_of(const VolumeEntry *e, const Grid *g);

/* How the surface was chosen: isovalue and side; `why` is a sentence for the log ("level set 'phi': inside below 0"). */
typedef struct SurfaceChoice {
    FieldSpec spec;
    char why[300];
} SurfaceChoice;
/* Level sets: inside below 0. Densities: inside above 0.1, the same in every frame, so that the surface does not jump
 * with a frame's largest value. `iso` and `inside` overrule (iso NaN: not given; inside 0: not given, 1 above,
 * -1 below). */
SurfaceChoice volume_choose_surface(const Volume *v, double iso, int inside);
