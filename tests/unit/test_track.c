/* The tracker: balls at rest, moving, growing, merging; the same bytes for any number of threads. */
#include "base/thread.h"
#include "fields.h"
#include "mesh_shapes.h"
#include "track/track.h"

#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

/* A sequence being tracked: the last field lives until the next frame is done. */
typedef struct Run {
    Track *tr;
    Field field[2];
    Grid velocity[2];
    int frames;
    double off_most;   /* |F| allowed at a mechanical vertex, for one in fifty */
    FrameStat stat;
    TriMesh mech, fine;
} Run;

static Run run_open(TrackSettings set) { return (Run){.tr = track_open(&set), .off_most = 1e-4}; }

static void run_close(Run *r)
{
    track_close(r->tr);
    for (int i = 0; i < 2; i++) {
        field_free(&r->field[i]);
        grid_free(&r->velocity[i]);
    }
    trimesh_free(&r->mech);
    trimesh_free(&r->fine);
}

/* Positive volume, every edge twice in opposite directions, V - F / 2 = chi. */
static void assert_closed(const TriMesh *m, int chi)
{
    Map edge;
    map_init(&edge, 3 * m->ntri);
    for (int h = 0; h < 3 * m->ntri; h++) assert_int_equal(map_put(&edge, key_pair(m->tri[h], m->tri[he_next(h)]), h), h);
    for (int h = 0; h < 3 * m->ntri; h++) assert_true(map_get(&edge, key_pair(m->tri[he_next(h)], m->tri[h])) != NONE);
    map_free(&edge);
    assert_int_equal(m->nvert - m->ntri / 2, chi);
}

/* A frame after which both meshes are what the grid says, component by component. */
static void run_frame_moved(Run *r, Grid g, Grid *velocity)
{
    int i = r->frames++ % 2;
    Err err = {0};
    field_free(&r->field[i]);
    grid_free(&r->velocity[i]);
    r->field[i] = field_from(g);
    if (velocity) r->velocity[i] = *velocity;
    if (!track_frame(r->tr, &r->field[i], velocity ? &r->velocity[i] : NULL, 1, &r->stat, &err)) fail_msg("%s", err.text);
    trimesh_free(&r->mech);
    trimesh_free(&r->fine);
    track_meshes(r->tr, false, &r->mech, &r->fine);
    const FrameStat *s = &r->stat;
    if (getenv("TWINMESH_TOLD"))
        print_message("frame %d: %d components, %d vertices, edge %.3f of asked, p5 %.1f, remade %d, kept %.3f, frozen %d, substeps %d, inverted %d -> %d, lost %d, off %.4f/%.4f vox\n", r->frames,
                      s->components, s->vertices_mechanical, s->edge_mean / s->edge_asked, s->min_angle_p5, s->remade_components, s->ids_kept, s->frozen_vertices, s->predict_substeps,
                      s->inverted_found, s->inverted_left, s->projections_lost, s->distance_mean_vox, s->distance_max_vox);
    assert_int_equal(s->wrong_components, 0);
    assert_int_equal(s->components, s->audit_components);
    assert_int_equal(s->inverted_left, 0);
    assert_int_equal(s->inverted_left_geometric, 0);
    assert_int_equal(s->vertices_mechanical, r->mech.nvert);
    assert_int_equal(s->triangles_geometric, r->fine.ntri);
    assert_closed(&r->mech, s->audit_euler);
    assert_closed(&r->fine, s->audit_euler);
    int off = 0;
    double worst = 0;
    for (int v = 0; v < r->mech.nvert; v++) {
        const float *p = r->mech.pos + 3 * v;
        double F = fabs(field_value(&r->field[i], vec3(p[0], p[1], p[2]), NULL, NULL));
        off += F > 1e-4;
        worst = real_max(worst, F);
    }
    if (getenv("TWINMESH_TOLD") && off) print_message("    %d vertices off the surface, by F of up to %.4f\n", off, worst);
    assert_true(worst <= r->off_most && 50 * off <= r->mech.nvert);
}

static void run_frame(Run *r, Grid g) { run_frame_moved(r, g, NULL); }

