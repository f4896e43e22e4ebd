#include "cli/command.h"

#include "base/thread.h"
#include "cli/options.h"
#include "diff/diff.h"
#include "io/mesh_sequence.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

enum { SAME = 0, DIFFERENT = 1, TROUBLE = 2 };
static const char *const kind_name[] = {"geometric", "mechanical"};

typedef enum Verdict { IDENTICAL, WITHIN, OTHER, ONLY_A, ONLY_B, VERDICTS } Verdict;
static const char *const verdict_name[VERDICTS] = {"identical", "within", "different", "only in A", "only in B"};

typedef struct DiffRun {
    DiffSettings settings;
    bool quiet, as_json;
    const char *name[2];
    const char *kind;            /* of the sequences at hand */
    MeshSequence *side[2];
    int count[VERDICTS];
    double farthest;             /* of all frames */
} DiffRun;

/* --- bytes ---------------------------------------------------------------------------------------- */

/* Whether two files hold the same bytes; false also where one cannot be read, which reading it as a mesh will tell. */
static bool is_same_file(const char *a, const char *b)
{
    enum { BLOCK = 1 << 16 };
    struct stat sa, sb;
    if (stat(a, &sa) != 0 || stat(b, &sb) != 0 || !S_ISREG(sa.st_mode) || !S_ISREG(sb.st_mode) ||
        sa.st_size != sb.st_size)
        return false;
    FILE *f = fopen(a, "rb"), *g = fopen(b, "rb");
    char *x = NEW(char, BLOCK), *y = NEW(char, BLOCK);
    bool same = f && g;
    for (size_t n = BLOCK; same && n == BLOCK;) {
        n = fread(x, 1, BLOCK, f);
        same = fread(y, 1, BLOCK, g) == n && memcmp(x, y, n) == 0;
    }
    same = same && !ferror(f) && !ferror(g);
    if (f) fclose(f);
    if (g) fclose(g);
    mem_free(x);
    mem_free(y);
    return same;
}

/* --- telling -------------------------------------------------------------------------------------- */

static json_t *number(double x) { return isfinite(x) ? json_real(x) : json_null(); }

