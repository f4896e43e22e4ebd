/* skin.c: what a frame of the active skin costs, against n for a grid of n^3: GI'98 4.1 has it grow as the surface's
 * area, n^2. A ball of 0.4 n voxels' radius under tension that keeps its volume. Prints, asserts nothing.
 *   tests/skin [THREADS] */
#include "base/thread.h"
#include "skin/skin.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { FRAMES = 3 };

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Blocks of 8^3 samples around the ball's surface; tiles within. */
static Field ball(int n)
{
    Grid g;
    grid_init(&g, 1);
    double radius = 0.4 * n, centre = 0.5 * n + 0.3;
    for (int a = 0; a < 3; a++) g.hi[a] = n - 1;
    g.background[0] = 8;
    for (int z = 0; z < n; z += 8)
        for (int y = 0; y < n; y += 8)
            for (int x = 0; x < n; x += 8) {
                double d = v_dist(vec3(x + 3.5, y + 3.5, z + 3.5), vec3(centre, centre, centre)) - radius;
                if (d < -16) grid_add_tile(&g, (GridTile){{x, y, z}, 3, {-8, 0, 0}});
                if (fabs(d) > 16) continue;
                float *v = grid_add_block(&g, x, y, z);
                for (int c = 0; c < GRID_CELLS; c++) v[c] = (float)(v_dist(vec3(x + (c & 7), y + (c >> 3 & 7), z + (c >> 6)), vec3(centre, centre, centre)) - radius);
            }
    Field f;
    Err err;
    if (!field_build(&f, &g, &(FieldSpec){.inside_below = true}, &err)) exit(1);
    grid_free(&g);
    return f;
}

/* Seconds of a frame. */
static double bench(int n)
{
    const SkinLattice lattice = {.voxel = 1};
    const SkinSettings settings = {.alpha = 2, .beta = 0.1, .gamma = 20, .keep = KEEP_VOLUME};
    Err err;
    Field f = ball(n);
    double start = seconds();
    SkinTarget *t = skin_target_field(&lattice, &f, &err);
    if (!t) exit(1);
    double made = seconds();
    Skin *s = skin_begin(&lattice, &settings, t);
    SkinStat stat = {0};
    for (int i = 0; i < FRAMES; i++) stat = skin_move(s, t, 1);
    double moved = seconds();
    Grid out;
    grid_init(&out, 1);
    skin_to_grid(s, &out);
    double gridded = seconds();
    double frame = (made - start) + (moved - made) / FRAMES + (gridded - moved);
    printf("%6d %8d %10.1f %14.1f %8d %10.1f %12.1f\n", n, stat.bricks, 1e3 * (made - start), 1e3 * (moved - made) / FRAMES, stat.substeps, 1e3 * (gridded - moved), 1e3 * frame);
    grid_free(&out);
    skin_end(s);
    skin_target_free(t);
    field_free(&f);
    return frame;
}

int main(int argc, char **argv)
{
    static const int sides[] = {64, 96, 128, 192, 256};
    enum { COUNT = sizeof sides / sizeof *sides };
    thread_set_count(argc > 1 ? atoi(argv[1]) : thread_hardware_count());
    double first = 0, last = 0;
    puts("     n   bricks  target ms   motion ms  substeps    grid ms   a frame ms");
    for (int i = 0; i < COUNT; i++) {
        last = bench(sides[i]);
        if (i == 0) first = last;
    }
    printf("a frame's time grows as n^%.2f from n = %d to %d\n", log(last / first) / log((double)sides[COUNT - 1] / sides[0]), sides[0], sides[COUNT - 1]);
    thread_shutdown();
    return 0;
}