static int ids_in_common(const TriMesh *m, const int32_t *id, int n)
{
    Map at;
    map_init(&at, m->nvert);
    for (int v = 0; v < m->nvert; v++) map_put(&at, (uint64_t)m->id[v], v);
    int common = 0;
    for (int i = 0; i < n; i++) common += map_get(&at, (uint64_t)id[i]) != NONE;
    map_free(&at);
    return common;
}

/* --- at rest --------------------------------------------------------------------------------------------------------------- */

static void ball_comes_to_rest(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    static const double k[2][4] = {{13.3, 13.6, 13.8, 8}, {13.3 + 4e-6, 13.6, 13.8, 8}}; /* moves by less than counts */
    run_frame(&r, grid_of(28, fn_ball, k[0]));
    assert_int_equal(r.stat.mend_patches, 0); /* the first mesh is right by itself */
    int n = r.mech.nvert, frames = 1;
    int32_t *id = NEW(int, n);
    memcpy(id, r.mech.id, (size_t)n * sizeof *id);
    while (frames < 80 && r.stat.frozen_vertices < r.stat.vertices_mechanical) {
        run_frame(&r, grid_of(28, fn_ball, k[frames % 2]));
        frames++;
        assert_int_equal(r.stat.remade_components, 0);
    }
    if (getenv("TWINMESH_TOLD")) print_message("at rest after %d frames\n", frames);
    assert_int_equal(r.stat.frozen_vertices, r.stat.vertices_mechanical);
    assert_true(ids_in_common(&r.mech, id, n) > 0.9 * n);
    assert_near(r.stat.edge_mean / r.stat.edge_asked, 1, 0.05);
    /* from now on nothing moves */
    TriMesh mech = r.mech, fine = r.fine;
    r.mech = r.fine = (TriMesh){0};
    for (int i = 0; i < 2; i++) {
        run_frame(&r, grid_of(28, fn_ball, k[(frames + i) % 2]));
        assert_int_equal(r.stat.frozen_vertices, r.stat.vertices_mechanical);
        assert_true(r.stat.ids_kept == 1 && r.stat.splits + r.stat.collapses + r.stat.flips == 0);
        assert_true(trimesh_is_same_run(&mech, &r.mech) && trimesh_is_same_run(&fine, &r.fine));
        assert_memory_equal(mech.pos, r.mech.pos, (size_t)(3 * mech.nvert) * sizeof *mech.pos);
        for (int k = 0; k < 3 * fine.nvert; k++) assert_near(fine.pos[k], r.fine.pos[k], 1e-5); /* balanced anew */
    }
    mem_free(id);
    trimesh_free(&mech);
    trimesh_free(&fine);
    run_close(&r);
}

/* The share of the vertices that a ball's last step leaves where they were without it: after some frames of slow motion, in one with `steps`
 * steps, in which it grows to `radius`. */
static double share_left_by_last_step(int steps, double radius)
{
    double k[4] = {13.3, 13.6, 13.8, 8};
    Run before = run_open(track_defaults());
    for (int f = 0; f < 6; f++, k[0] += 0.1) run_frame(&before, grid_of(32, fn_ball, k));
    k[3] = radius;
    TriMesh after[2];
    for (int i = 0; i < 2; i++) {
        TrackSettings set = track_defaults();
        set.relax_steps = steps - 1 + i;
        Run r = run_open(set);
        track_pass_on(before.tr, r.tr);
        run_frame(&r, grid_of(32, fn_ball, k));
        assert_int_equal(r.stat.relax_steps, steps - 1 + i);
        after[i] = r.mech;
        r.mech = (TriMesh){0};
        run_close(&r);
    }
    run_close(&before);
    Map at;
    int stayed = 0;
    map_init(&at, after[0].nvert);
    for (int v = 0; v < after[0].nvert; v++) map_put(&at, (uint64_t)after[0].id[v], v);
    for (int v = 0; v < after[1].nvert; v++) {
        int was = map_get(&at, (uint64_t)after[1].id[v]);
        stayed += was != NONE && memcmp(after[0].pos + 3 * was, after[1].pos + 3 * v, 3 * sizeof(float)) == 0;
    }
    double share = (double)stayed / after[1].nvert;
    if (getenv("TWINMESH_TOLD")) print_message("step %d, radius %g: %.2f of %d stayed\n", steps, radius, share, after[1].nvert);
    map_free(&at);
    for (int i = 0; i < 2; i++) trimesh_free(&after[i]);
    return share;
}

