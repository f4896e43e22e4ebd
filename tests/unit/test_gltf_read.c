/* The frames of a glTF come back as they were written, number by number; files that are cut, changed or foreign do no harm. */
#include "io/bytes.h"
#include "io/gltf.h"
#include "io/gltf_read.h"
#include "io/mesh_sequence.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include "temp_dir.h"
#include <cmocka.h>

/* A fan of `sides` triangles at a time. */
static TriMesh fan_at(int sides, int frame, int first_id)
{
    TriMesh m;
    trimesh_init(&m, sides ? sides + 1 : 0, sides, false, false);
    for (int v = 0; v < m.nvert; v++) {
        double a = 6.283185307179586 * v / sides + 0.1 * frame, r = v == sides ? 0 : 1;
        float p[3] = {(float)(r * cos(a) + frame), (float)(r * sin(a)), (float)(0.25 * frame)}, n[3] = {0, 0, 1};
        memcpy(m.pos + 3 * v, p, sizeof p);
        memcpy(m.normal + 3 * v, n, sizeof n);
        m.id[v] = first_id + v;
    }
    for (int t = 0; t < m.ntri; t++) memcpy(m.tri + 3 * t, (int32_t[3]){t, (t + 1) % sides, sides}, 3 * sizeof(int32_t));
    return m;
}

/* What each frame shows; 0: nothing, -1: skipped. */
typedef struct Script {
    int n;
    const int *sides;
    double fps;
    bool step;
    int first_id;
} Script;

static const char *write_script(const Script *s, GltfCompress compress, const char *name)
{
    const char *path = temp_path(name);
    Err err;
    GltfOptions options = {.path = path, .fps = s->fps, .name = "geometric", .step = s->step, .compress = compress};
    Gltf *g = gltf_open(&options, &err);
    int gap = 1;
    for (int f = 0; f < s->n; f++, gap++) {
        if (s->sides[f] < 0) continue;
        TriMesh m = fan_at(s->sides[f], f, s->first_id);
        if (!gltf_add_frame(g, &m, NULL, NULL, gap, &err)) fail_msg("%s", err.text);
        trimesh_free(&m);
        gap = 0;
    }
    if (!gltf_close(g, &err)) fail_msg("%s", err.text);
    return path;
}

/* A base and a target a frame on may be rounded on a grid of them both: a side of 3. */
static void expect_mesh(const TriMesh *got, const TriMesh *want, GltfCompress compress)
{
    assert_true(trimesh_is_same_run(got, want));
    float normals = compress ? 0.01f : 1e-6f;
    for (int i = 0; i < 3 * want->nvert; i++) { /* base and difference are rounded each */
        float places = compress ? 3.0f / 32767 : 1e-7f * (20 + fabsf(want->pos[i]));
        assert_true(fabsf(got->pos[i] - want->pos[i]) <= places);
        assert_true(fabsf(got->normal[i] - want->normal[i]) <= normals);
    }
}

static void expect_script(const Script *s, GltfCompress compress, const char *path)
{
    Err err;
    GltfReader *r = gltf_reader_open(path, &err);
    int i = 0;
    if (!r) fail_msg("%s", err.text);
    for (int f = 0; f < s->n; f++) {
        if (s->sides[f] <= 0) continue;
        TriMesh got, want = fan_at(s->sides[f], f, s->first_id);
        assert_int_equal(gltf_reader_frame(r, i), f);
        if (!gltf_reader_mesh(r, i++, &got, &err)) fail_msg("frame %d: %s", f, err.text);
        expect_mesh(&got, &want, compress);
        trimesh_free(&got);
        trimesh_free(&want);
    }
    assert_int_equal(gltf_reader_length(r), i);
    gltf_reader_close(r);
}

static void frames_come_back(void **state)
{
    (void)state;
    static const int calm[40] = {5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 6, 6, 6, 7, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5},
                     untidy[14] = {0, 0, 5, 5, -1, 5, 6, 0, 6, 6, -1, -1, 7, 7}, one[1] = {9}, late[3] = {0, 0, 4};
    const Script script[] = {
        {40, calm, 24, false, 0}, {40, calm, 24, true, 1 << 24}, {40, calm, 29.97, false, 3}, {14, untidy, 24, false, 0}, {14, untidy, 60, true, 5},
        {1, one, 24, false, 0},   {3, late, 24, false, 0},
    };
    for (size_t i = 0; i < sizeof script / sizeof *script; i++)
        for (int binary = 0; binary < 2; binary++)
            for (GltfCompress how = GLTF_PLAIN; how <= GLTF_MESHOPT; how++)
                expect_script(&script[i], how, write_script(&script[i], how, binary ? "a.glb" : "a.gltf"));
}

