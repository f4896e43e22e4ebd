/* The field: which bricks there are, values and gradients, borders, transforms. */
#include "base/thread.h"
#include "fields.h"

/* 1 + 2x - 4y + 8xyz on one cell: what trilinear interpolation keeps. */
static Grid one_cell(void)
{
    Grid g;
    grid_init(&g, 1);
    grid_from_dense(&g, (float[8]){1, 3, -3, -1, 1, 3, -3, 7}, (int[3]){2, 2, 2});
    return g;
}

static void value_is_trilinear(void **state)
{
    (void)state;
    Grid g = one_cell();
    Field f;
    Err err = {0};
    Vec3 p = vec3(0.25, 0.5, 0.75), grad;
    bool known;
    assert_true(field_build(&f, &g, &(FieldSpec){0, false}, &err));
    assert_true(field_value(&f, p, &grad, &known) == 0.25 && known);
    assert_true(v_dist(grad, vec3(5, -2.5, 1)) == 0); /* 2 + 8yz, -4 + 8xz, 8xy */
    double F;
    field_sample(&f, 1, &p, &F, NULL);
    assert_true(F == 0.25);
    field_free(&f);

    /* a level set about 0.5: F = 0.5 - v */
    assert_true(field_build(&f, &g, &(FieldSpec){0.5, true}, &err));
    assert_true(field_value(&f, p, &grad, NULL) == 0.25 && f.sign == -1);
    assert_true(v_dist(grad, vec3(-5, 2.5, -1)) == 0);
    field_free(&f);
    grid_free(&g);
}

static void isovalue_is_rounded_like_samples(void **state)
{
    (void)state;
    Grid g = one_cell();
    Field f;
    Err err = {0};
    float *v = (float *)(uintptr_t)grid_block(&g, 0, 0, 0);
    v[0] = 0.1f; /* above 0.1 in double */
    assert_true(field_build(&f, &g, &(FieldSpec){0.1, false}, &err));
    assert_true(field_value(&f, vec3(0, 0, 0), NULL, NULL) == 0);
    field_free(&f);
    grid_free(&g);
}

/* --- the smooth gradient --------------------------------------------------------------------------------------------- */

static double noise_at(const Grid *g, int x, int y, int z) { return (double)grid_at(g, x, y, z, 0); }

static Vec3 central(const Grid *g, int x, int y, int z)
{
    return vec3(0.5 * (noise_at(g, x + 1, y, z) - noise_at(g, x - 1, y, z)), 0.5 * (noise_at(g, x, y + 1, z) - noise_at(g, x, y - 1, z)),
                0.5 * (noise_at(g, x, y, z + 1) - noise_at(g, x, y, z - 1)));
}

static void smooth_gradient_is_interpolated_central_differences(void **state)
{
    (void)state;
    Grid g = grid_of_noise(12, 5, 0);
    Field f;
    Err err = {0};
    assert_true(field_build(&f, &g, &(FieldSpec){0, false}, &err));
    uint64_t seed = 1;
    for (int i = 0; i < 300; i++) {
        int o[3];
        double t[3];
        for (int a = 0; a < 3; a++) {
            double x = 5.5 + 8.9 * shape_noise(&seed); /* within samples 1 ... 10 */
            o[a] = (int)x, t[a] = i % 3 ? x - o[a] : 0;
        }
        Vec3 want = vec3(0, 0, 0), p = vec3(o[0] + t[0], o[1] + t[1], o[2] + t[2]), got;
        for (int c = 0; c < 8; c++) {
            double w = (c & 1 ? t[0] : 1 - t[0]) * (c & 2 ? t[1] : 1 - t[1]) * (c & 4 ? t[2] : 1 - t[2]);
            if (w > 0) want = v_axpy(want, w, central(&g, o[0] + (c & 1), o[1] + (c >> 1 & 1), o[2] + (c >> 2)));
        }
        double F;
        field_sample(&f, 1, &p, &F, &got);
        assert_near3(got, want, 1e-14);
        assert_near(F, grid_scalar(&g, p), 1e-14);
    }
    field_free(&f);
    grid_free(&g);
}