/* Most of a ball that only moves is calm after the first step, and much of it before; but what is stretched is woken. */
static void calm_vertices_sit_out_steps(void **state)
{
    (void)state;
    double second = share_left_by_last_step(2, 8), first = share_left_by_last_step(1, 8), stretched = share_left_by_last_step(1, 8.3);
    assert_true(second > 0.33 && second < 1);
    assert_true(first > 0.25 && first < 1);
    assert_true(stretched < 0.1);
}

/* The same samples again: the same meshes, whatever they would still relax to. Not so where a velocity moves what is on the surface. */
static void same_field_keeps_the_meshes(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    static const double k[] = {13.3, 13.6, 13.8, 8}, moved[] = {13.9, 13.6, 13.8, 8};
    run_frame(&r, grid_of(28, fn_ball, k));
    FrameStat first = r.stat;
    TriMesh mech = r.mech, fine = r.fine;
    r.mech = r.fine = (TriMesh){0};
    for (int i = 0; i < 3; i++) {
        run_frame(&r, grid_of(28, fn_ball, k));
        assert_true(r.stat.frozen_vertices == mech.nvert && r.stat.ids_kept == 1 && r.stat.relax_steps == 0 && r.stat.mend_faults == 0);
        assert_true(r.stat.edge_mean == first.edge_mean && r.stat.distance_mean_vox == first.distance_mean_vox && r.stat.audit_euler == 2);
        assert_true(trimesh_is_same_run(&mech, &r.mech) && trimesh_is_same_run(&fine, &r.fine));
        assert_memory_equal(mech.pos, r.mech.pos, (size_t)(3 * mech.nvert) * sizeof *mech.pos);
        assert_memory_equal(fine.pos, r.fine.pos, (size_t)(3 * fine.nvert) * sizeof *fine.pos);
        FrameEvents e = track_take_events(r.tr);
        assert_true(!e.first && e.nevent == 0 && e.nbefore == 1 && e.nafter == 1 && e.nlink == 1);
        assert_true(e.link[0][0] == e.before[0] && e.link[0][1] == e.before[0] && e.after[0] == e.before[0]);
        events_free(&e);
    }
    run_frame(&r, grid_of(28, fn_ball, moved));
    assert_true(r.stat.relax_steps > 0 && r.stat.frozen_vertices < mech.nvert && ids_in_common(&r.mech, mech.id, mech.nvert) > 0.9 * mech.nvert);
    Grid flow;
    grid_init(&flow, 3);
    flow.background[0] = 1;
    run_frame_moved(&r, grid_of(28, fn_ball, moved), &flow);
    assert_true(r.stat.relax_steps > 0);
    trimesh_free(&mech);
    trimesh_free(&fine);
    run_close(&r);
}

static void mean_edge_is_what_was_asked(void **state)
{
    (void)state;
    static const double k[] = {17.3, 17.6, 17.8, 10, 4.5};
    static const double edge[] = {1.5, 2.5};
    for (int i = 0; i < 2; i++) {
        TrackSettings set = track_defaults();
        set.edge = edge[i];
        Run r = run_open(set);
        for (int f = 0; f < 8; f++) {
            run_frame(&r, grid_of(36, fn_torus, k));
            assert_near(r.stat.edge_asked, edge[i], 1e-12);
            assert_near(r.stat.edge_mean / edge[i], 1, 0.05);
            assert_true(r.stat.edges_in_range > 0.99 && r.stat.min_angle_p5 > 30);
        }
        run_close(&r);
    }
}

/* --- in motion ------------------------------------------------------------------------------------------------------------- */

/* Five voxels a frame, half the ball's radius, without a velocity to tell. */
static void fast_ball_is_followed(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    double kept = 0;
    enum { FRAMES = 6 };
    for (int f = 0; f < FRAMES; f++) {
        const double k[] = {15.3 + 5 * f, 15.6, 15.8, 10};
        run_frame(&r, grid_of(56, fn_ball, k));
        if (f == 0) continue;
        assert_int_equal(r.stat.remade_components, 0);
        assert_true(r.stat.predict_substeps > 1);
        assert_near(r.stat.edge_mean / r.stat.edge_asked, 1, 0.1);
        kept += r.stat.ids_kept / (FRAMES - 1);
    }
    if (getenv("TWINMESH_TOLD")) print_message("kept %.3f a frame\n", kept);
    assert_true(kept > 0.6);
    run_close(&r);
}

