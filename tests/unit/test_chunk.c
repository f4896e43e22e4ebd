/* Chunk files: what is written is read, and what is damaged in any way is a sentence. */
#include "base/digest.h"
#include "cli/chunk.h"

#include "temp_dir.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { HEAD_BYTES = 40, RECORD_HEAD_BYTES = 16 };

/* A triangle a kind, and an event. */
static void make_frame(OutFrame *f, TriMesh mesh[KIND_COUNT])
{
    *f = (OutFrame){.label = "0012", .fate = FRAME_TRACKED, .mesh = mesh, .since = mem_text("0011"), .ncarried = {2, 0}};
    for (int k = 0; k < 2; k++) f->carried[0][k] = NEW0(float, 6);
    f->carried[0][0][5] = 3.5f;
    f->stat.splits = 17;
    f->events = (FrameEvents){.nafter = 1, .after = NEW0(int32_t, 1), .nevent = 1, .event = NEW0(FrameEvent, 1), .nnumber = 1, .number = NEW0(int32_t, 1),
                              .nplace = 1, .place = NEW0(Vec3, 1)};
    f->events.event[0] = (FrameEvent){.kind = EVENT_BIRTH, .count = 1, .nafter = 1, .nplace = 1};
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        TriMesh *m = &mesh[kind];
        trimesh_init(m, 3, 1, false, kind == KIND_GEOMETRIC);
        memset(m->pos, 0, 9 * sizeof *m->pos);
        memset(m->normal, 0, 9 * sizeof *m->normal);
        for (int v = 0; v < 3; v++) m->id[v] = 10 + v, m->tri[v] = v;
        if (m->parent) m->parent[0] = 0;
    }
}

/* The caller frees the bytes. */
static uint8_t *written(size_t *n)
{
    OutFrame f, skipped = {.label = "0013", .fate = FRAME_SKIPPED};
    TriMesh mesh[KIND_COUNT];
    OutFile out;
    Err err;
    char *path = chunk_path(temp_path("a"));
    make_frame(&f, mesh);
    assert_true(outfile_open(&out, path, &err));
    assert_true(chunk_begin(&out, &err) && chunk_add_frame(&out, &f, &err) && chunk_add_frame(&out, &skipped, &err));
    assert_true(outfile_commit(&out, &err));
    for (int kind = 0; kind < KIND_COUNT; kind++) trimesh_free(&mesh[kind]);
    outframe_free(&f);
    FILE *in = fopen(path, "rb");
    uint8_t *data = NEW(uint8_t, 1 << 16);
    *n = fread(data, 1, 1 << 16, in);
    fclose(in);
    mem_free(path);
    return data;
}

/* How many frames the bytes hold; a failure has a sentence with the file and says what to do. */
static int frames_in(const uint8_t *data, size_t n)
{
    ChunkFile c;
    Err err = {0};
    int frames = 0;
    temp_write("b.chunk", data, n);
    bool good = chunk_open(&c, temp_path("b"), &err), more = good;
    while (more) {
        OutFrame f;
        good = chunk_next(&c, &f, &more, &err);
        if (!good) more = false;
        frames += more;
        outframe_free(&f);
    }
    if (!good) assert_true(err.code == ERR_INPUT && strstr(err.text, "b.chunk: ") && strstr(err.text, "again"));
    if (c.stream) chunk_close(&c);
    return good ? frames : NONE;
}

static void test_round_trip(void **state)
{
    (void)state;
    size_t n;
    uint8_t *data = written(&n);
    ChunkFile c;
    OutFrame f;
    Err err;
    bool more;
    assert_true(chunk_open(&c, temp_path("a"), &err));
    for (int turn = 0; turn < 2; turn++) {
        assert_true(chunk_next(&c, &f, &more, &err) && more);
        assert_string_equal(f.label, "0012");
        assert_string_equal(f.since, "0011");
        assert_int_equal(f.stat.splits, 17);
        assert_int_equal(f.events.event[0].kind, EVENT_BIRTH);
        assert_true(f.ncarried[0] == 2 && f.carried[0][0][5] == 3.5f && !f.carried[1][0]);
        assert_true(f.mesh == c.mesh && f.mesh[KIND_GEOMETRIC].id[2] == 12 && !f.mesh[KIND_MECHANICAL].parent);
        outframe_free(&f);
        assert_true(chunk_next(&c, &f, &more, &err) && more);
        assert_true(f.fate == FRAME_SKIPPED && !f.mesh);
        outframe_free(&f);
        assert_true(chunk_next(&c, &f, &more, &err) && !more);
        outframe_free(&f);
        chunk_rewind(&c);
    }
    chunk_close(&c);
    mem_free(data);
}

/* Cut off anywhere, or with any byte changed. */
static void test_damage(void **state)
{
    (void)state;
    size_t n;
    uint8_t *data = written(&n);
    uint64_t first;
    memcpy(&first, data + HEAD_BYTES, sizeof first);
    for (size_t cut = 0; cut < n; cut++) {
        bool is_end = cut == HEAD_BYTES || cut == HEAD_BYTES + RECORD_HEAD_BYTES + first;
        assert_int_equal(frames_in(data, cut), is_end ? (cut == HEAD_BYTES ? 0 : 1) : NONE);
    }
    for (size_t i = 0; i < n; i++) {
        data[i] ^= 0x41;
        assert_int_equal(frames_in(data, n), NONE);
        data[i] ^= 0x41;
    }
    assert_int_equal(frames_in(data, n), 2);
    mem_free(data);
}

/* Bytes with a digest that is right for them: every count and index is looked at. */
static void test_forged(void **state)
{
    (void)state;
    size_t n;
    uint8_t *data = written(&n);
    uint64_t first;
    memcpy(&first, data + HEAD_BYTES, sizeof first);
    uint8_t *record = data + HEAD_BYTES + RECORD_HEAD_BYTES;
    for (size_t i = 0; i + 4 <= first; i++) {
        static const int32_t wrong[] = {INT32_MAX, INT32_MIN, -1};
        for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
            uint8_t was[4];
            memcpy(was, record + i, 4);
            memcpy(record + i, &wrong[k], 4);
            uint64_t digest = digest_bytes(record, first);
            memcpy(data + HEAD_BYTES + 8, &digest, sizeof digest);
            int frames = frames_in(data, n);
            assert_true(frames == 2 || frames == NONE); /* values that may be anything, or a sentence */
            memcpy(record + i, was, 4);
        }
    }
    mem_free(data);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_round_trip, temp_open, temp_close),
        cmocka_unit_test_setup_teardown(test_damage, temp_open, temp_close),
        cmocka_unit_test_setup_teardown(test_forged, temp_open, temp_close),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
