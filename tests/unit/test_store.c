/* The store: what goes in comes out, and what is damaged comes out as nothing. */
#include "base/digest.h"
#include "base/store.h"

#include "temp_dir.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

typedef struct Record {
    int n;
    double x;
    float *row;      /* [n] */
    char *name, *none;
    Map map;
} Record;

static void store_record(Record *r, Store *s)
{
    STORE(s, r->n);
    STORE(s, r->x);
    STORE_ARRAY(s, r->row, r->n);
    store_text(s, &r->name);
    store_text(s, &r->none);
    store_map(s, &r->map);
}

static void free_record(Record *r)
{
    mem_free(r->row);
    mem_free(r->name);
    mem_free(r->none);
    map_free(&r->map);
}

static Store written(void)
{
    float row[3] = {1, 2, 3};
    char name[] = "phi";
    Record r = {3, 0.5, row, name, NULL, {0}};
    for (int i = 0; i < 100; i++) map_put(&r.map, (uint64_t)i << 32, i);
    Store s = store_writing();
    store_record(&r, &s);
    map_free(&r.map);
    return s;
}

static void test_round_trip(void **state)
{
    (void)state;
    Store w = written(), r = store_reading(w.data, w.n);
    Record got = {0};
    store_record(&got, &r);
    assert_false(r.bad);
    assert_int_equal(r.at, w.n);
    assert_int_equal(got.n, 3);
    assert_true(got.x == 0.5 && got.row[2] == 3);
    assert_string_equal(got.name, "phi");
    assert_null(got.none);
    assert_int_equal(got.map.count, 100);
    for (int i = 0; i < 100; i++) assert_int_equal(map_get(&got.map, (uint64_t)i << 32), i);
    free_record(&got);
    store_free(&w);
}

/* Every cut is noticed, and what was read can be freed. */
static void test_cut_off(void **state)
{
    (void)state;
    Store w = written();
    for (size_t n = 0; n < w.n; n++) {
        Store r = store_reading(w.data, n);
        Record got = {0};
        store_record(&got, &r);
        assert_true(r.bad);
        free_record(&got);
    }
    store_free(&w);
}

/* A count that the bytes do not justify allocates nothing. */
static void test_counts(void **state)
{
    (void)state;
    const int counts[] = {-1, INT32_MIN, INT32_MAX, 1 << 28};
    for (int i = 0; i < 4; i++) {
        Store w = written();
        memcpy(w.data, &counts[i], sizeof counts[i]);
        Store r = store_reading(w.data, w.n);
        Record got = {0};
        store_record(&got, &r);
        assert_true(r.bad);
        free_record(&got);
        store_free(&w);
    }
}

static void test_digests(void **state)
{
    (void)state;
    Err err;
    uint64_t a, b;
    temp_write("a", "some bytes", 10);
    assert_true(digest_file(temp_path("a"), &a, &err));
    assert_true(a == digest_bytes("some bytes", 10));
    temp_write("a", "same bytes", 10);
    assert_true(digest_file(temp_path("a"), &b, &err));
    assert_true(a != b);
    assert_false(digest_file(temp_path("b"), &a, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.text, "/b: "));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),
        cmocka_unit_test(test_cut_off),
        cmocka_unit_test(test_counts),
        cmocka_unit_test_setup_teardown(test_digests, temp_open, temp_close),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
