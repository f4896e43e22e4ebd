/* Files that bear their final name only when they are whole. */
#include "io/file.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>

static char folder[64];

static const char *in_folder(const char *name)
{
    static char path[4][256];
    static int turn;
    char *p = path[turn++ % 4];
    snprintf(p, sizeof path[0], "%s/%s", folder, name);
    return p;
}

static int set_up(void **state)
{
    (void)state;
    strcpy(folder, "/tmp/twinmesh.file.XXXXXX");
    return mkdtemp(folder) ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    return rmdir(folder); /* fails where a test left a file behind */
}

static bool exists(const char *path)
{
    struct stat st;
    return lstat(path, &st) == 0;
}

static void final_name_comes_with_commit(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    const char *path = in_folder("a.ply"), *part = in_folder("a.ply.part");
    assert_true(outfile_open(&f, path, &err));
    assert_true(outfile_write(&f, "hello", 5, &err));
    assert_true(exists(part) && !exists(path));
    assert_true(outfile_commit(&f, &err));
    assert_true(!exists(part) && exists(path));
    assert_null(f.stream);

    char text[8] = {0};
    FILE *in = fopen(path, "rb");
    assert_non_null(in);
    assert_int_equal(fread(text, 1, sizeof text, in), 5);
    fclose(in);
    assert_string_equal(text, "hello");
    remove(path);
}

static void abort_leaves_nothing(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    assert_true(outfile_open(&f, in_folder("a"), &err));
    assert_true(outfile_write(&f, "hello", 5, &err));
    outfile_abort(&f);
    outfile_abort(&f); /* once more does nothing */
    assert_false(exists(in_folder("a.part")) || exists(in_folder("a")));
}

static void assert_sentence(const Err *err, const char *path, const char *words)
{
    assert_int_equal(err->code, ERR_OUTPUT);
    assert_non_null(strstr(err->text, path));
    assert_non_null(strstr(err->text, words));
    assert_null(strchr(err->text, '\n'));
}

static void missing_folder_is_a_sentence(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    const char *path = in_folder("none/a.ply");
    assert_false(outfile_open(&f, path, &err));
    assert_sentence(&err, path, "folder does not exist");
    outfile_abort(&f); /* zeroed: does nothing */
}

static void file_as_folder_is_a_sentence(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    assert_true(outfile_open(&f, in_folder("a"), &err) && outfile_commit(&f, &err));
    assert_false(outfile_open(&f, in_folder("a/b.ply"), &err));
    assert_sentence(&err, "a/b.ply", "is a file");
    remove(in_folder("a"));
}

static void unwritable_folder_is_a_sentence(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    assert_int_equal(chmod(folder, 0500), 0);
    bool root = geteuid() == 0; /* who may write anywhere, and steps down for a moment */
    if (root) assert_int_equal(seteuid(65534), 0);
    bool ok = outfile_open(&f, in_folder("a"), &err);
    if (root) assert_int_equal(seteuid(0), 0);
    chmod(folder, 0700);
    assert_false(ok);
    assert_sentence(&err, folder, "not permitted");
}

static void folder_in_the_way_is_a_sentence(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    assert_int_equal(mkdir(in_folder("a"), 0700), 0);
    assert_true(outfile_open(&f, in_folder("a"), &err));
    assert_false(outfile_commit(&f, &err));
    assert_sentence(&err, in_folder("a"), "in the way");
    assert_false(exists(in_folder("a.part")));
    rmdir(in_folder("a"));
}

/* /dev/full takes nothing; small writes fail only when they are flushed at the end. */
static void full_disk_is_named_at_commit(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    assert_int_equal(symlink("/dev/full", in_folder("a.part")), 0);
    assert_true(outfile_open(&f, in_folder("a"), &err));
    assert_true(outfile_write(&f, "hello", 5, &err));
    assert_false(outfile_commit(&f, &err));
    assert_sentence(&err, in_folder("a"), "disk is full");
    assert_false(exists(in_folder("a.part")) || exists(in_folder("a")));
}

