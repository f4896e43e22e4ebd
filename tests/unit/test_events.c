/* Drawn sequences of events (tests/soak): every frame exact, closed, manifold, identities never used twice.
 * TWINMESH_SEEDS=N runs as many; `make soak` runs a thousand, and `soak --seed N` one, a line a frame. */
#include "../soak/scenes.h"
#include "../soak/watch.h"
#include "base/thread.h"
#include "fields.h"
#include "topology/iso.h"

#include <stdlib.h>

enum { SEEDS = 20, FRAMES = 8, FEW = 30 };

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
               {"pass", 1, 2, 2}, {"pass", 23, 2, 2}, {"enright", 1, 1, 2}, {"morph", 1, 1, 0}, {"morph", 25, 2, 4},
               {"splash", 1, 2, 4}, {"splash", 30, 2, 4}, {"pour", 1, 1, 2}, {"pour", 18, 4, 8}};
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

static Vec3 corner(const TriMesh *m, int v) { return vec3(m->pos[3 * v], m->pos[3 * v + 1], m->pos[3 * v + 2]); }

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* The median of the least angles of the triangles that hold a vertex of an identity from `from` to before `to`; 90 where they are few. */
static double median_angle(const TriMesh *m, int32_t from, int32_t to)
{
    double *angle = NEW(double, m->ntri + 1), median = 90;
    int n = 0;
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->tri + 3 * t;
        bool any = false;
        for (int k = 0; k < 3; k++) any = any || (m->id[c[k]] >= from && m->id[c[k]] < to);
        if (!any) continue;
        angle[n] = 180;
        for (int k = 0; k < 3; k++) {
            Vec3 a = corner(m, c[k]), u = v_unit(v_sub(corner(m, c[(k + 1) % 3]), a)), w = v_unit(v_sub(corner(m, c[(k + 2) % 3]), a));
            angle[n] = real_min(angle[n], acos(real_clamp(v_dot(u, w), -1, 1)) * 180 / 3.14159265358979);
        }
        n++;
    }
    qsort(angle, (size_t)n, sizeof *angle, by_value);
    if (n >= FEW) median = angle[n / 2];
    mem_free(angle);
    return median;
}

static int32_t next_id(const TriMesh *m)
{
    int32_t next = 0;
    for (int v = 0; v < m->nvert; v++) next = int_max(next, m->id[v] + 1);
    return next;
}

/* GI'07 figures 11 and 12, water-like grids: exact at every frame, what the mesh keeps, and how soon what is new is regular. */
static void water_is_followed(void **state)
{
    (void)state;
    static const char *const NAME[] = {"splash", "pour"};
    enum { REGULAR = 5 }; /* frames */
    for (int i = 0; i < 2; i++) {
        SceneRun run;
        Watch w;
        TrackSettings set = track_defaults();
        int32_t first[64] = {0};     /* the first identity that is new in each frame */
        double least = 90, best[64]; /* of what is new in each frame, in the frames after it */
        scene_open(&run, scene_find(NAME[i]), 0);
        watch_open(&w, &set);
        float *phi = NEW(float, run.nsample);
        for (int f = 0; scene_next(&run, phi); f++) {
            Grid g;
            grid_init(&g, 1);
            grid_from_dense(&g, phi, run.n);
            if (!watch_frame(&w, &g, NULL)) fail_msg("%s, frame %d: %s", NAME[i], f + 1, w.wrong);
            first[f + 1] = next_id(&w.mesh[0]);
            best[f] = 0;
            for (int b = int_max(1, f - REGULAR); b <= f; b++) best[b] = real_max(best[b], median_angle(&w.mesh[0], first[b], first[b + 1]));
            if (f > REGULAR) least = real_min(least, best[f - REGULAR]);
        }
        if (getenv("TWINMESH_TOLD")) print_message("%s: %d events, identities kept %.3f, regular %.1f\n", NAME[i], w.events, w.ids_kept / (w.frames - 1), least);
        assert_true(w.events >= 3);
        assert_true(w.ids_kept > 0.9 * (w.frames - 1));
        assert_true(least > 45);
        mem_free(phi);
        watch_close(&w);
        scene_close(&run);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_hold_what_they_promise),
        cmocka_unit_test(water_is_followed),
        cmocka_unit_test(drawn_sequences_are_exact_at_every_frame),
    };
    int failed = cmocka_run_group_tests_name("events", tests, NULL, NULL);
    thread_shutdown();
    return failed;
}
