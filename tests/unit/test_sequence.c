/* FRAME... arguments: files, patterns, directories, standard input. */
#include "sequence/pattern.h"
#include "temp_dir.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

static bool is_vdb(const char *path)
{
    size_t n = strlen(path);
    return n > 4 && strcmp(path + n - 4, ".vdb") == 0;
}

static void touch(const char *name) { temp_write(name, "", 0); }

static int empty_dir(void **state)
{
    temp_close(state);
    return temp_open(state);
}

/* Opens with one argument (relative to the temporary directory unless it starts with '-') and compares
 * "0001=a.0001.vdb ..." */
static void expect_frames(const char *arg, const char *frames, const char *expected)
{
    char got[4096] = "";
    char *args[1] = {(char *)(uintptr_t)temp_path(arg)};
    Sequence s;
    Frame f;
    Err err = {0};
    if (!sequence_open(&s, 1, args, frames, is_vdb, &err)) fail_msg("%s", err.text);
    int count = 0;
    while (sequence_next(&s, &f, &err) == SEQUENCE_FRAME) {
        size_t n = strlen(got), d = strlen(temp_dir);
        assert_int_equal(strncmp(f.path, temp_dir, d), 0);
        assert_int_equal(strtoll(f.digits, NULL, 10), f.number);
        snprintf(got + n, sizeof got - n, "%s%s=%s", n ? " " : "", f.digits, f.path + d + 1);
        count++;
    }
    assert_int_equal(err.code, ERR_NONE);
    assert_int_equal(sequence_length(&s), count);
    sequence_close(&s);
    assert_string_equal(got, expected);
}

static void expect_error(int nargs, const char *const *args, const char *frames, ErrCode code, const char *word)
{
    char *list[8] = {0};
    for (int i = 0; i < nargs; i++) list[i] = (char *)(uintptr_t)args[i];
    Sequence s;
    Err err = {0};
    assert_false(sequence_open(&s, nargs, list, frames, is_vdb, &err));
    if (!strstr(err.text, word)) fail_msg("'%s' is not in: %s", word, err.text);
    assert_int_equal(err.code, code);
    assert_int_equal(s.nentry, 0);
}

static void parses_ranges(void **state)
{
    (void)state;
    FrameRange r;
    Err err = {0};
    assert_true(frame_range_parse("1-120", &r, &err) && r.first == 1 && r.last == 120 && r.step == 1);
    assert_true(frame_range_parse("0010-20x5", &r, &err) && r.first == 10 && r.last == 20 && r.step == 5);
    assert_true(frame_range_parse("7", &r, &err) && r.first == 7 && r.last == 7);
    static const char *const wrong[] = {"",      "-",     "1-",     "-5",    "a-b",   "1-2x",  "1-2x0", "1-2 ",
                                        "5-4",   "1,2",   "1-2-3",  " 1-2",  "1x2",   "1-2y3", "+1-2",  "1-9999999999999999999",
                                        "0-100000000"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        err = (Err){0};
        assert_false(frame_range_parse(wrong[i], &r, &err));
        assert_int_equal(err.code, ERR_USAGE);
        assert_non_null(strstr(err.text, "--frames"));
    }
}

static void patterns_with_a_range_name_missing_frames_too(void **state)
{
    (void)state;
    touch("p.0001.vdb");
    const char *expected = "0001=p.0001.vdb 0004=p.0004.vdb 0007=p.0007.vdb";
    expect_frames("p.####.vdb", "1-9x3", expected);
    expect_frames("p.%04d.vdb", "1-7x3", expected);
    expect_frames("p.$F4.vdb", "1-7x3", expected);
    expect_frames("p.%d.vdb", "9-11", "9=p.9.vdb 10=p.10.vdb 11=p.11.vdb");
    expect_frames("p.$F.vdb", "9-10", "9=p.9.vdb 10=p.10.vdb");
    expect_frames("p#.vdb", "10", "10=p10.vdb");
    expect_frames("##x2.vdb", "99-101", "99=99x2.vdb 100=100x2.vdb 101=101x2.vdb");
}

