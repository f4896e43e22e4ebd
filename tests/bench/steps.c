/* steps.c: RR-6128 table 2's question of stability: the skin's quasi-static steps as the papers take them, one a frame of a
 * moving scene, with ALTERMESH and the landing, by finite elements or by springs, and none of the program's own guards
 * (limited steps, healing, improving, mending). Prints the percentage of triangles inverted in the end, asserts nothing.
 *   steps SCENE.json EDGE DT ITERATIONS fem|spring */
#include "mechanics/mechanics.h"
#include "remesh/remesh.h"
#include "scene/scene.h"
#include "topology/iso.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REST_RATIO 0.74 /* as the tracker's */

typedef struct Run {
    double edge;
    MechanicsSettings set;
    Mechanics mech;
    Mesh mesh;
    int frames;
    double inverted; /* share of triangles, after the last step */
} Run;

static void begin(Run *run, const Field *field)
{
    IsoSurface iso;
    Remesh r;
    iso_build(&iso, field);
    uint8_t *want = NEW(uint8_t, iso.ncomp);
    memset(want, 1, (size_t)iso.ncomp);
    iso_triangulate(&iso, want, &run->mesh, NULL);
    remesh_begin(&r, &run->mesh, field, run->edge, NULL);
    remesh_coarsen(&r, 3);
    remesh_end(&r);
    mem_free(want);
    iso_free(&iso);
    remesh_remember_lengths(&run->mesh, NULL);
}

static void alter(Run *run, const Field *field)
{
    Remesh r;
    remesh_begin(&r, &run->mesh, field, run->edge, NULL);
    remesh_alter(&r, &(AlterRules){run->set.rest, 0.8, 2, 0.1});
    int32_t *to = NEW(int32_t, run->mesh.nvert);
    remesh_compact(&r, to);
    mem_free(to);
    remesh_end(&r);
}

static int find_inverted(const Mesh *m, const Field *field, uint8_t *inverted, Vec3 *normal)
{
    int n = 0;
    for (int t = 0; t < m->ntri; t++) {
        const int32_t *c = m->corner + 3 * t;
        Vec3 centroid = v_scale(v_add(v_add(m->pos[c[0]], m->pos[c[1]]), m->pos[c[2]]), 1.0 / 3);
        n += inverted[t] = field_triangle_inverted(field, m->pos[c[0]], m->pos[c[1]], m->pos[c[2]]);
        field_normals(field, 1, &centroid, &normal[t]);
    }
    return n;
}

static void step(Run *run, const Field *field)
{
    Mesh *m = &run->mesh;
    uint8_t *inverted = NEW(uint8_t, m->ntri);
    Vec3 *normal = NEW(Vec3, m->nvert), *tri_normal = NEW(Vec3, m->ntri), *dx = NEW(Vec3, m->nvert);
    field_normals(field, m->nvert, m->pos, normal);
    find_inverted(m, field, inverted, tri_normal);
    MechanicsProblem prob = {.nvert = m->nvert, .ntri = m->ntri, .pos = m->pos, .tri = m->corner, .normal = normal, .tri_normal = tri_normal, .inverted = inverted};
    mechanics_step(&run->mech, &run->set, &prob, dx);
    for (int v = 0; v < m->nvert; v++) m->pos[v] = v_add(m->pos[v], dx[v]);
    field_project(field, m->nvert, m->pos, 2 * run->edge, NULL);
    run->inverted = (double)find_inverted(m, field, inverted, tri_normal) / m->ntri;
    mem_free(inverted);
    mem_free(normal);
    mem_free(tri_normal);
    mem_free(dx);
}

static bool run_frame(Run *run, const Scene *s, int64_t number, Err *err)
{
    SceneFrame *frame = scene_frame(s, number);
    Grid g;
    Field field;
    grid_init(&g, 1);
    bool ok = scene_fill_grid(frame, false, &g, err) && field_build(&field, &g, &(FieldSpec){0, true}, err);
    if (ok) {
        field.exact = scene_exact(frame);
        if (run->frames++ == 0) begin(run, &field);
        else {
            field_project(&field, run->mesh.nvert, run->mesh.pos, 2 * run->edge, NULL);
            alter(run, &field);
        }
        step(run, &field);
        remesh_remember_lengths(&run->mesh, NULL);
        field_free(&field);
    }
    grid_free(&g);
    scene_frame_free(frame);
    return ok;
}

int main(int argc, char **argv)
{
    Scene s;
    Err err = {0};
    if (argc != 6 || !scene_load(argv[1], &s, &err)) return fprintf(stderr, "steps SCENE.json EDGE DT ITERATIONS fem|spring %s\n", err.text), 2;
    Run run = {.edge = atof(argv[2]), .set = mechanics_defaults()};
    run.set.rest = REST_RATIO * run.edge;
    run.set.dt = atof(argv[3]);
    run.set.cg_iterations = atoi(argv[4]);
    run.set.cg_tolerance = 0;
    run.set.kind = strcmp(argv[5], "fem") == 0 ? MECHANICS_FEM : MECHANICS_SPRING;
    mesh_init(&run.mesh);
    bool ok = true;
    for (int64_t f = s.first; ok && f <= s.last; f++) ok = run_frame(&run, &s, f, &err);
    if (!ok) fprintf(stderr, "%s\n", err.text);
    else printf("%.1f\n", 100 * run.inverted);
    mesh_free(&run.mesh);
    mechanics_free(&run.mech);
    scene_free(&s);
    return ok ? 0 : 1;
}
