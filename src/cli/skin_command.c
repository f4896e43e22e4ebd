#include "cli/command.h"

#include "base/thread.h"
#include "cli/run.h"
#include "cli/skin_source.h"
#include "cli/stop.h"
#include "io/volume_write.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SUBSTEPS_MAX = 1000 };  /* a frame */
#define SETTLE_TRACKED 8.0     /* ALPHA times time after which e^-8 of the way is left */
#define SETTLE_FRAMES 32.0     /* the first frame is given this much time to settle in at most */
#define TENSION_POINTS 0.1     /* GI'98: figure 4's */
#define TENSION_GRIDS 0.01     /* figure 5's */

typedef struct SkinRun {
    Console console;
    const Options *options;
    int nbehind;               /* arguments behind `--`, for mesh */
    char **behind;
    const char *pattern;       /* NULL: no grids are written */
    SkinReading reading;
    bool has_scene, alone;
    Scene scene;
    Sequence sequence;
    SkinShape start;           /* --from */
    SkinTarget *to;            /* --to */
    SkinLattice lattice;
    SkinSettings settings;
    double time;               /* a frame */
    Skin *skin;
    int done;
} SkinRun;

/* --- settings --------------------------------------------------------------------------------------------------------- */

static bool choose_settings(SkinRun *run, const SkinShape *first, Err *err)
{
    const Options *o = run->options;
    run->lattice = first->lattice;
    double band = SKIN_BAND_VOXELS * run->lattice.voxel;
    double unit = option_real(o, SKIN_UNIT) * (o->value[SKIN_UNIT].in_voxels ? run->lattice.voxel : 1) / band;
    double tension = option_given(o, SKIN_TENSION) ? option_real(o, SKIN_TENSION) : first->is_points ? TENSION_POINTS : TENSION_GRIDS;
    run->settings = (SkinSettings){.alpha = option_real(o, SKIN_TRACK), .beta = tension * unit * unit, .gamma = option_real(o, SKIN_GAMMA) * unit,
                                   .keep = (SkinKeep)option_choice(o, SKIN_KEEP)};
    double alpha = run->settings.alpha;
    run->time = 1;
    if (run->to || option_given(o, SKIN_TO)) run->time = (alpha > 0 ? SETTLE_TRACKED / alpha : SETTLE_TRACKED) / int_max(sequence_length(&run->sequence) - 1, 1);
    if (option_given(o, SKIN_TIME)) run->time = option_real(o, SKIN_TIME);
    double substeps = skin_substeps(&run->settings, run->time);
    if (substeps > SUBSTEPS_MAX)
        return fail(err, ERR_USAGE, "--tension %.6g, --track %.6g: take %.0f substeps a frame to be stable (eq. 7: dx^2 / 6 beta), and %d are made at most; give less tension, a smaller --time or a larger --voxel",
                    tension, alpha, substeps, SUBSTEPS_MAX);
    console_note(&run->console, "voxel %.6g, alpha %.6g, beta %.6g (%.6g voxels^2 a frame), time a frame %.6g", run->lattice.voxel, alpha, tension,
                 run->settings.beta * SKIN_BAND_VOXELS * SKIN_BAND_VOXELS * run->time, run->time);
    return true;
}

/* --- frames ------------------------------------------------------------------------------------------------------------- */

static bool write_skin(SkinRun *run, const Frame *frame, const Grid *g, Err *err)
{
    char path[FRAME_PATH_MAX];
    return pattern_name(run->pattern, frame->number, run->alone, path, err) && volume_write(path, g, err) && command_print_name(path, err);
}

/* The target of a frame, and on the first of all the lattice. */
static SkinTarget *read_target(SkinRun *run, const Frame *frame, Err *err)
{
    SkinShape shape;
    bool ok = run->has_scene ? skinshape_of_scene(&shape, &run->reading, &run->scene, frame->number, err) : skinshape_read(&shape, &run->reading, frame->path, err);
    if (!ok) return NULL;
    if (shape.said[0]) console_note(&run->console, "%s", shape.said);
    SkinTarget *t = NULL;
    if (run->skin || run->start.lattice.voxel > 0 || choose_settings(run, &shape, err)) t = skinshape_target(&shape, &run->reading, &run->lattice, err);
    skinshape_free(&shape);
    return t;
}

/* The first frame: at rest on its target, or where --from says. */
static bool begin_skin(SkinRun *run, const SkinTarget *target, Err *err)
{
    if (run->start.lattice.voxel > 0) {
        SkinTarget *start = skinshape_target(&run->start, &run->reading, &run->lattice, err);
        if (!start) return false;
        run->skin = skin_begin(&run->lattice, &run->settings, start);
        skin_target_free(start);
        return true;
    }
    run->skin = skin_begin(&run->lattice, &run->settings, target);
    if (run->settings.alpha > 0) skin_move(run->skin, target, real_min(SETTLE_TRACKED / run->settings.alpha, SETTLE_FRAMES * run->time));
    return true;
}

