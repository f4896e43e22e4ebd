#include "cli/command.h"

#include "base/thread.h"
#include "cli/console.h"
#include "cli/render_source.h"
#include "cli/stop.h"
#include "io/image.h"
#include "io/png.h"
#include "render/render.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { SIDE_MOST = 16384, COLUMNS = 3 };

typedef struct RenderRun {
    Console console;
    const Options *options;
    const char *pattern;
    bool exr, png, print;
    int width, height;
    unsigned layers;
    bool papers;
    RenderLook look;
    RenderSource source;
    Renderer *renderer;
    Bounds bounds;           /* of all frames; of the first one where they arrive */
    Fit fit;                 /* likewise */
    Camera camera;           /* of the first frame */
    Vec3 eye, target, up;    /* eye: of --camera */
    double turn_deg;         /* a frame number */
    int64_t first;
    bool has_view;
    int done;
} RenderRun;

/* --- what the options say ---------------------------------------------------------------------------- */

static bool parse_size(const char *text, int *width, int *height, Err *err)
{
    char end;
    bool two = sscanf(text, "%6dx%6d%c", width, height, &end) == 2;
    if (two && *width >= 1 && *height >= 1 && *width <= SIDE_MOST && *height <= SIDE_MOST) return true;
    return fail(err, ERR_USAGE, "--size %.100s: must be WxH, such as 1920x1080, each from 1 to %d", text, SIDE_MOST);
}

static bool parse_camera(const char *text, Vec3 *eye, Vec3 *target, Err *err)
{
    double x[6] = {0};
    const char *at = text;
    int n = 0;
    for (char *end; n < 6; n++, at = end + (*end == ',')) {
        x[n] = strtod(at, &end);
        if (end == at || !(fabs(x[n]) <= RENDER_REACH) || *end != (n < 5 ? ',' : 0)) break;
    }
    *eye = vec3(x[0], x[1], x[2]);
    *target = vec3(x[3], x[4], x[5]);
    return (n == 6 && v_dist(*eye, *target) > 0) ||
           fail(err, ERR_USAGE, "--camera %.200s: must be EX,EY,EZ,TX,TY,TZ: the eye, and another place to look at", text);
}

static bool ends_in(const char *path, const char *ending)
{
    size_t n = strlen(path), e = strlen(ending);
    return n > e && strcasecmp(path + n - e, ending) == 0;
}

static bool choose_output(RenderRun *run, const Options *o, Err *err)
{
    run->pattern = option_text(o, RENDER_OUTPUT);
    if (!run->pattern) return fail(err, ERR_USAGE, "-o PATTERN is missing: give the names of the pictures, such as -o pic.####.exr");
    run->exr = ends_in(run->pattern, ".exr");
    run->png = option_given(o, RENDER_PNG) || ends_in(run->pattern, ".png");
    if (!run->exr && !ends_in(run->pattern, ".png"))
        return fail(err, ERR_USAGE, "--output %.400s: pictures are written as .exr or .png; end the name so", run->pattern);
    run->layers = run->exr ? o->value[RENDER_LAYERS].set : 1u << LAYER_BEAUTY;
    return !run->png || (run->layers >> LAYER_BEAUTY & 1) ||
           fail(err, ERR_USAGE, "--layers %s: a .png is made of the beauty; name it too", option_text(o, RENDER_LAYERS));
}

