/* stitch.c: the chunks of a sequence as one, by the same writer that a run of the whole has. */
#include "cli/farm.h"

#include "cli/chunk.h"
#include "cli/rejoin.h"
#include "cli/renumber.h"
#include "cli/seam.h"
#include "cli/stop.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct Stitch {
    const Plan *plan;
    MeshJob job;
    Console console;
    Outputs out;
    ChunkFile chunk;                /* the one at hand */
    Renumber renumber;
    Rejoin rejoin;
    TriMesh shown[KIND_COUNT];      /* last, in the sequence's identities */
    char label[FRAME_DIGITS_MAX + 2]; /* of the frame tracked last; "": none */
    int64_t last_shown, first_tracked; /* frames' numbers; NONE */
    /* between two chunks, until the second has given a tracked frame */
    bool at_seam;
    OutFrame tail;                  /* the frame behind the first chunk's own, as that one has it */
    TriMesh tail_mesh[KIND_COUNT];
} Stitch;

static void free_meshes(TriMesh *mesh)
{
    for (int kind = 0; kind < KIND_COUNT; kind++) trimesh_free(&mesh[kind]);
}

static int64_t number_of(const char *label) { return strtoll(label, NULL, 10); }

/* --- reading --------------------------------------------------------------------------------------- */

/* The chunk's next frame, which must be there. */
static bool read_frame(ChunkFile *c, OutFrame *f, Err *err)
{
    bool more;
    if (!chunk_next(c, f, &more, err)) return false;
    return more || fail(err, ERR_INPUT, "%.800s: ends before its last frame; run the chunk again, it goes on where it was", c->path);
}

/* The meshes of the frame read last become the caller's. */
static void take_meshes(ChunkFile *c, TriMesh *to)
{
    memcpy(to, c->mesh, sizeof c->mesh);
    memset(c->mesh, 0, sizeof c->mesh);
}

/* --- seams ----------------------------------------------------------------------------------------- */

/* The last chunk's own frames are done: the one behind them. */
static bool read_tail(Stitch *st, Err *err)
{
    if (!read_frame(&st->chunk, &st->tail, err)) return false;
    if (st->tail.fate == FRAME_TRACKED) take_meshes(&st->chunk, st->tail_mesh);
    return true;
}

/* The frame that the next chunk began with, as the last one has it; none: nothing is known of its rest positions. */
static bool read_first(Stitch *st, const char *label, Err *err)
{
    OutFrame f = {0};
    TriMesh mesh = {0};
    bool good = true, found = false;
    chunk_rewind(&st->chunk);
    while (good && !found && strcmp(f.label, st->tail.label) != 0) {
        outframe_free(&f);
        good = read_frame(&st->chunk, &f, err);
        found = good && f.fate == FRAME_TRACKED && strcmp(f.label, label) == 0;
    }
    if (found) {
        rejoin_apply(&st->rejoin, &st->chunk.mesh[KIND_MECHANICAL]);
        mesh = st->chunk.mesh[KIND_MECHANICAL];
        st->chunk.mesh[KIND_MECHANICAL] = (TriMesh){0};
    }
    outframe_free(&f);
    rejoin_free(&st->rejoin);
    rejoin_begin(&st->rejoin, &mesh, job_intervals(st->first_tracked, number_of(label), 1));
    return good;
}

static void say_seam(Stitch *st, const Seam *seam, int k)
{
    static const char *const name[KIND_COUNT] = {"mechanical", "geometric"};
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        const SeamSide *s = &seam->side[kind];
        console_note(&st->console, "seam before frame %s, %s: %d of %d vertices go on as %d of %d (%.1f %%), %.2f edges away on average, %.2f at most",
                     st->plan->chunk[k].first, name[kind], s->pairs, s->vertices[0], s->pairs, s->vertices[1],
                     100.0 * s->pairs / int_max(int_max(s->vertices[0], s->vertices[1]), 1), s->mean, s->largest);
    }
}

/* Both have tracked the frame shown last, the next chunk as the last of the frames before its own. */
static void join_identities(Stitch *st, ChunkFile *next, const char *label, int k)
{
    int32_t fresh = st->renumber.next;
    Seam seam = {0};
    if (*label && strcmp(label, st->label) == 0) {
        seam_find(st->shown, next->mesh, &seam);
        say_seam(st, &seam, k);
    } else {
        console_problem(&st->console, "seam before frame %s: no frame before it was tracked by both chunks; no vertex goes on", st->plan->chunk[k].first);
    }
    renumber_free(&st->renumber);
    st->renumber = (Renumber){.identity = seam.identity, .number = seam.number, .next = fresh};
}

