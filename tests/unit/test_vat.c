/* Vertex animation textures, read back with OpenEXR's own decoder: at every frame base and offsets are the mesh that was given. */
#include "io/gltf_read.h"
#include "io/gltf_info.h"
#include "io/vat_priv.h"

#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

#include "read_image.h"
#include "temp_dir.h"

enum { SIDE = 16 }; /* of textures, so that small runs have several rows and are cut */

/* --- what is written -------------------------------------------------------------------------------- */

/* What each frame shows: a fan of so many triangles; 0: nothing, -1: it was skipped. */
typedef struct Script {
    int n;
    const int *sides;
} Script;

static float *fan_column(int sides, int frame, bool normal)
{
    float *column = NEW(float, 3 * (sides + 1));
    for (int v = 0; v <= sides; v++) {
        double a = 6.283185307179586 * v / sides + 0.01 * frame;
        float p[3] = {(float)(40 + cos(a) + 0.1 * frame), (float)(50 + sin(a)), (float)(60 + 0.25 * frame)}, n[3] = {(float)sin(a), 0, (float)cos(a)};
        memcpy(column + 3 * v, normal ? n : p, sizeof p);
    }
    return column;
}

static TriMesh fan_at(int sides, int frame)
{
    TriMesh m = {0};
    if (sides == 0) return m;
    trimesh_init(&m, sides + 1, sides, false, false);
    for (int k = 0; k < 2; k++) {
        float *column = fan_column(sides, frame, k);
        memcpy(k ? m.normal : m.pos, column, 3 * (size_t)m.nvert * sizeof *column);
        mem_free(column);
    }
    for (int v = 0; v < m.nvert; v++) m.id[v] = 7 + v;
    for (int t = 0; t < m.ntri; t++) memcpy(m.tri + 3 * t, (int32_t[3]){t, (t + 1) % sides, sides}, 3 * sizeof(int32_t));
    return m;
}

static VatOptions small(const char *prefix) { return (VatOptions){.prefix = prefix, .name = "geometric", .fps = 24, .side = SIDE}; }

static Vat *open_small(const char *prefix)
{
    VatOptions options = small(prefix);
    return vat_open(&options);
}

static void play(Vat *v, const Script *s, int from, int until)
{
    int gap = 1, last = 0;
    Err err;
    for (int f = 0; f < until; f++, gap++) {
        if (s->sides[f] < 0) continue;
        if (f >= from) {
            char label[16];
            TriMesh m = fan_at(s->sides[f], f);
            bool ends = last > 0 && s->sides[f] != last;
            float *pos = ends ? fan_column(last, f, false) : NULL, *normal = ends ? fan_column(last, f, true) : NULL;
            snprintf(label, sizeof label, "%04d", f);
            if (!vat_add_frame(v, &m, pos, normal, gap, label, &err)) fail_msg("%s", err.text);
            trimesh_free(&m);
            mem_free(pos);
            mem_free(normal);
        }
        last = s->sides[f];
        gap = 0;
    }
}

static void finish(Vat *v)
{
    Err err;
    if (!vat_finish(v, &err)) fail_msg("%s", err.text);
    vat_abort(v);
}

/* --- what is read ----------------------------------------------------------------------------------- */

/* plane[c][width * height] of R, G, B; to be freed. */
static void read_texture(const char *path, int width, int height, float *plane[3])
{
    static const ImageChannel rgb[3] = {{"R", IMAGE_FLOAT}, {"G", IMAGE_FLOAT}, {"B", IMAGE_FLOAT}};
    for (int k = 0; k < 3; k++) plane[k] = NEW(float, width * height);
    read_image(path, width, height, 3, rgb, (void *const *)plane);
}

typedef struct Decoded {
    int width, height, rows, blocks, nvert;
    TriMesh base;
    float *texture[VAT_TEXTURES][3];
} Decoded;

static const char *beside(json_t *run, const char *key) { return temp_path(json_string_value(json_object_get(run, key))); }
static int whole(json_t *run, const char *key) { return (int)json_integer_value(json_object_get(run, key)); }

static Decoded decode(json_t *run)
{
    Err err;
    Decoded d = {.width = whole(run, "width"), .height = whole(run, "height"), .rows = whole(run, "rows_per_frame"),
                 .blocks = whole(run, "frames") + json_is_true(json_object_get(run, "carried")), .nvert = whole(run, "vertices")};
    assert_int_equal(d.height, d.rows * d.blocks);
    assert_true(d.width <= SIDE && (d.width & (d.width - 1)) == 0 && d.width * d.rows >= d.nvert);
    read_texture(beside(run, "position"), d.width, d.height, d.texture[VAT_POSITION]);
    read_texture(beside(run, "normal"), d.width, d.height, d.texture[VAT_NORMAL]);
    GltfReader *r = gltf_reader_open(beside(run, "base"), &err);
    if (!r || !gltf_reader_mesh(r, 0, &d.base, &err)) fail_msg("%s", err.text);
    gltf_reader_close(r);
    assert_int_equal(d.base.nvert, d.nvert);
    return d;
}

