/* Drawn sequences of events (tests/soak): every frame exact, closed, manifold, identities never used twice.
 * TWINMESH_SEEDS=N runs as many; `make soak` runs a thousand, and `soak --seed N` one, a line a frame. */
#include "../soak/scenes.h"
#include "../soak/watch.h"
#include "base/thread.h"
#include "fields.h"
#include "topology/iso.h"

#include <stdlib.h>

enum { SEEDS = 20, FRAMES = 8 };

static void drawn_sequences_are_exact_at_every_frame(void **state)
{
    (void)state;
    const char *more = getenv("TWINMESH_SEEDS");
    int seeds = more ? atoi(more) : SEEDS, events = 0;
    for (int seed = 0; seed < seeds; seed++) {
        Events e = events_make((uint64_t)seed);
        TrackSettings set = track_defaults();
        set.edge = e.edge_vox;
        Watch w;
        watch_open(&w, &set);
        for (int f = 0; f < FRAMES; f++) {
            Grid g = events_grid(&e, f), v = events_velocity(&e, set.fps);
            if (!watch_frame(&w, &g, e.carried ? &v : NULL)) fail_msg("seed %d, frame %d: %s", seed, f + 1, w.wrong);
        }
        events += w.events;
        watch_close(&w);
    }
    assert_true(events >= 3 * seeds); /* they are not empty */
}

/* The first frames of each scene, and those around its middle, where most happens. */
static void scenes_hold_what_they_promise(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        int frame, components, euler;
    } row[] = {{"three", 1, 3, 6}, {"three", 15, 1, 0}, {"three", 25, 1, 2}, {"disc", 1, 1, 2}, {"disc", 21, 1, 0}, {"cavity", 1, 1, 2}, {"cavity", 9, 3, 6},
               {"pass", 1, 2, 2}, {"pass", 23, 2, 2}, {"enright", 1, 1, 2}, {"morph", 1, 1, 0}, {"morph", 25, 2, 4}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        SceneRun run;
        scene_open(&run, scene_find(row[i].name), 0);
        float *phi = NEW(float, run.nsample);
        if (run.scene->phi) run.frame = row[i].frame - 1; /* these can be entered anywhere */
        assert_true(scene_next(&run, phi));
        Grid g;
        Field f;
        IsoSurface iso;
        Err err;
        grid_init(&g, 1);
        grid_from_dense(&g, phi, run.n);
        assert_true(field_build(&f, &g, &(FieldSpec){0, true}, &err));
        iso_build(&iso, &f);
        int euler = 0;
        for (int k = 0; k < iso.ncomp; k++) euler += iso.comp_euler[k];
        if (iso.ncomp != row[i].components || euler != row[i].euler) fail_msg("%s, frame %d: %d components, Euler %d", row[i].name, row[i].frame, iso.ncomp, euler);
        iso_free(&iso);
        field_free(&f);
        grid_free(&g);
        mem_free(phi);
        scene_close(&run);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_hold_what_they_promise),
        cmocka_unit_test(drawn_sequences_are_exact_at_every_frame),
    };
    int failed = cmocka_run_group_tests_name("events", tests, NULL, NULL);
    thread_shutdown();
    return failed;
}
