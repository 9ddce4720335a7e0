/* `jumplink filter` with models of kind mekf: the reference cases, lost
 * measurements, the spread, and a clear word about mistakes. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#include "jumplink/base.h"

#define GOLDEN TOP_DIR "/tests/golden/mekf/"

/* Of states by max(1, |x|), of variances by themselves; on the stress cases of
 * states by sigma (tests/golden/test_golden_mekf.c). */
#if JL_REAL_FLOAT
#define TOLERANCE 5e-4
#define STRESS 1
#define STRESS_VAR 0.02
#else
#define TOLERANCE 1e-10
#define STRESS 1e-8
#define STRESS_VAR 1e-10
#endif

static const char spring[] =
    "{ \"kind\": \"mekf\", \"model\": \"spring2\", \"name\": \"a spring\",\n"
    "  \"n\": 2, \"m\": 1, \"r\": 1, \"p1\": 1, \"p2\": 1, \"cb\": \"prev\",\n"
    "  \"params\": { \"T\": 0.1, \"d\": 0.2, \"C\": [[1, 0]] },\n"
    "  \"x0\": [1, 0], \"y0\": [4], \"P10\": [[0.04, 0], [0, 0.04]],\n"
    "  \"P0\": [[0.04, 0, 0], [0, 0.04, 0], [0, 0, 4]],\n"
    "  \"Q\": [[0.01, 0], [0, 1e-6]], \"R\": [[0.01]] }\n";

static const char lengths[] = "k,z0\n1,0.9\n2,0.7\n3,\n4,nan\n5,-0.2\n6,-0.3\n";

static const char *case_file(const char *name, const char *file)
{
    static char path[2][400];
    static int turn;

    turn = !turn;
    snprintf(path[turn], sizeof path[turn], GOLDEN "%s/%s", name, file);
    return path[turn];
}

static void filtered(struct table *t)
{
    check_good(&ran);
    table_take(t, ran.out);
}

/* --- numbers ------------------------------------------------------------- */

/* Columns of states stand before those of variances. */
static int states(const struct table *t)
{
    const char *P = strstr(t->header, ",P11");

    assert_non_null(P);
    return table_count(t->header, ',') - table_count(P, ',');
}

static double tolerance(int stress, int variance)
{
    return !stress ? TOLERANCE : variance ? STRESS_VAR : STRESS;
}

static void check_rows(const struct table *got, const struct table *want,
                       int stress)
{
    int count = states(want), k, i;

    assert_string_equal(got->header, want->header);
    assert_int_equal(got->rows, want->rows);
    for (k = 0; k < want->rows; k++)
        for (i = 1; i < want->columns; i++) {
            double w = table_at(want, k, i), unit = fmax(1, fabs(w));

            if (i > count)
                unit = w;
            else if (stress)
                unit = sqrt(table_at(want, k, count + i));
            assert_close(table_at(got, k, i) / unit, w / unit,
                         tolerance(stress, i > count));
        }
}

static void check_case(const char *name, const char *filter)
{
    int ekf = strcmp(filter, "ekf") == 0;
    char *text = program_file(case_file(name, ekf ? "expected_ekf.csv"
                                        : "expected.csv"));
    struct table got, want;

    table_take(&want, text);
    run_jumplink("filter", case_file(name, "model.json"),
                 case_file(name, "z.csv"), "--filter", filter);
    filtered(&got);
    check_rows(&got, &want, strncmp(name, "stress", 6) == 0);
    table_free(&got);
    table_free(&want);
    free(text);
}

static void test_filter_mekf_meets_reference(void **state)
{
    static const char *const names[] = {
        "ar1", "spring2", "spring2_const", "ct4pos", "ct4rdc_prev",
        "ct4rdc_pred", "gen32_prev", "gen32_filt", "stress32"
    };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof names / sizeof *names; i++)
        check_case(names[i], "mekf");
    for (i = 0; i < 8; i++)
        check_case(names[i], "ekf");
    if (!JL_REAL_FLOAT)
        check_case("stress32_ct4", "mekf");
}

