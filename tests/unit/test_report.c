/* The report's lines: valid JSON by their looks, nothing that varies, totals that add up. */
#include "report/report.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static FrameStat sample(void)
{
    return (FrameStat){.components = 2, .triangles_mechanical = 100, .triangles_geometric = 250, .edge_asked = 0.5,
                       .edge_mean = 0.25, .edge_rest = 0.3, .min_angle_p5 = 30, .min_angle_p50 = 50, .splits = 3,
                       .ids_kept = NAN, .distance_mean_vox = 0.125, .distance_max_vox = 0.5,
                       .self_intersections = 3, .flattened = 7, .events = {[EVENT_SPLIT] = 2}, .seconds = {.relax = 0.25}};
}

/* Writes one frame's line into text. */
static void frame_line(const char *label, FrameFate fate, const FrameStat *stat, char *text, size_t size)
{
    FILE *f = tmpfile();
    assert_non_null(f);
    report_write_frame(f, label, fate, NULL, stat);
    rewind(f);
    assert_non_null(fgets(text, (int)size, f));
    assert_int_equal(fgetc(f), EOF);
    fclose(f);
}

static void expect_in(const char *text, const char *part)
{
    if (!strstr(text, part)) fail_msg("no '%s' in '%s'", part, text);
}

static void test_frame(void **state)
{
    (void)state;
    char text[4000];
    FrameStat stat = sample();
    frame_line("0012", FRAME_TRACKED, &stat, text, sizeof text);
    expect_in(text, "{\"frame\":\"0012\",\"fate\":\"tracked\",");
    expect_in(text, "\"triangles_geometric\":250,");
    expect_in(text, "\"edge_mean\":0.25,");
    expect_in(text, "\"ids_kept\":null,");
    expect_in(text, "\"self_intersections\":3,\"flattened\":7,\"events\":");
    expect_in(text, ",\"events\":{\"blend\":0,\"split\":2,\"birth\":0,\"death\":0,\"hole-open\":0,\"hole-close\":0,\"mend\":0}}\n");
    assert_null(strstr(text, "nan"));
    assert_null(strstr(text, "seconds"));
}

static void test_events(void **state)
{
    (void)state;
    int32_t before[] = {3, 17}, after[] = {3}, link[][2] = {{3, 3}, {17, 3}}, number[] = {3, 17, 3};
    Vec3 place[] = {{0.5, -0.0, 2}};
    FrameEvent blend = {EVENT_BLEND, 1, 24, 0, 2, 2, 1, 0, 1};
    FrameEvents e = {.nbefore = 2, .nafter = 1, .before = before, .after = after, .nlink = 2, .link = link, .nevent = 1, .event = &blend, .number = number, .place = place};
    char text[1000];
    FILE *f = tmpfile();
    assert_non_null(f);
    events_write_frame(f, "0012", "0011", &e);
    e = (FrameEvents){.first = true, .nafter = 1, .after = after};
    events_write_frame(f, "0001", NULL, &e);
    rewind(f);
    size_t n = fread(text, 1, sizeof text - 1, f);
    text[n] = 0;
    fclose(f);
    assert_string_equal(text, "{\"frame\":\"0012\",\"kind\":\"components\",\"since\":\"0011\",\"before\":[3,17],\"after\":[3],\"links\":[[3,3],[17,3]]}\n"
                              "{\"frame\":\"0012\",\"kind\":\"blend\",\"place\":[0.5,0,2],\"before\":[3,17],\"after\":[3],\"replaced\":24,\"count\":1,\"places\":[[0.5,0,2]]}\n"
                              "{\"frame\":\"0001\",\"kind\":\"components\",\"since\":null,\"before\":[],\"after\":[3],\"links\":[]}\n");
}

static void test_frame_not_tracked(void **state)
{
    (void)state;
    char text[400];
    frame_line("a\"b\\c\n", FRAME_SKIPPED, NULL, text, sizeof text);
    assert_string_equal(text, "{\"frame\":\"a\\\"b\\\\c\\u000a\",\"fate\":\"skipped\"}\n");
}

static void test_totals(void **state)
{
    (void)state;
    ReportTotals t = report_totals_zero();
    FrameStat a = sample(), b = sample(), empty = {.ids_kept = NAN};
    b.ids_kept = 0.75;
    b.min_angle_p5 = 20;
    b.wrong_components = 1;
    StageSeconds s = report_stages(&a);
    s.whole = 1;
    assert_true(s.relax == 0.25);
    report_totals_add(&t, FRAME_TRACKED, &a, &s);
    report_totals_add(&t, FRAME_TRACKED, &b, &s);
    report_totals_add(&t, FRAME_TRACKED, &empty, &s);
    report_totals_add(&t, FRAME_HELD, NULL, &s);
    report_totals_add(&t, FRAME_SKIPPED, NULL, &s);
    assert_int_equal(t.frames, 3);
    assert_int_equal(t.held, 1);
    assert_int_equal(t.skipped, 1);
    assert_int_equal(t.empty, 1);
    assert_int_equal(t.exact, 2);
    assert_int_equal(t.triangles_geometric, 500);
    assert_int_equal(t.events[EVENT_SPLIT], 4);
    assert_int_equal(t.nsurface, 2);
    assert_true(t.edge_ratio_sum == 1);
    assert_true(t.angle_p5_least == 20);
    assert_true(t.ids_kept_least == 0.75 && t.nids == 1);
    assert_true(t.seconds.whole == 5 && t.seconds.relax == 1.25);
}

/* A run of nothing but empty frames divides by nothing. */
static void test_totals_of_nothing(void **state)
{
    (void)state;
    char text[4000];
    ReportTotals t = report_totals_zero();
    FILE *f = tmpfile();
    assert_non_null(f);
    report_write_totals(f, &t, 0, NULL, false);
    rewind(f);
    assert_non_null(fgets(text, sizeof text, f));
    fclose(f);
    expect_in(text, "\"complete\":false,");
    expect_in(text, "\"min_angle_p5_least\":null,");
    expect_in(text, "\"runs\":{}}}\n");
    assert_null(strstr(text, "inf"));
    assert_null(strstr(text, "nan"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_frame),
        cmocka_unit_test(test_events),
        cmocka_unit_test(test_frame_not_tracked),
        cmocka_unit_test(test_totals),
        cmocka_unit_test(test_totals_of_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
