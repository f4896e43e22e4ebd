/* What became of the components: each kind of event where it happens, once, at its place; nothing where nothing happens. */
#include "../soak/scenes.h"
#include "base/thread.h"
#include "fields.h"
#include "track/track.h"

#include <stdlib.h>

typedef struct Run {
    Track *tr;
    Field field[2];
    int frames;
    FrameStat stat;
    FrameEvents events;
    int sum[EVENT_KINDS];  /* counts of all frames */
} Run;

static Run run_open(void)
{
    TrackSettings set = track_defaults();
    return (Run){.tr = track_open(&set)};
}

static void run_close(Run *r)
{
    track_close(r->tr);
    events_free(&r->events);
    for (int i = 0; i < 2; i++) field_free(&r->field[i]);
}

/* Every component comes from somewhere or is born, goes somewhere or dies. */
static void assert_balance(const Run *r)
{
    const int *n = r->stat.events;
    int change = n[EVENT_SPLIT] - n[EVENT_BLEND] + n[EVENT_BIRTH] - n[EVENT_DEATH];
    if (!r->events.first) assert_int_equal(r->events.nafter, r->events.nbefore + change);
    assert_int_equal(r->events.nafter, r->stat.components);
}

static void run_field(Run *r, Field f)
{
    int i = r->frames++ % 2;
    Err err = {0};
    field_free(&r->field[i]);
    r->field[i] = f;
    if (!track_frame(r->tr, &r->field[i], NULL, 1, &r->stat, &err)) fail_msg("%s", err.text);
    events_free(&r->events);
    r->events = track_take_events(r->tr);
    for (int k = 0; k < EVENT_KINDS; k++) r->sum[k] += r->stat.events[k];
    for (int k = 0; getenv("TWINMESH_TOLD") && k < r->events.nevent; k++) {
        const FrameEvent *v = &r->events.event[k];
        Vec3 p = r->events.place[v->place];
        print_message("frame %d: %s of %d to %d, count %d, replaced %d, at %.2f %.2f %.2f\n", r->frames, event_kind_name(v->kind), v->nbefore, v->nafter, v->count, v->replaced, p.x, p.y, p.z);
    }
    assert_balance(r);
}

static void run_frame(Run *r, int n, FieldFn *fn, const double *k) { run_field(r, field_of(n, fn, k)); }

/* One frame of a scene that can be entered anywhere. */
static void run_scene_frame(Run *r, SceneRun *scene, int frame)
{
    Err err = {0};
    Grid g;
    Field f;
    float *phi = NEW(float, scene->nsample);
    scene->frame = frame;
    assert_true(scene_next(scene, phi));
    grid_init(&g, 1);
    grid_from_dense(&g, phi, scene->n);
    assert_true(field_build(&f, &g, &(FieldSpec){0, true}, &err));
    grid_free(&g);
    mem_free(phi);
    run_field(r, f);
}

/* The only event of a kind in the frame just tracked. */
static const FrameEvent *only(const Run *r, EventKind kind)
{
    const FrameEvent *found = NULL;
    for (int i = 0; i < r->events.nevent; i++) {
        if (r->events.event[i].kind != kind) continue;
        assert_null(found);
        found = &r->events.event[i];
    }
    assert_non_null(found);
    return found;
}

static void assert_place(const Run *r, const FrameEvent *v, Vec3 p, double within)
{
    double d = v_dist(r->events.place[v->place], p);
    if (d > within) fail_msg("%s is %.2f away from its place", event_kind_name(v->kind), d);
}

/* No event of the run but those of the kinds listed (bits) and mends. */
static void assert_only_kinds(const Run *r, unsigned kinds)
{
    for (int k = 0; k < EVENT_KINDS; k++)
        if (k != EVENT_MEND && !(kinds >> k & 1)) assert_int_equal(r->sum[k], 0);
}

/* --- blends and splits ----------------------------------------------------------------------------------------------------- */

