/* `jumplink filter` with models of kind cgimm: the reference cases, lost
 * measurements, gains that follow from Q, and a clear word about mistakes. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#include "jumplink/base.h"

#define GOLDEN TOP_DIR "/tests/golden/cgimm/"

/* x in sqrt(R), mu, loglik. */
#if JL_REAL_FLOAT
#define TOLERANCE 2e-3
#else
#define TOLERANCE 1e-11
#endif

/* Two axes, and gains by Q. */
static const char designed[] =
    "{ \"kind\": \"cgimm\", \"axes\": 2, \"T\": 0.5, \"R\": 2500,\n"
    "  \"Q\": [49, 1500], \"Pi\": [[0.97, 0.03], [0.08, 0.92]],\n"
    "  \"mu0\": [0.7, 0.3], \"modes\": [\n"
    "  { \"order\": 2, \"x0\": [1, 2, 0, -3, 4, 0] },\n"
    "  { \"order\": 3, \"x0\": [1, 2, 3, -3, 4, 1], \"name\": \"CA\" } ] }\n";

static const char positions[] =
    "k,z0,z1\n1,2,3\n2,40,-8\n3,,\n4,nan,nan\n5,35,1\n6,60,20\n";

/* The estimates, of `columns` columns. */
static void filtered(struct table *t, const char *model, const char *data,
                     int columns)
{
    run_jumplink("filter", model, data);
    check_good(&ran);
    table_take(t, ran.out);
    assert_int_equal(t->columns, columns);
}

/* --- numbers ------------------------------------------------------------- */

static void check_case(const char *name, double sigma)
{
    char model[400], data[400], expected[400], *text;
    struct table got, want;
    int k, i;

    snprintf(model, sizeof model, GOLDEN "%s/model.json", name);
    snprintf(data, sizeof data, GOLDEN "%s/z.csv", name);
    snprintf(expected, sizeof expected, GOLDEN "%s/expected.csv", name);
    text = program_file(expected);
    table_take(&want, text);
    filtered(&got, model, data, 1 + 3 + 2 + 1);
    assert_string_equal(got.header, want.header);
    assert_int_equal(got.rows, want.rows);
    for (k = 0; k < want.rows; k++)
        for (i = 0; i < want.columns; i++) {
            double unit = i >= 1 && i <= 3 ? sigma : 1;

            assert_close(table_at(&got, k, i) / unit,
                         table_at(&want, k, i) / unit, TOLERANCE);
        }
    table_free(&got);
    table_free(&want);
    free(text);
}

static void test_filter_cgimm_meets_reference(void **state)
{
    (void)state;
    check_case("cg_paper", 100);
    check_case("cg_steady", 50);
}

static double probability(const struct table *t, int row, int mode)
{
    return table_at(t, row, 1 + 6 + mode);
}

/* Row k + 1 is row k moved on: mu by Pi, positions by what velocities and
 * accelerations, of modes that are mixed, are together. */
static void check_predicted(const struct table *t, int k)
{
    static const double Pi[2][2] = { { 0.97, 0.03 }, { 0.08, 0.92 } };
    const double T = 0.5, small = JL_REAL_FLOAT ? 1e-4 : 1e-12;
    int a;

    for (a = 0; a < 2; a++) {
        int p = 1 + 3 * a;
        double from_p = table_at(t, k, p), from_v = table_at(t, k, p + 1);
        double v = table_at(t, k + 1, p + 1);

        assert_close(probability(t, k + 1, a),
                     probability(t, k, 0) * Pi[0][a]
                         + probability(t, k, 1) * Pi[1][a], small);
        assert_close(table_at(t, k + 1, p), from_p + T * (from_v + v) / 2,
                     100 * small);
    }
    assert_close(table_at(t, k + 1, t->columns - 1), 0, 0);
}

