#include "cli/command.h"
#include "cli/info.h"
#include "cli/options.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static InfoJob job_of(const Options *o)
{
    InfoJob job = {.iso = option_given(o, INFO_ISO) ? option_real(o, INFO_ISO) : NAN,
                   .inside = !option_given(o, INFO_INSIDE) ? 0 : option_choice(o, INFO_INSIDE) == 0 ? 1 : -1,
                   .request = {.grid = option_text(o, INFO_GRID),
                               .raw_type = option_text(o, INFO_TYPE),
                               .raw_order = option_text(o, INFO_ORDER)}};
    for (int a = 0; a < 3; a++) job.request.raw_dims[a] = (int)o->value[INFO_DIMS].real[a];
    return job;
}

static bool ends_in(const char *path, const char *ending)
{
    size_t n = strlen(path), e = strlen(ending);
    return n > e && strcasecmp(path + n - e, ending) == 0;
}

static json_t *info_of(const char *path, const InfoJob *job, PlyRuns *runs, Err *err)
{
    if (ends_in(path, ".ply")) return info_ply(path, runs, err);
    if (ends_in(path, ".glb") || ends_in(path, ".gltf")) return info_gltf(path, err);
    if (scene_is_known(path)) return info_scene(path, err);
    return info_volume(path, job, err);
}

static void print(json_t *o, bool as_json, bool first)
{
    if (as_json) {
        json_dumpf(o, stdout, JSON_COMPACT | JSON_REAL_PRECISION(9));
        putchar('\n');
    } else {
        if (!first) putchar('\n');
        info_print(o, stdout);
    }
    json_decref(o);
}

/* Files that cannot be read are named; the others are told of all the same. */
static int tell_all(const Options *o)
{
    InfoJob job = job_of(o);
    PlyRuns *runs = plyruns_make();
    bool as_json = option_given(o, INFO_JSON);
    int status = 0;
    for (int i = 0; i < o->noperand; i++) {
        Err err;
        json_t *info = info_of(o->operand[i], &job, runs, &err);
        if (info) {
            print(info, as_json, i == 0);
        } else {
            fprintf(stderr, "twinmesh info: %s\n", err.text);
            status = (int)err.code;
        }
    }
    json_t *sequence = plyruns_end(runs);
    if (sequence) print(json_pack("{s:o}", "sequence", sequence), as_json, false);
    return status;
}

static int info_run(Options *o)
{
    if (o->noperand > 0) return tell_all(o);
    fputs("twinmesh info: no files are named\n", stderr);
    return ERR_USAGE;
}

const Command info_command = {&info_options, "twinmesh info FILE...\n\n"
    "What a volume holds, grid by grid, and which surface mesh would take from it; what a PLY or glTF holds, and\n"
    "which frames of it share their connectivity.", NULL, info_run};
