/* info.h: what `twinmesh info` tells of a file, as a JSON object that can be printed either way. */
#pragma once
#include "io/volume.h"

#include <jansson.h>

typedef struct InfoJob {
    VolumeRequest request;
    double iso;   /* NaN: by the grid */
    int inside;   /* 1 above, -1 below, 0 by the grid */
} InfoJob;

/* Each a new reference, or NULL with a sentence. */
json_t *info_volume(const char *path, const InfoJob *job, Err *err);
json_t *info_gltf(const char *path, Err *err);
json_t *info_scene(const char *path, Err *err);

/* PLY files one after the other: which of them have one connectivity. */
typedef struct PlyRuns PlyRuns;
PlyRuns *plyruns_make(void);
json_t *info_ply(const char *path, PlyRuns *runs, Err *err);
/* Frees; NULL where there were fewer than two files. */
json_t *plyruns_end(PlyRuns *runs);

/* --- pieces of JSON ----------------------------------------------------------------------------- */

/* A text from a file, of whatever bytes. */
json_t *info_text(const char *s);
/* null for what is no finite number. */
json_t *info_real(double x);
json_t *info_reals(int n, const double *x);
/* As lines of `key: value`, indented. */
void info_print(const json_t *object, FILE *out);