static bool choose_look(RenderRun *run, const Options *o, Err *err)
{
    bool mechanical = option_choice(o, RENDER_KIND) == 1;
    int wire = option_choice(o, RENDER_WIRE); /* none, geometric, mechanical */
    run->papers = option_choice(o, RENDER_STYLE) == 1;
    run->look = (RenderLook){.samples = option_int(o, RENDER_SAMPLES), .cell = option_given(o, RENDER_CELL) ? option_real(o, RENDER_CELL) : 0};
    if (run->papers) {
        if (option_given(o, RENDER_KIND) || option_given(o, RENDER_WIRE) || option_given(o, RENDER_TEXTURE) || option_given(o, RENDER_LAYERS))
            return fail(err, ERR_USAGE,
                        "--style papers has a kind, wires, a texture and layers of its own; leave out --kind, --wire, --texture, "
                        "--layers");
        run->layers = 1u << LAYER_BEAUTY;
        run->look.surface = SURFACE_CHECKER;
        return run->width >= COLUMNS || fail(err, ERR_USAGE, "--size %s: three columns need a width of 3", option_text(o, RENDER_SIZE));
    }
    if (mechanical && wire == 1)
        return fail(err, ERR_USAGE,
                    "--wire geometric: the edges of the geometric mesh are not on the mechanical one; leave out --kind mechanical");
    run->look.surface = option_choice(o, RENDER_TEXTURE) == 1 ? SURFACE_CHECKER : SURFACE_CLAY;
    run->look.wire = wire == 0 ? WIRE_NONE : wire == 2 && !mechanical ? WIRE_PARENTS : WIRE_TRIANGLES;
    return true;
}

/* --- the view ---------------------------------------------------------------------------------------- */

static void measure(RenderRun *run, const TriMesh *m)
{
    bounds_add_mesh(&run->bounds, m);
    fit_add_mesh(&run->fit, m);
}

static bool measure_all(RenderRun *run, Err *err)
{
    RenderShot shot;
    SequenceStep step;
    while (!stop_signal() && (step = render_source_next(&run->source, false, &shot, err)) != SEQUENCE_END) {
        if (step == SEQUENCE_ERROR) return false;
        measure(run, shot.mesh);
    }
    render_source_rewind(&run->source);
    return true;
}

static int column_width(const RenderRun *run) { return run->papers ? run->width / COLUMNS : run->width; }

/* From the front, somewhat from the right and above. */
static void begin_view(RenderRun *run)
{
    static const Vec3 from_z_up = {0.45, -1, 0.42}, from_y_up = {0.45, 0.42, 1};
    bool z_up = option_choice(run->options, RENDER_UP) == 1;
    run->up = z_up ? vec3(0, 0, 1) : vec3(0, 1, 0);
    run->bounds = bounds_none();
    run->fit = fit_begin(z_up ? from_z_up : from_y_up, run->up, option_real(run->options, RENDER_FOV), column_width(run), run->height);
}

/* Once all is measured. */
static void set_view(RenderRun *run)
{
    const Options *o = run->options;
    if (option_given(o, RENDER_CAMERA)) {
        run->camera = camera_make(run->eye, run->target, run->up, option_real(o, RENDER_FOV), column_width(run), run->height);
    } else {
        run->target = bounds_centre(&run->bounds);
        run->camera = run->turn_deg == 0 ? fit_camera(&run->fit) : fit_turning(&run->fit, &run->bounds, run->up);
    }
    if (!(run->look.cell > 0)) run->look.cell = bounds_size(&run->bounds) / 24;
    run->has_view = true;
}

static void set_turn(RenderRun *run)
{
    int n = render_source_length(&run->source);
    if (n == NONE) return;
    run->first = render_source_first(&run->source);
    double span = (double)(render_source_last(&run->source) - run->first);
    if (n > 1) run->turn_deg = option_real(run->options, RENDER_ORBIT) * (n - 1) / (span * n);
}

static Camera camera_of(const RenderRun *run, int64_t number)
{
    if (run->turn_deg == 0) return run->camera;
    return camera_turned(&run->camera, run->target, run->up, run->turn_deg * (double)(number - run->first));
}

/* --- writing ----------------------------------------------------------------------------------------- */

static ImageType image_type(PlaneKind kind, bool half)
{
    return kind == PLANE_NUMBER ? IMAGE_UINT : kind == PLANE_SMALL && half ? IMAGE_HALF : IMAGE_FLOAT;
}