/* Opens the chunk and reads what it has before its own frames. */
static bool join(Stitch *st, ChunkFile *next, int k, Err *err)
{
    const ChunkPlan *c = &st->plan->chunk[k];
    char first[sizeof st->label] = "", label[sizeof st->label] = "";
    if (!read_tail(st, err)) return false;
    for (int i = c->run.first; i < c->own.first; i++) {
        OutFrame f;
        bool good = read_frame(next, &f, err);
        if (good && f.fate == FRAME_TRACKED) {
            if (!*first) memcpy(first, f.label, sizeof first);
            memcpy(label, f.label, sizeof label);
        }
        outframe_free(&f);
        if (!good) return false;
    }
    st->at_seam = true;
    join_identities(st, next, label, k);
    return !st->job.track.rest || read_first(st, *first ? first : c->first, err);
}

/* Where the last meshes shown go at the frame behind the seam. */
static void take_tail(Stitch *st, OutFrame *f)
{
    bool is_wanted = st->job.formats & FORMATS_CARRIED;
    bool is_known = is_wanted && st->tail.fate == FRAME_TRACKED && strcmp(st->tail.label, f->label) == 0;
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int k = 0; k < 2; k++) {
            mem_free(f->carried[kind][k]);
            f->carried[kind][k] = NULL;
            if (!is_known) continue;
            TriMesh *same = &st->tail_mesh[kind]; /* its run had not ended */
            float **own = k == 0 ? &same->pos : &same->normal, **from = st->tail.carried[kind][k] ? &st->tail.carried[kind][k] : own;
            f->ncarried[kind] = from == own ? same->nvert : st->tail.ncarried[kind];
            f->carried[kind][k] = *from;
            *from = NULL;
        }
}

/* The share of the identities shown last that are still there. */
static double share_kept(const TriMesh *last, const TriMesh *mesh)
{
    Map at;
    int kept = 0;
    map_init(&at, mesh->nvert);
    for (int v = 0; v < mesh->nvert; v++) map_put(&at, (uint64_t)mesh->id[v], v);
    for (int v = 0; v < last->nvert; v++) kept += map_get(&at, (uint64_t)last->id[v]) != NONE;
    map_free(&at);
    return last->nvert ? (double)kept / last->nvert : NAN;
}

static void leave_seam(Stitch *st, OutFrame *f)
{
    take_tail(st, f);
    f->stat.ids_kept = share_kept(&st->shown[KIND_MECHANICAL], &f->mesh[KIND_MECHANICAL]);
    outframe_free(&st->tail);
    free_meshes(st->tail_mesh);
    st->at_seam = false;
}

/* --- frames ---------------------------------------------------------------------------------------- */

/* Carried is what was shown last, unless the connectivity goes on. */
static bool check_carried(const Stitch *st, OutFrame *f, Err *err)
{
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        bool goes_on = st->last_shown == NONE || trimesh_is_same_run(&st->shown[kind], &f->mesh[kind]);
        for (int k = 0; k < 2; k++) {
            if (!f->carried[kind][k]) continue;
            if (f->ncarried[kind] != st->shown[kind].nvert)
                return fail(err, ERR_INPUT, "frame %s: its chunk does not go with the one before; run both again", f->label);
            if (!goes_on) continue;
            mem_free(f->carried[kind][k]);
            f->carried[kind][k] = NULL;
        }
    }
    return true;
}

static bool give_tracked(Stitch *st, OutFrame *f, Err *err)
{
    TriMesh mesh[KIND_COUNT];
    take_meshes(&st->chunk, mesh);
    f->mesh = mesh;
    bool good = renumber_frame(&st->renumber, f, mesh, err);
    for (int kind = 0; kind < KIND_COUNT; kind++) rejoin_apply(&st->rejoin, &mesh[kind]);
    if (st->at_seam) leave_seam(st, f);
    good = good && check_carried(st, f, err) && outputs_add_frame(&st->out, f, err);
    free_meshes(st->shown);
    memcpy(st->shown, mesh, sizeof mesh);
    memcpy(st->label, f->label, sizeof st->label);
    if (st->first_tracked == NONE) st->first_tracked = number_of(f->label);
    return good;
}

