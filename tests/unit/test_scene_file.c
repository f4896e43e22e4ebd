/* Scene files: every mistake is one sentence that names file, line, element and field. */
#include "scene/scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

#include "temp_dir.h"

static Err err;

static bool load(const char *text)
{
    Scene s;
    memset(&err, 0, sizeof err);
    bool ok = scene_load(temp_write("scene.json", text, strlen(text)), &s, &err);
    if (ok) scene_free(&s);
    else assert_null(s.element);
    return ok;
}

/* The sentence has all the pieces, NULL ends them. */
static void wrong(const char *text, ...)
{
    assert_false(load(text));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.text, "scene.json"));
    assert_null(strchr(err.text, '\n'));
    va_list args;
    va_start(args, text);
    for (const char *piece; (piece = va_arg(args, const char *)) != NULL;) {
        if (!strstr(err.text, piece)) print_message("no '%s' in: %s\n", piece, err.text);
        assert_non_null(strstr(err.text, piece));
    }
    va_end(args);
}

#define TOP "{\n\"frames\": [1, 2],\n\"domain\": [[0, 0, 0], [1, 1, 1]],\n\"voxel\": 0.1,\n\"elements\": [\n"
#define GOOD "{\"points\": [[0, 0, 0]], \"radius\": 1},\n"

static void good_ones_load(void **state)
{
    (void)state;
    assert_true(load(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1}]}"));
    assert_true(load("{\"comment\": \"[{\\\"\", \"fps\": 25, \"iso\": 0.5, \"tolerance\": 1e-3, \"frames\": [0, 0], \"domain\": [[0, 0, 0], [1, 1, 1]], \"voxel\": 1,"
                     "\"elements\": [{\"comment\": \"x\", \"triangles\": [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], \"radius\": {\"keys\": [[1, 1], [2, 2]], \"interpolation\": \"smooth\"},"
                     "\"norm\": 0.6, \"strength\": -1, \"scale\": [1, 2, 3], \"kernel\": \"compact\", \"warp\": [{\"bend\": 1, \"axis\": \"x\"}]}]}"));
}

static void the_file_itself(void **state)
{
    (void)state;
    Scene s;
    assert_false(scene_load("no/such.json", &s, &err));
    assert_non_null(strstr(err.text, "no/such.json"));
    wrong("", ":1:", NULL);
    wrong("[]", ":1:", NULL);
    wrong("{\n\"frames\": [1, 2],\n\"voxel\" 3}", ":3:", "JSON", NULL);
    wrong("{\n\"frames\": [1, 2],\n\"frames\": [1, 2]}", ":3:", NULL);
    char deep[5000];
    memset(deep, '[', sizeof deep);
    deep[sizeof deep - 1] = 0;
    wrong(deep, ":1:", NULL);
}

static void the_scene(void **state)
{
    (void)state;
    wrong("{\"domain\": 1}", "\"frames\"", "missing", NULL);
    wrong("{\n\n\"frames\": [3, 1]}", ":3:", "\"frames\"", NULL);
    wrong("{\"frames\": [1, 2],\n\"domain\": [[0, 0, 0], [1, 1]], \"voxel\": 1}", ":2:", "\"domain[2]\"", "3 numbers", NULL);
    wrong("{\"frames\": [1, 2],\n\"domain\": [[0, 0, 0], [-1, 1, 1]], \"voxel\": 1}", ":2:", "\"domain\"", "least corner first", NULL);
    wrong("{\"frames\": [1, 2], \"domain\": [[0, 0, 0], [1, 1, 1]],\n\"voxel\": 0}", ":2:", "\"voxel\"", "1e-06", NULL);
    wrong("{\"frames\": [1, 2], \"domain\": [[0, 0, 0], [1, 1, 1]],\n\"voxel\": 1e-5}", ":2:", "\"voxel\"", "16384", NULL);
    wrong("{\"frames\": [1, 2], \"domain\": [[0, 0, 0], [1, 1, 1]], \"voxel\": 1,\n\"iso\": -1, \"elements\": []}", ":2:", "\"iso\"", NULL);
    wrong("{\"frames\": [1, 2], \"domain\": [[0, 0, 0], [1, 1, 1]], \"voxel\": 1,\n\"elements\": []}", ":2:", "\"elements\"", NULL);
    wrong("{\"frames\": [1, 2],\n\"colour\": 3}", ":2:", "\"colour\"", "voxel", NULL);
}

