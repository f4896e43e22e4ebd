/* PLY: what is written is read back; what is damaged is refused before anything is believed. */
#include "io/ply.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>

static char folder[64], path[96];

static int set_up(void **state)
{
    (void)state;
    strcpy(folder, "/tmp/twinmesh.ply.XXXXXX");
    if (!mkdtemp(folder)) return -1;
    snprintf(path, sizeof path, "%s/a.ply", folder);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    remove(path);
    return rmdir(folder);
}

static void put(const void *bytes, size_t n)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(bytes, 1, n, f), n);
    assert_int_equal(fclose(f), 0);
}

static char *slurp(size_t *n)
{
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    char *bytes = malloc(1 << 16);
    *n = fread(bytes, 1, 1 << 16, f);
    fclose(f);
    return bytes;
}

/* A tetrahedron. */
static TriMesh tetrahedron(bool velocity, bool parent, int nattr)
{
    static const int32_t tri[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
    TriMesh m;
    trimesh_init(&m, 4, 4, velocity, parent);
    for (int i = 0; i < 12; i++) {
        m.pos[i] = (float)(i % 4 == 0) + 0.1f * (float)i;
        m.normal[i] = i % 3 == 0 ? 1 : 0;
        if (velocity) m.velocity[i] = -1.5f * (float)i;
    }
    for (int v = 0; v < 4; v++) m.id[v] = 100000000 * v + 7;
    memcpy(m.tri, tri, sizeof tri);
    for (int t = 0; parent && t < 4; t++) m.parent[t] = 3 - t;
    static const char *const name[] = {"temperature", "my grid", "x", "x"};
    m.nattr = nattr;
    m.attr_name = NEW(char *, nattr);
    m.attr = NEW(float *, nattr);
    for (int a = 0; a < nattr; a++) {
        m.attr_name[a] = mem_text(name[a]);
        m.attr[a] = NEW(float, 4);
        for (int v = 0; v < 4; v++) m.attr[a][v] = (float)(10 * a + v) / 3;
    }
    return m;
}

static void assert_same(const TriMesh *a, const TriMesh *b)
{
    size_t v3 = 3 * sizeof(float) * (size_t)a->nvert;
    assert_true(a->ntri == b->ntri && trimesh_is_same_run(a, b));
    assert_memory_equal(a->pos, b->pos, v3);
    assert_memory_equal(a->normal, b->normal, v3);
    assert_int_equal(!a->velocity, !b->velocity);
    if (a->velocity) assert_memory_equal(a->velocity, b->velocity, v3);
    assert_int_equal(!a->parent, !b->parent);
    if (a->parent) assert_memory_equal(a->parent, b->parent, (size_t)a->ntri * sizeof *a->parent);
    assert_int_equal(a->nattr, b->nattr);
    for (int i = 0; i < a->nattr; i++) assert_memory_equal(a->attr[i], b->attr[i], v3 / 3);
}

static void round_trip_is_exact(void **state)
{
    (void)state;
    for (int k = 0; k < 8; k++) {
        Err err = {0};
        TriMesh m = tetrahedron(k & 1, k & 2, k & 4 ? 4 : 0), back;
        assert_true(ply_write(path, &m, &err));
        assert_true(ply_read(path, &back, &err));
        assert_same(&m, &back);
        if (k & 4) {
            assert_string_equal(back.attr_name[0], "temperature");
            assert_string_equal(back.attr_name[1], "my_grid");
            assert_string_equal(back.attr_name[2], "x_");
            assert_string_equal(back.attr_name[3], "x__");
        }
        trimesh_free(&m);
        trimesh_free(&back);
    }
}

static void header_and_bytes_are_as_designed(void **state)
{
    (void)state;
    static const char header[] =
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property float nx\nproperty float ny\nproperty float nz\n"
        "property float vx\nproperty float vy\nproperty float vz\n"
        "property int id\nproperty float temperature\n"
        "element face 4\nproperty list uchar int vertex_indices\nproperty int mechanical\n"
        "end_header\n";
    Err err = {0};
    TriMesh m = tetrahedron(true, true, 1);
    assert_true(ply_write(path, &m, &err));
    size_t n;
    char *bytes = slurp(&n);
    assert_int_equal(n, sizeof header - 1 + 4 * 44 + 4 * 17);
    assert_memory_equal(bytes, header, sizeof header - 1);
    assert_memory_equal(bytes + sizeof header - 1, "\0\0\x80\x3f", 4);               /* x: 1 */
    assert_memory_equal(bytes + sizeof header - 1 + 44 + 36, "\x07\xe1\xf5\x05", 4); /* id: 100000007 */
    assert_memory_equal(bytes + n - 17, "\3\2\0\0\0\0\0\0\0\3\0\0\0\0\0\0\0", 17);   /* 2 0 3, parent 0 */
    free(bytes);
    trimesh_free(&m);
}

static void empty_mesh_is_a_valid_file(void **state)
{
    (void)state;
    Err err = {0};
    TriMesh m, back;
    trimesh_init(&m, 0, 0, false, false);
    assert_true(ply_write(path, &m, &err));
    assert_true(ply_read(path, &back, &err));
    assert_same(&m, &back);
    trimesh_free(&m);
    trimesh_free(&back);
}

static void assert_refused(const char *words)
{
    Err err = {0};
    TriMesh m;
    assert_false(ply_read(path, &m, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.text, path));
    if (!strstr(err.text, words)) print_message("%s\n", err.text);
    assert_non_null(strstr(err.text, words));
    assert_true(m.nvert == 0 && m.pos == NULL);
}

static void every_truncated_prefix_is_refused(void **state)
{
    (void)state;
    Err err = {0};
    TriMesh m = tetrahedron(true, true, 2);
    assert_true(ply_write(path, &m, &err));
    trimesh_free(&m);
    size_t n;
    char *bytes = slurp(&n);
    for (size_t cut = 0; cut < n; cut++) {
        put(bytes, cut);
        assert_refused("");
    }
    bytes[n] = 0;
    put(bytes, n + 1);
    assert_refused("longer");
    free(bytes);
}

/* Any one byte changed: refused or read, never a crash or an index out of range. */
static void every_damaged_byte_is_survived(void **state)
{
    (void)state;
    Err err = {0};
    TriMesh m = tetrahedron(false, true, 1);
    assert_true(ply_write(path, &m, &err));
    trimesh_free(&m);
    size_t n;
    char *bytes = slurp(&n);
    for (size_t at = 0; at < n; at++)
        for (int k = 0; k < 3; k++) {
            char was = bytes[at];
            bytes[at] = (char)(k == 0 ? was ^ 0x80 : k == 1 ? '9' : was ^ 1);
            put(bytes, n);
            TriMesh back;
            if (ply_read(path, &back, &err))
                for (int i = 0; i < 3 * back.ntri; i++) assert_in_range(back.tri[i], 0, back.nvert - 1);
            trimesh_free(&back);
            bytes[at] = was;
        }
    free(bytes);
}

#define XYZ "property float x\nproperty float y\nproperty float z\n"
#define LIST "property list uchar int vertex_indices\n"

static void put_text(const char *text) { put(text, strlen(text)); }

static void ascii_and_doubles_are_read(void **state)
{
    (void)state;
    static const char text[] =
        "ply\r\nformat ascii 1.0\r\ncomment a b\r\nobj_info c\r\nelement vertex 3\r\n"
        "property double x\r\nproperty uchar red\r\nproperty double y\r\nproperty float64 z\r\n"
        "property list uchar int neighbours\r\nelement edge 1\r\nproperty int a\r\n"
        "element face 1\r\nproperty list uint8 uint vertex_index\r\nproperty uchar flag\r\n"
        "end_header\r\n"
        "0 255 0 1e0 0\r\n1 255 -.5 1 2 8 9\r\n0 255 1 1 0\r\n77\r\n3 0 1 2 1\r\n";
    put_text(text);
    Err err = {0};
    TriMesh m;
    if (!ply_read(path, &m, &err)) print_message("%s\n", err.text);
    assert_int_equal(m.nvert, 3);
    assert_int_equal(m.ntri, 1);
    assert_true(m.pos[3] == 1.0f && m.pos[4] == -0.5f && m.pos[5] == 1.0f && m.normal[8] == 0.0f);
    assert_true(m.id[2] == 2 && m.tri[2] == 2 && m.nattr == 0 && !m.velocity && !m.parent);
    trimesh_free(&m);
    for (size_t cut = 0; cut + 1 < sizeof text - 1; cut++) { /* all but the very last line end */
        put(text, cut);
        assert_refused("");
    }
}

static void points_without_faces_are_read(void **state)
{
    (void)state;
    put_text("ply\nformat ascii 1.0\nelement vertex 1\n" XYZ
             "property float radius\nend_header\n1 2 3 0.5\n");
    Err err = {0};
    TriMesh m;
    assert_true(ply_read(path, &m, &err));
    assert_true(m.nvert == 1 && m.ntri == 0 && m.nattr == 1 && m.attr[0][0] == 0.5f);
    assert_string_equal(m.attr_name[0], "radius");
    trimesh_free(&m);
}

static void what_cannot_be_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text, *words;
    } bad[] = {
        {"", "no PLY file"},
        {"solid\n", "no PLY file"},
        {"ply\nformat binary_big_endian 1.0\n", "convert"},
        {"ply\nelement vertex 0\n" XYZ "end_header\n", "no format"},
        {"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", "no vertices"},
        {"ply\nformat ascii 1.0\nelement vertex -1\n", "count"},
        {"ply\nformat ascii 1.0\nelement vertex 3x\n", "count"},
        {"ply\nformat ascii 1.0\nelement vertex 99999999999999999999\n", "count"},
        {"ply\nformat ascii 1.0\nelement vertex 2147483648\n", "count"},
        {"ply\nformat ascii 1.0\nelement vertex 2147483647\n" XYZ "end_header\n", "more than the file holds"},
        {"ply\nformat binary_little_endian 1.0\nelement vertex 2147483647\n" XYZ "end_header\n",
         "more than the file holds"},
        {"ply\nformat ascii 1.0\nelement vertex 0\n" XYZ "element face 2000000000\n" LIST "end_header\n",
         "more than"},
        {"ply\nformat ascii 1.0\nelement vertex 0\n" XYZ "element none 2000000000\nend_header\n",
         "no properties"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\n" LIST
         "end_header\n0 0 0\n4 0 0 0 0\n",
         "4 corners"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\n" LIST
         "end_header\n0 0 0\n3 0 0 1\n",
         "vertex 1 of 1"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\n" LIST
         "end_header\n0 0 0\n3 0 0 -1\n",
         "vertex -1"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "element face 1\n" LIST
         "end_header\n0 0 0\n3 0 0 .5\n",
         "whole"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "end_header\n0 nan 0\n", "finite"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "end_header\n0 1e99 0\n", "finite"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "end_header\n0 zero 0\n", "word"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "end_header\n0 0 0\n0\n", "longer"},
        {"ply\nformat ascii 1.0\nelement vertex 1\n" XYZ "property float x\nend_header\n0 0 0 0\n", "twice"},
        {"ply\nformat ascii 1.0\nproperty float x\n", "property line"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n", "property line"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\n", "property line"},
        {"ply\nformat ascii 1.0\nsurprise\n", "understood"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        put_text(bad[i].text);
        assert_refused(bad[i].words);
    }
}

