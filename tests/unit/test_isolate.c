/* Reading in processes of their own: the same grids and sentences as without, and one sentence for whatever becomes of a
 * process. */
#include "io/isolate.h"
#include "io/volume.h"
#include "io/volume_write.h"
#include "temp_dir.h"

#include <dirent.h>
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <time.h>
#include <cmocka.h>

static const VolumeRequest PLAIN = {0};

/* --- processes ------------------------------------------------------------------------------------ */

/* A child of a process, that has not ended, or 0. */
static pid_t child_of(pid_t parent)
{
    DIR *d = opendir("/proc");
    pid_t found = 0;
    for (struct dirent *e; d && (e = readdir(d)) != NULL;) {
        char path[300], state;
        int pid, up;
        snprintf(path, sizeof path, "/proc/%s/stat", e->d_name);
        FILE *f = e->d_name[0] >= '1' && e->d_name[0] <= '9' ? fopen(path, "r") : NULL;
        if (!f) continue;
        if (fscanf(f, "%d (%*[^)]) %c %d", &pid, &state, &up) == 3 && up == parent && state != 'Z') found = pid;
        fclose(f);
    }
    if (d) closedir(d);
    return found;
}

static pid_t the_reader(void) { return child_of(child_of(getpid())); }

static void pause_a_little(void) { nanosleep(&(struct timespec){.tv_nsec = 10 * 1000 * 1000}, NULL); }

static void start(IsolateLimits limits)
{
    Err err;
    assert_true(isolate_start(limits, &err));
}

/* Kills the process that has the open file, and waits until it is gone. */
static void kill_reader(int number)
{
    pid_t pid = the_reader();
    assert_true(pid > 0);
    kill(pid, number);
    while (number != SIGSTOP && the_reader() == pid) pause_a_little();
}

/* --- files ---------------------------------------------------------------------------------------- */

static const char *write_ball(const char *name)
{
    Grid g;
    Err err;
    float value[20 * 20 * 20];
    for (int i = 0; i < 8000; i++) value[i] = (float)sqrt(pow(i % 20 - 9.5, 2) + pow(i / 20 % 20 - 9.5, 2) + pow(i / 400 - 9.5, 2)) - 6;
    grid_init(&g, 1);
    grid_from_dense(&g, value, (int[3]){20, 20, 20});
    const char *path = temp_path(name);
    assert_true(volume_write(path, &g, &err));
    grid_free(&g);
    return path;
}

static void expect_read(const char *path)
{
    Volume v;
    Err err = {0};
    if (!volume_read(path, &PLAIN, &v, &err)) fail_msg("%s", err.text);
    assert_true(grid_at(&v.surface, 9, 9, 9, 0) < -5);
    volume_free(&v);
}

static void expect_failed(bool ok, const Err *err, ErrCode code, const char *path, const char *word)
{
    assert_false(ok);
    if (!strstr(err->text, word) || !strstr(err->text, path)) fail_msg("'%s' of %s is not in: %s", word, path, err->text);
    assert_int_equal(err->code, code);
}

/* What a read of a file that is open meets. */
static void expect_load_failed(VolumeFile *f, ErrCode code, const char *path, const char *word)
{
    Grid g;
    Err err = {0};
    grid_init(&g, 1);
    bool ok = volume_load(f, 0, &g, &err);
    expect_failed(ok, &err, code, path, word);
    grid_free(&g);
}

static bool is_same(const Grid *a, const Grid *b)
{
    if (a->nblock != b->nblock || a->ntile != b->ntile || memcmp(a->xform.m, b->xform.m, sizeof a->xform.m) != 0) return false;
    for (int k = 0; k < 3; k++)
        if (a->lo[k] != b->lo[k] || a->hi[k] != b->hi[k] || a->background[k] != b->background[k]) return false;
    return memcmp(a->origin, b->origin, (size_t)a->nblock * sizeof *a->origin) == 0 &&
           memcmp(a->value, b->value, (size_t)a->nblock * (size_t)a->ncomp * GRID_CELLS * sizeof(float)) == 0;
}

/* --- tests ---------------------------------------------------------------------------------------- */

static void grids_are_the_same(void **state)
{
    (void)state;
    const char *names[] = {"a.vdb", "a.npy", "a.exr"};
    for (int i = 0; i < 3; i++) {
        const char *path = write_ball(names[i]);
        Volume direct, isolated;
        Err err = {0};
        assert_true(volume_read(path, &PLAIN, &direct, &err));
        start(ISOLATE_LIMITS);
        if (!volume_read(path, &PLAIN, &isolated, &err)) fail_msg("%s", err.text);
        isolate_stop();
        assert_true(is_same(&direct.surface, &isolated.surface));
        assert_string_equal(direct.name, isolated.name);
        assert_int_equal(direct.kind, isolated.kind);
        volume_free(&direct);
        volume_free(&isolated);
    }
}

