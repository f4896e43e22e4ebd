#include "cli/job.h"

#include "base/thread.h"
#include "cli/volume_options.h"

#include <stdlib.h>
#include <string.h>

/* "a,b,c" into names. */
static bool attributes_fill(MeshJob *job, const Options *o, Err *err)
{
    const char *given = option_text(o, OPT_ATTRIBUTE);
    if (!given) return true;
    if (strlen(given) >= sizeof job->attribute_text) return fail(err, ERR_USAGE, "--attribute: its list of names is too long");
    strcpy(job->attribute_text, given);
    int n = 0;
    for (char *name = job->attribute_text, *comma; name; name = comma) {
        comma = strchr(name, ',');
        if (comma) *comma++ = 0;
        if (!*name) return fail(err, ERR_USAGE, "--attribute %s: names with commas between are wanted, such as density,heat", given);
        if (n == ATTRIBUTES_MAX) return fail(err, ERR_USAGE, "--attribute: at most %d grids can be sampled", ATTRIBUTES_MAX);
        job->attribute[n++] = name;
    }
    job->request.nattribute = n;
    job->request.attribute = job->attribute;
    return true;
}

/* "8G", "500M" into bytes. */
static bool memory_fill(MeshJob *job, const Options *o, Err *err)
{
    static const char unit[] = "KMGT";
    const char *text = option_text(o, OPT_MAX_MEMORY);
    if (!text) return true;
    char *end;
    double bytes = strtod(text, &end);
    const char *u = *end ? strchr(unit, *end) : NULL;
    if (u) bytes *= (double)((uint64_t)1 << (10 * (u - unit + 1))), end++;
    if (*end || !(bytes >= 128 << 20) || bytes > 1e15) return fail(err, ERR_USAGE, "--max-memory %s: must be bytes, or a number with K, M, G or T behind it, and at least 128M", text);
    job->max_memory = (uint64_t)bytes;
    return true;
}

/* The method's own defaults stand where nothing was given; a unit test holds the table to them. */
static void track_fill(TrackSettings *set, const Options *o)
{
    *set = track_defaults();
    if (option_given(o, OPT_EDGE)) {
        set->edge = option_real(o, OPT_EDGE);
        set->edge_in_voxels = o->value[OPT_EDGE].in_voxels;
    }
    const struct {
        int id;
        double *to;
    } real[] = {
        {OPT_E_MIN, &set->e_min},         {OPT_E_MAX, &set->e_max},          {OPT_EPS_E, &set->eps_e},
        {OPT_ANGLE, &set->angle_deg},     {OPT_DEVIATION, &set->deviation_vox}, {OPT_YOUNG, &set->mech.young},
        {OPT_POISSON, &set->mech.poisson}, {OPT_DT, &set->mech.dt},           {OPT_MIN_ASPECT, &set->min_aspect},
    };
    for (size_t i = 0; i < sizeof real / sizeof *real; i++)
        if (option_given(o, real[i].id)) *real[i].to = option_real(o, real[i].id);
    if (option_given(o, OPT_PASSES)) set->passes = option_int(o, OPT_PASSES);
    if (option_given(o, OPT_RELAX_STEPS)) set->relax_steps = option_int(o, OPT_RELAX_STEPS);
    if (option_given(o, OPT_CG_ITERATIONS)) {
        set->mech.cg_iterations = option_int(o, OPT_CG_ITERATIONS);
        set->mech.cg_tolerance = 0;
    }
    set->mech.kind = option_choice(o, OPT_MECHANICS) == 0 ? MECHANICS_FEM : MECHANICS_SPRING;
    set->refine_by = (RefineBy)option_choice(o, OPT_REFINE_BY);
    set->refine_scheme = (RefineScheme)option_choice(o, OPT_REFINE_SCHEME);
    set->topology = (TopologyKind)option_choice(o, OPT_TOPOLOGY);
    set->fps = option_real(o, OPT_FPS);
    set->own_motion = option_given(o, OPT_SURFACE_VELOCITY);
    set->rest = option_given(o, OPT_REST);
}