static void batches_of_any_length_are_the_single_points(void **state)
{
    (void)state;
    enum { N = 67 };
    Field f = field_from(grid_of_noise(12, 6, 0));
    Vec3 p[N], grad[N], part[N];
    double F[N], G[N];
    uint64_t seed = 2;
    for (int i = 0; i < N; i++) p[i] = v_axpy(vec3(5.5, 5.5, 5.5), 50, shape_noise3(&seed)); /* many beyond the bricks */
    field_sample(&f, N, p, F, grad);
    int unknown = 0;
    for (int i = 0; i < N; i++) {
        bool known;
        assert_near(field_value(&f, p[i], NULL, &known), F[i], 1e-15);
        assert_near3(field_gradient(&f, p[i]), grad[i], 1e-14);
        if (known) continue;
        unknown++;
        assert_true(F[i] == -f.far && v_len(grad[i]) == 0);
    }
    assert_in_range(unknown, 3, N - 20);
    static const int lengths[] = {0, 1, 31, 32, 33, 64};
    for (size_t k = 0; k < sizeof lengths / sizeof *lengths; k++) {
        int n = lengths[k];
        for (int i = 0; i < N; i++) G[i] = 99, part[i] = vec3(99, 99, 99);
        field_sample(&f, n, p, G, part);
        if (n) assert_memory_equal(G, F, (size_t)n * sizeof *F);
        if (n) assert_memory_equal(part, grad, (size_t)n * sizeof *grad);
        assert_true(G[n] == 99 && part[n].x == 99); /* not a place more */
    }
    field_free(&f);
}

static void no_number_as_a_point_is_nowhere(void **state)
{
    (void)state;
    Field f = field_of(8, fn_ball, (double[]){4, 4, 4, 2});
    static const Vec3 at[] = {{NAN, 4, 4}, {4, INFINITY, 4}, {4, 4, -1e300}, {1048577, 4, 4}};
    for (int i = 0; i < 4; i++) {
        bool known;
        assert_true(field_value(&f, at[i], NULL, &known) == -f.far && !known);
    }
    field_free(&f);
}

/* --- borders --------------------------------------------------------------------------------------------------------- */

static void full_grid_closes_half_a_voxel_beyond(void **state)
{
    (void)state;
    for (int depth = 1; depth <= 3; depth += 2) {
        Grid g;
        grid_init(&g, 1);
        float v[64];
        for (int i = 0; i < 64; i++) v[i] = (float)depth;
        grid_from_dense(&g, v, (int[3]){4, 4, 4});
        Field f = field_from(g);
        assert_true(f.far == depth);
        assert_true(field_value(&f, vec3(-0.5, 1.5, 2), NULL, NULL) == 0);
        assert_true(field_value(&f, vec3(1, 3.5, 2), NULL, NULL) == 0);
        assert_true(field_value(&f, vec3(1, 2, 3.25), NULL, NULL) == 0.5 * depth);
        assert_true(field_value(&f, vec3(1, 2, -1), NULL, NULL) == -depth);
        field_free(&f);
    }
}

/* A tile of 4096 samples' side, clipped: a file of some kilobytes, and a hundred thousand bricks. */
static void a_tile_out_of_proportion_is_refused(void **state)
{
    (void)state;
    Grid g;
    Field f;
    Err err;
    grid_init(&g, 1);
    g.background[0] = -1;
    grid_add_tile(&g, (GridTile){{-4096, -4096, -4096}, 12, {1, 0, 0}});
    for (int a = 0; a < 3; a++) g.lo[a] = -1200, g.hi[a] = -1;
    FieldSpec spec = {0, false};
    assert_false(field_build(&f, &g, &spec, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.text, "tile"));
    grid_free(&g);
}

static void inside_tiles_at_the_border_make_bricks(void **state)
{
    (void)state;
    Grid g;
    grid_init(&g, 1);
    g.background[0] = -1;
    grid_add_tile(&g, (GridTile){{0, 0, 0}, 3, {2, 0, 0}});
    for (int a = 0; a < 3; a++) g.lo[a] = 0, g.hi[a] = 7;
    Field f = field_from(g);
    assert_int_equal(f.ncrossed, 8); /* origins -8 and 0 */
    assert_int_equal(f.nbrick, 64);
    assert_true(field_value(&f, vec3(7.5, 3, 3), NULL, NULL) == 0);
    field_free(&f);

    /* a large one that the bounding box cuts: its skin alone, 4 bricks a side, and the inside is hollow */
    grid_init(&g, 1);
    g.background[0] = -1;
    grid_add_tile(&g, (GridTile){{-128, -128, -128}, 7, {1, 0, 0}});
    for (int a = 0; a < 3; a++) g.lo[a] = -32, g.hi[a] = -1;
    f = field_from(g);
    assert_int_equal(f.ncrossed, 5 * 5 * 5 - 3 * 3 * 3);
    assert_true(field_value(&f, vec3(-32.5, -20, -10), NULL, NULL) == 0);
    assert_true(field_value(&f, vec3(-0.5, -20, -10), NULL, NULL) == 0);
    field_free(&f);
}