static void elements(void **state)
{
    (void)state;
    wrong(TOP GOOD "{\"radius\": 1}]}", ":7:", "element 2", "shape", NULL);
    wrong(TOP GOOD "{\"points\": [[0, 0, 0]]}]}", ":7:", "element 2", "\"radius\"", "missing", NULL);
    wrong(TOP GOOD "{\"points\": [[0, 0, 0]],\n\"radius\": 0}]}", ":8:", "element 2", "\"radius\"", NULL);
    wrong(TOP GOOD "{\"points\": [[0, 0, 0]],\n\"radius\": 1,\n\"raduis\": 2}]}", ":9:", "element 2", "\"raduis\"", "translate", NULL);
    wrong(TOP GOOD "{\"points\": [[0, 0, 0],\n[0, 0]], \"radius\": 1}]}", ":8:", "element 2", "\"points[2]\"", NULL);
    wrong(TOP GOOD "{\"points\": [[0, 0, \"0\"]], \"radius\": 1}]}", "\"points[1][3]\"", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"polyline\": [[0, 0, 0], [1, 1, 1]], \"radius\": 1}]}", ":6:", "one shape", NULL);
    wrong(TOP "{\"polyline\": [[0, 0, 0]], \"radius\": 1}]}", "two points", NULL);
    wrong(TOP "{\"segments\": [[[0, 0, 0]]], \"radius\": 1}]}", "\"segments[1]\"", "2 points", NULL);
    wrong(TOP "{\"points\": {\"random\": 1e9, \"box\": [[0, 0, 0], [1, 1, 1]]}, \"radius\": 1}]}", "\"points.random\"", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1,\n\"norm\": 0}]}", ":7:", "\"norm\"", "0.1", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1,\n\"strength\": 0}]}", ":7:", "\"strength\"", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1,\n\"kernel\": \"gauss\"}]}", ":7:", "\"kernel\"", "inverse-square or compact", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1,\n\"scale\": [1, 0, 1]}]}", ":7:", "\"scale[2]\"", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1, \"rotate\": [0, 0, 0, 0]}]}", "\"rotate\"", "quaternion", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1, \"rotate\": {\"axis\": [0, 0, 0], \"degrees\": 1}}]}", "\"rotate.axis\"", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1, \"warp\": [{\"axis\": \"x\"}]}]}", "\"warp[1]\"", "twist", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1, \"warp\": [{\"twist\": 1}]}]}", "\"warp[1].axis\"", NULL);
}

static void keys(void **state)
{
    (void)state;
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": {\"keys\": []}}]}", "element 1", "\"radius.keys\"", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": {\"keys\": [[1, 1],\n[1, 2]]}}]}", ":7:", "\"radius.keys[2][1]\"", "rise", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": {\"keys\": [[1, 1], [2, -2]]}}]}", "\"radius.keys[2][2]\"", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": {\"keys\": [[1, 1]], \"interpolation\": \"bezier\"}}]}", "\"radius.interpolation\"", "smooth", NULL);
    wrong(TOP "{\"points\": [[0, 0, 0]], \"radius\": 1, \"scale\": {\"keys\": [[1, 1], [2, [1, 1, 1]]]}}]}", "\"scale.keys[2][2]\"", NULL);
}

/* A cut-off file is never taken for a whole one. */
static void every_prefix(void **state)
{
    (void)state;
    const char *text = TOP "{\"points\": {\"random\": 3, \"box\": [[0, 0, 0], [1, 1, 1]]}, \"radius\": {\"keys\": [[1, 1], [2, 2]]}}]}";
    char cut[1000];
    assert_true(load(text));
    for (size_t n = 0; n < strlen(text); n++) {
        memcpy(cut, text, n);
        cut[n] = 0;
        assert_false(load(cut));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(good_ones_load), cmocka_unit_test(the_file_itself), cmocka_unit_test(the_scene),
        cmocka_unit_test(elements),       cmocka_unit_test(keys),            cmocka_unit_test(every_prefix),
    };
    return cmocka_run_group_tests(tests, temp_open, temp_close);
}