static bool move_skin(SkinRun *run, const Frame *frame, Err *err)
{
    const SkinTarget *target = run->to;
    SkinTarget *own = NULL;
    if (!target) {
        target = own = read_target(run, frame, err);
        if (!own) return false;
    }
    bool ok = true;
    if (!run->skin) {
        ok = begin_skin(run, target, err);
    } else {
        SkinStat s = skin_move(run->skin, target, run->time);
        console_detail(&run->console, "frame %s: substeps %d, bricks %d, components born %d, area %.6g, volume %.6g, last speed %.3g voxels a frame", frame->digits, s.substeps,
                       s.bricks, s.born, s.area, s.volume, s.speed * run->time);
    }
    skin_target_free(own);
    return ok;
}

/* The skin at a frame, also written where that is wanted. */
static bool make_frame(SkinRun *run, const Frame *frame, Grid *g, Err *err)
{
    if (!move_skin(run, frame, err)) return false;
    skin_to_grid(run->skin, g);
    return !run->pattern || write_skin(run, frame, g, err);
}

/* Also ends, as done, where a signal asks for an end between frames. */
static bool make_all(SkinRun *run, Err *err)
{
    Frame *frame = NEW(Frame, 1);
    SequenceStep step = SEQUENCE_END;
    bool ok = true;
    while (ok && !stop_signal() && (step = sequence_next(&run->sequence, frame, err)) == SEQUENCE_FRAME) {
        Grid g;
        grid_init(&g, 1);
        ok = make_frame(run, frame, &g, err);
        grid_free(&g);
        run->done += ok;
        console_progress(&run->console, run->done, int_max(sequence_length(&run->sequence), 0));
    }
    mem_free(frame);
    return ok && (step != SEQUENCE_ERROR || stop_signal());
}

/* --- the run ------------------------------------------------------------------------------------------------------------ */

/* --frames N: 1 to N; A-B as it stands. */
static bool open_numbers(const SkinRun *run, Sequence *out, Err *err)
{
    const char *text = option_text(run->options, SKIN_FRAMES);
    FrameRange r;
    if (!text) return fail(err, ERR_USAGE, "--to: --frames N is missing, the number of frames that the metamorphosis is to take");
    if (!frame_range_parse(text, &r, err)) return false;
    if (r.first == r.last) r.first = 1;
    return sequence_open_numbers(out, option_text(run->options, SKIN_TO), r.first, r.last, NULL, err);
}

static bool check_morph(const Options *o, Err *err)
{
    if (o->noperand) return fail(err, ERR_USAGE, "--to is the target of all frames: name no others");
    if (!option_given(o, SKIN_FROM)) return fail(err, ERR_USAGE, "--to: --from is missing, the file where the metamorphosis begins");
    return true;
}

/* A FieldSource's `open`: once for this command, and for mesh as often as it wants. */
static bool open_sequence(void *maker, Sequence *out, Err *err)
{
    const SkinRun *run = maker;
    const Options *o = run->options;
    const char *frames = option_text(o, SKIN_FRAMES);
    if (option_given(o, SKIN_TO)) return check_morph(o, err) && open_numbers(run, out, err);
    if (run->has_scene) return sequence_open_numbers(out, run->scene.path, run->scene.first, run->scene.last, frames, err);
    return sequence_open(out, o->noperand, o->operand, frames, skin_is_known, err);
}

static bool open_frames(SkinRun *run, Err *err)
{
    const Options *o = run->options;
    if (o->noperand == 0 && !option_given(o, SKIN_TO)) return fail(err, ERR_USAGE, "no target is named: give files, a pattern such as parts.####.vdb, a folder, -, a scene, or --from and --to");
    if (o->noperand == 1 && scene_is_known(o->operand[0])) {
        if (!scene_load(o->operand[0], &run->scene, err)) return false;
        run->has_scene = true;
    }
    return open_sequence(run, &run->sequence, err);
}

static bool open_ends(SkinRun *run, Err *err)
{
    const char *from = option_text(run->options, SKIN_FROM), *to = option_text(run->options, SKIN_TO);
    if (!from) return true;
    if (!skinshape_read(&run->start, &run->reading, from, err) || !choose_settings(run, &run->start, err)) return false;
    if (!to) return true;
    SkinShape end;
    if (!skinshape_read(&end, &run->reading, to, err)) return false;
    run->to = skinshape_target(&end, &run->reading, &run->lattice, err);
    skinshape_free(&end);
    return run->to != NULL;
}

static bool check_outputs(SkinRun *run, Err *err)
{
    const Options *o = run->options;
    run->pattern = option_text(o, SKIN_OUTPUT);
    if (!run->pattern && !option_given(o, SKIN_MESH)) return fail(err, ERR_USAGE, "-o PATTERN is missing: give the names of the files, such as -o skin.####.vdb, or --mesh PREFIX");
    if (run->pattern && !volume_can_write(run->pattern)) return fail(err, ERR_USAGE, "--output %.400s: volumes are written as .vdb, .npy or .exr; end the name so", run->pattern);
    if (run->nbehind && !option_given(o, SKIN_MESH)) return fail(err, ERR_USAGE, "what stands behind -- is for --mesh, which is missing");
    return true;
}