static bool write_exr(const RenderRun *run, const Picture *p, const char *path, Err *err)
{
    ImageChannel channel[PLANE_COUNT];
    const void *plane[PLANE_COUNT];
    int n = 0;
    for (int id = 0; id < PLANE_COUNT; id++) {
        if (!p->plane[id]) continue;
        channel[n] = (ImageChannel){plane_table[id].name, image_type(plane_table[id].kind, option_given(run->options, RENDER_HALF))};
        plane[n++] = p->plane[id];
    }
    ImageFile *f = image_open(path, p->width, p->height, n, channel, err);
    if (!f) return false;
    if (image_put_rows(f, p->height, plane, err)) return image_close(f, err);
    image_abort(f);
    return false;
}

static bool write_png(const Picture *p, const char *path, Err *err)
{
    char name[FRAME_PATH_MAX];
    uint8_t *rgb = NEW(uint8_t, 3 * (size_t)p->width * (size_t)p->height);
    snprintf(name, sizeof name, "%.*s.png", (int)strlen(path) - 4, path);
    picture_to_rgb(p, rgb);
    bool ok = png_file_write(name, p->width, p->height, rgb, err);
    mem_free(rgb);
    return ok;
}

static bool write_picture(const RenderRun *run, const Picture *p, int64_t number, Err *err)
{
    char path[FRAME_PATH_MAX];
    return pattern_name(run->pattern, number, render_source_length(&run->source) == 1, path, err) &&
           (!run->exr || write_exr(run, p, path, err)) && (!run->png || write_png(p, path, err)) &&
           (!run->print || command_print_name(path, err));
}

/* --- one frame --------------------------------------------------------------------------------------- */

static bool has_all(const RenderRun *run, const RenderShot *shot, Err *err)
{
    const TriMesh *m = shot->mesh;
    if (m->ntri == 0) return true;
    if (run->look.wire == WIRE_PARENTS && !m->parent)
        return fail(err, ERR_INPUT,
                    "frame %lld: the mesh does not say of which mechanical triangles it is; picture the PLY files of twinmesh mesh",
                    (long long)shot->number);
    if (run->layers >> LAYER_REST & 1 && !render_has_rest(m))
        return fail(err, ERR_INPUT, "frame %lld: the mesh has no rest positions; picture PLY files of twinmesh mesh --rest",
                    (long long)shot->number);
    return true;
}

static RenderFrame frame_of(const RenderRun *run, const RenderShot *shot)
{
    double second = 1 / option_real(run->options, RENDER_FPS);
    return (RenderFrame){.mesh = shot->mesh, .camera = camera_of(run, shot->number),
                         .before = {shot->before, camera_of(run, shot->number - shot->to_before), -second * (double)shot->to_before},
                         .after = {shot->after, camera_of(run, shot->number + shot->to_after), second * (double)shot->to_after}};
}

/* The mechanical mesh, the geometric one, the surface. */
static bool picture_papers(const RenderRun *run, const RenderShot *shot, Picture *picture, Err *err)
{
    RenderLook paper = {.samples = run->look.samples, .surface = SURFACE_PAPER, .wire = WIRE_TRIANGLES};
    const TriMesh *mesh[COLUMNS] = {shot->mechanical, shot->mesh, shot->mesh};
    const RenderLook *look[COLUMNS] = {&paper, &paper, &run->look};
    bool ok = true;
    for (int c = 0; ok && c < COLUMNS; c++) {
        Picture column;
        RenderFrame frame = {.mesh = mesh[c], .camera = camera_of(run, shot->number)};
        picture_init(&column, column_width(run), run->height, run->layers);
        ok = render_frame(run->renderer, look[c], &frame, &column, err);
        picture_paste(picture, c * column_width(run), &column);
        picture_free(&column);
    }
    return ok;
}

static bool picture_shot(RenderRun *run, const RenderShot *shot, Err *err)
{
    Picture picture;
    RenderFrame frame = frame_of(run, shot);
    picture_init(&picture, run->width, run->height, run->layers);
    bool ok = run->papers ? picture_papers(run, shot, &picture, err) : render_frame(run->renderer, &run->look, &frame, &picture, err);
    ok = ok && write_picture(run, &picture, shot->number, err);
    picture_free(&picture);
    return ok;
}

