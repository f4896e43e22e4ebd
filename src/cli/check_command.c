#include "cli/command.h"

#include "base/thread.h"
#include "cli/check_table.h"
#include "cli/console.h"
#include "cli/fields.h"
#include "cli/run_report.h"
#include "cli/stop.h"
#include "cli/volume_options.h"
#include "io/mesh_sequence.h"

#include <stdio.h>
#include <string.h>

/* The mechanical mesh comes first: the geometric one names its triangles. */
enum { MECHANICAL, GEOMETRIC, KINDS };
static const char *const kind_name[KINDS] = {"mechanical", "geometric"};

typedef struct KindRun {
    MeshSequence *meshes;  /* NULL: not checked */
    TriMesh mesh, last;    /* of this frame and the one before */
    bool has_mesh, has_last;
} KindRun;

typedef struct CheckRun {
    Console console;
    RunReport report;
    CheckSettings settings;
    CheckTable table;
    Fields fields;
    KindRun kind[KINDS];
    FieldFrame frame, last;
    bool has_last;         /* the frame before had a field */
    bool as_json;
    ErrCode trouble;       /* the first thing that could not be read */
    int done;
} CheckRun;

/* --- one frame ------------------------------------------------------------------------------------ */

static void say_trouble(CheckRun *run, const Err *err)
{
    console_problem(&run->console, "frame %s: %s", run->frame.frame.digits, err->text);
    if (run->trouble == ERR_NONE) run->trouble = err->code;
}

/* A glTF that shows nothing has an empty mesh. */
static bool read_mesh(KindRun *k, int64_t number, TriMesh *mesh, Err *err)
{
    int i = mesh_sequence_find(k->meshes, number);
    *mesh = (TriMesh){0};
    if (i != NONE) return mesh_sequence_read(k->meshes, i, mesh, err);
    if (!mesh_sequence_is_gltf(k->meshes)) return fail(err, ERR_INPUT, "it has no mesh beside those of other frames");
    trimesh_init(mesh, 0, 0, false, false);
    return true;
}

static void check_kind(CheckRun *run, int which, const CheckSurface *surface)
{
    KindRun *k = &run->kind[which];
    CheckRow row = check_row_empty();
    Err err;
    trimesh_free(&k->last);
    k->last = k->mesh;
    k->has_last = k->has_mesh && run->has_last;
    k->has_mesh = read_mesh(k, run->frame.frame.number, &k->mesh, &err);
    if (!k->has_mesh) {
        say_trouble(run, &err);
        return;
    }
    CheckSettings settings = run->settings;
    if (which == GEOMETRIC) settings.edge = 0; /* it is refined by curvature: no length was aimed at */
    check_mesh(&settings, surface, &k->mesh, &row);
    check_ids(&k->mesh, &row);
    if (k->has_last) check_motion(&run->last.field, &k->last, &run->frame.field, &k->mesh, &row);
    if (k->mesh.parent && run->kind[MECHANICAL].has_mesh) check_parents(&k->mesh, run->kind[MECHANICAL].mesh.ntri, &row);
    bool passed = check_table_add(&run->table, kind_name[which], run->frame.frame.digits, &row);
    if (run->as_json) check_table_print_row(&run->table, run->table.nrow - 1, stdout);
    console_detail(&run->console, "frame %s: %s: %s", run->frame.frame.digits, kind_name[which],
                   passed ? "within all limits" : "past a limit");
}

static void check_frame(CheckRun *run)
{
    Err err;
    bool good = fields_read(&run->fields, &run->frame, &err);
    if (!good) say_trouble(run, &err);
    if (good && run->frame.surface[0]) console_note(&run->console, "%s", run->frame.surface);
    CheckSurface *surface = good ? check_surface_make(&run->frame.field) : NULL;
    for (int k = 0; k < KINDS; k++) {
        if (good && run->kind[k].meshes) check_kind(run, k, surface);
        else trimesh_free(&run->kind[k].mesh), run->kind[k].has_mesh = false;
    }
    check_surface_free(surface);
    fieldframe_free(&run->last);
    run->last = run->frame;
    run->has_last = good;
    run->frame = (FieldFrame){0};
}

static bool check_all(CheckRun *run, Err *err)
{
    while (!stop_signal()) {
        SequenceStep step = fields_next(&run->fields, &run->frame, err);
        if (step != SEQUENCE_FRAME) return step == SEQUENCE_END;
        check_frame(run);
        console_progress(&run->console, ++run->done, int_max(sequence_length(&run->fields.sequence), 0));
    }
    return true;
}

/* --- the run -------------------------------------------------------------------------------------- */

/* Of a PREFIX those that are asked for, or are there; a file's are geometric unless its name says otherwise. */
static bool open_meshes(CheckRun *run, const Options *o, Err *err)
{
    const char *name = option_text(o, CHECK_OPT_MESHES);
    bool prefix = mesh_sequence_is_prefix(name);
    int only = strstr(name, "mechanical") ? MECHANICAL : GEOMETRIC;
    if (option_given(o, CHECK_OPT_KIND)) only = option_choice(o, CHECK_OPT_KIND) == 0 ? GEOMETRIC : MECHANICAL;
    else if (prefix && mesh_sequence_is_there(name, "geometric"))
        only = mesh_sequence_is_there(name, "mechanical") ? NONE : GEOMETRIC;
    else if (prefix) only = mesh_sequence_is_there(name, "mechanical") ? MECHANICAL : GEOMETRIC;
    for (int k = 0; k < KINDS; k++) {
        if (only != NONE && only != k) continue;
        run->kind[k].meshes = mesh_sequence_open(name, kind_name[k], err);
        if (!run->kind[k].meshes) return false;
    }
    return true;
}

