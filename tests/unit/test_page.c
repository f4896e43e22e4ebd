/* Pages of reports that are cut, and meshes longer than a part. */
#include "page/page.h"
#include "temp_dir.h"

#include <zlib.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

static const char REPORT[] = "{\"program\":\"twinmesh\",\"version\":\"0\",\"settings\":{\"fps\":24}}\n"
                             "{\"frame\":\"1\",\"fate\":\"tracked\",\"surface\":\"<i>\",\"events\":{\"blend\":1}}\n"
                             "{\"totals\":{\"complete\":true}}\n";
enum { REPORT_SIZE = sizeof REPORT - 1 };

static Page page_of(const char *report)
{
    return (Page){.title = "t", .report = report, .mesh = {{.kind = "mechanical", .missing = "none"}, {.kind = "geometric", .missing = "none"}}};
}

static char *read_all(const char *path)
{
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    assert_int_equal(fseek(f, 0, SEEK_END), 0);
    size_t size = (size_t)ftell(f);
    rewind(f);
    char *text = NEW(char, size + 1);
    assert_int_equal(fread(text, 1, size, f), size);
    text[size] = 0;
    fclose(f);
    return text;
}

static bool page_made(const void *report, size_t size, Err *err)
{
    const char *out = temp_path("page.html");
    Page page = page_of(temp_write("report.jsonl", report, size));
    *err = (Err){0};
    bool made = page_write(out, &page, err);
    assert_int_equal(made, access(out, F_OK) == 0);
    assert_true(made || (err->code == ERR_INPUT && strstr(err->text, "report.jsonl")));
    remove(out);
    return made;
}

/* A report that ends within a line is refused, one that ends behind a line is not. */
static void cut_reports(void **state)
{
    (void)state;
    Err err;
    for (size_t n = 0; n <= REPORT_SIZE; n++) {
        bool whole = n > 0 && (REPORT[n - 1] == '\n' || (n < REPORT_SIZE && REPORT[n] == '\n'));
        assert_int_equal(page_made(REPORT, n, &err), whole);
    }
}

static void lines_behind_the_totals(void **state)
{
    (void)state;
    char twice[2 * REPORT_SIZE];
    Err err;
    memcpy(twice, REPORT, REPORT_SIZE);
    memcpy(twice + REPORT_SIZE, REPORT, REPORT_SIZE);
    assert_false(page_made(twice, sizeof twice, &err));
    assert_non_null(strstr(err.text, "line 4"));
    char zero[] = "{\"version\":\"0\",\"settings\":{\"a\":\"\0\"}}\n";
    assert_false(page_made(zero, sizeof zero - 1, &err));
}

/* --- meshes ------------------------------------------------------------------------------------------ */

static int sign_value(char c)
{
    static const char sign[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *at = strchr(sign, c);
    return c && at ? (int)(at - sign) : -1;
}

/* The bytes of one part, whose text begins at `text`. */
static size_t part_bytes(const char *text, uint8_t *out)
{
    size_t n = 0;
    unsigned bits = 0, held = 0;
    for (; sign_value(*text) >= 0; text++) {
        bits = bits << 6 | (unsigned)sign_value(*text);
        held += 6;
        if (held >= 8) out[n++] = (uint8_t)(bits >> (held -= 8));
    }
    return n;
}

static size_t unpack(const char *page, const char *head, uint8_t *to, size_t room, int *parts)
{
    uint8_t *packed = NEW(uint8_t, strlen(page));
    size_t n = 0;
    *parts = 0;
    for (const char *at = page; (at = strstr(at, head)) != NULL; ++*parts) n += part_bytes(at += strlen(head), packed + n);
    z_stream z = {.next_in = packed, .avail_in = (uInt)n, .next_out = to, .avail_out = (uInt)room};
    assert_int_equal(inflateInit2(&z, 15 + 16), Z_OK);
    assert_int_equal(inflate(&z, Z_FINISH), Z_STREAM_END);
    assert_int_equal(z.avail_in, 0);
    inflateEnd(&z);
    mem_free(packed);
    return room - z.avail_out;
}

/* Noise does not shrink: the lengths around those where a part or a triple of bytes ends. */
static void mesh_of_length(size_t size, int wanted_parts)
{
    uint8_t *noise = NEW(uint8_t, size + 1), *back = NEW(uint8_t, size + 1);
    uint32_t x = 1;
    for (size_t i = 0; i < size; i++) noise[i] = (uint8_t)((x = x * 1664525u + 1013904223u) >> 24);
    const char *out = temp_path("page.html");
    Page page = page_of(temp_write("report.jsonl", REPORT, REPORT_SIZE));
    page.mesh[1] = (PageMesh){.kind = "geometric", .path = temp_write("mesh.glb", noise, size)};
    Err err;
    assert_true(page_write(out, &page, &err));
    char *text = read_all(out);
    int parts;
    assert_int_equal(unpack(text, "data-mesh=\"geometric\">", back, size + 1, &parts), size);
    assert_memory_equal(noise, back, size);
    assert_int_equal(parts, wanted_parts);
    assert_true(strlen(text) < 1500000 + page_embedded_size(size));
    mem_free(text);
    mem_free(noise);
    mem_free(back);
}

static void meshes_of_many_lengths(void **state)
{
    (void)state;
    for (size_t size = 0; size < 4; size++) mesh_of_length(size, 1);
    mesh_of_length(1000, 1);
    mesh_of_length((3 << 20) - 2000, 1);
    mesh_of_length(7 << 20, 3);
}

static void texts_in_the_page(void **state)
{
    (void)state;
    const char *out = temp_path("page.html");
    Page page = page_of(temp_write("report.jsonl", REPORT, REPORT_SIZE));
    page.title = "<b>&\"";
    page.mesh[0].missing = "\"><script>";
    page.mesh[1].link = "a\"b.glb";
    Err err;
    assert_true(page_write(out, &page, &err));
    char *text = read_all(out);
    assert_non_null(strstr(text, "<title>&lt;b&gt;&amp;&quot;</title>"));
    assert_non_null(strstr(text, "data-missing=\"&quot;&gt;&lt;script&gt;\""));
    assert_non_null(strstr(text, "data-link=\"a&quot;b.glb\""));
    assert_non_null(strstr(text, "\"surface\":\"\\u003ci>\""));
    assert_null(strstr(text, "{{"));
    mem_free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cut_reports),
        cmocka_unit_test(lines_behind_the_totals),
        cmocka_unit_test(meshes_of_many_lengths),
        cmocka_unit_test(texts_in_the_page),
    };
    return cmocka_run_group_tests(tests, temp_open, temp_close);
}