static void decoded_free(Decoded *d)
{
    for (int t = 0; t < VAT_TEXTURES; t++)
        for (int k = 0; k < 3; k++) mem_free(d->texture[t][k]);
    trimesh_free(&d->base);
}

/* As a shader does it: the texel of the vertex in the block of the frame. */
static void expect_block(const Decoded *d, int block, const float *pos, const float *normal)
{
    for (int v = 0; v < d->nvert; v++) {
        int texel = (block * d->rows + v / d->width) * d->width + v % d->width;
        for (int k = 0; k < 3; k++) {
            assert_true(d->base.pos[3 * v + k] + d->texture[VAT_POSITION][k][texel] == pos[3 * v + k]);
            assert_true(d->texture[VAT_NORMAL][k][texel] == normal[3 * v + k]);
        }
    }
}

static void expect_fan(const Decoded *d, int block, int frame)
{
    float *pos = fan_column(d->nvert - 1, frame, false), *normal = fan_column(d->nvert - 1, frame, true);
    expect_block(d, block, pos, normal);
    mem_free(pos);
    mem_free(normal);
}

static void expect_script(const Script *s, const char *prefix)
{
    char *path = vat_path(prefix);
    json_t *root = json_load_file(path, 0, NULL), *runs = json_object_get(root, "runs"), *run;
    size_t i;
    int frame = 0;
    mem_free(path);
    assert_non_null(root);
    json_array_foreach(runs, i, run)
    {
        for (; s->sides[frame] <= 0; frame++) assert_true(frame < s->n);
        assert_int_equal(whole(run, "first"), frame);
        Decoded d = decode(run);
        int last = frame + d.blocks - json_is_true(json_object_get(run, "carried"));
        bool follows = last < s->n && s->sides[last] >= 0;
        assert_int_equal(json_is_true(json_object_get(run, "carried")), follows);
        for (int k = 0; k < d.blocks; k++) expect_fan(&d, k, frame + k);
        for (; frame < last; frame++) assert_int_equal(s->sides[frame], d.nvert - 1);
        decoded_free(&d);
    }
    for (; frame < s->n; frame++) assert_true(s->sides[frame] <= 0);
    json_decref(root);
}

/* --- tests ------------------------------------------------------------------------------------------ */

static const int untidy[] = {0, 5, 5, 5, 6, 6, -1, 6, 40, 40, 40, 40, 40, 40, 40, 0, 0, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, -1, 4};
static const Script script = {sizeof untidy / sizeof *untidy, untidy};

static void frames_come_back_exactly(void **state)
{
    (void)state;
    const char *prefix = temp_path("a.geometric");
    Vat *v = open_small(prefix);
    play(v, &script, 0, script.n);
    finish(v);
    expect_script(&script, prefix);
}

/* 41 vertices have 3 rows of 16: 5 blocks at most, the last one carried on; 4 have one of 4. */
static void long_runs_are_cut(void **state)
{
    (void)state;
    const char *prefix = temp_path("cut.geometric");
    Vat *v = open_small(prefix);
    play(v, &script, 0, script.n);
    int most = 0;
    for (int i = 0; i < v->nrun; i++) {
        most = int_max(most, v->run[i].rows * vat_blocks(&v->run[i]));
        if (v->run[i].nvert == 41) assert_true(v->run[i].width == 16 && v->run[i].rows == 3 && v->run[i].frames <= 4);
        if (v->run[i].nvert == 4) assert_true(v->run[i].width == 4 && v->run[i].rows == 1);
    }
    assert_int_equal(most, SIDE);
    finish(v);
}

static void texture_coordinates_are_the_middles_of_texels(void **state)
{
    (void)state;
    const int sides[] = {40, 40};
    Vat *v = open_small(temp_path("uv.geometric"));
    play(v, &(Script){2, sides}, 0, 2);
    finish(v);
    GltfInfo info;
    Err err;
    assert_true(gltf_info_read(temp_path("uv.geometric.0000.base.glb"), &info, &err));
    assert_non_null(strstr(info.attributes, "TEXCOORD_0"));
    gltf_info_free(&info);

    /* the last array of the file */
    float uv[2 * 41];
    FILE *f = fopen(temp_path("uv.geometric.0000.base.glb"), "rb");
    assert_int_equal(fseek(f, -(long)sizeof uv, SEEK_END), 0);
    assert_int_equal(fread(uv, sizeof uv, 1, f), 1);
    fclose(f);
    for (int i = 0; i < 41; i++) {
        assert_true(floorf(uv[2 * i] * 16) == (float)(i % 16) && fabsf(uv[2 * i] * 16 - (float)(i % 16) - 0.5f) < 1e-5f);
        assert_true(fabsf(uv[2 * i + 1] * 6 - (float)(i / 16) - 0.5f) < 1e-5f); /* 2 blocks of 3 rows */
    }
}

