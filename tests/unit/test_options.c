/* The table of options and its parser: values, mistakes, and defaults that are the method's own. */
#include "cli/job.h"
#include "cli/options.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

/* Arguments as one text, blanks between. */
static bool parse(Options *o, const char *line, Err *err)
{
    static char text[400];
    static char *argv[40];
    int argc = 0;
    snprintf(text, sizeof text, "%s", line);
    for (char *word = strtok(text, " "); word; word = strtok(NULL, " ")) argv[argc++] = word;
    return options_parse(o, argc, argv, err);
}

static void expect_mistake(const char *line, const char *part)
{
    Options o;
    Err err;
    assert_false(parse(&o, line, &err));
    assert_int_equal(err.code, ERR_USAGE);
    if (!strstr(err.text, part)) fail_msg("no '%s' in '%s'", part, err.text);
    options_free(&o);
}

static void test_forms(void **state)
{
    (void)state;
    Options o;
    Err err;
    assert_true(parse(&o, "a.vdb --angle 30 -o out --edge=0.25 -qv b.vdb -- --angle", &err));
    assert_int_equal(o.noperand, 3);
    assert_string_equal(o.operand[0], "a.vdb");
    assert_string_equal(o.operand[2], "--angle");
    assert_true(option_real(&o, OPT_ANGLE) == 30);
    assert_string_equal(option_text(&o, OPT_OUTPUT), "out");
    assert_true(option_real(&o, OPT_EDGE) == 0.25);
    assert_false(o.value[OPT_EDGE].in_voxels);
    assert_true(option_given(&o, OPT_QUIET) && option_given(&o, OPT_VERBOSE));
    assert_false(option_given(&o, OPT_PASSES));
    options_free(&o);

    assert_true(parse(&o, "-oname - --iso -0.5", &err));
    assert_string_equal(option_text(&o, OPT_OUTPUT), "name");
    assert_string_equal(o.operand[0], "-");
    assert_true(option_real(&o, OPT_ISO) == -0.5);
    options_free(&o);
}

static void test_kinds(void **state)
{
    (void)state;
    Options o;
    Err err;
    assert_true(parse(&o, "--edge 2.5v --format ply,gltf --dims 3,4,5 --spacing 0.5 --inside below", &err));
    assert_true(o.value[OPT_EDGE].in_voxels && option_real(&o, OPT_EDGE) == 2.5);
    assert_int_equal(o.value[OPT_FORMAT].set, FORMAT_PLY | FORMAT_GLTF);
    for (int i = 0; i < 3; i++) {
        assert_true(o.value[OPT_DIMS].real[i] == 3 + i);
        assert_true(o.value[OPT_SPACING].real[i] == 0.5);
    }
    assert_int_equal(option_choice(&o, OPT_INSIDE), 1);
    options_free(&o);
}

static void test_mistakes(void **state)
{
    (void)state;
    expect_mistake("--angle 180.5", "0 to 180");
    expect_mistake("--angle x", "--angle x");
    expect_mistake("--angle nan", "--angle nan");
    expect_mistake("--angle 3deg", "3deg");
    expect_mistake("--passes 2.5", "whole number");
    expect_mistake("--dims 1,2", "three whole numbers");
    expect_mistake("--dims 1,2,3,4", "three whole numbers");
    expect_mistake("--dims 1,2,", "three whole numbers");
    expect_mistake("--edge 1w", "voxels with v");
    expect_mistake("--format ply,,glb", "some of");
    expect_mistake("--topology sharp", "exact, papers or none");
    expect_mistake("--output=", "empty");
    expect_mistake("--angle", "missing");
    expect_mistake("--print=1", "takes no value");
    expect_mistake("--angl 3", "no such option");
    expect_mistake("--interpolation cubic", "not in this version");
}

/* Every default in the table reads as a value of its option, and no name or letter comes twice. */
static void test_table(void **state)
{
    (void)state;
    for (int i = 0; i < OPTION_COUNT; i++) {
        const OptionSpec *a = &option_table[i];
        char line[100];
        Options o;
        Err err;
        if (a->fallback) {
            snprintf(line, sizeof line, "--%s %s", a->name, a->fallback);
            assert_true(parse(&o, line, &err));
            options_free(&o);
        }
        for (int j = 0; j < i; j++) {
            assert_string_not_equal(a->name, option_table[j].name);
            assert_true(!a->letter || a->letter != option_table[j].letter);
        }
    }
}