static void balls_that_merge_blend_once_and_part_once(void **state)
{
    (void)state;
    Run r = run_open();
    int components = 0;
    for (int f = 0; f < 10; f++) {
        double x = f < 5 ? f : 9 - f; /* there and back */
        run_frame(&r, 34, fn_two_balls, (double[]){9.3 + x, 12.6, 12.8, 6, 24.7 - x, 12.6, 12.8, 6});
        assert_true(r.events.first == (f == 0));
        if (f && r.stat.components < components) {
            const FrameEvent *v = only(&r, EVENT_BLEND);
            assert_true(v->nbefore == 2 && v->nafter == 1 && v->count == 1 && v->nplace == 1);
            assert_true(r.events.number[v->before] == r.events.before[0] && r.events.number[v->before + 1] == r.events.before[1]);
            assert_place(&r, v, vec3(17, 12.6, 12.8), 1.5);
        }
        if (f && r.stat.components > components) {
            const FrameEvent *v = only(&r, EVENT_SPLIT);
            assert_true(v->nbefore == 1 && v->nafter == 2 && v->count == 1 && v->nplace == 1);
            assert_place(&r, v, vec3(17, 12.6, 12.8), 3);
        }
        components = r.stat.components;
    }
    assert_only_kinds(&r, 1u << EVENT_BLEND | 1u << EVENT_SPLIT);
    assert_true(r.sum[EVENT_BLEND] == 1 && r.sum[EVENT_SPLIT] == 1);
    run_close(&r);
}

/* Two joints and a hole between them, at one frame; then the hole closes. */
static void three_balls_meet_at_once(void **state)
{
    (void)state;
    Run r = run_open();
    SceneRun scene;
    scene_open(&scene, scene_find("three"), 0);
    for (int f = 9; f < 16; f++) {
        run_scene_frame(&r, &scene, f);
        if (!r.stat.events[EVENT_BLEND]) continue;
        const FrameEvent *v = only(&r, EVENT_BLEND);
        assert_true(v->nbefore == 3 && v->nafter == 1 && v->count == 2 && v->nplace == 2);
        assert_true(v_dist(r.events.place[v->place], r.events.place[v->place + 1]) > 8);
        assert_int_equal(only(&r, EVENT_HOLE_OPEN)->count, 1 - r.stat.audit_euler / 2);
    }
    /* where they touch the samples may see two necks at first */
    assert_only_kinds(&r, 1u << EVENT_BLEND | 1u << EVENT_HOLE_OPEN | 1u << EVENT_HOLE_CLOSE);
    assert_true(r.sum[EVENT_BLEND] == 2 && r.sum[EVENT_HOLE_OPEN] == r.sum[EVENT_HOLE_CLOSE]);
    assert_place(&r, only(&r, EVENT_HOLE_CLOSE), vec3(39.6, 39.7, 19.8), 4);
    scene_close(&scene);
    run_close(&r);
}

/* --- births and deaths ----------------------------------------------------------------------------------------------------- */

static void ball_is_born_and_dies(void **state)
{
    (void)state;
    Run r = run_open();
    static const double radius[] = {-1, -1, 2, 3, 2, -1, -1};
    for (int f = 0; f < 7; f++) {
        run_frame(&r, 34, fn_two_balls, (double[]){10.3, 10.6, 10.8, 6, 25.7, 25.6, 25.8, radius[f]});
        assert_int_equal(r.stat.events[EVENT_BIRTH], f == 2);
        assert_int_equal(r.stat.events[EVENT_DEATH], f == 5);
        if (f != 2 && f != 5) continue;
        const FrameEvent *v = only(&r, f == 2 ? EVENT_BIRTH : EVENT_DEATH);
        assert_true(v->nbefore == (f == 5) && v->nafter == (f == 2) && v->replaced >= 4);
        assert_place(&r, v, vec3(25.7, 25.6, 25.8), 0.5);
    }
    assert_only_kinds(&r, 1u << EVENT_BIRTH | 1u << EVENT_DEATH);
    run_close(&r);
}