static void print_json(json_t *o)
{
    json_dumpf(o, stdout, JSON_COMPACT | JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(o);
}

static json_t *side_json(const DiffSide *s)
{
    return json_pack("{s:i,s:i,s:i,s:i,s:o,s:o,s:[o,o,o]}", "vertices", s->vertices, "triangles", s->triangles,
                     "components", s->components, "euler", s->euler, "distance", number(s->distance), "at_most",
                     number(s->most), "at", number(s->at[0]), number(s->at[1]), number(s->at[2]));
}

static void tell_json(const DiffRun *run, const char *frame, Verdict verdict, const DiffMesh *d)
{
    json_t *o = json_pack("{s:s,s:s,s:s}", "frame", frame, "kind", run->kind, "verdict", verdict_name[verdict]);
    if (d) {
        json_object_set_new(o, "same_triangles", json_boolean(d->same_run));
        json_object_set_new(o, "place", number(d->place));
        json_object_set_new(o, "vertex", d->place_vertex == NONE ? json_null() : json_integer(d->place_vertex));
        json_object_set_new(o, "normal_degrees", number(d->normal_deg));
        json_object_set_new(o, "velocity", number(d->velocity));
        json_object_set_new(o, "attribute", number(d->value));
        json_object_set_new(o, "parents", json_integer(d->parents));
        json_object_set_new(o, "same_columns", json_boolean(d->same_columns));
        json_object_set_new(o, "a", side_json(&d->side[0]));
        json_object_set_new(o, "b", side_json(&d->side[1]));
    }
    print_json(o);
}

static void print_difference(const char *what, double x)
{
    if (x > 0) printf(", %s %.6g", what, x);
}

static void tell_same_run(const DiffMesh *d)
{
    print_difference("places", d->place);
    if (d->place_vertex != NONE) printf(" (vertex %d)", d->place_vertex);
    print_difference("normals in degrees", d->normal_deg);
    print_difference("velocities", d->velocity);
    print_difference("attributes", d->value);
    print_difference("parents of triangles", d->parents);
    if (!d->same_columns) printf(", other columns");
}

static void tell_surfaces(const DiffMesh *d)
{
    const DiffSide *a = &d->side[0], *b = &d->side[1];
    printf(", triangles %d and %d, components %d and %d, Euler characteristic %d and %d", a->triangles, b->triangles,
           a->components, b->components, a->euler, b->euler);
    if (!isnan(a->distance))
        printf(", A to B %.6g (at most %.6g), B to A %.6g (at most %.6g)", a->distance, a->most, b->distance, b->most);
}

static void tell_text(const DiffRun *run, const char *frame, Verdict verdict, const DiffMesh *d)
{
    printf("%s %s: %s", run->kind, frame, verdict_name[verdict]);
    if (d) (d->same_run ? tell_same_run : tell_surfaces)(d);
    putchar('\n');
}

static void tell(DiffRun *run, const char *frame, Verdict verdict, const DiffMesh *d)
{
    run->count[verdict]++;
    if (d && !isnan(d->place)) run->farthest = fmax(run->farthest, d->place);
    for (int i = 0; d && i < 2; i++) run->farthest = fmax(run->farthest, d->side[i].distance);
    if (!run->quiet) (run->as_json ? tell_json : tell_text)(run, frame, verdict, d);
}

static void tell_all(const DiffRun *run, bool same)
{
    if (run->quiet) return;
    if (run->as_json) {
        print_json(json_pack("{s:b,s:i,s:i,s:i,s:i,s:i,s:o}", "same", same, "identical", run->count[IDENTICAL], "within",
                             run->count[WITHIN], "different", run->count[OTHER], "only_in_a", run->count[ONLY_A],
                             "only_in_b", run->count[ONLY_B], "farthest", number(run->farthest)));
        return;
    }
    printf("%s: identical %d, within the tolerance %d, different %d, on one side only %d; farthest apart %.6g\n",
           same ? "the same" : "different", run->count[IDENTICAL], run->count[WITHIN], run->count[OTHER],
           run->count[ONLY_A] + run->count[ONLY_B], run->farthest);
}

/* --- comparing ------------------------------------------------------------------------------------ */

/* The mesh of a frame, an empty one where a glTF shows none. */
static bool read_side(MeshSequence *s, int i, TriMesh *mesh, Err *err)
{
    if (i != NONE) return mesh_sequence_read(s, i, mesh, err);
    trimesh_init(mesh, 0, 0, false, false);
    return true;
}

/* i: which mesh of each side; NONE: it has none of that frame. */
static bool compare_frame(DiffRun *run, const char *label, const int i[2], Err *err)
{
    bool files = true;
    for (int s = 0; s < 2; s++) {
        files = files && !mesh_sequence_is_gltf(run->side[s]);
        if (i[s] != NONE || mesh_sequence_is_gltf(run->side[s])) continue;
        tell(run, label, s ? ONLY_A : ONLY_B, NULL);
        return true;
    }
    if (files && is_same_file(mesh_sequence_path(run->side[0], i[0]), mesh_sequence_path(run->side[1], i[1]))) {
        tell(run, label, IDENTICAL, NULL);
        return true;
    }
    TriMesh a = {0}, b = {0};
    bool ok = read_side(run->side[0], i[0], &a, err) && read_side(run->side[1], i[1], &b, err);
    if (ok) {
        DiffMesh d = diff_meshes(&run->settings, &a, &b);
        tell(run, label, d.same ? WITHIN : OTHER, &d);
    }
    trimesh_free(&a);
    trimesh_free(&b);
    return ok;
}

/* Goes through the numbers of both sides as they rise. */
static bool compare_frames(DiffRun *run, Err *err)
{
    int at[2] = {0, 0}, n[2] = {mesh_sequence_length(run->side[0]), mesh_sequence_length(run->side[1])};
    while (at[0] < n[0] || at[1] < n[1]) {
        char label[24];
        int i[2];
        int64_t next = INT64_MAX;
        for (int s = 0; s < 2; s++)
            if (at[s] < n[s] && mesh_sequence_number(run->side[s], at[s]) < next)
                next = mesh_sequence_number(run->side[s], at[s]);
        for (int s = 0; s < 2; s++)
            i[s] = at[s] < n[s] && mesh_sequence_number(run->side[s], at[s]) == next ? at[s]++ : NONE;
        snprintf(label, sizeof label, "%04lld", (long long)next);
        if (!compare_frame(run, label, i, err)) return false;
    }
    return true;
}

/* A glTF beside PLY files has their numbers. */
static void match_numbers(DiffRun *run)
{
    for (int s = 0; s < 2; s++) {
        const MeshSequence *other = run->side[!s];
        int n = mesh_sequence_length(other);
        if (mesh_sequence_is_gltf(other) || n == 0) continue;
        int64_t first = mesh_sequence_number(other, 0), step = n > 1 ? mesh_sequence_number(other, 1) - first : 1;
        mesh_sequence_number_from(run->side[s], first, step);
    }
}

static bool compare_sequences(DiffRun *run, Err *err)
{
    const MeshSequence *a = run->side[0], *b = run->side[1];
    bool one = mesh_sequence_length(a) == 1 && mesh_sequence_length(b) == 1,
         gltf = mesh_sequence_is_gltf(a) && mesh_sequence_is_gltf(b);
    if (gltf && is_same_file(mesh_sequence_path(a, 0), mesh_sequence_path(b, 0))) {
        tell(run, "all frames", IDENTICAL, NULL);
        return true;
    }
    if (one && !gltf) return compare_frame(run, "alone", (int[2]){0, 0}, err); /* two files, whatever their numbers */
    match_numbers(run);
    return compare_frames(run, err);
}

static bool compare_kind(DiffRun *run, const char *kind, Err *err)
{
    bool ok = true;
    run->kind = kind;
    for (int s = 0; ok && s < 2; s++) ok = (run->side[s] = mesh_sequence_open(run->name[s], kind, err)) != NULL;
    ok = ok && compare_sequences(run, err);
    for (int s = 0; s < 2; s++) mesh_sequence_close(run->side[s]);
    run->side[0] = run->side[1] = NULL;
    return ok;
}

/* Of two prefixes each kind that either has. */
static bool compare_all(DiffRun *run, int only, Err *err)
{
    bool prefixes = mesh_sequence_is_prefix(run->name[0]) && mesh_sequence_is_prefix(run->name[1]), any = false;
    for (int k = 0; only == NONE && prefixes && k < 2; k++) {
        if (!mesh_sequence_is_there(run->name[0], kind_name[k]) && !mesh_sequence_is_there(run->name[1], kind_name[k]))
            continue;
        if (!compare_kind(run, kind_name[k], err)) return false;
        any = true;
    }
    return any || compare_kind(run, kind_name[only == NONE ? 0 : only], err);
}

/* --- the command ---------------------------------------------------------------------------------- */

static int diff_run(Options *o)
{
    if (o->noperand != 2) {
        fputs("twinmesh diff: two meshes or sequences are to be named, such as golden/splash out/splash\n", stderr);
        return TROUBLE;
    }
    double tolerance = option_real(o, DIFF_TOLERANCE);
    DiffRun run = {
        .settings = {.tolerance = tolerance,
                     .normals_deg = option_given(o, DIFF_NORMALS) ? option_real(o, DIFF_NORMALS)
                                    : tolerance > 0               ? 180
                                                                  : 0,
                     .values = option_given(o, DIFF_VALUES) ? option_real(o, DIFF_VALUES)
                               : tolerance > 0              ? INFINITY
                                                            : 0,
                     .surface = option_given(o, DIFF_SURFACE)},
        .quiet = option_given(o, DIFF_QUIET),
        .as_json = option_given(o, DIFF_JSON),
        .name = {o->operand[0], o->operand[1]},
    };
    Err err = {0};
    thread_set_count(option_given(o, DIFF_THREADS) ? option_int(o, DIFF_THREADS) : thread_hardware_count());
    if (!compare_all(&run, option_given(o, DIFF_KIND) ? option_choice(o, DIFF_KIND) : NONE, &err)) {
        fprintf(stderr, "twinmesh diff: %s\n", err.text);
        return TROUBLE;
    }
    bool same = run.count[OTHER] + run.count[ONLY_A] + run.count[ONLY_B] == 0;
    tell_all(&run, same);
    if (fflush(stdout) == 0) return same ? SAME : DIFFERENT;
    fputs("twinmesh diff: standard output cannot be written\n", stderr);
    return TROUBLE;
}

const Command diff_command = {&diff_options, "twinmesh diff A B\n\n"
    "Compares two meshes or sequences frame by frame: PLY files, patterns or folders of them, glTF, or what mesh was\n"
    "given as -o. Exit status: 0 the same, 1 different, 2 trouble.", NULL, diff_run};
