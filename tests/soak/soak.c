/* soak: long runs of made-up sequences through the tracker, every frame checked.
 *
 *   soak [--sequences N] [--from SEED]        N (1000) drawn sequences, each in a process of its own; [--threads N]
 *   soak --seed N [--write FOLDER]            one of them, a line a frame
 *   soak --scene NAME [--side N] [--write FOLDER]
 *   soak --list
 *
 * --write writes the frames as FOLDER/frame.NNNN.npy instead of tracking them. Exit status: 0 all is well, 1 not, 2 usage. */
#include "base/thread.h"
#include "scenes.h"
#include "watch.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { PATIENCE_S = 120 }; /* a sequence of a dozen small frames that takes longer hangs */

typedef struct Request {
    int sequences, side;
    int64_t from, seed; /* seed < 0: many */
    const char *scene, *folder;
} Request;

/* What a sequence's process tells: plain data, through a pipe. */
typedef struct Verdict {
    bool good, finished;
    int frames, events;
    uint64_t hash;
    int64_t components, triangles, remade_components, raw_components, inverted_left[2], degenerate[2];
    double ids_kept;
    char wrong[500];
} Verdict;

/* --- frames ---------------------------------------------------------------------------------------------------------------- */

static bool write_npy(const char *folder, int frame, const float *phi, const int n[3])
{
    char path[4096], header[256];
    snprintf(path, sizeof path, "%s/frame.%04d.npy", folder, frame);
    int length = snprintf(header, sizeof header, "{'descr': '<f4', 'fortran_order': True, 'shape': (%d, %d, %d), }", n[0], n[1], n[2]);
    while ((10 + length + 1) % 64) header[length++] = ' ';
    header[length++] = '\n';
    const uint8_t magic[10] = {0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0, (uint8_t)length, (uint8_t)(length >> 8)};
    size_t size = (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
    FILE *f = fopen(path, "wb");
    bool good = f && fwrite(magic, sizeof magic, 1, f) == 1 && fwrite(header, (size_t)length, 1, f) == 1 && fwrite(phi, sizeof *phi, size, f) == size;
    if (f && fclose(f) != 0) good = false;
    if (!good) fprintf(stderr, "soak: %s: cannot be written\n", path);
    return good;
}

static void say_frame(const Watch *w)
{
    const FrameStat *s = &w->stat;
    printf("frame %3d: components %d, Euler %d, triangles %d + %d, remade %d (%d vertices, %d raw), kept %.3f, inverted %d + %d, max %.2f vox%s%s\n", w->frames,
           s->audit_components, s->audit_euler, s->triangles_mechanical, s->triangles_geometric, s->remade_components, s->replaced_vertices, s->raw_components, s->ids_kept,
           s->inverted_left, s->inverted_left_geometric, s->distance_max_vox, w->wrong[0] ? ": " : "", w->wrong);
    fflush(stdout);
}

static Verdict verdict_of(const Watch *w, bool good)
{
    Verdict v = {.good = good, .finished = true, .frames = w->frames, .events = w->events, .hash = w->hash, .components = w->components, .triangles = w->triangles[0],
                 .remade_components = w->remade_components, .raw_components = w->raw_components, .ids_kept = w->ids_kept};
    for (int i = 0; i < 2; i++) v.inverted_left[i] = w->inverted_left[i], v.degenerate[i] = w->degenerate[i];
    memcpy(v.wrong, w->wrong, sizeof v.wrong);
    return v;
}

static Verdict run_events(const Events *e, bool tell)
{
    TrackSettings set = track_defaults();
    set.edge = e->edge_vox;
    Watch w;
    watch_open(&w, &set);
    bool good = true;
    for (int f = 0; f < EVENTS_FRAMES && good; f++) {
        Grid g = events_grid(e, f), v = events_velocity(e, set.fps);
        good = watch_frame(&w, &g, e->carried ? &v : NULL);
        if (tell) say_frame(&w);
    }
    Verdict v = verdict_of(&w, good);
    watch_close(&w);
    return v;
}

/* --- one sequence ----------------------------------------------------------------------------------------------------------- */

static int one_seed(const Request *q)
{
    Events e = events_make((uint64_t)q->seed);
    printf("seed %lld: %d x %d x %d samples of %g, %d balls, blend %.2f, noise %.2f, steps %d, clamp %.2f, unit %g, edge %g%s\n", (long long)q->seed, e.n[0], e.n[1], e.n[2],
           e.xform.m[0][0], e.nball, e.blend, e.noise, e.steps, e.clamp, e.unit, e.edge_vox, e.carried ? ", with a velocity" : "");
    if (!q->folder) return run_events(&e, true).good ? 0 : 1;
    printf("--spacing %.17g --origin %.17g,%.17g,%.17g --edge %gv --iso 0 --inside below\n", e.xform.m[0][0], e.xform.t.x, e.xform.t.y, e.xform.t.z, e.edge_vox);
    float *phi = NEW(float, events_samples(&e));
    bool good = true;
    for (int f = 0; f < EVENTS_FRAMES && good; f++) {
        events_sample(&e, f, phi);
        good = write_npy(q->folder, f + 1, phi, e.n);
    }
    mem_free(phi);
    return good ? 0 : 1;
}

static int one_scene(const Request *q)
{
    const Scene *scene = scene_find(q->scene);
    if (!scene) {
        fprintf(stderr, "soak: no scene '%s'; --list names them\n", q->scene);
        return 2;
    }
    SceneRun run;
    Watch w;
    TrackSettings set = track_defaults();
    scene_open(&run, scene, q->side);
    watch_open(&w, &set);
    float *phi = NEW(float, run.nsample);
    bool good = true;
    while (good && scene_next(&run, phi)) {
        if (q->folder) {
            good = write_npy(q->folder, run.frame, phi, run.n);
            continue;
        }
        Grid g;
        grid_init(&g, 1);
        grid_from_dense(&g, phi, run.n);
        good = watch_frame(&w, &g, NULL);
        say_frame(&w);
    }
    mem_free(phi);
    watch_close(&w);
    scene_close(&run);
    return good ? 0 : 1;
}

/* --- many ------------------------------------------------------------------------------------------------------------------- */

/* A process of its own: a crash or a hang is a verdict too. */
static Verdict run_apart(int64_t seed)
{
    Verdict v = {0};
    int ends[2], status = 0;
    fflush(stdout);
    if (pipe(ends) != 0) exit(ERR_RESOURCE);
    pid_t child = fork();
    if (child < 0) exit(ERR_RESOURCE);
    if (child == 0) {
        alarm(PATIENCE_S);
        Events e = events_make((uint64_t)seed);
        v = run_events(&e, false);
        thread_shutdown();
        _exit(write(ends[1], &v, sizeof v) == (ssize_t)sizeof v ? 0 : 1);
    }
    close(ends[1]);
    if (read(ends[0], &v, sizeof v) != (ssize_t)sizeof v) v = (Verdict){0};
    close(ends[0]);
    waitpid(child, &status, 0);
    if (!v.finished && WIFSIGNALED(status)) snprintf(v.wrong, sizeof v.wrong, "ended by signal %d", WTERMSIG(status));
    else if (!v.finished) snprintf(v.wrong, sizeof v.wrong, "ended with status %d", WEXITSTATUS(status));
    return v;
}

static void add_verdict(Verdict *sum, const Verdict *v)
{
    sum->frames += v->frames;
    sum->events += v->events;
    sum->hash = hash_mix(sum->hash ^ v->hash);
    sum->components += v->components;
    sum->triangles += v->triangles;
    sum->remade_components += v->remade_components;
    sum->raw_components += v->raw_components;
    sum->ids_kept += v->ids_kept;
    for (int i = 0; i < 2; i++) sum->inverted_left[i] += v->inverted_left[i], sum->degenerate[i] += v->degenerate[i];
}

static int many(const Request *q)
{
    Verdict sum = {0};
    int failed = 0;
    for (int i = 0; i < q->sequences; i++) {
        Verdict v = run_apart(q->from + i);
        add_verdict(&sum, &v);
        if (!v.good) {
            failed++;
            printf("seed %lld, frame %d: %s\n", (long long)(q->from + i), v.frames, v.wrong);
        }
        if (isatty(2)) fprintf(stderr, "\r%d of %d, %d failed ", i + 1, q->sequences, failed);
    }
    if (isatty(2)) fprintf(stderr, "\r%40s\r", "");
    double later = sum.frames > q->sequences ? sum.frames - q->sequences : 1; /* frames but the first of each */
    printf("frames %d, with an event %.1f %%; mechanical triangles a frame %.0f\n", sum.frames, 100 * sum.events / later, (double)sum.triangles / (sum.frames ? sum.frames : 1));
    printf("components %lld, remade after the first frame %lld, raw %lld\n", (long long)sum.components, (long long)sum.remade_components, (long long)sum.raw_components);
    printf("inverted left %lld + %lld, without area %lld + %lld, identities kept %.4f, hash %016llx\n", (long long)sum.inverted_left[0], (long long)sum.inverted_left[1],
           (long long)sum.degenerate[0], (long long)sum.degenerate[1], sum.ids_kept / later, (unsigned long long)sum.hash);
    printf("%d passed, %d failed\n", q->sequences - failed, failed);
    return failed ? 1 : 0;
}

/* --- the command line ------------------------------------------------------------------------------------------------------- */

static int usage(void)
{
    fputs("usage: soak [--sequences N] [--from SEED] [--threads N] | --seed N [--write FOLDER] | --scene NAME [--side N] [--write FOLDER] | --list\n", stderr);
    return 2;
}

static int list(void)
{
    for (int i = 0; i < scene_count; i++)
        printf("%-8s %3d frames of %d x %d x %d: %s\n", scene_list[i].name, scene_list[i].frames, scene_list[i].side[0], scene_list[i].side[1],
               scene_list[i].side[2], scene_list[i].what);
    return 0;
}

int main(int argc, char **argv)
{
    Request q = {.sequences = 1000, .seed = -1};
    int threads = 1; /* small grids: more cost more than they help */
    if (argc == 2 && strcmp(argv[1], "--list") == 0) return list();
    if (argc % 2 == 0) return usage();
    for (int i = 1; i < argc; i += 2) {
        const char *name = argv[i], *value = argv[i + 1];
        if (strcmp(name, "--sequences") == 0) q.sequences = atoi(value);
        else if (strcmp(name, "--from") == 0) q.from = atoll(value);
        else if (strcmp(name, "--seed") == 0) q.seed = atoll(value);
        else if (strcmp(name, "--scene") == 0) q.scene = value;
        else if (strcmp(name, "--side") == 0) q.side = atoi(value);
        else if (strcmp(name, "--write") == 0) q.folder = value;
        else if (strcmp(name, "--threads") == 0) threads = atoi(value);
        else return usage();
    }
    if (threads < 1 || threads > 256 || q.side < 0 || q.side > 512) return usage();
    thread_set_count(threads);
    int status = q.scene ? one_scene(&q) : q.seed >= 0 ? one_seed(&q) : many(&q);
    thread_shutdown();
    return status;
}