/* The first frame with a surface is no birth where it is the first frame of all. */
static void surface_comes_and_goes(void **state)
{
    (void)state;
    Run r = run_open();
    static const double radius[] = {-1, 6, 6, -1, -1, 6};
    for (int f = 0; f < 6; f++) {
        run_frame(&r, 24, fn_ball, (double[]){11.3, 11.6, 11.8, radius[f]});
        assert_int_equal(r.stat.events[EVENT_BIRTH], f == 1 || f == 5);
        assert_int_equal(r.stat.events[EVENT_DEATH], f == 3);
    }
    run_close(&r);
}

/* --- holes ----------------------------------------------------------------------------------------------------------------- */

static void hole_opens_and_closes_in_a_plate(void **state)
{
    (void)state;
    Run r = run_open();
    SceneRun scene;
    scene_open(&scene, scene_find("disc"), 0);
    for (int f = 3; f < 38; f++) {
        run_scene_frame(&r, &scene, f);
        for (int k = EVENT_HOLE_OPEN; k <= EVENT_HOLE_CLOSE; k++) {
            if (!r.stat.events[k]) continue;
            const FrameEvent *v = only(&r, (EventKind)k);
            assert_true(v->count == 1 && v->nbefore == 1 && v->nafter == 1 && v->nplace == 1);
            assert_place(&r, v, vec3(31.6, 31.7, 13.3), 3.5);
        }
    }
    assert_only_kinds(&r, 1u << EVENT_HOLE_OPEN | 1u << EVENT_HOLE_CLOSE);
    assert_true(r.sum[EVENT_HOLE_OPEN] == 1 && r.sum[EVENT_HOLE_CLOSE] == 1);
    scene_close(&scene);
    run_close(&r);
}

/* --- nothing happens ------------------------------------------------------------------------------------------------------- */

static void nothing_happens_in_a_still_scene(void **state)
{
    (void)state;
    Run r = run_open();
    for (int f = 0; f < 6; f++) {
        run_frame(&r, 34, fn_two_balls, (double[]){10.3, 10.6, 10.8, 6, 25.7, 25.6, 25.8, 0.6});
        assert_int_equal(r.events.nevent, 0);
        assert_int_equal(r.events.nlink, f ? 2 : 0);
    }
    run_close(&r);
}

/* The speck is drawn anew in every frame, with identities of its own: it is the same all the same. */
static void balls_and_specks_that_move_are_followed(void **state)
{
    (void)state;
    Run r = run_open();
    int renumbered = 0;
    for (int f = 0; f < 6; f++) {
        run_frame(&r, 34, fn_two_balls, (double[]){10.3 + 0.8 * f, 10.6, 10.8, 6, 25.7 + 0.1 * f, 26.1, 25.9, 0.55});
        assert_int_equal(r.events.nbefore, f ? 2 : 0);
        assert_true(r.events.nafter == 2 && r.events.nlink == r.events.nbefore);
        for (int i = 0; i < r.events.nlink; i++) renumbered += r.events.link[i][0] != r.events.link[i][1];
    }
    assert_only_kinds(&r, 0);
    assert_true(renumbered > 0);
    run_close(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(balls_that_merge_blend_once_and_part_once),
        cmocka_unit_test(three_balls_meet_at_once),
        cmocka_unit_test(ball_is_born_and_dies),
        cmocka_unit_test(surface_comes_and_goes),
        cmocka_unit_test(hole_opens_and_closes_in_a_plate),
        cmocka_unit_test(nothing_happens_in_a_still_scene),
        cmocka_unit_test(balls_and_specks_that_move_are_followed),
    };
    int failed = cmocka_run_group_tests_name("lineage", tests, NULL, NULL);
    thread_shutdown();
    return failed;
}