static void test_defaults_are_the_methods(void **state)
{
    (void)state;
    Options o;
    Err err;
    TrackSettings d = track_defaults();
    assert_true(parse(&o, "", &err));
    assert_true(option_real(&o, OPT_EDGE) == d.edge);
    assert_true(o.value[OPT_EDGE].in_voxels == d.edge_in_voxels);
    assert_true(option_real(&o, OPT_ANGLE) == d.angle_deg);
    assert_true(option_real(&o, OPT_PASSES) == d.passes);
    assert_true(option_real(&o, OPT_DEVIATION) == d.deviation_vox);
    assert_true(option_real(&o, OPT_MIN_ASPECT) == d.min_aspect);
    assert_int_equal(option_choice(&o, OPT_REFINE_BY), d.refine_by);
    assert_int_equal(option_choice(&o, OPT_REFINE_SCHEME), d.refine_scheme);
    assert_true(option_real(&o, OPT_RELAX_STEPS) == d.relax_steps);
    assert_true(option_real(&o, OPT_E_MIN) == d.e_min);
    assert_true(option_real(&o, OPT_E_MAX) == d.e_max);
    assert_true(option_real(&o, OPT_EPS_E) == d.eps_e);
    assert_true(option_real(&o, OPT_YOUNG) == d.mech.young);
    assert_true(option_real(&o, OPT_POISSON) == d.mech.poisson);
    assert_true(option_real(&o, OPT_DT) == d.mech.dt);
    assert_true(option_real(&o, OPT_FPS) == d.fps);
    assert_int_equal(option_choice(&o, OPT_TOPOLOGY) == 0, d.topology == TOPOLOGY_EXACT);
    assert_int_equal(option_choice(&o, OPT_MECHANICS) == 0, d.mech.kind == MECHANICS_FEM);
    options_free(&o);
}

static void test_job(void **state)
{
    (void)state;
    Options o;
    Err err;
    MeshJob job;
    assert_true(parse(&o, "a.vdb -o p --cg-iterations 10 --iso 0.5 --inside above --mechanics spring --border open --refine-by hessian --refine-scheme red-green --min-aspect 0.5", &err));
    assert_true(job_make(&job, &o, &err));
    assert_int_equal(job.track.mech.cg_iterations, 10);
    assert_true(job.track.mech.cg_tolerance == 0);
    assert_true(job.iso == 0.5 && job.inside == 1 && job.open_border);
    assert_int_equal(job.track.mech.kind, MECHANICS_SPRING);
    assert_int_equal(job.velocity_units, VELOCITY_BY_GRID);
    assert_int_equal(job.track.refine_by, REFINE_BY_HESSIAN);
    assert_int_equal(job.track.refine_scheme, REFINE_SCHEME_RED_GREEN);
    assert_true(job.track.min_aspect == 0.5);
    options_free(&o);

    assert_true(parse(&o, "a.vdb -o p --max-memory 1.5G --frames 1-2 --follow", &err));
    assert_true(job_make(&job, &o, &err));
    assert_true(job.max_memory == (uint64_t)3 << 29 && job.follow);
    options_free(&o);
    static const char *const wrong[] = {"a.vdb -o p --max-memory 8x", "a.vdb -o p --max-memory 5M", "a.vdb -o p --follow"};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        assert_true(parse(&o, wrong[i], &err));
        assert_false(job_make(&job, &o, &err));
        assert_int_equal(err.code, ERR_USAGE);
        options_free(&o);
    }

    assert_true(parse(&o, "a.vdb", &err));
    assert_false(job_make(&job, &o, &err));
    assert_non_null(strstr(err.text, "-o PREFIX"));
    options_free(&o);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_forms),
        cmocka_unit_test(test_kinds),
        cmocka_unit_test(test_mistakes),
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_defaults_are_the_methods),
        cmocka_unit_test(test_job),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