static void velocity_carries_identities(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    for (int f = 0; f < 5; f++) {
        const double k[] = {13.3 + 4 * f, 13.6, 13.8, 8};
        Grid v;
        grid_init(&v, 3); /* nothing stored: the background alone, 4 voxels a frame */
        v.background[0] = 4 * 24;
        run_frame_moved(&r, grid_of(44, fn_ball, k), &v);
        assert_non_null(r.mech.velocity);
        assert_true(r.mech.velocity[0] == 96 && r.fine.velocity[3 * (r.fine.nvert - 1)] == 96);
        if (f == 0) continue;
        assert_true(r.stat.predict_substeps == 0 && r.stat.remade_components == 0);
        assert_true(r.stat.ids_kept > 0.95);
    }
    run_close(&r);
}

/* A ball of radius 9 that circles about (24, 24, 24) at distance 4 and turns with it, and drifts along z: centre at frame f. */
static const double CIRCLE_STEP = 0.05, DRIFT = 0.15; /* radians and voxels a frame */
static Vec3 circling(double f) { return vec3(24 + 4 * cos(CIRCLE_STEP * f), 24 + 4 * sin(CIRCLE_STEP * f), 20 + DRIFT * f); }
/* Voxels a second, at 24 frames. */
static Vec3 circling_velocity(Vec3 p) { return v_scale(vec3(-CIRCLE_STEP * (p.y - 24), CIRCLE_STEP * (p.x - 24), DRIFT), 24); }

static Grid circling_ball(int f)
{
    Vec3 c = circling(f);
    return grid_of(48, fn_ball, (double[4]){c.x, c.y, c.z, 9});
}

static Vec3 get3(const float *v) { return vec3((double)v[0], (double)v[1], (double)v[2]); }

static void surface_velocity_is_the_motion_of_the_surface(void **state)
{
    (void)state;
    TrackSettings set = track_defaults();
    set.own_motion = true;
    Run r = run_open(set);
    r.off_most = 1e-3;
    for (int f = 0; f < 5; f++) {
        run_frame(&r, circling_ball(f));
        double worst = 0, sum = 0, most = 0, across = 0;
        for (int v = 0; v < r.fine.nvert; v++) {
            Vec3 p = get3(r.fine.pos + 3 * v), n = v_unit(v_sub(p, circling(f))), got = get3(r.fine.velocity + 3 * v), want = circling_velocity(p);
            if (f == 0) assert_true(v_len(got) == 0);
            double off = fabs(v_dot(got, n) - v_dot(want, n));
            worst = real_max(worst, off);
            sum += off * off / r.fine.nvert;
            most = real_max(most, v_len(want));
            across = real_max(across, v_len(v_axpy(got, -v_dot(got, n), n)));
        }
        if (getenv("TWINMESH_TOLD")) print_message("frame %d: normal speed off by %.4f (worst %.4f) of %.4f, across up to %.4f\n", f, sqrt(sum), worst, most, across);
        if (f == 0) continue;
        assert_true(sqrt(sum) < 0.02 * most);
        assert_true(worst < 0.02 * most);
    }
    run_close(&r);
}

static void velocity_of_a_turning_ball_is_the_grids(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    enum { N = 48 };
    float *value = NEW(float, 3 * N * N * N);
    for (int f = 0; f < 3; f++) {
        for (int i = 0; i < N * N * N; i++) {
            Vec3 u = circling_velocity(vec3(i % N, i / N % N, i / (N * N)));
            for (int k = 0; k < 3; k++) value[3 * i + k] = (float)v_get(u, k);
        }
        Grid g;
        grid_init(&g, 3);
        grid_from_dense(&g, value, (int[3]){N, N, N});
        run_frame_moved(&r, circling_ball(f), &g);
        for (int v = 0; v < r.fine.nvert; v++) {
            Vec3 want = circling_velocity(get3(r.fine.pos + 3 * v));
            assert_true(v_dist(get3(r.fine.velocity + 3 * v), want) < 1e-4 * v_len(want));
        }
    }
    mem_free(value);
    run_close(&r);
}

