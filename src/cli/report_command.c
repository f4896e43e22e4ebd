#include "cli/command.h"

#include "cli/console.h"
#include "cli/options.h"
#include "io/gltf_info.h"
#include "page/page.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MISSING_MAX = 600 };

/* The page, and the texts it is of. */
typedef struct ReportRun {
    Console console;
    const char *prefix;
    char *output, *report, *events, *timings;
    char *gltf[PAGE_MESHES];
    char missing[PAGE_MESHES][MISSING_MAX];
    Page page;
} ReportRun;

static const struct {
    const char *kind, *glb, *gltf;
} mesh_file[PAGE_MESHES] = {{"mechanical", ".mechanical.glb", ".mechanical.gltf"}, {"geometric", ".geometric.glb", ".geometric.gltf"}};

/* To be freed. */
static char *join(const char *prefix, const char *ending)
{
    size_t size = strlen(prefix) + strlen(ending) + 1;
    char *text = NEW(char, size);
    snprintf(text, size, "%s%s", prefix, ending);
    return text;
}

static const char *last_part(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static bool exists(const char *path) { return access(path, F_OK) == 0; }

/* Whether two files lie in one folder. */
static bool are_neighbours(const char *a, const char *b)
{
    struct stat in[2];
    const char *path[2] = {a, b};
    for (int i = 0; i < 2; i++) {
        const char *name = last_part(path[i]);
        char *folder = name == path[i] ? mem_text(".") : mem_text(path[i]);
        if (name != path[i]) folder[name - path[i]] = 0;
        bool good = stat(folder, &in[i]) == 0;
        mem_free(folder);
        if (!good) return false;
    }
    return in[0].st_dev == in[1].st_dev && in[0].st_ino == in[1].st_ino;
}

/* A remark for the page's reader, and on standard error. */
static void leave_out(ReportRun *run, int i)
{
    run->page.mesh[i].missing = run->missing[i];
    console_note(&run->console, "%s", run->missing[i]);
}

static void tell_absent(ReportRun *run, int i)
{
    char *gltf = join(run->prefix, mesh_file[i].gltf);
    snprintf(run->missing[i], MISSING_MAX,
             exists(gltf) ? "The %s mesh is a .gltf with files beside it, which the player does not take: twinmesh mesh --format glb writes one file."
                          : "There is no %s mesh as .glb to be played: twinmesh mesh --format glb writes it.", mesh_file[i].kind);
    leave_out(run, i);
    mem_free(gltf);
}

/* Whether the file takes no more megabytes in the page than `most`; else says so. */
static bool fits(ReportRun *run, int i, int most)
{
    struct stat st;
    uint64_t mb = stat(run->gltf[i], &st) == 0 ? (page_embedded_size((uint64_t)st.st_size) + 999999) / 1000000 : 0;
    if (mb <= (uint64_t)most) return true;
    snprintf(run->missing[i], MISSING_MAX, "%.300s is left out: it would take up to %llu MB, and --max-embed is %d; raise that, or take --link.",
             last_part(run->gltf[i]), (unsigned long long)mb, most);
    leave_out(run, i);
    return false;
}

static bool choose_mesh(ReportRun *run, const Options *o, int i, Err *err)
{
    PageMesh *m = &run->page.mesh[i];
    GltfInfo info;
    m->kind = mesh_file[i].kind;
    run->gltf[i] = join(run->prefix, mesh_file[i].glb);
    if (!exists(run->gltf[i])) {
        tell_absent(run, i);
        return true;
    }
    if (!gltf_info_read(run->gltf[i], &info, err)) return false;
    gltf_info_free(&info);
    if (option_given(o, REPORT_LINK)) m->link = last_part(run->gltf[i]);
    else if (fits(run, i, option_int(o, REPORT_MAX_EMBED))) m->path = run->gltf[i];
    return true;
}

static bool choose_lines(ReportRun *run, Err *err)
{
    run->report = join(run->prefix, ".report.jsonl");
    run->events = join(run->prefix, ".events.jsonl");
    run->timings = join(run->prefix, ".timings.jsonl");
    if (!exists(run->report))
        return fail(err, ERR_INPUT, "%.600s: there is no such file; twinmesh mesh -o %.300s writes it when it ends", run->report, run->prefix);
    run->page.report = run->report;
    if (exists(run->events)) run->page.events = run->events;
    else console_note(&run->console, "%s: there is no such file; the page tells no places of events", run->events);
    if (exists(run->timings)) run->page.timings = run->timings;
    return true;
}

static bool report_open(ReportRun *run, const Options *o, Err *err)
{
    if (o->noperand != 1) return fail(err, ERR_USAGE, "one PREFIX is to be named, that of twinmesh mesh -o");
    run->prefix = o->operand[0];
    if (!*last_part(run->prefix)) return fail(err, ERR_USAGE, "%.800s: is a folder; name the PREFIX of a run in it", run->prefix);
    run->output = option_given(o, REPORT_OUTPUT) ? mem_text(option_text(o, REPORT_OUTPUT)) : join(run->prefix, ".report.html");
    run->page.title = option_given(o, REPORT_TITLE) ? option_text(o, REPORT_TITLE) : last_part(run->prefix);
    if (option_given(o, REPORT_LINK) && !are_neighbours(run->output, run->prefix))
        return fail(err, ERR_USAGE, "--link: %.400s does not lie beside the glTFs of %.400s; write it there", run->output, run->prefix);
    return choose_lines(run, err);
}

static void report_close(ReportRun *run)
{
    char **own[] = {&run->output, &run->report, &run->events, &run->timings, &run->gltf[0], &run->gltf[1]};
    for (size_t i = 0; i < sizeof own / sizeof *own; i++) mem_free(*own[i]);
}

static int report_run(Options *o)
{
    ReportRun run = {.console = console_make(option_given(o, REPORT_QUIET) ? LOUD_QUIET : LOUD_NORMAL)};
    Err err = {0};
    bool ok = report_open(&run, o, &err);
    for (int i = 0; ok && i < PAGE_MESHES; i++) ok = choose_mesh(&run, o, i, &err);
    if (ok && !page_has_viewer()) console_note(&run.console, "this build has no viewer, as it was made without npm: the page has none either");
    ok = ok && page_write(run.output, &run.page, &err) && command_print_name(run.output, &err);
    if (!ok) fprintf(stderr, "twinmesh report: %s\n", err.text);
    report_close(&run);
    return ok ? 0 : (int)err.code;
}

const Command report_command = {&report_options, "twinmesh report PREFIX\n\n"
    "One page of HTML, PREFIX.report.html, of what twinmesh mesh -o PREFIX left: plots of the report and the times, the\n"
    "events, and both meshes in a player. It needs a browser, and no network.", NULL, report_run};