static bool skin_open(SkinRun *run, Err *err)
{
    char first[FRAME_PATH_MAX];
    if (!check_outputs(run, err) || !open_frames(run, err)) return false;
    run->alone = sequence_length(&run->sequence) == 1;
    return (!run->pattern || pattern_name(run->pattern, 1, run->alone, first, err)) && open_ends(run, err);
}

static void skin_close(SkinRun *run)
{
    if (run->skin) skin_end(run->skin);
    skin_target_free(run->to);
    skinshape_free(&run->start);
    sequence_close(&run->sequence);
    if (run->has_scene) scene_free(&run->scene);
}

/* --- meshes of it ------------------------------------------------------------------------------------------------------- */

/* A FieldSource's `next`. */
static bool next_field(void *maker, const Frame *frame, Field *out, Err *err)
{
    Grid g;
    grid_init(&g, 1);
    bool ok = make_frame(maker, frame, &g, err) && field_build(out, &g, &(FieldSpec){.inside_below = true}, err);
    grid_free(&g);
    return ok;
}

/* The job of `mesh -o PREFIX` with the options behind `--`. `prefix`: --output=PREFIX, which the job borrows from. */
static bool mesh_job(SkinRun *run, char *prefix, MeshJob *job, Options *o, Err *err)
{
    static char frames[] = "skin"; /* stands for them, for as long as the options do */
    char **argv = NEW(char *, run->nbehind + 2);
    argv[0] = frames;
    for (int i = 0; i < run->nbehind; i++) argv[1 + i] = run->behind[i];
    argv[run->nbehind + 1] = prefix;
    bool ok = options_parse(o, run->nbehind + 2, argv, err) && job_make(job, o, err);
    mem_free(argv);
    if (!ok) return false;
    if (o->noperand > 1 || job->frames || job->resume || job->start_from || job->follow)
        return fail(err, ERR_USAGE, "--mesh: the frames are the skin's; --frames, --follow, --resume and --start-from do not go behind --");
    job->source = (FieldSource){open_sequence, next_field, run};
    job->threads = thread_count();
    job->loudness = run->console.loudness;
    return true;
}

/* The skin moves in the thread that reads ahead, while the frame before is solved. */
static int skin_mesh(SkinRun *run, Err *err)
{
    const char *text = option_text(run->options, SKIN_MESH);
    size_t size = strlen(text) + sizeof "--output=";
    char *prefix = NEW(char, size);
    snprintf(prefix, size, "--output=%s", text);
    Run mesh = {0};
    Options o = {0};
    bool ok = mesh_job(run, prefix, &mesh.job, &o, err);
    int status = ok ? run_job(&mesh, &o) : (int)err->code;
    job_free(&mesh.job);
    options_free(&o);
    mem_free(prefix);
    return status;
}

static int say_end(SkinRun *run, bool ok, Err *err)
{
    if (ok && run->done == 0 && !stop_signal()) ok = fail(err, ERR_INPUT, "there were no frames to read");
    if (!ok && err->code == ERR_USAGE) fprintf(stderr, "twinmesh skin: %s\n", err->text);
    else if (!ok) console_problem(&run->console, "%s", err->text);
    if (ok && stop_signal()) {
        console_problem(&run->console, "stopped by a signal; %d finished frames are kept", run->done);
        return 128 + stop_signal();
    }
    return ok ? 0 : (int)err->code;
}

static int skin_run(Options *o)
{
    SkinRun own = {.options = o, .nbehind = o->noperand - o->behind, .behind = o->operand + o->behind}, *run = &own;
    Err err = {0};
    o->noperand = o->behind; /* the others are mesh's arguments */
    run->console = console_make(option_given(o, SKIN_QUIET) ? LOUD_QUIET : option_given(o, SKIN_VERBOSE) ? LOUD_VERBOSE : LOUD_NORMAL);
    thread_set_count(option_given(o, SKIN_THREADS) ? option_int(o, SKIN_THREADS) : thread_hardware_count());
    run->reading = skin_reading(o);
    int status;
    bool ok = skin_open(run, &err);
    if (ok && option_given(o, SKIN_MESH)) {
        status = skin_mesh(run, &err);
        if (err.code != ERR_NONE) fprintf(stderr, "twinmesh skin: %s\n", err.text);
    } else {
        ok = ok && make_all(run, &err);
        console_clear(&run->console);
        status = say_end(run, ok, &err);
    }
    skin_close(run);
    return status;
}

const Command skin_command = {&skin_options, "twinmesh skin FRAME... -o PATTERN\n"
    "twinmesh skin --from FILE --to FILE --frames N -o PATTERN\n"
    "twinmesh skin ... --mesh PREFIX [-- OPTION OF MESH...]\n\n"
    "Moves a skin towards particles, grids or a scene, frame by frame, with surface tension, and writes it as a\n"
    "sequence of level sets, each named on standard output when it is finished. FRAME is what `mesh` takes, or\n"
    "particles: .ply, .npy (n x 3), or a point grid of a .vdb. With --mesh the skin is followed at once.", NULL, skin_run};