/* Without --filter, by the kind; z0 or z1, cb and P10 or not: the same. */
static void test_filter_mekf_defaults(void **state)
{
    const char *data = scratch_write("z.csv", lengths);
    char *want;

    (void)state;
    run_jumplink("filter", scratch_write("m.json", spring), data,
                 "--filter", "mekf");
    check_good(&ran);
    want = strdup(ran.out);
    run_jumplink("filter", scratch_write("short.json",
        "{ \"kind\": \"mekf\", \"model\": \"spring2\", \"steps\": 6,\n"
        "  \"n\": 2, \"m\": 1, \"r\": 1, \"p1\": 1, \"p2\": 1,\n"
        "  \"params\": { \"T\": 0.1, \"d\": 0.2, \"C\": [[1, 0]] },\n"
        "  \"x0\": [1, 0], \"y0\": [4],\n"
        "  \"P0\": [[0.04, 0, 0], [0, 0.04, 0], [0, 0, 4]],\n"
        "  \"Q\": [[0.01, 0], [0, 1e-6]], \"R\": [[0.01]] }\n"),
        scratch_write("z1.csv", "k,z1\n1,0.9\n2,0.7\n3,\n4,\n5,-0.2\n6,-0.3\n"));
    check_good(&ran);
    check_same_text(ran.out, want);
    free(want);
}

/* A row without z moves xbar as f does at ybar, and its variance grows. */
static void test_filter_mekf_predicts_what_is_lost(void **state)
{
    const double small = JL_REAL_FLOAT ? 1e-5 : 1e-14;
    struct table t;
    int k;

    (void)state;
    run_jumplink("filter", scratch_write("m.json", spring),
                 scratch_write("z.csv", lengths));
    filtered(&t);
    assert_int_equal(t.rows, 6);
    assert_string_equal(t.header, "k,xbar1,xbar2,ybar1,xhat1,xhat2,P11,P22,"
                        "P33,P1_11,P1_22");
    for (k = 1; k < 3; k++) {
        double x = table_at(&t, k, 4), v = table_at(&t, k, 5);
        double y = table_at(&t, k, 3);

        assert_close(table_at(&t, k + 1, 3), y, 0);
        assert_close(table_at(&t, k + 1, 1), x + 0.1 * v, small);
        assert_close(table_at(&t, k + 1, 2), 0.98 * v - 0.1 * y * x, small);
        assert_close(table_at(&t, k + 1, 4), x + 0.1 * v, small);
        assert_close(table_at(&t, k + 1, 8), table_at(&t, k, 8) + 1e-6,
                     small);
        assert_true(table_at(&t, k + 1, 6) > table_at(&t, k, 6));
    }
    assert_true(table_at(&t, 4, 6) < table_at(&t, 3, 6));
    table_free(&t);
}

/* B's predicted covariance gains J P_yy J', J = [0, -T x1], and nothing else
 * changes in the first step: seen in a row without z. */
static void test_filter_mekf_spread(void **state)
{
    const char *model = scratch_write("m.json", spring);
    const char *data = scratch_write("z.csv", "k,z0\n1,\n2,0.7\n");
    struct table without, with;
    int i;

    (void)state;
    run_jumplink("filter", model, data);
    filtered(&without);
    run_jumplink("filter", model, data, "--spread");
    filtered(&with);
    for (i = 0; i < 10; i++)
        assert_close(table_at(&with, 0, i), table_at(&without, 0, i), 0);
    assert_close(table_at(&with, 0, 10) - table_at(&without, 0, 10),
                 0.01 * 1 * 4, JL_REAL_FLOAT ? 1e-6 : 1e-14);
    assert_true(fabs(table_at(&with, 1, 5) - table_at(&without, 1, 5)) > 1e-3);
    table_free(&with);
    table_free(&without);
}