static void growing_ball_keeps_its_edge_length(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    for (int f = 0; f < 12; f++) {
        const double k[] = {17.3, 17.6, 17.8, 6 + 0.7 * f};
        run_frame(&r, grid_of(36, fn_ball, k));
        assert_int_equal(r.stat.remade_components, 0);
        if (f >= 2) assert_near(r.stat.edge_mean / r.stat.edge_asked, 1, 0.05);
    }
    run_close(&r);
}

static void balls_may_merge_and_part(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    r.off_most = 1.5; /* around a neck that thins within a frame vertices find no landing and stay behind */
    int most = 0, least = 9;
    for (int f = 0; f < 10; f++) {
        double x = f < 5 ? f : 9 - f; /* there and back */
        const double k[] = {9.3 + x, 12.6, 12.8, 6, 24.7 - x, 12.6, 12.8, 6};
        run_frame(&r, grid_of(34, fn_two_balls, k));
        most = int_max(most, r.stat.components);
        least = int_min(least, r.stat.components);
    }
    assert_true(most == 2 && least == 1);
    run_close(&r);
}

/* Ball to torus to ball, hollow and back. */
static void handles_and_hollows_open_and_close(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    r.off_most = 0.01; /* where the first has its dimples the gradient leads nowhere */
    static const struct {
        FieldFn *fn;
        double k[5];
        int components, chi;
    } row[] = {{fn_torus, {15.5, 15.5, 15.5, 6, 6.5}, 1, 2}, {fn_torus, {15.5, 15.5, 15.5, 7, 5}, 1, 0}, {fn_torus, {15.5, 15.5, 15.5, 7, 5.5}, 1, 0},
               {fn_torus, {15.5, 15.5, 15.5, 5.5, 6.5}, 1, 2}, {fn_cavity, {15.5, 15.5, 15.5, 10, 3}, 2, 4}, {fn_ball, {15.5, 15.5, 15.5, 10}, 1, 2}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        run_frame(&r, grid_of(32, row[i].fn, row[i].k));
        assert_int_equal(r.stat.components, row[i].components);
        assert_int_equal(r.stat.audit_euler, row[i].chi);
    }
    run_close(&r);
}

static void noise_is_exact_at_every_frame(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    for (uint64_t seed = 1; seed <= 3; seed++) {
        Grid g = grid_of_noise(8, seed, 0);
        Err err = {0};
        int i = r.frames++ % 2;
        field_free(&r.field[i]);
        r.field[i] = field_from(g);
        assert_true(track_frame(r.tr, &r.field[i], NULL, 1, &r.stat, &err));
        assert_int_equal(r.stat.wrong_components, 0);
        assert_int_equal(r.stat.components, r.stat.audit_components);
        track_meshes(r.tr, false, &r.mech, &r.fine);
        assert_closed(&r.mech, r.stat.audit_euler);
        assert_closed(&r.fine, r.stat.audit_euler);
        trimesh_free(&r.mech);
        trimesh_free(&r.fine);
    }
    run_close(&r);
}

static void frame_without_surface_is_empty(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    static const double ball[] = {11.3, 11.6, 11.8, 6}, none[] = {11.3, 11.6, 11.8, -1};
    const double *k[] = {none, ball, none, none, ball, ball};
    int32_t last_id = -1;
    for (int f = 0; f < 6; f++) {
        run_frame(&r, grid_of(24, fn_ball, k[f]));
        assert_int_equal(r.mech.nvert > 0, k[f] == ball);
        if (k[f] == none) assert_true(r.stat.components == 0 && r.mech.ntri == 0 && r.fine.ntri == 0);
        if (f == 4) /* a new surface has new identities */
            for (int v = 0; v < r.mech.nvert; v++) assert_true(r.mech.id[v] > last_id);
        for (int v = 0; v < r.mech.nvert; v++) last_id = int_max(last_id, r.mech.id[v]);
    }
    assert_near(r.stat.edge_asked, 1.5, 1e-12);
    run_close(&r);
}

/* --- the meshes ------------------------------------------------------------------------------------------------------------ */