static void test_filter_cgimm_predicts_what_is_lost(void **state)
{
    const char *model = scratch_write("designed.json", designed);
    struct table t;

    (void)state;
    filtered(&t, model, scratch_write("z.csv", positions), 1 + 6 + 2 + 1);
    assert_int_equal(t.rows, 6);
    assert_string_equal(t.header, "k,x0,x1,x2,x3,x4,x5,mu0,mu1,loglik");
    check_predicted(&t, 1);
    check_predicted(&t, 2);
    assert_true(table_at(&t, 4, t.columns - 1) < 0);
    table_free(&t);
}

/* What does not arrive by column or repetition is as what is not there. */
static void test_filter_cgimm_holds(void **state)
{
    const char *model = scratch_write("designed.json", designed);
    struct table want, got;

    (void)state;
    filtered(&want, model, scratch_write("a.csv", "k,z0,z1\n1,2,3\n2,,\n"
                                         "3,4,5\n"), 10);
    filtered(&got, model, scratch_write("b.csv", "k,arrived,z0,z1\n1,1,2,3\n"
                                        "2,0,9,9\n3,1,4,5\n"), 10);
    assert_same_bits(want.v, got.v, sizeof *got.v * 30);
    table_free(&got);
    run_jumplink("filter", model, scratch_write("c.csv", "k,z0,z1\n1,2,3\n"
                                                "2,2,3\n3,4,5\n"),
                 "--hold", "detect", "--filter", "cgimm");
    check_good(&ran);
    table_take(&got, ran.out);
    assert_same_bits(want.v, got.v, sizeof *got.v * 30);
    table_free(&got);
    table_free(&want);
}

/* A model in which the first `old` is replaced; good as scratch_path's. */
static const char *edited(const char *old, const char *new)
{
    const char *at = strstr(designed, old), *path;
    char *text;

    assert_non_null(at);
    assert_true(asprintf(&text, "%.*s%s%s", (int)(at - designed), designed,
                         new, at + strlen(old)) > 0);
    path = scratch_write("edited.json", text);
    free(text);
    return path;
}

/* A path that goes to and fro. */
static const char *long_path(int rows)
{
    static char text[20000];
    int k, used = sprintf(text, "k,z0,z1\n");

    for (k = 0; k < rows; k++)
        used += sprintf(text + used, "%d,%d,%d\n", k, k * k % 71 * 5,
                        k * 31 % 97 - k);
    return scratch_write("long.csv", text);
}

/* T, Q, R are those of cg_steady, whose steady gains were found apart from
 * ours: after the transient there is no difference. */
static void test_filter_cgimm_designs_gains(void **state)
{
    enum { ROWS = 300 };
    const char *data = long_path(ROWS);
    char *model, *both;
    struct table want, got;
    int i;

    (void)state;
    model = strdup(edited("\"order\": 2,", "\"w0\": [1, 1], \"kc\": [0, 0, 0],"
                          "\"winf\": [0.23232022357377036, "
                          "0.03066606799252444, 0],"));
    both = program_file(model);
    free(model);
    model = strstr(both, "\"order\": 3,");
    assert_non_null(model);
    *model = '\0';
    assert_true(asprintf(&model, "%s \"w0\": [1, 1, 1], \"kc\": [0, 0, 0],"
                         "\"winf\": [0.6855463088594109, 0.3858605574802723, "
                         "0.10859103746521669], %s", both,
                         model + strlen("\"order\": 3,")) > 0);
    filtered(&want, scratch_write("given.json", model), data, 10);
    filtered(&got, scratch_write("designed.json", designed), data, 10);
    assert_true(fabs(got.v[10 + 1] - want.v[10 + 1]) > 1e-3);
    for (i = (ROWS - 1) * 10; i < ROWS * 10; i++)
        assert_close(got.v[i], want.v[i], JL_REAL_FLOAT ? 1e-2 : 1e-10);
    table_free(&got);
    table_free(&want);
    free(model);
    free(both);
}

/* Rows of a run of their own start anew, gains too. */
static void test_filter_cgimm_runs(void **state)
{
    const char *model = scratch_write("designed.json", designed);
    struct table t;
    int i;

    (void)state;
    filtered(&t, model, scratch_write("r.csv", "run,k,z0,z1\n1,1,2,3\n1,2,4,9\n"
                                      "2,1,2,3\n2,2,4,9\n"), 11);
    for (i = 2; i < t.columns; i++) {
        assert_close(table_at(&t, 2, i), table_at(&t, 0, i), 0);
        assert_close(table_at(&t, 3, i), table_at(&t, 1, i), 0);
    }
    table_free(&t);
}