/* Rows of a run of their own start anew. */
static void test_filter_mekf_runs(void **state)
{
    struct table t;
    int i;

    (void)state;
    run_jumplink("filter", scratch_write("m.json", spring),
                 scratch_write("r.csv", "run,k,z0\n1,1,0.9\n1,2,0.7\n"
                                        "2,1,0.9\n2,2,0.7\n"));
    filtered(&t);
    for (i = 2; i < t.columns; i++) {
        assert_close(table_at(&t, 2, i), table_at(&t, 0, i), 0);
        assert_close(table_at(&t, 3, i), table_at(&t, 1, i), 0);
    }
    table_free(&t);
}

/* --- mistakes ------------------------------------------------------------ */

/* The model with the first `old` replaced. */
static const char *edited(const char *old, const char *new)
{
    const char *at = strstr(spring, old), *path;
    char *text;

    assert_non_null(at);
    assert_true(asprintf(&text, "%.*s%s%s", (int)(at - spring), spring, new,
                         at + strlen(old)) > 0);
    path = scratch_write("edited.json", text);
    free(text);
    return path;
}

static void test_filter_mekf_bad_models(void **state)
{
    static const char *const edits[][3] = {
        { "\"model\": \"spring2\", ", "", "edited.json: model: missing" },
        { "spring2", "spring3", "model: 'spring3' is not ar1, spring2, ct4" },
        { "\"n\": 2", "\"n\": 3", "n: 3, but this model has 2" },
        { "\"m\": 1", "\"m\": 0", "m: 0, but this model has 1" },
        { "\"r\": 1", "\"r\": 5", "r: must be a whole number from 1 to 4" },
        { "\"r\": 1", "\"r\": 2", "params.C: must have 2 rows, has 1" },
        { "\"p1\": 1", "\"p1\": 2", "p1: 2, but this model has 1" },
        { "\"p2\": 1, ", "", "p2: missing" },
        { "\"cb\": \"prev\"", "\"cb\": \"next\"", "cb: 'next' is not prev" },
        { "\"cb\": \"prev\"", "\"cb\": 1", "cb: must be a text" },
        { "\"cb\": \"prev\"", "\"steps\": -1", "steps: must be a whole" },
        { "\"cb\"", "\"cd\"", "cd: unknown key" },
        { "\"cb\": \"prev\"", "\"modes\": []", "modes: unknown key" },
        { "{ \"T\": 0.1, \"d\": 0.2, \"C\": [[1, 0]] }", "[0.1]",
          "params: must be an object, is an array" },
        { "\"params\"", "\"note\": \"\", \"name2\"", "name2: unknown key" },
        { "\"T\": 0.1", "\"T\": 0", "params.T: 0: must be above 0" },
        { "\"d\": 0.2, ", "", "params.d: missing" },
        { "\"d\": 0.2", "\"D\": 0.2", "params.D: unknown key" },
        { "\"d\": 0.2", "\"d\": \"0.2\"", "params.d: must be a number" },
        { "[[1, 0]] }", "[[1]] }", "params.C[0]: must have 2 numbers" },
        { "\"x0\": [1, 0]", "\"x0\": [1]", "x0: must have 2 numbers" },
        { "\"x0\": [1, 0], ", "", "x0: missing" },
        { "\"y0\": [4]", "\"y0\": 4", "y0: must be an array of 1 numbers" },
        { "[0, 0, 4]]", "[0, 1, 4]]", "P0[1][2]: 0, but [2][1] is 1" },
        { "[0, 0, 4]]", "[0, 0, -4]]", "P0: not positive semidefinite" },
        { "\"P10\": [[0.04, 0]", "\"P10\": [[-1, 0]", "P10: not positive" },
        { "\"Q\": [[0.01, 0]", "\"Q\": [[-0.01, 0]", "Q: not positive" },
        { "\"Q\": [[0.01, 0], [0, 1e-6]]", "\"Q\": [[1]]", "Q: must have 2" },
        { "\"R\": [[0.01]]", "\"R\": [[-0.01]]", "R: not positive" },
        { "\"R\": [[0.01]]", "\"R\": [[1e400]]", "edited.json:6: |not JSON" },
        { ", \"R\": [[0.01]]", "", "R: missing" },
    };
    const char *data = scratch_write("z.csv", lengths);
    size_t i;

    (void)state;
    for (i = 0; i < sizeof edits / sizeof *edits; i++) {
        run_jumplink("filter", edited(edits[i][0], edits[i][1]), data);
        check_refused(&ran, 2, edits[i][2]);
    }
}