/* As in no sound grid: of the brick at 48, 40, 40, deep in a tile, only the block beside it is outside. */
static void bricks_above_crossed_ones_are_known_as_crossed(void **state)
{
    (void)state;
    Grid g;
    grid_init(&g, 1);
    g.background[0] = -1;
    grid_add_tile(&g, (GridTile){{0, 0, 0}, 7, {1, 0, 0}});
    float *mixed = grid_add_block(&g, 40, 40, 40);
    for (int c = 0; c < GRID_CELLS; c++) mixed[c] = c ? -1 : 1;
    float *outside = grid_add_block(&g, 48, 48, 40);
    for (int c = 0; c < GRID_CELLS; c++) outside[c] = -1;
    for (int a = 0; a < 3; a++) g.lo[a] = 0, g.hi[a] = 127;
    Field f = field_from(g);
    assert_in_range(field_brick(&f, 48, 40, 40), 0, f.ncrossed - 1);
    field_free(&f);
}

static void inside_background_closes_at_the_box(void **state)
{
    (void)state;
    Grid g;
    grid_init(&g, 1);
    g.background[0] = 1;
    for (int c = 0; c < GRID_CELLS; c++) grid_add_block(&g, 8, 8, 8)[c] = -1; /* a hollow */
    for (int a = 0; a < 3; a++) g.lo[a] = 0, g.hi[a] = 23;
    Field f = field_from(g);
    assert_true(field_value(&f, vec3(-0.5, 12, 12), NULL, NULL) == 0);
    assert_true(field_value(&f, vec3(12, 12, 23.5), NULL, NULL) == 0);
    assert_true(field_value(&f, vec3(7.5, 12, 12), NULL, NULL) == 0);
    assert_true(field_value(&f, vec3(12, 15.5, 12), NULL, NULL) == 0);
    field_free(&f);
}

/* --- what is refused, what is empty ----------------------------------------------------------------------------------- */

static void what_is_no_number_is_refused_with_its_place(void **state)
{
    (void)state;
    static const float bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        Grid g = grid_of(12, fn_ball, (double[]){6, 6, 6, 3});
        Field f;
        Err err = {0};
        grid_add_block(&g, 8, 0, 0)[3 * 64 + 2 * 8 + 1] = bad[i];
        assert_false(field_build(&f, &g, &(FieldSpec){0, false}, &err));
        assert_int_equal(err.code, ERR_INPUT);
        assert_non_null(strstr(err.text, "(9, 2, 3)"));
        assert_int_equal(f.nbrick, 0);
        field_free(&f);
        grid_free(&g);

        g = grid_of(12, fn_ball, (double[]){6, 6, 6, 3});
        grid_add_block(&g, 8, 0, 0)[4] = bad[i]; /* x 12: beyond the active box, nobody's business */
        assert_true(field_build(&f, &g, &(FieldSpec){0, false}, &err));
        field_free(&f);
        g.background[0] = bad[i]; /* covered everywhere */
        assert_true(field_build(&f, &g, &(FieldSpec){0, false}, &err));
        field_free(&f);
        grid_add_block(&g, 8, 0, 0)[4] = -1;
        g.hi[0] = 40; /* now it is not */
        assert_false(field_build(&f, &g, &(FieldSpec){0, false}, &err));
        assert_non_null(strstr(err.text, "background"));
        grid_free(&g);
    }
    Grid g = grid_of(12, fn_ball, (double[]){6, 6, 6, 3});
    Field f;
    Err err = {0};
    grid_add_tile(&g, (GridTile){{16, 0, 0}, 3, {NAN, 0, 0}});
    assert_true(field_build(&f, &g, &(FieldSpec){0, false}, &err));
    field_free(&f);
    g.hi[0] = 20;
    assert_false(field_build(&f, &g, &(FieldSpec){0, false}, &err));
    assert_non_null(strstr(err.text, "tile"));
    grid_free(&g);
}