/* A request's own words come through: raw files are nothing without them. */
static void requests_are_handed_on(void **state)
{
    (void)state;
    const uint8_t bytes[24] = {0, 0, 0, 0, 7};
    const char *path = temp_write("a.raw", bytes, sizeof bytes), *const names[] = {"x", "y"};
    const VolumeRequest r = {.raw_dims = {4, 3, 2}, .raw_type = "u8", .raw_order = "zyx", .spacing = {2, 2, 2}, .origin = {1, 0, 0}, .has_origin = true};
    VolumeRequest more = r;
    Volume v;
    Err err = {0};
    more.nattribute = 2;
    more.attribute = names;
    start(ISOLATE_LIMITS);
    if (!volume_read(path, &r, &v, &err)) fail_msg("%s", err.text);
    assert_true(grid_at(&v.surface, 0, 2, 0, 0) == 7 && v.surface.xform.m[0][0] == 2 && v.surface.xform.t.x == 1);
    volume_free(&v);
    assert_false(volume_read(path, &more, &v, &err));
    assert_non_null(strstr(err.text, "--attribute"));
    isolate_stop();
}

static void refusals_are_the_same(void **state)
{
    (void)state;
    const char *good = write_ball("a.vdb"), *bad = temp_write("b.vdb", " BDV", 4);
    Volume v;
    Err direct = {0}, isolated = {0};
    assert_false(volume_read(bad, &PLAIN, &v, &direct));
    start(ISOLATE_LIMITS);
    for (int i = 0; i < 200; i++) { /* a process each */
        assert_false(volume_read(bad, &PLAIN, &v, &isolated));
        assert_string_equal(direct.text, isolated.text);
        assert_int_equal(direct.code, isolated.code);
        if (i % 50 == 0) expect_read(good);
    }
    isolate_stop();
}

static void a_death_costs_one_file(void **state)
{
    (void)state;
    static const struct {
        int signal;
        ErrCode code;
        const char *word;
    } deaths[] = {{SIGSEGV, ERR_INPUT, "signal 11"}, {SIGABRT, ERR_INPUT, "signal 6"}, {SIGKILL, ERR_RESOURCE, "killed"}};
    const char *path = write_ball("a.vdb");
    Err err = {0};
    start(ISOLATE_LIMITS);
    for (int i = 0; i < 3; i++) {
        VolumeFile *f = volume_open(path, &PLAIN, &err);
        assert_non_null(f);
        kill_reader(deaths[i].signal);
        expect_load_failed(f, deaths[i].code, path, deaths[i].word);
        volume_close(f);
        expect_read(path);
        kill_reader(deaths[i].signal); /* the one that waits for the next file */
        expect_read(path);
    }
    isolate_stop();
}

static void time_is_limited(void **state)
{
    (void)state;
    const char *path = write_ball("a.vdb");
    IsolateLimits limits = ISOLATE_LIMITS;
    Err err = {0};
    limits.seconds = 0.2;
    start(limits);
    VolumeFile *f = volume_open(path, &PLAIN, &err);
    assert_non_null(f);
    kill_reader(SIGSTOP);
    expect_load_failed(f, ERR_INPUT, path, "too long");
    volume_close(f);
    while (the_reader()) pause_a_little(); /* it was ended */
    expect_read(path);
    isolate_stop();
}

static void memory_is_limited(void **state)
{
    (void)state;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    skip(); /* there it is not */
#endif
    const char *small = write_ball("a.vdb"), *large = temp_path("b.npy");
    char head[128];
    FILE *out = fopen(large, "wb");
    memset(head, ' ', sizeof head);
    memcpy(head, "\x93NUMPY\1\0\x76\0", 10);
    int n = snprintf(head + 10, sizeof head - 10, "{'descr': '<f4', 'fortran_order': True, 'shape': (512, 512, 256), }");
    head[10 + n] = ' ';
    head[127] = '\n';
    fwrite(head, 1, sizeof head, out);
    fseek(out, 512 * 512 * 256 * 4 - 1, SEEK_CUR);
    fputc(0, out);
    fclose(out);
    IsolateLimits limits = {.memory = (int64_t)1 << 29, .seconds = 60};
    Volume v;
    Err err = {0};
    start(limits);
    expect_failed(volume_read(large, &PLAIN, &v, &err), &err, ERR_RESOURCE, large, "more memory");
    expect_read(small);
    isolate_stop();
}

static void several_files_may_be_open(void **state)
{
    (void)state;
    const char *path = write_ball("a.vdb");
    VolumeFile *f[3];
    Err err = {0};
    start(ISOLATE_LIMITS);
    for (int i = 0; i < 3; i++) assert_non_null(f[i] = volume_open(path, &PLAIN, &err));
    for (int i = 0; i < 3; i++) {
        Grid g;
        grid_init(&g, 1);
        if (!volume_load(f[i], 0, &g, &err)) fail_msg("%s", err.text);
        grid_free(&g);
        volume_close(f[i]);
    }
    isolate_stop();
    assert_int_equal(child_of(getpid()), 0);
}

static void a_lost_server_is_told_of(void **state)
{
    (void)state;
    const char *path = write_ball("a.vdb");
    Volume v;
    Err err = {0};
    start(ISOLATE_LIMITS);
    kill(child_of(getpid()), SIGKILL);
    while (child_of(getpid())) pause_a_little();
    assert_false(volume_read(path, &PLAIN, &v, &err));
    assert_int_equal(err.code, ERR_RESOURCE);
    isolate_stop();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(grids_are_the_same),     cmocka_unit_test(requests_are_handed_on),    cmocka_unit_test(refusals_are_the_same),
        cmocka_unit_test(a_death_costs_one_file), cmocka_unit_test(time_is_limited),           cmocka_unit_test(memory_is_limited),
        cmocka_unit_test(several_files_may_be_open), cmocka_unit_test(a_lost_server_is_told_of),
    };
    return cmocka_run_group_tests_name("isolate", tests, temp_open, temp_close);
}