/* A frame that no run could read; what a chunk had nothing to hold for, the sequence may have. */
static bool give_other(Stitch *st, OutFrame *f, Err *err)
{
    bool hold = st->job.on_error == ON_ERROR_HOLD && st->last_shown != NONE;
    f->fate = hold ? FRAME_HELD : FRAME_SKIPPED;
    f->mesh = hold ? st->shown : NULL;
    return outputs_add_frame(&st->out, f, err);
}

static bool give(Stitch *st, OutFrame *f, Err *err)
{
    int64_t number = number_of(f->label);
    f->gap = job_intervals(st->last_shown, number, st->plan->step);
    if (!(f->fate == FRAME_TRACKED ? give_tracked : give_other)(st, f, err)) return false;
    if (f->fate != FRAME_SKIPPED) st->last_shown = number;
    return true;
}

static bool give_chunk(Stitch *st, int k, Err *err)
{
    const ChunkPlan *c = &st->plan->chunk[k];
    for (int i = c->own.first; i <= c->own.last; i++) {
        OutFrame f;
        const char *want = i == c->own.first ? c->first : i == c->own.last ? c->last : NULL;
        bool good = read_frame(&st->chunk, &f, err);
        if (good && want && strcmp(f.label, want) != 0)
            good = fail(err, ERR_INPUT, "%.800s: has frame %s where the plan has %s; run the chunk again", st->chunk.path, f.label, want);
        good = good && give(st, &f, err);
        outframe_free(&f);
        if (!good || stop_signal()) return false;
    }
    return true;
}

static bool open_chunk(const Stitch *st, int k, ChunkFile *c, Err *err)
{
    char *prefix = plan_chunk_prefix(st->plan, k);
    bool good = chunk_open(c, prefix, err);
    mem_free(prefix);
    return good;
}

/* Nothing is begun before the last chunk is there. */
static bool find_chunks(const Stitch *st, Err *err)
{
    bool good = true;
    for (int k = 0; k < st->plan->nchunk && good; k++) {
        ChunkFile c;
        good = open_chunk(st, k, &c, err);
        if (good) chunk_close(&c);
    }
    return good;
}

/* False also where a signal asked for an end. */
static bool stitch_all(Stitch *st, Err *err)
{
    for (int k = 0; k < st->plan->nchunk; k++) {
        ChunkFile next;
        bool good = open_chunk(st, k, &next, err) && (k == 0 || join(st, &next, k, err));
        chunk_close(&st->chunk);
        st->chunk = next;
        if (!good || !give_chunk(st, k, err)) return false;
        console_progress(&st->console, st->plan->chunk[k].own.last + 1, st->plan->chunk[st->plan->nchunk - 1].own.last + 1);
    }
    return true;
}

static bool stitch_frames(Stitch *st, const Options *o, Err *err)
{
    if (!find_chunks(st, err)) return false;
    if (!outputs_open(&st->out, &st->job, st->job.track.fps / (double)st->plan->step, err)) return false;
    job_echo(o, TWINMESH_VERSION, st->out.lines[LINES_REPORT].stream);
    bool good = stitch_all(st, err);
    console_clear(&st->console);
    return outputs_close(&st->out, good, NULL, good ? err : &(Err){0}) && good;
}

int farm_stitch(const Plan *p)
{
    Options o;
    Err err = {0};
    Stitch st = {.plan = p, .renumber.plain = true, .rejoin.plain = true, .last_shown = NONE, .first_tracked = NONE};
    bool good = options_parse(&o, p->narg, p->arg, &err) && job_make(&st.job, &o, &err) && job_load_scene(&st.job, &o, &err);
    st.console = console_make(st.job.loudness);
    st.console.json = st.job.json_log;
    good = good && stitch_frames(&st, &o, &err);
    if (err.code != ERR_NONE) console_problem(&st.console, "%s", err.text);
    if (good && st.job.loudness > LOUD_QUIET && !st.console.json) report_summarise(stderr, &st.out.totals);
    chunk_close(&st.chunk);
    renumber_free(&st.renumber);
    rejoin_free(&st.rejoin);
    outframe_free(&st.tail);
    free_meshes(st.tail_mesh);
    free_meshes(st.shown);
    job_free(&st.job);
    options_free(&o);
    return stop_signal() ? 128 + stop_signal() : (int)err.code;
}