/* One fan over three frames; frame 1 is `far` away from the others, and its normals are `turn` radians off. */
static void expect_move(float far, double turn)
{
    Err err;
    const char *path = temp_path("move.glb");
    Gltf *g = gltf_open(&(GltfOptions){.path = path, .fps = 24, .name = "geometric", .compress = GLTF_MESHOPT}, &err);
    TriMesh want[3];
    for (int f = 0; f < 3; f++) {
        want[f] = fan_at(5, 0, 0);
        for (int v = 0; v < want[f].nvert && f == 1; v++) {
            want[f].pos[3 * v] += far;
            memcpy(want[f].normal + 3 * v, (float[3]){(float)sin(turn), 0, (float)cos(turn)}, 3 * sizeof(float));
        }
        assert_true(gltf_add_frame(g, &want[f], NULL, NULL, 1, &err));
    }
    assert_true(gltf_close(g, &err));
    GltfReader *r = gltf_reader_open(path, &err);
    assert_non_null(r);
    assert_int_equal(gltf_reader_length(r), 3);
    for (int f = 0; f < 3; f++) {
        TriMesh got;
        assert_int_equal(gltf_reader_frame(r, f), f);
        assert_true(gltf_reader_mesh(r, f, &got, &err));
        for (int i = 0; i < 3 * got.nvert; i++) {
            assert_true(fabsf(got.pos[i] - want[f].pos[i]) <= (2 + fabsf(far)) / 32767);
            assert_true(fabsf(got.normal[i] - want[f].normal[i]) <= 0.05f || turn > 1.6);
        }
        for (int v = 0; v < got.nvert; v++) { /* of one that turns farther at least the side is right */
            const float *n = got.normal + 3 * v, *m = want[f].normal + 3 * v;
            assert_true(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-5f);
            assert_true(n[0] * m[0] + n[1] * m[1] + n[2] * m[2] > 0 || turn > 3);
        }
        trimesh_free(&got);
        trimesh_free(&want[f]);
    }
    gltf_reader_close(r);
}

/* However far a frame is from the last: pieces are cut where whole numbers of 16 bits do not reach. */
static void quick_motion_fits_whole_numbers(void **state)
{
    (void)state;
    const float far[] = {0, 0.3f, 1, 2, 30, 1e4f, -1e7f};
    for (size_t i = 0; i < sizeof far / sizeof *far; i++) expect_move(far[i], 0);
    for (double turn = 0.5; turn < 3.2; turn += 0.5) expect_move(0.1f, turn);
    expect_move(0.1f, 3.141592653589793); /* right round: no difference that fits leads there */
}

/* Vertices in one place, far from the origin, and tiny: what floats hold is held. */
static void small_and_far_meshes_are_exact(void **state)
{
    (void)state;
    const float at[] = {0, 1, -1e6f, 1e30f, 1e-20f};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        Err err;
        TriMesh m = fan_at(3, 0, 0), got;
        for (int k = 0; k < 3 * m.nvert; k++) m.pos[k] = at[i];
        const char *path = temp_path("point.glb");
        Gltf *g = gltf_open(&(GltfOptions){.path = path, .fps = 24, .name = "geometric", .compress = GLTF_QUANTIZE}, &err);
        assert_true(gltf_add_frame(g, &m, NULL, NULL, 1, &err));
        assert_true(gltf_close(g, &err));
        GltfReader *r = gltf_reader_open(path, &err);
        if (!r || !gltf_reader_mesh(r, 0, &got, &err)) fail_msg("%s", err.text);
        for (int k = 0; k < 3 * m.nvert; k++) assert_true(got.pos[k] == m.pos[k]);
        gltf_reader_close(r);
        trimesh_free(&m);
        trimesh_free(&got);
    }
}

/* Float times an hour in are rounded by a hundredth of a frame: still whole frames from one to the next. */
static void numbers_hold_in_long_sequences(void **state)
{
    (void)state;
    enum { N = 30000 };
    int *sides = NEW(int, N);
    for (int f = 0; f < N; f++) sides[f] = f % 1000 == 0 || f > N - 20 ? 3 : 0;
    Script s = {N, sides, 24, false, 0};
    expect_script(&s, GLTF_PLAIN, write_script(&s, GLTF_PLAIN, "long.glb"));
    mem_free(sides);
}

static void a_sequence_by_number(void **state)
{
    (void)state;
    static const int sides[4] = {5, 0, 5, 6};
    Script s = {4, sides, 24, false, 0};
    Err err;
    MeshSequence *m = mesh_sequence_open(write_script(&s, GLTF_PLAIN, "a.glb"), "geometric", &err);
    assert_non_null(m);
    mesh_sequence_number_from(m, 10, 5);
    assert_int_equal(mesh_sequence_length(m), 3);
    assert_int_equal(mesh_sequence_number(m, 1), 20);
    assert_int_equal(mesh_sequence_find(m, 25), 2);
    assert_int_equal(mesh_sequence_find(m, 15), NONE);
    mesh_sequence_close(m);
    assert_null(mesh_sequence_open(temp_path("nothing"), "geometric", &err));
    assert_non_null(strstr(err.text, "nothing.geometric.NNNN.ply"));
}