static void frame_without_surface_has_no_bricks(void **state)
{
    (void)state;
    Grid g;
    grid_init(&g, 1);
    Field empty = field_from(g), outside = field_of(12, fn_ball, (double[]){6, 6, 6, -1});
    const Field *f[2] = {&empty, &outside};
    for (int i = 0; i < 2; i++) {
        assert_true(f[i]->nbrick == 0 && f[i]->ncrossed == 0 && f[i]->far > 0);
        bool known = true;
        double F;
        Vec3 p = vec3(6, 6, 6), grad = p;
        assert_true(field_value(f[i], p, NULL, &known) < 0 && !known);
        field_sample(f[i], 1, &p, &F, &grad);
        assert_true(F < 0 && v_len(grad) == 0);
        assert_int_equal(field_project(f[i], 1, &p, 5, NULL), 1);
        assert_int_equal(field_brick(f[i], 6, 6, 6), NONE);
    }
    field_free(&empty);
    field_free(&outside);
}

static void sample_at_the_isovalue_is_outside(void **state)
{
    (void)state;
    float v[27];
    for (int i = 0; i < 27; i++) v[i] = -1;
    for (int inside = 0; inside < 2; inside++) {
        v[13] = inside ? 1e-30f : 0;
        Grid g;
        grid_init(&g, 1);
        grid_from_dense(&g, v, (int[3]){3, 3, 3});
        Field f = field_from(g);
        assert_int_equal(f.nbrick > 0, inside);
        field_free(&f);
    }
}

/* --- cost ---------------------------------------------------------------------------------------------------------------- */

static void cost_is_of_the_surface_not_of_the_extent(void **state)
{
    (void)state;
    Grid small = grid_of(40, fn_ball, (double[]){20, 20, 20, 10}), huge = grid_of(40, fn_ball, (double[]){20, 20, 20, 10});
    for (int a = 0; a < 3; a++) huge.lo[a] = -8192, huge.hi[a] = 8191;
    for (int i = 0; i < 64; i++) /* behind the blocks and around them */
        grid_add_tile(&huge, (GridTile){{4096 * (i % 4 - 2), 4096 * (i / 4 % 4 - 2), 4096 * (i / 16 - 2)}, 12, {-1, 0, 0}});
    Field s = field_from(small), h = field_from(huge);
    assert_true(s.nbrick > 0 && s.ncrossed > 0);
    assert_int_equal(h.nbrick, s.nbrick);
    assert_int_equal(h.ncrossed, s.ncrossed);
    assert_memory_equal(h.origin, s.origin, (size_t)s.nbrick * sizeof *s.origin);
    field_free(&s);
    field_free(&h);
}

static void bricks_are_in_order_and_found(void **state)
{
    (void)state;
    Field f = field_of(40, fn_ball, (double[]){20, 20, 20, 10});
    for (int b = 0; b < f.nbrick; b++) {
        const int *o = f.origin[b], *last = f.origin[b ? b - 1 : 0];
        assert_int_equal(field_brick(&f, o[0], o[1], o[2]), b);
        assert_int_equal(field_brick(&f, o[0] + 7, o[1] + 7, o[2] + 7), b);
        if (b == 0 || b == f.ncrossed) continue;
        int order = o[2] != last[2] ? o[2] - last[2] : o[1] != last[1] ? o[1] - last[1] : o[0] - last[0];
        assert_true(order > 0);
    }
    for (int b = 0; b < f.ncrossed; b++) /* the ring is whole */
        for (int k = 0; k < 27; k++)
            assert_true(field_brick(&f, f.origin[b][0] + 8 * (k % 3 - 1), f.origin[b][1] + 8 * (k / 3 % 3 - 1), f.origin[b][2] + 8 * (k / 9 - 1)) != NONE);
    double F[8];
    field_cell(&f, field_brick(&f, 20, 12, 10), 20, 12, 10, F);
    for (int c = 0; c < 8; c++)
        assert_true(F[c] == (double)(float)fn_ball((double[]){20, 20, 20, 10}, vec3(20 + (c & 1), 12 + (c >> 1 & 1), 10 + (c >> 2))));
    field_free(&f);
}

/* --- bricks that wait --------------------------------------------------------------------------------------------------- */

