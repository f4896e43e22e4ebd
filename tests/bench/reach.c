/* reach.c: how far a mesh is from a finer one about a place: the largest distance of the finer one's vertices there.
 * Prints, asserts nothing.
 *   reach FINE.ply MESH.ply X Y Z RADIUS */
#include "io/ply.h"
#include "mesh/nearest.h"

#include <stdio.h>
#include <stdlib.h>

static Vec3 vertex(const TriMesh *m, int v) { return vec3(m->pos[3 * v], m->pos[3 * v + 1], m->pos[3 * v + 2]); }

static double distance_to_mesh(const TriMesh *m, Vec3 p)
{
    double best = INFINITY;
    for (int t = 0; t < m->ntri; t++) {
        Vec3 q[3];
        double w[3];
        for (int k = 0; k < 3; k++) q[k] = vertex(m, m->tri[3 * t + k]);
        triangle_nearest(p, q, w);
        best = real_min(best, v_dist(p, v_add(v_add(v_scale(q[0], w[0]), v_scale(q[1], w[1])), v_scale(q[2], w[2]))));
    }
    return best;
}

int main(int argc, char **argv)
{
    TriMesh fine = {0}, mesh = {0};
    Err err = {0};
    if (argc != 7 || !ply_read(argv[1], &fine, &err) || !ply_read(argv[2], &mesh, &err)) return fprintf(stderr, "reach FINE.ply MESH.ply X Y Z RADIUS %s\n", err.text), 2;
    Vec3 place = vec3(atof(argv[3]), atof(argv[4]), atof(argv[5]));
    double worst = 0;
    for (int v = 0; v < fine.nvert; v++)
        if (v_dist(vertex(&fine, v), place) <= atof(argv[6])) worst = real_max(worst, distance_to_mesh(&mesh, vertex(&fine, v)));
    printf("%.5f\n", worst);
    trimesh_free(&fine);
    trimesh_free(&mesh);
    return 0;
}
