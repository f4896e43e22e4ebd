/* ridges.c: how well the mechanical mesh holds the twelve ridges of the ||.||_q ball, q <= 1, with and without the constraint
 * of GI'07's equation 4, with vertices on F = 0, and on the samples' surface or, if one is given, on that of a volume sampled
 * from the scene, which knows nothing of the ball (GI'07 figure 9). Prints, asserts nothing.
 *   ridges SCENE.json [VOLUME]     whose one element is a point under ||.||_q */
#include "io/volume.h"
#include "scene/scene_priv.h"
#include "track/track.h"

#include <stdio.h>

enum { RIDGES = 12, STEPS = 60 };

typedef struct Ridge {
    Vec3 at[STEPS + 1];
} Ridge;

static Vec3 nearest_on(Vec3 p, Vec3 a, Vec3 b)
{
    Vec3 d = v_sub(b, a);
    return v_axpy(a, real_clamp(v_dot(v_sub(p, a), d) / v_len2(d), 0, 1), d);
}

/* Straight for q = 1, bent inward below. */
static void find_ridges(const Pose *ps, Ridge ridge[RIDGES])
{
    double q = ps->e->norm;
    for (int n = 0; n < RIDGES; n++)
        for (int i = 0; i <= STEPS; i++) {
            int a = n / 4, b = (a + 1) % 3;
            double u = (double)i / STEPS, r = ps->radius * pow(pow(1 - u, q) + pow(u, q), -1 / q);
            Vec3 p = ps->e->corner[0];
            v_set(&p, a, v_get(p, a) + (n & 1 ? 1 : -1) * r * (1 - u));
            v_set(&p, b, v_get(p, b) + (n & 2 ? 1 : -1) * r * u);
            ridge[n].at[i] = affine_to_world(&ps->place, p);
        }
}

static double distance_to_ridges(const Ridge ridge[RIDGES], Vec3 p)
{
    double d = INFINITY;
    for (int r = 0; r < RIDGES; r++)
        for (int i = 0; i < STEPS; i++) d = real_min(d, v_dist(p, nearest_on(p, ridge[r].at[i], ridge[r].at[i + 1])));
    return d;
}

static Vec3 vertex(const TriMesh *m, int v) { return vec3(m->pos[3 * v], m->pos[3 * v + 1], m->pos[3 * v + 2]); }

/* The distance of p from the mesh, by points of its triangles a twentieth of an edge apart. */
static double distance_to_mesh(const TriMesh *m, Vec3 p)
{
    enum { CUTS = 20 };
    double best = INFINITY;
    for (int t = 0; t < m->ntri; t++) {
        Vec3 a = vertex(m, m->tri[3 * t]), b = vertex(m, m->tri[3 * t + 1]), c = vertex(m, m->tri[3 * t + 2]);
        if (v_dist(a, p) > best + v_dist(a, b) + v_dist(a, c)) continue;
        for (int i = 0; i <= CUTS; i++) best = real_min(best, v_dist(p, nearest_on(p, a, v_mix(b, c, (double)i / CUTS))));
    }
    return best;
}

static void measure(const char *title, const TriMesh *m, const Ridge ridge[RIDGES], const FrameStat *stat, double voxel)
{
    double sum = 0, off = 0, worst = 0;
    int near = 0, on = 0;
    for (int v = 0; v < m->nvert; v++) {
        double d = distance_to_ridges(ridge, vertex(m, v));
        if (d > 0.3 * stat->edge_mean) continue;
        near++;
        on += d < 0.01 * voxel;
        sum += d;
    }
    for (int r = 0; r < RIDGES; r++)
        for (int i = 3; i <= STEPS - 3; i++) {
            double d = distance_to_mesh(m, ridge[r].at[i]);
            off += d;
            worst = real_max(worst, d);
        }
    printf("  %-34s %6d %9d %16.4f %14.4f %9.4f\n", title, near, on, near ? sum / near / voxel : 0, off / (RIDGES * (STEPS - 5)) / voxel, worst / voxel);
}

typedef enum Source { EXACT, TRILINEAR, VOLUME } Source;

static bool make_field(const SceneFrame *frame, Source source, const char *path, Field *field, Err *err)
{
    Volume volume = {0};
    Grid g;
    bool ok;
    grid_init(&g, 1);
    if (source == VOLUME) ok = volume_read(path, &(VolumeRequest){0}, &volume, err) && field_build(field, &volume.surface, &(FieldSpec){0, true}, err);
    else ok = scene_fill_grid(frame, false, &g, err) && field_build(field, &g, &(FieldSpec){0, true}, err);
    if (ok && source == EXACT) field->exact = scene_exact(frame);
    if (source == VOLUME) volume_free(&volume);
    grid_free(&g);
    return ok;
}

static bool run(const Scene *s, Source source, const char *path, bool sharp, const char *title, Err *err)
{
    TrackSettings set = track_defaults();
    set.mech.sharp = sharp;
    SceneFrame *frame = scene_frame(s, s->first);
    Field field;
    FrameStat stat;
    if (!make_field(frame, source, path, &field, err)) return false;
    Track *tr = track_open(&set);
    bool ok = true;
    for (int64_t f = s->first; ok && f <= s->last; f++) {
        stat = (FrameStat){0};
        ok = track_frame(tr, &field, NULL, 1, &stat, err);
    }
    if (ok) {
        Ridge ridge[RIDGES];
        TriMesh m;
        find_ridges(&frame->pose[0], ridge);
        track_meshes(tr, false, &m, NULL);
        measure(title, &m, ridge, &stat, s->voxel);
        trimesh_free(&m);
    }
    track_close(tr);
    field_free(&field);
    scene_frame_free(frame);
    return ok;
}

int main(int argc, char **argv)
{
    Scene s;
    Err err = {0};
    if (argc < 2 || argc > 3 || !scene_load(argv[1], &s, &err)) return fprintf(stderr, "ridges SCENE.json [VOLUME]: %s\n", err.text), 2;
    printf("  %-34s %6s %9s %16s %14s %9s\n", "", "near", "on ridge", "distance (vox)", "ridge cut off", "at most");
    bool ok = run(&s, EXACT, NULL, true, "exact, with equation 4", &err) && run(&s, EXACT, NULL, false, "exact, without", &err);
    if (argc == 2) ok = ok && run(&s, TRILINEAR, NULL, true, "trilinear, with equation 4", &err) && run(&s, TRILINEAR, NULL, false, "trilinear, without", &err);
    if (argc == 3) ok = ok && run(&s, VOLUME, argv[2], true, "volume, with equation 4", &err) && run(&s, VOLUME, argv[2], false, "volume, without", &err);
    if (!ok) fprintf(stderr, "%s\n", err.text);
    scene_free(&s);
    return ok ? 0 : 1;
}