/* --- mistakes ------------------------------------------------------------ */

static void test_filter_cgimm_bad_models(void **state)
{
    static const char *const edits[][3] = {
        { "\"T\": 0.5", "\"T\": 0", "edited.json|T: 0: must be above 0" },
        { "\"T\": 0.5, ", "", "T: missing" },
        { "\"R\": 2500", "\"R\": -1", "R: -1: must be above 0" },
        { "\"R\": 2500", "\"R\": 1e-320", "edited.json" },
        { "\"Q\": [49, 1500]", "\"Q\": [49]", "Q: must have 2 numbers" },
        { "\"Q\": [49, 1500]", "\"Q\": [49, 0]", "Q[1]: 0: T^2 sqrt(Q / R)" },
        { "  \"Q\": [49, 1500],", "", "Q: missing" },
        { "0.97", "0.98", "Pi[0]: sums to" },
        { "0.7,", "0.8,", "mu0: sums to" },
        { "\"mu0\": [0.7, 0.3], ", "", "mu0: missing" },
        { "\"axes\": 2", "\"axes\": 0", "axes: must be a whole number" },
        { "\"axes\": 2", "\"axes\": 2, \"m\": 1", "m: 1, but there are 2" },
        { "\"axes\": 2", "\"axes\": 2, \"n\": 4", "n: 4, but axes and orders" },
        { "\"axes\": 2", "\"axles\": 2", "axles: unknown key" },
        { "\"order\": 2,", "", "modes[0].order: missing" },
        { "\"order\": 2", "\"order\": 4", "modes[0].order: must be a whole" },
        { "-3, 4, 0]", "-3, 4]", "modes[0].x0: must have 6 numbers" },
        { "\"x0\": [1, 2, 0, -3, 4, 0]", "\"note\": \"\"",
          "modes[1].x0: not in modes[0]" },
        { "\"x0\": [1, 2, 3, -3, 4, 1], ", "",
          "modes[1].x0: missing, but in modes[0]" },
        { "-3, 4, 0]", "-3, 4, 5]", "modes[0].x0[5]: 5, but a mode of order" },
        { "\"name\"", "\"P0\": [], \"name\"", "modes[1].P0: unknown key" },
        { "\"name\"", "\"w0\": [1, 1, 1], \"name\"", "modes[1].winf: missing" },
        { "\"name\"", "\"w0\": [1, 1, 1], \"winf\": [1.1, 1, 1], "
          "\"kc\": [1, 1, 1], \"name\"", "modes[1].winf: gains of no stable" },
        { "\"name\"", "\"w0\": [1, 1, 1], \"winf\": [0.5, 3.1, 0.1], "
          "\"kc\": [1, 1, 1], \"name\"", "modes[1].winf: gains of no stable" },
        { "\"name\"", "\"w0\": [1.5, 1, 1], \"winf\": [0.5, 0.2, 0.1], "
          "\"kc\": [1, 1, 1], \"name\"", "modes[1].w0[0]: 1.5: alpha" },
        { "\"name\"", "\"w0\": [1, 1, 1], \"winf\": [0.5, 0.2, 0.1], "
          "\"kc\": [1, -1, 1], \"name\"", "modes[1].kc[1]: -1: must not" },
        { "\"order\": 2,", "\"order\": 2, \"w0\": [1, 1, 1], \"winf\": "
          "[0.5, 0.2, 0], \"kc\": [1, 1, 1],", "modes[0].w0[2]: 1, but the" },
        { "\"name\"", "\"Phi\": [[1, 1, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], "
          "[0, 0, 0, 0, 0, 0], [0, 0, 0, 1, 1, 0], [0, 0, 0, 0, 1, 0], "
          "[0, 0, 0, 0, 0, 0]], \"name\"", "modes[1].Phi[0][1]: 1, but with" },
    };
    const char *data = scratch_write("z.csv", positions);
    size_t i;

    (void)state;
    for (i = 0; i < sizeof edits / sizeof *edits; i++) {
        if (JL_REAL_FLOAT && strstr(edits[i][1], "1e-320") != NULL)
            continue;                   /* is 0 there: another line */
        run_jumplink("filter", edited(edits[i][0], edits[i][1]), data);
        check_refused(&ran, 2, edits[i][2]);
    }
}

