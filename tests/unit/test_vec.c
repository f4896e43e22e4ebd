/* vec.h: what the compiler has to leave as it is written. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/vec.h"

enum { N = 7 }; /* not a multiple of any vector's length */

__attribute__((noinline)) static void round_all(Vec3 *p, int n)
{
    for (int i = 0; i < n; i++) p[i] = v_round32(p[i]);
}

/* gcc 12.2 with -O2 or -O3 leaves x and y of some of them as they were, by way of its SLP vectoriser. */
static void rounding_a_column_rounds_every_coordinate(void **state)
{
    (void)state;
    Vec3 p[N];
    for (int i = 0; i < N; i++) p[i] = vec3(0.1 * i, 0.1 * i, 0.1 * i);
    round_all(p, N);
    for (int i = 0; i < N; i++) {
        volatile float expected = (float)(0.1 * i);
        assert_true(p[i].x == (double)expected);
        assert_true(p[i].y == (double)expected);
        assert_true(p[i].z == (double)expected);
    }
}

static void an_affine_map_and_its_inverse_cancel(void **state)
{
    (void)state;
    Affine a = {.m = {{2, 0.5, 0}, {0, -3, 0.25}, {0.1, 0, 4}}, .t = {1, 2, 3}};
    assert_true(affine_invert(&a));
    Vec3 p = vec3(0.3, -7, 11), q = affine_to_index(&a, affine_to_world(&a, p));
    assert_true(v_dist(p, q) < 1e-13);
    Affine flat = {.m = {{1, 0, 0}, {2, 0, 0}, {0, 0, 1}}};
    assert_false(affine_invert(&flat));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rounding_a_column_rounds_every_coordinate),
        cmocka_unit_test(an_affine_map_and_its_inverse_cancel),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
