/* ridges.c: how well the mechanical mesh holds the twelve ridges of the ||.||_1 ball with and without the constraint of
 * GI'07's equation 4, and with vertices on F = 0 or on the samples' surface. Prints, asserts nothing.
 *   ridges SCENE.json     whose one element is a point under ||.||_1 */
#include "scene/scene_priv.h"
#include "track/track.h"

#include <stdio.h>

enum { RIDGES = 12, STEPS = 60 };

static Vec3 nearest_on(Vec3 p, Vec3 a, Vec3 b)
{
    Vec3 d = v_sub(b, a);
    return v_axpy(a, real_clamp(v_dot(v_sub(p, a), d) / v_len2(d), 0, 1), d);
}

static void find_ridges(const Pose *ps, Vec3 ridge[RIDGES][2])
{
    int n = 0;
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < 4; k++) {
            Vec3 from = ps->e->corner[0], to = from;
            v_set(&from, a, v_get(from, a) + (k & 1 ? 1 : -1) * ps->radius);
            v_set(&to, (a + 1) % 3, v_get(to, (a + 1) % 3) + (k & 2 ? 1 : -1) * ps->radius);
            ridge[n][0] = affine_to_world(&ps->place, from);
            ridge[n++][1] = affine_to_world(&ps->place, to);
        }
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

static void measure(const char *title, const TriMesh *m, Vec3 ridge[RIDGES][2], const FrameStat *stat, double voxel)
{
    double sum = 0, off = 0, worst = 0;
    int near = 0, on = 0;
    for (int v = 0; v < m->nvert; v++) {
        double d = INFINITY;
        for (int r = 0; r < RIDGES; r++) d = real_min(d, v_dist(vertex(m, v), nearest_on(vertex(m, v), ridge[r][0], ridge[r][1])));
        if (d > 0.3 * stat->edge_mean) continue;
        near++;
        on += d < 0.01 * voxel;
        sum += d;
    }
    for (int r = 0; r < RIDGES; r++)
        for (int i = 3; i <= STEPS - 3; i++) {
            double d = distance_to_mesh(m, v_mix(ridge[r][0], ridge[r][1], (double)i / STEPS));
            off += d;
            worst = real_max(worst, d);
        }
    printf("  %-34s %6d %9d %16.4f %14.4f %9.4f\n", title, near, on, near ? sum / near / voxel : 0, off / (RIDGES * (STEPS - 5)) / voxel, worst / voxel);
}

static bool run(const Scene *s, bool exact, bool sharp, const char *title, Err *err)
{
    TrackSettings set = track_defaults();
    set.mech.sharp = sharp;
    SceneFrame *frame = scene_frame(s, s->first);
    Grid g;
    Field field;
    FrameStat stat;
    grid_init(&g, 1);
    if (!scene_fill_grid(frame, false, &g, err) || !field_build(&field, &g, &(FieldSpec){0, true}, err)) return false;
    if (exact) field.exact = scene_exact(frame);
    Track *tr = track_open(&set);
    bool ok = true;
    for (int64_t f = s->first; ok && f <= s->last; f++) {
        stat = (FrameStat){0};
        ok = track_frame(tr, &field, NULL, 1, &stat, err);
    }
    if (ok) {
        Vec3 ridge[RIDGES][2];
        TriMesh m;
        find_ridges(&frame->pose[0], ridge);
        track_meshes(tr, false, &m, NULL);
        measure(title, &m, ridge, &stat, s->voxel);
        trimesh_free(&m);
    }
    track_close(tr);
    field_free(&field);
    grid_free(&g);
    scene_frame_free(frame);
    return ok;
}

int main(int argc, char **argv)
{
    Scene s;
    Err err = {0};
    if (argc != 2 || !scene_load(argv[1], &s, &err)) return fprintf(stderr, "ridges SCENE.json: %s\n", err.text), 2;
    printf("  %-34s %6s %9s %16s %14s %9s\n", "", "near", "on ridge", "distance (vox)", "ridge cut off", "at most");
    bool ok = run(&s, true, true, "exact, with equation 4", &err) && run(&s, true, false, "exact, without", &err) &&
              run(&s, false, true, "trilinear, with equation 4", &err) && run(&s, false, false, "trilinear, without", &err);
    if (!ok) fprintf(stderr, "%s\n", err.text);
    scene_free(&s);
    return ok ? 0 : 1;
}