static bool do_shot(RenderRun *run, const RenderShot *shot, Err *err)
{
    if (!run->has_view) {
        measure(run, shot->mesh);
        set_view(run);
    }
    if (!has_all(run, shot, err) || !picture_shot(run, shot, err)) return false;
    console_detail(&run->console, "frame %lld: %d triangles", (long long)shot->number, shot->mesh->ntri);
    return true;
}

/* --- the run ----------------------------------------------------------------------------------------- */

static bool render_all(RenderRun *run, Err *err)
{
    bool motion = run->layers >> LAYER_MOTION & 1;
    while (!stop_signal()) {
        RenderShot shot;
        SequenceStep step = render_source_next(&run->source, motion, &shot, err);
        if (step != SEQUENCE_FRAME) return step == SEQUENCE_END;
        if (!do_shot(run, &shot, err)) return false;
        console_progress(&run->console, ++run->done, int_max(render_source_length(&run->source), 0));
    }
    return true;
}

static bool needs_measures(const RenderRun *run)
{
    const Options *o = run->options;
    return !option_given(o, RENDER_CAMERA) || (run->look.surface == SURFACE_CHECKER && !option_given(o, RENDER_CELL));
}

/* All is measured at once where all is there. */
static bool open_meshes(RenderRun *run, Options *o, Err *err)
{
    if (!render_source_open(&run->source, o, err)) return false;
    if (render_source_is_piped(&run->source))
        return !option_given(o, RENDER_ORBIT) ||
               fail(err, ERR_USAGE, "--orbit goes with frames that are all there, not with names on standard input");
    set_turn(run);
    if (needs_measures(run) && !measure_all(run, err)) return false;
    set_view(run);
    return true;
}

static bool render_open(RenderRun *run, Options *o, Err *err)
{
    if (o->noperand != 1)
        return fail(err, ERR_USAGE,
                    "one sequence of meshes is to be named: the PREFIX that mesh was given, PLY files, a glTF, or - for names on "
                    "standard input");
    if (!parse_size(option_text(o, RENDER_SIZE), &run->width, &run->height, err)) return false;
    if (option_given(o, RENDER_CAMERA) && !parse_camera(option_text(o, RENDER_CAMERA), &run->eye, &run->target, err)) return false;
    if (!choose_output(run, o, err) || !choose_look(run, o, err)) return false;
    begin_view(run);
    return open_meshes(run, o, err) && (run->renderer = renderer_open(err)) != NULL;
}

static int render_run(Options *o)
{
    RenderRun *run = NEW0(RenderRun, 1);
    Err err = {0};
    Loudness loud = option_given(o, RENDER_QUIET) ? LOUD_QUIET : option_given(o, RENDER_VERBOSE) ? LOUD_VERBOSE : LOUD_NORMAL;
    run->console = console_make(loud);
    run->options = o;
    run->print = option_given(o, RENDER_PRINT);
    thread_set_count(option_given(o, RENDER_THREADS) ? option_int(o, RENDER_THREADS) : thread_hardware_count());
    bool opened = render_open(run, o, &err), ok = opened && render_all(run, &err);
    console_clear(&run->console);
    if (!ok && !opened && err.code == ERR_USAGE) fprintf(stderr, "twinmesh render: %s\n", err.text);
    else if (!ok) console_problem(&run->console, "%s", err.text);
    else if (stop_signal()) console_problem(&run->console, "stopped by a signal; %d finished frames are kept", run->done);
    render_source_close(&run->source);
    renderer_close(run->renderer);
    mem_free(run);
    return !ok ? (int)err.code : stop_signal() ? 128 + stop_signal() : 0;
}

const Command render_command = {&render_options, "twinmesh render MESHES -o PATTERN\n\n"
    "Pictures a sequence of meshes as OpenEXR with named layers, or PNG: the PREFIX that mesh was given, PLY files, a\n"
    "glTF, or - for names of PLY files on standard input, taken as they arrive.", NULL, render_run};