static void patterns_alone_find_what_is_there(void **state)
{
    (void)state;
    static const char *const names[] = {"p.0010.vdb", "p.0002.vdb", "p.0001.vdb",    "p.00003.vdb", "p.12345.vdb", "p.004.vdb",
                                        "p.0005.vdb.part", "q.0001.vdb", "p.000a.vdb", "p..vdb"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) touch(names[i]);
    expect_frames("p.####.vdb", NULL, "0001=p.0001.vdb 0002=p.0002.vdb 0010=p.0010.vdb 12345=p.12345.vdb");
    expect_frames("p.%03d.vdb", NULL, "004=p.004.vdb 12345=p.12345.vdb");
    expect_error(1, (const char *[]){temp_path("none.####.vdb")}, NULL, ERR_INPUT, "no file matches");
    expect_error(1, (const char *[]){temp_path("no/where.####.vdb")}, NULL, ERR_INPUT, "cannot be listed");
}

static void refuses_wrong_patterns(void **state)
{
    (void)state;
    expect_error(1, (const char *[]){"a#b##.vdb"}, "1-2", ERR_USAGE, "one place");
    expect_error(1, (const char *[]){"d##/b.vdb"}, "1-2", ERR_USAGE, "one place");
    expect_error(1, (const char *[]){"p.####################.vdb"}, "1-2", ERR_USAGE, "at most");
    expect_error(1, (const char *[]){"p.0001.vdb"}, "1-2", ERR_USAGE, "--frames goes with");
    expect_error(1, (const char *[]){""}, NULL, ERR_USAGE, "empty");
    expect_error(0, NULL, NULL, ERR_USAGE, "no frames");
    static char longer[2 * FRAME_PATH_MAX];
    memset(longer, 'a', sizeof longer - 1);
    longer[5] = '#';
    expect_error(1, (const char *[]){longer}, NULL, ERR_USAGE, "too long");
    longer[5] = 'a';
    expect_error(1, (const char *[]){longer}, NULL, ERR_USAGE, "too long");
}

static void directories_hold_one_sequence(void **state)
{
    (void)state;
    static const char *const names[] = {"p_9.vdb", "p_10.vdb", "p_8.vdb", "README.md", ".p_1.vdb", "p_7.vdb.part"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) touch(names[i]);
    expect_frames(".", NULL, "8=./p_8.vdb 9=./p_9.vdb 10=./p_10.vdb");
    expect_frames(".", "8-12x2", "8=./p_8.vdb 10=./p_10.vdb 12=./p_12.vdb");
    touch("q_1.vdb");
    expect_error(1, (const char *[]){temp_path(".")}, NULL, ERR_INPUT, "p_####.vdb, q_####.vdb");
}

static void directories_may_be_unnumbered_or_empty(void **state)
{
    (void)state;
    expect_error(1, (const char *[]){temp_path(".")}, NULL, ERR_INPUT, "no volume files");
    touch("bunny.vdb");
    expect_frames(".", NULL, "0001=./bunny.vdb");
    touch("dragon.vdb");
    expect_error(1, (const char *[]){temp_path(".")}, NULL, ERR_INPUT, "bunny.vdb, dragon.vdb");
}

static void a_file_that_exists_is_a_file(void **state)
{
    (void)state;
    touch("p.####.vdb");
    expect_frames("p.####.vdb", NULL, "0001=p.####.vdb");
}