static void angle_of_180_writes_the_mesh_twice(void **state)
{
    (void)state;
    TrackSettings set = track_defaults();
    set.angle_deg = 180;
    Run r = run_open(set);
    for (int f = 0; f < 2; f++) {
        run_frame(&r, grid_of(24, fn_ball, (double[]){11.3 + f, 11.6, 11.8, 6}));
        assert_true(trimesh_is_same_run(&r.mech, &r.fine));
        assert_memory_equal(r.mech.pos, r.fine.pos, (size_t)(3 * r.mech.nvert) * sizeof(float));
    }
    run_close(&r);
}

/* A slab that runs into the walls: open, nothing beyond the bounding box is left; parents still point at theirs. */
static void open_border_leaves_out_what_closes(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    r.off_most = 0.5; /* sharp edges, where the border closes */
    run_frame(&r, grid_of(16, fn_slab, (double[]){7.6, 3.2}));
    TriMesh mech, fine;
    track_meshes(r.tr, true, &mech, &fine);
    assert_in_range(mech.ntri, r.mech.ntri / 4, r.mech.ntri - 50);
    assert_true(fine.ntri < r.fine.ntri);
    const TriMesh *m[2] = {&mech, &fine};
    for (int i = 0; i < 2; i++) {
        uint8_t *used = NEW0(uint8_t, m[i]->nvert);
        for (int h = 0; h < 3 * m[i]->ntri; h++) {
            assert_true(m[i]->tri[h] >= 0 && m[i]->tri[h] < m[i]->nvert);
            used[m[i]->tri[h]] = 1;
        }
        for (int v = 0; v < m[i]->nvert; v++) assert_true(used[v]);
        mem_free(used);
    }
    for (int t = 0; t < mech.ntri; t++) {
        double x = 0, y = 0;
        for (int k = 0; k < 3; k++) x += (double)mech.pos[3 * mech.tri[3 * t + k]] / 3, y += (double)mech.pos[3 * mech.tri[3 * t + k] + 1] / 3;
        assert_true(x >= 0 && x <= 15 && y >= 0 && y <= 15);
    }
    for (int t = 0; t < fine.ntri; t++) assert_true(fine.parent[t] >= 0 && fine.parent[t] < mech.ntri);
    trimesh_free(&mech);
    trimesh_free(&fine);
    run_close(&r);
}

static void carried_vertices_land_on_the_new_surface(void **state)
{
    (void)state;
    Run r = run_open(track_defaults());
    run_frame(&r, grid_of(28, fn_ball, (double[]){12.3, 13.6, 13.8, 7}));
    TriMesh last = r.mech;
    r.mech = (TriMesh){0};
    run_frame(&r, grid_of(28, fn_ball, (double[]){13.8, 13.6, 13.8, 7}));
    float *pos = NEW(float, 3 * last.nvert), *normal = NEW(float, 3 * last.nvert);
    track_carry(r.tr, &last, pos, normal);
    for (int v = 0; v < last.nvert; v++) {
        Vec3 p = vec3(pos[3 * v], pos[3 * v + 1], pos[3 * v + 2]), n = vec3(normal[3 * v], normal[3 * v + 1], normal[3 * v + 2]);
        assert_near(field_value(&r.field[1], p, NULL, NULL), 0, 1e-4);
        assert_near(v_dot(n, v_unit(v_sub(p, vec3(13.8, 13.6, 13.8)))), 1, 0.01);
    }
    TriMesh moved = r.mech;
    r.mech = (TriMesh){0};
    run_frame(&r, grid_of(28, fn_ball, (double[]){13, 13, 13, -1})); /* no surface: held */
    float *held = NEW(float, 3 * moved.nvert), *held_normal = NEW(float, 3 * moved.nvert);
    track_carry(r.tr, &moved, held, held_normal);
    assert_memory_equal(held, moved.pos, (size_t)(3 * moved.nvert) * sizeof(float));
    assert_memory_equal(held_normal, moved.normal, (size_t)(3 * moved.nvert) * sizeof(float));
    trimesh_free(&last);
    trimesh_free(&moved);
    mem_free(pos);
    mem_free(normal);
    mem_free(held);
    mem_free(held_normal);
    run_close(&r);
}