/* A narrow-band ball: blocks within three voxels of its surface, tiles inside. */
static Grid narrow_band(void)
{
    const double k[] = {30.2, 31.1, 29.7, 19};
    enum { SIDE = 64 };
    Grid g;
    grid_init(&g, 1);
    g.background[0] = -3;
    for (int a = 0; a < 3; a++) g.lo[a] = 0, g.hi[a] = SIDE - 1;
    for (int b = 0; b < SIDE * SIDE * SIDE / GRID_CELLS; b++) {
        int o[3] = {8 * (b % 8), 8 * (b / 8 % 8), 8 * (b / 64)};
        double middle = fn_ball(k, vec3(o[0] + 3.5, o[1] + 3.5, o[2] + 3.5));
        if (middle > 3 + 6.1) grid_add_tile(&g, (GridTile){{o[0], o[1], o[2]}, 3, {3}});
        if (fabs(middle) > 3 + 6.1) continue;
        float *v = grid_add_block(&g, o[0], o[1], o[2]);
        for (int c = 0; c < GRID_CELLS; c++) v[c] = (float)real_clamp(fn_ball(k, vec3(o[0] + (c & 7), o[1] + (c >> 3 & 7), o[2] + (c >> 6))), -3, 3);
    }
    return g;
}

static Field take(Grid *g)
{
    Field f;
    Err err;
    assert_true(field_take(&f, g, &(FieldSpec){0}, &err));
    return f;
}

enum { ASKED = 1 << 14 };

typedef struct Asked {
    const Field *f;
    Vec3 p[ASKED], grad[ASKED];
    double F[ASKED];
} Asked;

static void ask_block(void *ctx, int begin, int end)
{
    Asked *a = ctx;
    field_sample(a->f, end - begin, a->p + begin, a->F + begin, a->grad + begin);
}

static Asked *ask(const Field *f)
{
    Asked *a = NEW(Asked, 1);
    uint64_t seed = 8;
    a->f = f;
    for (int i = 0; i < ASKED; i++) a->p[i] = vec3(64 * (shape_noise(&seed) + 0.5), 64 * (shape_noise(&seed) + 0.5), 40 * (shape_noise(&seed) + 0.5));
    parallel_for(ASKED, 64, ask_block, a);
    return a;
}

static void bricks_that_wait_are_gathered_when_asked_for(void **state)
{
    (void)state;
    Grid g = narrow_band(), h = narrow_band();
    Field lazy = take(&g), eager = field_from(h);
    assert_non_null(lazy.gathered);
    assert_int_equal(g.nblock, 0); /* it went along */
    thread_set_count(4);
    Asked *a = ask(&lazy), *b = ask(&eager);
    assert_memory_equal(a->F, b->F, sizeof a->F);
    assert_memory_equal(a->grad, b->grad, sizeof a->grad);
    int gathered = 0, ring = lazy.nbrick - lazy.ncrossed;
    for (int i = 0; i < ring; i++) gathered += lazy.gathered[i] == 1;
    assert_in_range(gathered, ring / 4, ring - 10); /* nobody asked above 40 */
    assert_true(field_is_same(&lazy, &eager));
    field_free(&eager);

    h = narrow_band();
    grid_add_block(&h, 30, 31, 55)[7] = -2.9f; /* far from any crossed cell */
    eager = field_from(h);
    assert_int_equal(eager.nbrick, lazy.nbrick);
    assert_false(field_is_same(&lazy, &eager));
    mem_free(a);
    mem_free(b);
    field_free(&lazy);
    field_free(&eager);
}

static void a_grid_larger_than_what_waits_stays(void **state)
{
    (void)state;
    Grid g = grid_of(64, fn_ball, (double[]){30, 30, 30, 6});
    Field f = take(&g);
    assert_null(f.gathered);
    assert_int_equal(g.nblock, 512);
    field_free(&f);
    grid_free(&g);
}

/* --- transforms -------------------------------------------------------------------------------------------------------- */

static double fn_plane(const double *k, Vec3 p) { return k[0] + k[1] * p.x + k[2] * p.y + k[3] * p.z; }