static bool job_check(const MeshJob *job, const Options *o, Err *err)
{
    const char *prefix = job->prefix;
    if (!prefix)
        return fail(err, ERR_USAGE,
                    "-o PREFIX is missing: give the beginning of the output names, such as -o out/splash");
    if (prefix[strlen(prefix) - 1] == '/')
        return fail(err, ERR_USAGE,
                    "--output %s: names a folder; give the beginning of file names in it too, such as %smesh", prefix,
                    prefix);
    if (job->follow && !job->frames)
        return fail(err, ERR_USAGE, "--follow: give --frames A-B too, so that the last frame is known; or name frames on standard input (-) as they are done");
    if (job->render && !(job->formats & FORMAT_PLY)) return fail(err, ERR_USAGE, "--render: pictures are made of the PLYs; give --format ply too");
    if (job->render && job->resume)
        return fail(err, ERR_USAGE, "--render: does not go with --resume, which goes on behind frames that are not pictured; let twinmesh render picture the meshes");
    if (!(job->track.e_min < job->track.e_max))
        return fail(err, ERR_USAGE, "--e-min %.9g: must be below --e-max, which is %.9g", job->track.e_min,
                    job->track.e_max);
    if (o->noperand == 0)
        return fail(err, ERR_USAGE,
                    "no frames are named: give files, a pattern such as phi.####.vdb, a folder, or - for names on "
                    "standard input");
    return true;
}

bool job_make(MeshJob *job, const Options *o, Err *err)
{
    *job = (MeshJob){
        .prefix = option_text(o, OPT_OUTPUT),
        .formats = o->value[OPT_FORMAT].set,
        .gltf_step = option_choice(o, OPT_GLTF_INTERPOLATION) == 1,
        .compress = (GltfCompress)option_choice(o, OPT_COMPRESS),
        .print = option_given(o, OPT_PRINT),
        .render = option_text(o, OPT_RENDER),
        .resume = option_given(o, OPT_RESUME),
        .json_log = option_given(o, OPT_JSON_LOG),
        .follow = option_given(o, OPT_FOLLOW),
        .keep_state = option_given(o, OPT_KEEP_STATE),
        .start_from = option_text(o, OPT_START_FROM),
        .turn = {.up = option_given(o, OPT_UP) ? (UpAxis)option_choice(o, OPT_UP) : UP_AS_IT_IS,
                 .scale = option_real(o, OPT_SCALE)},
        .frames = option_text(o, OPT_FRAMES),
        .on_error = (OnError)option_choice(o, OPT_ON_ERROR),
        .request = volume_options_request(o),
        .iso = volume_options_iso(o),
        .inside = volume_options_inside(o),
        .trilinear = option_choice(o, OPT_PROJECTION) == 1,
        .open_border = volume_options_border_is_open(o),
        .velocity_units = option_given(o, OPT_VELOCITY_UNITS)
                              ? (VelocityUnits)option_choice(o, OPT_VELOCITY_UNITS)
                              : VELOCITY_BY_GRID,
        .threads = option_given(o, OPT_THREADS) ? option_int(o, OPT_THREADS) : thread_hardware_count(),
        .loudness = option_given(o, OPT_QUIET)     ? LOUD_QUIET
                    : option_given(o, OPT_VERBOSE) ? LOUD_VERBOSE
                                                   : LOUD_NORMAL,
    };
    job->request.velocity = option_text(o, OPT_VELOCITY);
    track_fill(&job->track, o);
    return attributes_fill(job, o, err) && memory_fill(job, o, err) && job_check(job, o, err);
}

/* Of volumes it says nothing. */
static bool is_beside_the_point(const Options *o, int id)
{
    return id == OPT_PROJECTION && !(o->noperand == 1 && scene_is_known(o->operand[0]));
}

void job_echo(const Options *o, const char *version, FILE *report)
{
    ReportSetting setting[OPTION_COUNT];
    char number[OPTION_COUNT][32];
    int n = 0;
    for (int i = 0; i < OPTION_COUNT; i++) {
        const OptionSpec *spec = &option_table[i];
        if (spec->echo == OPTION_HIDE || spec->echo == OPTION_RUN || (spec->echo == OPTION_GIVEN && !option_given(o, i)) || is_beside_the_point(o, i)) continue;
        bool is_number = spec->kind == OPTION_REAL || spec->kind == OPTION_INT;
        if (is_number) snprintf(number[n], sizeof number[n], "%.9g", o->value[i].real[0]);
        const char *text = is_number && o->value[i].text ? number[n] : o->value[i].text;
        setting[n++] = (ReportSetting){.name = spec->name, .text = text, .is_number = is_number};
    }
    report_write_settings(report, version, n, setting);
}
