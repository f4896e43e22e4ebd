#include "cli/command.h"

#include "base/thread.h"
#include "cli/console.h"
#include "cli/options.h"
#include "cli/stop.h"
#include "io/volume_write.h"
#include "scene/scene.h"
#include "sequence/pattern.h"

#include <stdio.h>
#include <stdlib.h>

typedef struct FieldRun {
    Console console;
    const char *pattern;
    Scene scene;
    Sequence sequence;
    int done;
} FieldRun;

static bool write_frame(FieldRun *run, int64_t number, Err *err)
{
    char path[FRAME_PATH_MAX];
    if (!pattern_name(run->pattern, number, sequence_length(&run->sequence) == 1, path, err)) return false;
    SceneFrame *f = scene_frame(&run->scene, number);
    Grid g;
    grid_init(&g, 1);
    bool ok = scene_fill_grid(f, true, &g, err) && volume_write(path, &g, err);
    if (ok) console_detail(&run->console, "frame %lld: %d blocks of 8^3 samples, %d tiles", (long long)number, g.nblock, g.ntile);
    grid_free(&g);
    scene_frame_free(f);
    return ok && command_print_name(path, err);
}

/* Also ends, as done, where a signal asks for an end between frames. */
static bool write_all(FieldRun *run, Err *err)
{
    Frame *frame = NEW(Frame, 1);
    bool ok = true;
    while (ok && !stop_signal() && sequence_next(&run->sequence, frame, err) == SEQUENCE_FRAME) {
        ok = write_frame(run, frame->number, err);
        run->done += ok;
        console_progress(&run->console, run->done, sequence_length(&run->sequence));
    }
    mem_free(frame);
    return ok;
}

/* The fewest digits that mean the number. */
static const char *say_real(double x, char out[32])
{
    for (int digits = 6; digits <= 17; digits++) {
        snprintf(out, 32, "%.*g", digits, x);
        if (strtod(out, NULL) == x) break;
    }
    return out;
}

/* .npy cannot say it itself. */
static void say_place(FieldRun *run)
{
    const Scene *s = &run->scene;
    char text[4][32];
    console_note(&run->console, "%d x %d x %d samples, negative inside; a .npy is to be read with --spacing %s --origin %s,%s,%s", s->n[0], s->n[1], s->n[2],
                 say_real(s->voxel, text[0]), say_real(s->origin.x, text[1]), say_real(s->origin.y, text[2]), say_real(s->origin.z, text[3]));
}

static bool field_open(FieldRun *run, const Options *o, Err *err)
{
    char first[FRAME_PATH_MAX];
    run->pattern = option_text(o, FIELD_OUTPUT);
    if (o->noperand != 1) return fail(err, ERR_USAGE, "one scene is to be named, such as scene.json");
    if (!run->pattern) return fail(err, ERR_USAGE, "-o PATTERN is missing: give the names of the files, such as -o phi.####.vdb");
    if (!volume_can_write(run->pattern)) return fail(err, ERR_USAGE, "--output %.400s: volumes are written as .vdb, .npy or .exr; end the name so", run->pattern);
    if (!scene_load(o->operand[0], &run->scene, err)) return false;
    const Scene *s = &run->scene;
    if (!sequence_open_numbers(&run->sequence, s->path, s->first, s->last, option_text(o, FIELD_FRAMES), err)) return false;
    return pattern_name(run->pattern, s->first, sequence_length(&run->sequence) == 1, first, err);
}

static int field_run(Options *o)
{
    FieldRun own = {0}, *run = &own;
    Err err = {0};
    Loudness loud = option_given(o, FIELD_QUIET) ? LOUD_QUIET : option_given(o, FIELD_VERBOSE) ? LOUD_VERBOSE : LOUD_NORMAL;
    run->console = console_make(loud);
    thread_set_count(option_given(o, FIELD_THREADS) ? option_int(o, FIELD_THREADS) : thread_hardware_count());
    bool opened = field_open(run, o, &err), ok = opened;
    if (opened) say_place(run);
    if (opened) ok = write_all(run, &err);
    console_clear(&run->console);
    sequence_close(&run->sequence);
    scene_free(&run->scene);
    if (!ok && !opened && err.code == ERR_USAGE) fprintf(stderr, "twinmesh field: %s\n", err.text);
    else if (!ok) console_problem(&run->console, "%s", err.text);
    if (ok && stop_signal()) {
        console_problem(&run->console, "stopped by a signal; %d finished frames are kept", run->done);
        return 128 + stop_signal();
    }
    return ok ? 0 : (int)err.code;
}

const Command field_command = {&field_options, "twinmesh field SCENE.json -o PATTERN\n\n"
    "Samples a scene of skeleton elements into a sequence of volumes, negative inside, and names each on standard\n"
    "output when it is finished. The ending of PATTERN chooses the format: .vdb, .npy or .exr.", NULL, field_run};
