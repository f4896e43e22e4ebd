/* gltf_priv.h: what the files behind gltf.h share.
 *
 * gltf.c cuts frames into runs and pieces; gltf_store.c keeps the streams of bytes and the tables of views
 * and accessors into them, gltf_round.c makes whole numbers of what it stores; gltf_file.c makes the animation at the end and assembles the file; gltf_text.c writes
 * the tables as JSON. All that is known of the frames already written is in the flat tables
 * of GltfDoc. */
#pragma once
#include "io/file.h"
#include "io/gltf.h"

enum {
    GLTF_TARGETS = 8, /* of a mesh at most: the specification promises viewers no more */
    GLTF_I8 = 5120,   /* component types and targets, as the specification numbers them */
    GLTF_I16 = 5122,
    GLTF_U16 = 5123,
    GLTF_U32 = 5125,
    GLTF_F32 = 5126,
    GLTF_ARRAY = 34962,
    GLTF_INDEX = 34963,
    GLTF_I16_MOST = 32767,
    GLTF_EXPONENT_LEAST = -100, /* of a step */
    GLTF_EXPONENT_MOST = 128,
};
#define GLTF_PART_BYTES ((uint64_t)1 << 30)      /* of a .bin file */
#define GLTF_GLB_BYTES (((uint64_t)1 << 32) - 1) /* a .glb counts itself in 32 bits */

typedef struct GltfView {
    int part, stride, target; /* stride and target: 0 for none */
    int packed;               /* bytes of a row that EXT_meshopt_compression has packed; 0: they lie there as they are */
    uint64_t offset, bytes;   /* offset: within the part */
    int64_t count;            /* packed: rows */
    uint64_t raw;             /* packed: where they would begin in a buffer without that extension */
} GltfView;

typedef struct GltfRange {
    uint8_t known;
    float lo[3], hi[3]; /* [width of the accessor], exact */
} GltfRange;

typedef struct GltfAccessor {
    int view, component, width; /* width: 1 scalar, 2 or 3 vector */
    uint64_t offset;            /* within the view */
    int64_t count;
    GltfRange range;
} GltfAccessor;

/* Places of whole numbers: 2^exponent * (origin + number). */
typedef struct GltfGrid {
    int32_t exponent, origin[3];
} GltfGrid;

typedef struct GltfAttribute {
    char *name; /* with its leading underscore */
    int accessor;
} GltfAttribute;

typedef struct GltfRun {
    int frames; /* shown */
    int index, id, uv; /* uv: NONE but in gltf_write_still */
    int attr, nattr; /* rows of doc.attr */
} GltfRun;

typedef struct GltfPiece {
    int run, grid; /* grid: 0 where nothing is rounded */
    int from, until;                /* frames: shown in [from, until) */
    int position, normal, velocity; /* velocity: NONE where it is not known */
    int target, ntarget;            /* accessors: target + 2 k position, behind it the normal */
    int key[GLTF_TARGETS + 1];      /* frames of the base and the targets */
    int weights_in, weights_out, scale_in, scale_out; /* accessors, made at the end; NONE: no channel */
} GltfPiece;

typedef struct GltfDoc {
    const char *name;
    bool step;
    GltfCompress compress;
    uint64_t raw_bytes;   /* of the packed views, unpacked */
    uint64_t *part_bytes; /* [npart] */
    GltfView *view;
    GltfAccessor *accessor;
    GltfAttribute *attr;
    GltfRun *run;
    GltfGrid *grid;       /* each of some pieces that follow each other */
    GltfPiece *piece;
    int npart, nview, naccessor, nattr, nrun, ngrid, npiece;
    int cap_part, cap_view, cap_accessor, cap_attr, cap_run, cap_grid, cap_piece;
} GltfDoc;

struct Gltf {
    GltfDoc doc;
    char *path, *prefix, *name;
    bool binary;
    double fps;
    void (*warn)(const char *sentence);
    uint64_t part_bytes, glb_bytes; /* limits; lower in tests */
    OutFile *part;                  /* [doc.npart] */
    int synced;                     /* parts that are on disk and full */
    int frame;                      /* of the last mesh given; -1 before the first */
    bool open;                      /* doc's last piece takes targets */
    TriMesh last, now;              /* copies of the last mesh and the one being added, without attributes */
    float *base_pos, *base_normal;  /* of the open piece */
    uint8_t *scratch, *packed;      /* the array being stored */
    size_t cap_scratch, cap_packed;
    Err broken;                     /* code ERR_NONE while nothing failed */
};

/* --- gltf_store.c --- */

/* What the names of a file's parts begin with: PREFIX of PREFIX.gltf, but all of PREFIX.glb, as the two may be written beside
 * each other. To be freed with mem_free. */
char *gltf_stem(const char *path);
/* STEM.bin, STEM.1.bin, ...; to be freed with mem_free. */
char *gltf_part_path(const char *stem, int part);

/* Each stores the values as little-endian bytes and returns the accessor, or NONE after a failure. */
int gltf_store_vec3(Gltf *g, const float *v, int n, Err *err);
int gltf_store_vec2(Gltf *g, const float *v, int n, Err *err);
int gltf_store_scalars(Gltf *g, const float *v, int n, Err *err);
/* As 16-bit where the vertices allow it. */
int gltf_store_indices(Gltf *g, const TriMesh *mesh, Err *err);
/* As floats where they hold them exactly, else as pairs of 16-bit halves, low first. */
int gltf_store_ids(Gltf *g, const TriMesh *mesh, Err *err);
/* Animation data: `count` rows of `width` floats that no vertex reads; ranges only for width 1. */
int gltf_store_keys(Gltf *g, const float *v, int count, int width, bool with_range, Err *err);

typedef struct GltfColumns {
    const float *pos, *normal; /* [3 * n] */
} GltfColumns;
/* A base of the last piece, or a target's differences to `base`, in whole numbers where they are wanted. The normal's accessor
 * follows that of the position, which is returned. */
int gltf_store_vertices(Gltf *g, const GltfColumns *of, const GltfColumns *base, int n, Err *err);

/* --- gltf_round.c --- */

/* A grid on which `pos`, and `next` as differences to it, are whole numbers of 16 bits with a sign, rounded to less than 1/16383
 * of their longest side: the last one where it will do. `next`: NULL: not known. */
int gltf_grid_for(Gltf *g, const float *pos, const float *next, int n);
bool gltf_grid_fits(const GltfGrid *grid, const float *pos, const float *next, int n);
double gltf_grid_step(const GltfGrid *grid);
int gltf_round(const GltfGrid *grid, int axis, float x);
/* In 127ths; `base`: NULL, or what the difference is to. */
void gltf_round_normal(const float n[3], const float base[3], int out[3]);

/* --- gltf_file.c --- */

/* Adds the animation, writes the final file from the parts, which stay. */
bool gltf_assemble(Gltf *g, Err *err);

uint64_t gltf_sum_of_parts(const Gltf *g);

/* --- gltf_text.c --- */

/* The JSON of the whole file; one_buffer: the parts follow each other in one, as in a .glb. */
uint64_t gltf_text_size(const Gltf *g, bool one_buffer);
bool gltf_write_text(const Gltf *g, bool one_buffer, OutFile *file, Err *err);