/* World units, a mirrored transform: the same method. */
static void world_units_do_not_matter(void **state)
{
    (void)state;
    TrackSettings set = track_defaults();
    set.edge = 0.02;
    set.edge_in_voxels = false;
    Run r = run_open(set);
    for (int f = 0; f < 3; f++) {
        Grid g = grid_of(24, fn_ball, (double[]){10.3 + f, 11.6, 11.8, 7});
        g.xform = affine_of(vec3(0, 0.01, 0), vec3(0.01, 0, 0), vec3(0, 0, 0.01), vec3(1, 0, -0.5));
        run_frame(&r, g);
        assert_near(r.stat.edge_mean / 0.02, 1, 0.05);
        assert_int_equal(r.stat.remade_components, 0);
    }
    run_close(&r);
}

/* --- threads --------------------------------------------------------------------------------------------------------------- */

static uint64_t hash_bytes(uint64_t hash, const void *data, size_t n)
{
    const uint8_t *p = data;
    for (size_t i = 0; i < n; i++) hash = (hash ^ p[i]) * 1099511628211u;
    return hash;
}

static uint64_t sequence_hash(void)
{
    Run r = run_open(track_defaults());
    uint64_t hash = 14695981039346656037u;
    for (int f = 0; f < 4; f++) {
        const double k[] = {9.3 + f, 12.6, 12.8, 6.5, 23.7 - f, 12.6, 12.8, 6.5};
        run_frame(&r, grid_of(34, fn_two_balls, k));
        const TriMesh *m[2] = {&r.mech, &r.fine};
        for (int i = 0; i < 2; i++) {
            size_t v = (size_t)m[i]->nvert, t = (size_t)m[i]->ntri;
            hash = hash_bytes(hash_bytes(hash, m[i]->pos, 12 * v), m[i]->normal, 12 * v);
            hash = hash_bytes(hash_bytes(hash, m[i]->id, 4 * v), m[i]->tri, 12 * t);
        }
        hash = hash_bytes(hash, &r.stat, offsetof(FrameStat, seconds));
    }
    run_close(&r);
    return hash;
}

/* Threads are counted once a process: each number has a child of its own. */
static void same_bytes_for_any_number_of_threads(void **state)
{
    (void)state;
    static const int counts[] = {1, 2, 3};
    uint64_t hash[3] = {0};
    for (int i = 0; i < 3; i++) {
        int ends[2], status = 1;
        assert_int_equal(pipe(ends), 0);
        pid_t child = fork();
        assert_true(child >= 0);
        if (child == 0) {
            thread_set_count(counts[i]);
            uint64_t own = sequence_hash();
            thread_shutdown();
            _exit(write(ends[1], &own, sizeof own) == (ssize_t)sizeof own ? 0 : 1);
        }
        close(ends[1]);
        assert_int_equal(read(ends[0], &hash[i], sizeof *hash), sizeof *hash);
        close(ends[0]);
        assert_int_equal(waitpid(child, &status, 0), child);
        assert_int_equal(status, 0);
    }
    assert_true(hash[0] == hash[1] && hash[0] == hash[2]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bytes_for_any_number_of_threads),
        cmocka_unit_test(ball_comes_to_rest),
        cmocka_unit_test(calm_vertices_sit_out_steps),
        cmocka_unit_test(same_field_keeps_the_meshes),
        cmocka_unit_test(mean_edge_is_what_was_asked),
        cmocka_unit_test(fast_ball_is_followed),
        cmocka_unit_test(velocity_carries_identities),
        cmocka_unit_test(surface_velocity_is_the_motion_of_the_surface),
        cmocka_unit_test(velocity_of_a_turning_ball_is_the_grids),
        cmocka_unit_test(growing_ball_keeps_its_edge_length),
        cmocka_unit_test(balls_may_merge_and_part),
        cmocka_unit_test(handles_and_hollows_open_and_close),
        cmocka_unit_test(noise_is_exact_at_every_frame),
        cmocka_unit_test(frame_without_surface_is_empty),
        cmocka_unit_test(angle_of_180_writes_the_mesh_twice),
        cmocka_unit_test(open_border_leaves_out_what_closes),
        cmocka_unit_test(carried_vertices_land_on_the_new_surface),
        cmocka_unit_test(world_units_do_not_matter),
    };
    int failed = cmocka_run_group_tests_name("track", tests, NULL, NULL);
    thread_shutdown();
    return failed;
}
