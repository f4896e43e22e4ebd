/* Meshes turned and scaled; grids sampled onto them. */
#include "cli/attributes.h"
#include "cli/turn.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

static TriMesh triangle(void)
{
    TriMesh m;
    static const float pos[] = {1, 2, 3, 4, 0, -6, -7, 8, 9}, normal[] = {0, 0, 1, 0, 1, 0, 0, -1, 0}, velocity[] = {0, 1, 2, 3, 4, 5, 6, 7, 8};
    trimesh_init(&m, 3, 1, true, false);
    memcpy(m.pos, pos, sizeof pos);
    memcpy(m.normal, normal, sizeof normal);
    memcpy(m.velocity, velocity, sizeof velocity);
    for (int v = 0; v < 3; v++) m.id[v] = m.tri[v] = v;
    return m;
}

static void expect3(const float *v, float x, float y, float z) { assert_true(v[0] == x && v[1] == y && v[2] == z); }

static void turns_and_scales(void **state)
{
    (void)state;
    TriMesh m = triangle();
    TriMesh up = turn_mesh(&(Turn){UP_Y, 2}, &m);
    expect3(up.pos, 2, 6, -4);
    expect3(up.normal, 0, 1, 0); /* what pointed up along z does along y */
    expect3(up.normal + 3, 0, 0, -1);
    expect3(up.velocity + 3, 6, 10, -8);
    TriMesh back = turn_mesh(&(Turn){UP_Z, 0.5}, &up);
    assert_memory_equal(back.pos, m.pos, 9 * sizeof(float));
    assert_memory_equal(back.normal, m.normal, 9 * sizeof(float));
    assert_memory_equal(back.velocity, m.velocity, 9 * sizeof(float));
    assert_ptr_equal(back.tri, m.tri);
    TriMesh same = turn_mesh(&(Turn){UP_AS_IT_IS, 1}, &m);
    assert_memory_equal(same.pos, m.pos, 9 * sizeof(float));
    turn_free(&same);
    turn_free(&back);
    turn_free(&up);
    trimesh_free(&m);
}

static void samples_scalars_and_vectors(void **state)
{
    (void)state;
    enum { N = 10 };
    static float one[N * N * N], three[3 * N * N * N];
    for (int i = 0; i < N * N * N; i++) {
        one[i] = (float)(i % N + 10 * (i / N % N) + 100 * (i / (N * N)));
        for (int k = 0; k < 3; k++) three[3 * i + k] = (float)(k + 1) * one[i];
    }
    Grid g[2];
    grid_init(&g[0], 1);
    grid_init(&g[1], 3);
    grid_from_dense(&g[0], one, (int[3]){N, N, N});
    grid_from_dense(&g[1], three, (int[3]){N, N, N});
    TriMesh m = triangle();
    m.pos[3] = 4.5f;
    m.pos[5] = 6;
    attributes_sample(&m, 2, (const char *const[]){"heat", "wind"}, g);
    assert_int_equal(m.nattr, 4);
    assert_string_equal(m.attr_name[0], "heat");
    assert_string_equal(m.attr_name[3], "wind_z");
    assert_true(m.attr[0][0] == 321 && m.attr[0][1] == 604.5f && m.attr[0][2] == 0);
    assert_true(m.attr[2][0] == 642 && m.attr[3][1] == 3 * 604.5f);
    trimesh_free(&m);
    for (int i = 0; i < 2; i++) grid_free(&g[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(turns_and_scales),
        cmocka_unit_test(samples_scalars_and_vectors),
    };
    return cmocka_run_group_tests_name("turn", tests, NULL, NULL);
}