static void missing_file_and_folder_are_sentences(void **state)
{
    (void)state;
    Err err = {0};
    TriMesh m;
    assert_false(ply_read("/nowhere/a.ply", &m, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_false(ply_read(folder, &m, &err));
    assert_non_null(strstr(err.text, "no regular file"));
    m = tetrahedron(false, false, 0);
    assert_false(ply_write("/nowhere/a.ply", &m, &err));
    assert_int_equal(err.code, ERR_OUTPUT);
    trimesh_free(&m);
}

static void full_disk_leaves_no_file(void **state)
{
    (void)state;
    char part[128];
    snprintf(part, sizeof part, "%s.part", path);
    remove(path);
    assert_int_equal(symlink("/dev/full", part), 0);
    Err err = {0};
    TriMesh m = tetrahedron(false, false, 0);
    assert_false(ply_write(path, &m, &err));
    assert_int_equal(err.code, ERR_OUTPUT);
    assert_non_null(strstr(err.text, "disk is full"));
    struct stat st;
    assert_true(lstat(path, &st) != 0 && lstat(part, &st) != 0);
    trimesh_free(&m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(round_trip_is_exact),
        cmocka_unit_test(header_and_bytes_are_as_designed),
        cmocka_unit_test(empty_mesh_is_a_valid_file),
        cmocka_unit_test(every_truncated_prefix_is_refused),
        cmocka_unit_test(every_damaged_byte_is_survived),
        cmocka_unit_test(ascii_and_doubles_are_read),
        cmocka_unit_test(points_without_faces_are_read),
        cmocka_unit_test(what_cannot_be_is_refused),
        cmocka_unit_test(missing_file_and_folder_are_sentences),
        cmocka_unit_test(full_disk_leaves_no_file),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