static void takes_numbers_from_names(void **state)
{
    (void)state;
    static const struct {
        const char *name, *digits;
        int64_t number;
    } cases[] = {
        {"a.0012.vdb", "0012", 12},       {"a1b22c333.vdb", "333", 333},      {"dir.7/a.vdb", "0001", 1},
        {"a.0012", "0012", 12},           {"a", "0001", 1},                    {"a12_b.vdb", "12", 12},
        {".5.vdb", "5", 5},               {"a.20240115123045.vdb", "20240115123045", 20240115123045},
        {"x.012345678901234567.vdb", "012345678901234567", 12345678901234567}, {"a.0.vdb", "0", 0},
        {"a.v2.bin", "2", 2},             {"noise.mp3", "0001", 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *args[1] = {(char *)(uintptr_t)cases[i].name};
        Sequence s;
        Frame f;
        Err err = {0};
        assert_true(sequence_open(&s, 1, args, NULL, is_vdb, &err));
        assert_int_equal(sequence_next(&s, &f, &err), SEQUENCE_FRAME);
        assert_string_equal(f.path, cases[i].name);
        assert_string_equal(f.digits, cases[i].digits);
        assert_true(f.number == cases[i].number);
        assert_int_equal(sequence_next(&s, &f, &err), SEQUENCE_END);
        sequence_close(&s);
    }
    expect_error(1, (const char *[]){"a.1234567890123456789.vdb"}, NULL, ERR_INPUT, "at most 18 digits");
}

static void sorts_files_and_refuses_duplicates(void **state)
{
    (void)state;
    char *args[] = {(char[]){"a.10.vdb"}, (char[]){"a.9.vdb"}, (char[]){"b.0011.vdb"}};
    Sequence s;
    Frame f;
    Err err = {0};
    assert_true(sequence_open(&s, 3, args, NULL, is_vdb, &err));
    for (int i = 9; i <= 11; i++) assert_true(sequence_next(&s, &f, &err) == SEQUENCE_FRAME && f.number == i);
    sequence_close(&s);
    expect_error(2, (const char *[]){"a.01.vdb", "a.1.vdb"}, NULL, ERR_USAGE, "both frame 1");
    expect_error(2, (const char *[]){"-", "a.1.vdb"}, NULL, ERR_USAGE, "standard input");
    expect_error(1, (const char *[]){"-"}, "1-2", ERR_USAGE, "standard input");
}

/* Each name is there before the next is written: nothing waits for the end of the input. */
static void names_on_standard_input_arrive_one_by_one(void **state)
{
    (void)state;
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    Sequence s;
    Frame f;
    Err err = {0};
    char *args[1] = {(char[]){"-"}};
    assert_true(sequence_open(&s, 1, args, NULL, is_vdb, &err));
    assert_int_equal(sequence_length(&s), NONE);
    s.names = fdopen(ends[0], "r");
    FILE *in = s.names;
    for (int i = 3; i >= 1; i--) {
        char line[32];
        int n = snprintf(line, sizeof line, "f.%04d.vdb\r\n\n", i);
        assert_int_equal(write(ends[1], line, (size_t)n), n);
        assert_int_equal(sequence_next(&s, &f, &err), SEQUENCE_FRAME);
        assert_true(f.number == i);
        assert_int_equal(strlen(f.path), 10);
    }
    assert_int_equal(write(ends[1], "x.vdb\nlast.0009", 15), 15);
    close(ends[1]);
    assert_int_equal(sequence_next(&s, &f, &err), SEQUENCE_FRAME);
    assert_string_equal(f.digits, "0004");
    assert_int_equal(sequence_next(&s, &f, &err), SEQUENCE_FRAME);
    assert_string_equal(f.path, "last.0009");
    assert_int_equal(sequence_next(&s, &f, &err), SEQUENCE_END);
    sequence_close(&s);
    fclose(in);
}

static void expect_input_error(const char *text, size_t size, const char *word)
{
    Sequence s;
    Frame f;
    Err err = {0};
    char *args[1] = {(char[]){"-"}};
    FILE *in = fopen(temp_write("names", text, size), "r");
    assert_true(in && sequence_open(&s, 1, args, NULL, is_vdb, &err));
    s.names = in;
    SequenceStep step;
    while ((step = sequence_next(&s, &f, &err)) == SEQUENCE_FRAME) continue;
    assert_int_equal(step, SEQUENCE_ERROR);
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.text, word));
    sequence_close(&s);
    fclose(in);
}

static void refuses_strange_standard_input(void **state)
{
    (void)state;
    static char longer[FRAME_PATH_MAX + 1];
    memset(longer, 'a', sizeof longer);
    expect_input_error("a.1.vdb\nb.01.vdb\n", 17, "before already");
    expect_input_error("a.1\0.vdb\n", 9, "no text");
    expect_input_error(longer, sizeof longer, "too long");
    expect_input_error("a.1234567890123456789.vdb\n", 26, "digits");
}

int main(void)
{
#define IN_EMPTY_DIR(f) cmocka_unit_test_setup(f, empty_dir)
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parses_ranges),
        IN_EMPTY_DIR(patterns_with_a_range_name_missing_frames_too),
        IN_EMPTY_DIR(patterns_alone_find_what_is_there),
        cmocka_unit_test(refuses_wrong_patterns),
        IN_EMPTY_DIR(directories_hold_one_sequence),
        IN_EMPTY_DIR(directories_may_be_unnumbered_or_empty),
        IN_EMPTY_DIR(a_file_that_exists_is_a_file),
        cmocka_unit_test(takes_numbers_from_names),
        cmocka_unit_test(sorts_files_and_refuses_duplicates),
        cmocka_unit_test(names_on_standard_input_arrive_one_by_one),
        cmocka_unit_test(refuses_strange_standard_input),
    };
    return cmocka_run_group_tests(tests, temp_open, temp_close);
}