static void test_filter_cgimm_refuses_what_it_cannot(void **state)
{
    const char *model = scratch_write("designed.json", designed);
    const char *data = scratch_write("z.csv", positions);

    (void)state;
    run_jumplink("filter", model, data, "--filter", "imm");
    check_refused(&ran, 2, "--filter imm needs covariances|designed.json");
    run_jumplink("filter", model, data, "--filter", "kf", "--mode", "0");
    check_refused(&ran, 2, "--filter kf needs covariances");
    run_jumplink("filter", model, data, "--form", "sqrt");
    check_refused(&ran, 2, "--form needs covariances");
    run_jumplink("filter", model, data, "--gate", "0.99");
    check_refused(&ran, 2, "--gate needs covariances");
    run_jumplink("filter", model, data, "--diagnostics");
    check_refused(&ran, 2, "--diagnostics needs covariances");
    run_jumplink("filter", model, data, "--mode", "0");
    check_refused(&ran, 2, "--mode goes with --filter kf");
    run_jumplink("filter", TOP_DIR "/sim/data/two_modes.json", data,
                 "--filter", "cgimm");
    check_refused(&ran, 2, "two_modes.json|of kind imm");
}

static void test_filter_cgimm_bad_data(void **state)
{
    const char *model = scratch_write("designed.json", designed);

    (void)state;
    run_jumplink("filter", model, scratch_write("one.csv", "k,z0\n1,2\n"));
    check_refused(&ran, 2, "one.csv:1:|needs 2");
    run_jumplink("filter", model, scratch_write("word.csv", "k,z0,z1\n"
                                                "1,2,3\n2,x,3\n"));
    check_refused(&ran, 2, "word.csv:3:|z0");
    run_jumplink("filter", model, scratch_write("huge.csv", JL_REAL_FLOAT
        ? "k,z0,z1\n1,2,3\n2,1e30,3\n" : "k,z0,z1\n1,2,3\n2,1e200,3\n"));
    check_ended(&ran, "huge.csv:3: the step fails");
}

/* One row in twelve: mode 1's errors grow; on PEs as in one process. */
static void test_filter_cgimm_diverges(void **state)
{
    enum { ROWS = 6000 };
    static char text[16 * ROWS];
    const char *model = scratch_write("designed.json", designed), *data;
    int k, used = sprintf(text, "k,z0,z1\n");
    char *serial;

    (void)state;
    for (k = 0; k < ROWS; k++)
        used += sprintf(text + used, k % 12 == 0 ? "%d,5,7\n" : "%d,,\n", k);
    data = scratch_write("sparse.csv", text);
    run_jumplink("filter", model, data);
    check_ended(&ran, "the step fails: number not finite");
    assert_null(strstr(ran.out, "nan"));
    serial = strdup(ran.out);
    run_jumplink("filter", model, data, "--pes", "2", "--port", "threads");
    check_ended(&ran, "the step fails: number not finite");
    check_same_text(serial, ran.out);
    free(serial);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_filter_cgimm_meets_reference),
        cmocka_unit_test(test_filter_cgimm_predicts_what_is_lost),
        cmocka_unit_test(test_filter_cgimm_holds),
        cmocka_unit_test(test_filter_cgimm_designs_gains),
        cmocka_unit_test(test_filter_cgimm_runs),
        cmocka_unit_test(test_filter_cgimm_bad_models),
        cmocka_unit_test(test_filter_cgimm_refuses_what_it_cannot),
        cmocka_unit_test(test_filter_cgimm_bad_data),
        cmocka_unit_test(test_filter_cgimm_diverges),
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