static void full_disk_is_named_while_writing(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    static char block[1 << 20];
    assert_int_equal(symlink("/dev/full", in_folder("a.part")), 0);
    assert_true(outfile_open(&f, in_folder("a"), &err));
    assert_false(outfile_write(&f, block, sizeof block, &err));
    assert_sentence(&err, in_folder("a"), "disk is full");
    outfile_abort(&f);
    assert_false(exists(in_folder("a.part")) || exists(in_folder("a")));
}

static void size_limit_is_named(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    struct rlimit old, low;
    getrlimit(RLIMIT_FSIZE, &old);
    low = old;
    low.rlim_cur = 1000;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &low), 0);
    char block[2000] = {0};
    bool opened = outfile_open(&f, in_folder("a"), &err);
    bool wrote = opened && outfile_write(&f, block, sizeof block, &err) && outfile_commit(&f, &err);
    setrlimit(RLIMIT_FSIZE, &old);
    signal(SIGXFSZ, SIG_DFL);
    assert_true(opened && !wrote);
    assert_sentence(&err, in_folder("a"), "size limit");
    assert_false(exists(in_folder("a.part")) || exists(in_folder("a")));
}

static long long length_of(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 ? (long long)st.st_size : -1;
}

static void what_was_left_is_gone_on_with(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    char text[16] = {0};
    assert_true(outfile_open(&f, in_folder("a"), &err));
    assert_true(outfile_write(&f, "one two", 7, &err));
    assert_true(outfile_sync(&f, &err));
    assert_int_equal(outfile_length(&f), 7);
    outfile_leave(&f);
    assert_true(outfile_reopen(&f, in_folder("a"), 4, &err)); /* the rest is cut off */
    assert_int_equal(outfile_length(&f), 4);
    assert_true(outfile_write(&f, "three", 5, &err));
    assert_true(outfile_commit(&f, &err));
    FILE *in = fopen(in_folder("a"), "rb");
    assert_int_equal(fread(text, 1, sizeof text, in), 9);
    fclose(in);
    assert_string_equal(text, "one three");
    remove(in_folder("a"));
}

static void what_is_shorter_or_gone_is_a_sentence(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f;
    assert_false(outfile_reopen(&f, in_folder("a"), 0, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_true(outfile_open(&f, in_folder("a"), &err));
    assert_true(outfile_write(&f, "one", 3, &err));
    outfile_leave(&f);
    assert_false(outfile_reopen(&f, in_folder("a"), 4, &err));
    assert_non_null(strstr(err.text, "shorter"));
    assert_int_equal(length_of(in_folder("a.part")), 3);
    remove(in_folder("a.part"));
}

static void a_copy_is_published(void **state)
{
    (void)state;
    Err err = {0};
    OutFile f, all;
    assert_true(outfile_open(&f, in_folder("a"), &err));
    assert_true(outfile_write(&f, "one", 3, &err));
    assert_true(outfile_publish(&f, &err));
    assert_int_equal(length_of(in_folder("a")), 3);
    assert_true(outfile_write(&f, "two", 3, &err)); /* it goes on */
    assert_true(outfile_open(&all, in_folder("b"), &err));
    assert_true(outfile_append(&all, &f, &err) && outfile_append(&all, &f, &err));
    assert_true(outfile_commit(&all, &err));
    assert_int_equal(length_of(in_folder("b")), 12);
    assert_int_equal(length_of(in_folder("a")), 3);
    outfile_abort(&f);
    remove(in_folder("a"));
    remove(in_folder("b"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(final_name_comes_with_commit),
        cmocka_unit_test(abort_leaves_nothing),
        cmocka_unit_test(missing_folder_is_a_sentence),
        cmocka_unit_test(file_as_folder_is_a_sentence),
        cmocka_unit_test(unwritable_folder_is_a_sentence),
        cmocka_unit_test(folder_in_the_way_is_a_sentence),
        cmocka_unit_test(full_disk_is_named_at_commit),
        cmocka_unit_test(full_disk_is_named_while_writing),
        cmocka_unit_test(size_limit_is_named),
        cmocka_unit_test(what_was_left_is_gone_on_with),
        cmocka_unit_test(what_is_shorter_or_gone_is_a_sentence),
        cmocka_unit_test(a_copy_is_published),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