static void test_filter_mekf_refuses_what_it_cannot(void **state)
{
    static const char *const told[][3] = {
        { "--filter", "imm", "--filter imm is not for kind mekf" },
        { "--filter", "cgimm", "--filter cgimm is not for kind mekf" },
        { "--filter", "kf", "--filter kf is not for kind mekf" },
        { "--form", "sqrt", "--form is not for kind mekf|m.json" },
        { "--gate", "0.99", "--gate is not for kind mekf" },
        { "--mode", "0", "--mode is not for kind mekf" },
        { "--port", "loop", "m.json is of kind mekf|one processor" },
        { "--pes", "2", "m.json is of kind mekf|one processor" },
        { "--spread", "--filter=ekf", "--spread is not for --filter ekf" },
    };
    const char *model = scratch_write("m.json", spring);
    const char *data = scratch_write("z.csv", lengths);
    const char *imm = TOP_DIR "/sim/data/two_modes.json";
    size_t i;

    (void)state;
    for (i = 0; i < sizeof told / sizeof *told; i++) {
        run_jumplink("filter", model, data, told[i][0], told[i][1]);
        check_refused(&ran, 2, told[i][2]);
    }
    run_jumplink("filter", model, data, "--diagnostics");
    check_refused(&ran, 2, "--diagnostics is not for kind mekf");
    run_jumplink("filter", imm, data, "--filter", "mekf");
    check_refused(&ran, 2, "--filter mekf needs a model of kind mekf|two_mode");
    run_jumplink("filter", imm, data, "--filter", "ekf");
    check_refused(&ran, 2, "--filter ekf needs a model of kind mekf");
    run_jumplink("filter", imm, data, "--spread");
    check_refused(&ran, 2, "--spread needs a model of kind mekf");
    run_jumplink("sim", "--model", model);
    check_refused(&ran, 2, "m.json is of kind mekf|jumplink filter");
}

static void test_filter_mekf_bad_data(void **state)
{
    const char *model = scratch_write("m.json", spring);

    (void)state;
    run_jumplink("filter", model, scratch_write("two.csv", "k,z0,z1\n1,2,3\n"));
    check_refused(&ran, 2, "two.csv:1:|has 2 measurements a row|needs 1");
    run_jumplink("filter", model, scratch_write("word.csv",
                                                "k,z0\n1,2\n2,x\n"));
    check_refused(&ran, 2, "word.csv:3:|z0");
    run_jumplink("filter", model, scratch_write("huge.csv", JL_REAL_FLOAT
        ? "k,z0\n1,2\n2,1e30\n" : "k,z0\n1,2\n2,1e200\n"));
    check_ended(&ran, "huge.csv:3: the step fails");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_filter_mekf_meets_reference),
        cmocka_unit_test(test_filter_mekf_defaults),
        cmocka_unit_test(test_filter_mekf_predicts_what_is_lost),
        cmocka_unit_test(test_filter_mekf_spread),
        cmocka_unit_test(test_filter_mekf_runs),
        cmocka_unit_test(test_filter_mekf_bad_models),
        cmocka_unit_test(test_filter_mekf_refuses_what_it_cannot),
        cmocka_unit_test(test_filter_mekf_bad_data),
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
