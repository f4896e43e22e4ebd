/* vdb_priv.h: an OpenVDB file in four steps.
 *
 *   vdb_toc.c   the table of contents: which grids the file has and where
 *   vdb_walk.c  walks through one grid's bytes and checks every count, mask and chunk, without decoding any
 *   vdb.cpp     has OpenVDB decode a tree that was found sound
 *   vdb_read.c  the format as format.c knows it
 *
 * Why the walk: OpenVDB 10 takes files that are cut short for whole ones, and trusts the sizes of compressed chunks,
 * so that a crafted file can make it write beyond its buffers. It gets to see only what the walk has passed.
 * Files of format 222 (2013) and later. */
#pragma once
#include "io/io_priv.h"

typedef enum VdbType { VDB_OTHER, VDB_FLOAT, VDB_DOUBLE, VDB_VEC3S, VDB_VEC3D, VDB_INT32, VDB_INT64, VDB_VEC3I } VdbType;

enum { VDB_COMPRESS_ZIP = 1, VDB_COMPRESS_ACTIVE = 2, VDB_COMPRESS_BLOSC = 4 };

typedef struct VdbEntry {
    char name[256];   /* "density", or "density[1]" where several have that name; nothing unprintable */
    char type[64];    /* "Tree_float_5_4_3" */
    char parent[256]; /* the grid whose tree this one shares, or "" */
    VdbType kind;
    bool half;        /* stored as half floats */
    int64_t at, end;  /* from the compression flags to behind the tree */
} VdbEntry;

typedef struct VdbToc {
    InFile in;
    uint32_t version;
    int nentry, capentry;
    VdbEntry *entry;
} VdbToc;

/* Opens the file. Files written to a pipe hold no offsets: they are walked through. */
bool vdb_toc_open(VdbToc *toc, const char *path, Err *err);
void vdb_toc_close(VdbToc *toc);

/* One grid's bytes, checked. */
typedef struct VdbTree {
    const char *path, *name; /* for messages */
    uint32_t version, compression;
    VdbType kind;
    bool half;
    char grid_class[32];     /* "level set", "fog volume", "staggered", "unknown" or "" */
    Affine xform;
    size_t tree_at, size;    /* the tree's bytes are data[tree_at] ... data[size - 1] */
    uint8_t *data;           /* owned */
} VdbTree;

/* Reads and checks the grid's header and transform (and leaves the tree of an instance to its parent). */
bool vdb_tree_load(VdbToc *toc, int i, VdbTree *out, Err *err);
void vdb_tree_free(VdbTree *t);

/* Walks through a tree's bytes from t->tree_at. *used is its length. False with a sentence where it is not sound. */
bool vdb_walk(const VdbTree *t, size_t *used, Err *err);
/* The same from the compression flags on, for files without offsets: class, transform and tree_at are filled. */
bool vdb_walk_header(VdbTree *t, bool transform_wanted, Err *err);

/* vdb.cpp: decodes a tree that vdb_walk has passed into an empty grid of 1 or 3 components (the transform aside). */
#ifdef __cplusplus
extern "C"
#endif
bool vdb_decode(const VdbTree *t, Grid *out, Err *err);