static bool any_is_gltf(const CheckRun *run)
{
    for (int k = 0; k < KINDS; k++)
        if (run->kind[k].meshes && mesh_sequence_is_gltf(run->kind[k].meshes)) return true;
    return false;
}

/* A glTF's frames are those of its run, or where that left no report those of the volumes. */
static bool number_meshes(CheckRun *run, const Options *o, Err *err)
{
    if (!any_is_gltf(run)) return true;
    int64_t first = run->report.first, step = run->report.step, last = NONE;
    Fields all = {0};
    FieldFrame *frame = NEW(FieldFrame, 1);
    bool good = first != NONE || fields_open(&all, o, err);
    if (good && first == NONE && sequence_length(&all.sequence) != NONE) {
        for (step = 0; fields_next(&all, frame, err) == SEQUENCE_FRAME; last = frame->frame.number) {
            if (first == NONE) first = frame->frame.number;
            else if (step == 0) step = frame->frame.number - last;
        }
    }
    fields_close(&all);
    mem_free(frame);
    for (int k = 0; good && first != NONE && k < KINDS; k++)
        if (run->kind[k].meshes) mesh_sequence_number_from(run->kind[k].meshes, first, step > 0 ? step : 1);
    return good;
}

static bool check_open(CheckRun *run, Options *o, Err *err)
{
    const char *name = option_text(o, CHECK_OPT_MESHES);
    if (!name) return fail(err, ERR_USAGE, "--meshes PREFIX is missing: name the meshes, such as -m out/splash");
    if (o->noperand == 0)
        return fail(err, ERR_USAGE,
                    "no frames are named: give the volumes that the meshes were made from, such as 'phi.####.vdb'");
    run->report = run_report_read(name);
    if (!run_report_suggest(&run->report, o, err)) return false;
    run->settings = (CheckSettings){.edge = option_given(o, CHECK_OPT_EDGE) ? option_real(o, CHECK_OPT_EDGE) : 0,
                                    .edge_in_voxels = o->value[CHECK_OPT_EDGE].in_voxels,
                                    .open_border = volume_options_border_is_open(o),
                                    .quick = option_given(o, CHECK_OPT_QUICK)};
    return check_table_open(&run->table, option_text(o, CHECK_OPT_LIMIT), err) && open_meshes(run, o, err) &&
           number_meshes(run, o, err) && fields_open(&run->fields, o, err);
}

static void check_close(CheckRun *run)
{
    for (int k = 0; k < KINDS; k++) {
        mesh_sequence_close(run->kind[k].meshes);
        trimesh_free(&run->kind[k].mesh);
        trimesh_free(&run->kind[k].last);
    }
    fieldframe_free(&run->last);
    fields_close(&run->fields);
    check_table_free(&run->table);
    run_report_free(&run->report);
}

static int check_with(CheckRun *run, Options *o)
{
    Err err = {0};
    Loudness loud = option_given(o, CHECK_OPT_QUIET)     ? LOUD_QUIET
                    : option_given(o, CHECK_OPT_VERBOSE) ? LOUD_VERBOSE
                                                         : LOUD_NORMAL;
    run->console = console_make(loud);
    run->as_json = option_given(o, CHECK_OPT_JSON);
    thread_set_count(option_given(o, CHECK_OPT_THREADS) ? option_int(o, CHECK_OPT_THREADS) : thread_hardware_count());
    bool opened = check_open(run, o, &err), ok = opened && check_all(run, &err);
    console_clear(&run->console);
    bool passed = opened && check_table_passed(&run->table);
    if (opened && run->as_json) check_table_print_summary(&run->table, stdout);
    else if (opened) check_table_print(&run->table, stdout);
    if (opened && fflush(stdout) != 0) ok = fail(&err, ERR_OUTPUT, "standard output cannot be written");
    check_close(run);
    if (!ok) console_problem(&run->console, "%s", err.text);
    if (stop_signal()) return 128 + stop_signal();
    return !ok ? (int)err.code : run->trouble != ERR_NONE ? (int)run->trouble : passed ? 0 : ERR_CHECK;
}

static int check_run(Options *o)
{
    CheckRun *run = NEW0(CheckRun, 1);
    int status = check_with(run, o);
    mem_free(run);
    return status;
}

static void print_options(FILE *out)
{
    options_print_table(out, &check_options);
    check_figures_print(out);
}

const Command check_command = {&check_options, "twinmesh check FRAME... --meshes PREFIX\n\n"
    "Measures meshes against the volumes, or the scene, they were made from, and says where they pass a limit.\n"
    "What a run was told of the surface is taken from its PREFIX.report.jsonl where that is there.", print_options, check_run};