static void gradients_are_of_the_world(void **state)
{
    (void)state;
    const struct {
        Affine a;
        bool mirrored;
        double voxel;
    } row[] = {
        {affine_of(vec3(2, 0, 0), vec3(0, 0.5, 0), vec3(0, 0, 0.125), vec3(7, 8, 9)), false, 0.5},   /* anisotropic */
        {affine_of(vec3(1, 0, 0), vec3(0.5, 1, 0), vec3(0, 0.25, 1), vec3(-1, 0, 0)), false, 1},     /* sheared */
        {affine_of(vec3(-1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1), vec3(0, 0, 0)), true, 1},           /* mirrored */
        {affine_of(vec3(0, 2, 0), vec3(2, 0, 0), vec3(1, 1, 2), vec3(0, 0, 0)), true, 2},            /* and sheared */
    };
    const double k[] = {-8, 1, 0.5, 0.25};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        Grid g = grid_of(16, fn_plane, k);
        g.xform = row[i].a;
        Field f = field_from(g);
        assert_int_equal(f.mirrored, row[i].mirrored);
        assert_near(f.voxel, row[i].voxel, 1e-15);
        Vec3 q = vec3(6.25, 2.5, 3.75), p = affine_to_world(&f.xform, q), cell, n;
        assert_near(field_value(&f, p, &cell, NULL), fn_plane(k, q), 1e-13);
        Vec3 g1 = field_gradient(&f, p), want = vec3(0, 0, 0);
        for (int a = 0; a < 3; a++) { /* by differences over the world */
            Vec3 d = vec3(0, 0, 0);
            v_set(&d, a, 1.0 / 1024);
            v_set(&want, a, (field_value(&f, v_add(p, d), NULL, NULL) - field_value(&f, v_sub(p, d), NULL, NULL)) * 512);
        }
        assert_near3(cell, want, 1e-11);
        assert_near3(g1, want, 1e-11);
        field_normals(&f, 1, &p, &n);
        assert_near3(n, v_scale(v_unit(want), -1), 1e-11);
        field_free(&f);
    }
}

static void triangles_against_the_gradient_are_inverted(void **state)
{
    (void)state;
    for (int mirrored = 0; mirrored < 2; mirrored++) {
        Grid g = grid_of(16, fn_slab, (double[]){8, 3.25});
        if (mirrored) g.xform = affine_of(vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, -1), vec3(0, 0, 16));
        Field f = field_from(g);
        Vec3 a = vec3(6, 6, 11.25), b = vec3(8, 6, 11.25), c = vec3(7, 8, 11.25); /* counter-clockwise from above */
        assert_false(field_triangle_inverted(&f, a, b, c));
        assert_true(field_triangle_inverted(&f, a, c, b));
        Vec3 down = vec3(0, 0, -6.5);
        assert_true(field_triangle_inverted(&f, v_add(a, down), v_add(b, down), v_add(c, down)));
        assert_false(field_triangle_inverted(&f, v_add(a, down), v_add(c, down), v_add(b, down)));
        field_free(&f);
    }
}

/* Normals in a sheet thinner than the central differences see: the cell knows. */
static void normals_of_a_thin_sheet_point_out(void **state)
{
    (void)state;
    Field f = field_of(16, fn_slab, (double[]){8, 0.3});
    Vec3 p[2] = {vec3(7.5, 7.5, 8.25), vec3(7.5, 7.5, 7.75)}, n[2];
    field_normals(&f, 2, p, n);
    assert_near3(n[0], vec3(0, 0, 1), 1e-12);
    assert_near3(n[1], vec3(0, 0, -1), 1e-12);
    field_free(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(value_is_trilinear),
        cmocka_unit_test(isovalue_is_rounded_like_samples),
        cmocka_unit_test(smooth_gradient_is_interpolated_central_differences),
        cmocka_unit_test(batches_of_any_length_are_the_single_points),
        cmocka_unit_test(no_number_as_a_point_is_nowhere),
        cmocka_unit_test(full_grid_closes_half_a_voxel_beyond),
        cmocka_unit_test(a_tile_out_of_proportion_is_refused),
        cmocka_unit_test(inside_tiles_at_the_border_make_bricks),
        cmocka_unit_test(inside_background_closes_at_the_box),
        cmocka_unit_test(what_is_no_number_is_refused_with_its_place),
        cmocka_unit_test(frame_without_surface_has_no_bricks),
        cmocka_unit_test(sample_at_the_isovalue_is_outside),
        cmocka_unit_test(cost_is_of_the_surface_not_of_the_extent),
        cmocka_unit_test(bricks_are_in_order_and_found),
        cmocka_unit_test(bricks_that_wait_are_gathered_when_asked_for),
        cmocka_unit_test(a_grid_larger_than_what_waits_stays),
        cmocka_unit_test(gradients_are_of_the_world),
        cmocka_unit_test(bricks_above_crossed_ones_are_known_as_crossed),
        cmocka_unit_test(triangles_against_the_gradient_are_inverted),
        cmocka_unit_test(normals_of_a_thin_sheet_point_out),
    };
    return cmocka_run_group_tests_name("field", tests, NULL, NULL);
}