static char *slurp(const char *path, size_t *n)
{
    FILE *f = fopen(path, "rb");
    if (!f) fail_msg("%s", path);
    char *data = NEW(char, 1 << 20);
    *n = fread(data, 1, 1 << 20, f);
    fclose(f);
    return data;
}

static void expect_same_file(const char *a, const char *b)
{
    size_t na, nb;
    char *da = slurp(a, &na), *db = slurp(b, &nb);
    assert_int_equal(na, nb);
    assert_memory_equal(da, db, na);
    mem_free(da);
    mem_free(db);
}

/* Left after each frame, with what came behind the state in the parts and a published file beside: the same files at the end. */
static void one_left_is_gone_on_with(void **state)
{
    (void)state;
    char whole_prefix[1024], cut[1024];
    snprintf(whole_prefix, sizeof whole_prefix, "%s", temp_path("whole.geometric"));
    snprintf(cut, sizeof cut, "%s", temp_path("left.geometric"));
    Vat *w = open_small(whole_prefix);
    play(w, &script, 0, script.n);
    finish(w);
    for (int k = 1; k < script.n; k++) {
        if (script.sides[k - 1] < 0) continue;
        Err err;
        Vat *v = open_small(cut);
        play(v, &script, 0, k);
        Store out = store_writing();
        vat_store(v, &out);
        assert_true(vat_sync(v, &err));
        int later = int_min(k + 1, script.n);
        play(v, &script, k, later);
        if (k % 2) assert_true(vat_finish(v, &err));
        vat_leave(v);

        Store in = store_reading(out.data, out.n);
        VatOptions options = small(cut);
        v = vat_reopen(&options, &in, &err);
        assert_non_null(v);
        assert_true(in.at == in.n);
        play(v, &script, k, script.n);
        finish(v);
        store_free(&out);
        expect_script(&script, cut);
        expect_same_file(temp_path("whole.geometric.0017.position.exr"), temp_path("left.geometric.0017.position.exr"));
        expect_same_file(temp_path("whole.geometric.0008.base.glb"), temp_path("left.geometric.0008.base.glb"));
        assert_int_not_equal(access(temp_path("left.geometric.vat.0.part"), F_OK), 0);
        assert_int_not_equal(access(temp_path("left.geometric.vat.1.part"), F_OK), 0);
    }
}

static void damage_in_a_store_does_no_harm(void **state)
{
    (void)state;
    const char *prefix = temp_path("bad.geometric");
    const int sides[] = {3, 3, 4, 4};
    Err err = {0};
    VatOptions options = small(prefix);
    Vat *v = vat_open(&options);
    play(v, &(Script){4, sides}, 0, 4);
    Store w = store_writing();
    assert_true(vat_sync(v, &err));
    vat_store(v, &w);
    vat_leave(v);
    int refused = 0;
    for (size_t i = 0; i < w.n; i++) {
        w.data[i] ^= 0x81;
        Store r = store_reading(w.data, w.n);
        v = vat_reopen(&options, &r, &err);
        assert_true(v || r.bad || err.code == ERR_INPUT);
        refused += !v;
        if (v) vat_leave(v);
        w.data[i] ^= 0x81;
    }
    assert_true(refused > 50);
    store_free(&w);
}

static void no_folder_is_said(void **state)
{
    (void)state;
    Err err;
    Vat *v = open_small(temp_path("none/a.geometric"));
    TriMesh m = fan_at(3, 0);
    assert_false(vat_add_frame(v, &m, NULL, NULL, 1, "0000", &err));
    assert_int_equal(err.code, ERR_OUTPUT);
    assert_non_null(strstr(err.text, "folder does not exist"));
    assert_false(vat_finish(v, &err));
    assert_non_null(strstr(err.text, "folder does not exist"));
    trimesh_free(&m);
    vat_abort(v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_come_back_exactly),
        cmocka_unit_test(long_runs_are_cut),
        cmocka_unit_test(texture_coordinates_are_the_middles_of_texels),
        cmocka_unit_test(one_left_is_gone_on_with),
        cmocka_unit_test(damage_in_a_store_does_no_harm),
        cmocka_unit_test(no_folder_is_said),
    };
    return cmocka_run_group_tests_name("vat", tests, temp_open, temp_close);
}