/* --- hostile files -------------------------------------------------------------------------------- */

static uint8_t *read_whole(const char *path, size_t *size)
{
    FILE *f = fopen(path, "rb");
    uint8_t *data = NEW(uint8_t, 1 << 20);
    *size = fread(data, 1, 1 << 20, f);
    fclose(f);
    return data;
}

/* Reads all that can be read. */
static bool read_all(const char *path)
{
    Err err = {0};
    GltfReader *r = gltf_reader_open(path, &err);
    bool good = r != NULL;
    for (int i = 0; r && i < gltf_reader_length(r); i++) {
        TriMesh m;
        if (gltf_reader_mesh(r, i, &m, &err)) {
            for (int h = 0; h < 3 * m.ntri; h++) assert_true(m.tri[h] >= 0 && m.tri[h] < m.nvert);
            for (int k = 0; k < 3 * m.nvert; k++) assert_true(isfinite(m.pos[k]));
            trimesh_free(&m);
        } else {
            good = false;
            assert_null(m.pos);
        }
    }
    if (!good) assert_int_equal(err.code, ERR_INPUT);
    if (r) gltf_reader_close(r);
    return good;
}

static uint8_t *small_file(GltfCompress compress, size_t *size)
{
    static const int sides[12] = {3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 4, 4};
    Script s = {12, sides, 24, false, 0};
    return read_whole(write_script(&s, compress, "small.glb"), size);
}

static void no_prefix_is_a_file(void **state)
{
    (void)state;
    for (GltfCompress how = GLTF_PLAIN; how <= GLTF_MESHOPT; how++) {
        size_t size;
        uint8_t *data = small_file(how, &size);
        for (size_t n = 0; n < size; n += 1 + n / 100) assert_false(read_all(temp_write("cut.glb", data, n)));
        assert_true(read_all(temp_write("cut.glb", data, size)));
        mem_free(data);
    }
}

/* How many of 2000 changed files are refused. */
static int change_files(GltfCompress compress)
{
    static const char bytes[] = "0123456789[]{}\",:e-\xff";
    size_t size;
    uint8_t *data = small_file(compress, &size), *b = NEW(uint8_t, size);
    size_t json = get_u32(data + 12) + 20;
    uint64_t seed = 7;
    int refused = 0;
    for (int i = 0; i < 2000; i++) {
        memcpy(b, data, size);
        for (int k = 0; k < 1 + i % 3; k++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            size_t at = (seed >> 33) % (i % 4 ? json : size);
            b[at] = i % 8 ? (uint8_t)bytes[(seed >> 20) % (sizeof bytes - 1)] : (uint8_t)(seed >> 40);
        }
        refused += !read_all(temp_write("changed.glb", b, size));
    }
    mem_free(b);
    mem_free(data);
    return refused;
}

static void changed_files_do_no_harm(void **state)
{
    (void)state;
    assert_true(change_files(GLTF_PLAIN) > 500);
    assert_true(change_files(GLTF_MESHOPT) > 500);
}

static void foreign_files_are_refused(void **state)
{
    (void)state;
    static const char *const text[] = {
        "{\"asset\":{\"version\":\"2.0\"},\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]}",
        "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0,\"translation\":[1,0,0]}],\"meshes\":[{\"primitives\":[{}]}]}",
        "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0},{\"mesh\":0}],\"meshes\":[{\"primitives\":[{}]}]}",
        "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":0}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"type\":\"VEC3\",\"count\":3}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
        "\"buffers\":[{\"byteLength\":36,\"uri\":\"../etc/passwd\"}]}",
        "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":0}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"type\":\"VEC3\",\"count\":3}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
        "\"buffers\":[{\"byteLength\":36,\"uri\":\"%2e%2e%2fetc%2fpasswd\"}]}",
    };
    static const char *const says[] = {"extension", "places", "several", "beside", "beside"};
    for (size_t i = 0; i < sizeof text / sizeof *text; i++) {
        Err err = {0};
        TriMesh m = {0};
        GltfReader *r = gltf_reader_open(temp_write("foreign.gltf", text[i], strlen(text[i])), &err);
        assert_false(r && gltf_reader_mesh(r, 0, &m, &err));
        if (!strstr(err.text, says[i])) fail_msg("%s", err.text);
        if (r) gltf_reader_close(r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_come_back),     cmocka_unit_test(numbers_hold_in_long_sequences), cmocka_unit_test(a_sequence_by_number),
        cmocka_unit_test(no_prefix_is_a_file),  cmocka_unit_test(changed_files_do_no_harm),       cmocka_unit_test(foreign_files_are_refused),
        cmocka_unit_test(quick_motion_fits_whole_numbers), cmocka_unit_test(small_and_far_meshes_are_exact),
    };
    return cmocka_run_group_tests_name("gltf_read", tests, temp_open, temp_close);
}
