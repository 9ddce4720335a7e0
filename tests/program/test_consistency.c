/* `--diagnostics` and `--truth`: what the columns say, and that nees and nis of
 * a filter whose model is right are what theory says, and else are not. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#include "jumplink/base.h"

#define GOLDEN TOP_DIR "/tests/golden/imm/"
#define DATA TOP_DIR "/sim/data/"
#define TWO DATA "two_modes.json"
#define FLIGHT "--z", "east_m,north_m"

static char *said(int speaks)
{
    char *out = ran.out;

    if (!speaks)
        check_good(&ran);
    assert_int_equal(ran.status, 0);
    ran.out = NULL;
    return out;
}

#define filtered(...) (run_jumplink("filter", __VA_ARGS__), said(0))
#define gated(...) (run_jumplink("filter", __VA_ARGS__), said(1))

static int column_of(const struct table *t, const char *name)
{
    char *names = strdup(t->header), *rest = names, *found;
    int i = 0;

    while ((found = strsep(&rest, ",")) != NULL && strcmp(found, name) != 0)
        i++;
    if (found == NULL) {
        print_error("no column %s in %s\n", name, t->header);
        fail();
    }
    free(names);
    return i;
}

static double at(const struct table *t, int row, const char *name)
{
    return table_at(t, row, column_of(t, name));
}

/* --- columns ------------------------------------------------------------- */

/* The other columns stay as they are. */
static void check_more_columns(const char *plain, const char *more,
                               const char *names)
{
    size_t length = strcspn(plain, "\n"), longer = strlen(names);

    assert_int_equal(strncmp(more + length, names, longer), 0);
    assert_int_equal(more[length + longer], '\n');
    while (*plain != '\0') {
        length = strcspn(plain, "\n");
        assert_int_equal(strncmp(plain, more, length), 0);
        assert_int_equal(more[length], ',');
        plain += length + 1;
        more += strcspn(more, "\n") + 1;
    }
    assert_string_equal(more, "");
}

static void test_diagnostics_are_more_columns(void **state)
{
    const char *data = program_head("flight.csv", DATA "sightseeing_1hz.csv",
                                    301);
    char *plain = filtered(TWO, data, FLIGHT);
    char *more = filtered(TWO, data, FLIGHT, "--diagnostics");
    char *most = filtered(TWO, data, FLIGHT, "--diagnostics", "--truth",
                          "-,v_east_mps,-,v_north_mps");

    (void)state;
    check_more_columns(plain, more, ",nu0_0,nu0_1,nis0,nis_mean0,nu1_0,nu1_1,"
                       "nis1,nis_mean1,rejected");
    check_more_columns(more, most, ",nees");
    free(plain);
    free(more);
    free(most);
}

/* A random walk with x0 = 0, P0 = 1, Q = R = 1: by hand. */
static const char walk[] = "{ \"kind\": \"imm\", \"n\": 1, \"m\": 1,"
    " \"Pi\": [[1]], \"mu0\": [1], \"x0\": [0], \"P0\": [[1]],"
    " \"modes\": [ {\"Phi\": [[1]], \"Gamma\": [[1]], \"Q\": [[1]],"
    " \"H\": [[1]], \"R\": [[1]]} ] }";

static void test_diagnostics_by_hand(void **state)
{
    const char *model = scratch_write("walk.json", walk);
    char *text = gated(model, scratch_write("walk.csv",
        "k,z0,x\n" "1,3,1\n" "2,,\n" "3,100,2\n" "4,-1,nan\n"),
        "--diagnostics", "--truth", "x", "--gate", "0.999");
    struct table t;

    (void)state;
    table_take(&t, text);
    assert_int_equal(t.rows, 4);
    /* S = 3, x = 2, P = 2/3 */
    assert_close(at(&t, 0, "nu0_0"), 3, 0);
    assert_close(at(&t, 0, "nis0"), 3, 1e-5);
    assert_close(at(&t, 0, "nis_mean0"), 3, 1e-5);
    assert_close(at(&t, 0, "rejected"), 0, 0);
    assert_close(at(&t, 0, "nees"), 1.5, 1e-5);
    /* nothing measured: P = 5/3, and no truth */
    assert_true(isnan(at(&t, 1, "nu0_0")) && isnan(at(&t, 1, "nis0")));
    assert_close(at(&t, 1, "nis_mean0"), 3, 1e-5);
    assert_close(at(&t, 1, "rejected"), 0, 0);
    assert_true(isnan(at(&t, 1, "nees")));
    /* rejected: S = 11/3, P = 8/3, x = 2 */
    assert_close(at(&t, 2, "nu0_0"), 98, 1e-4);
    assert_close(at(&t, 2, "nis0"), 98 * 98 * 3 / 11.0, 1e-2);
    assert_close(at(&t, 2, "nis_mean0"), 3, 1e-5);
    assert_close(at(&t, 2, "rejected"), 1, 0);
    assert_close(at(&t, 2, "nees"), 0, 1e-9);
    /* S = 14/3; nis 27/14 */
    assert_close(at(&t, 3, "nis0"), 27 / 14.0, 1e-5);
    assert_close(at(&t, 3, "nis_mean0"), (3 + 27 / 14.0) / 2, 1e-5);
    assert_true(isnan(at(&t, 3, "nees")));
    table_free(&t);
    free(text);
}

/* Before a record starts there is nothing; at its start, no innovation; of a
 * number that cannot be used no nis. */
static void test_diagnostics_of_rows_without(void **state)
{
    char *text = gated(TWO, scratch_write("late.csv", JL_REAL_FLOAT
        ? "t_s,z0,z1\n0,,\n1,5,5\n2,5,5\n3,3e38,0\n"
        : "t_s,z0,z1\n0,,\n1,5,5\n2,5,5\n3,1e308,0\n"),
        "--diagnostics", "--gate", "0.99");
    struct table t;

    (void)state;
    table_take(&t, text);
    assert_true(isnan(at(&t, 0, "nis0")) && isnan(at(&t, 0, "rejected")));
    assert_true(isnan(at(&t, 1, "nu1_1")) && isnan(at(&t, 1, "nis_mean0")));
    assert_close(at(&t, 1, "rejected"), 0, 0);
    assert_true(isfinite(at(&t, 2, "nis1")));
    assert_close(at(&t, 3, "rejected"), 1, 0);
    assert_true(isnan(at(&t, 3, "nis0")) && isfinite(at(&t, 3, "nu0_0")));
    assert_null(strstr(text, "inf"));
    table_free(&t);
    free(text);
}

/* The mean is that of the present run. */
static void test_diagnostics_of_several_runs(void **state)
{
    const char *model = scratch_write("walk.json", walk);
    char *text = filtered(model, scratch_write("runs.csv", "run,k,z0\n"
        "1,1,3\n1,2,1\n2,1,0\n"), "--diagnostics");
    struct table t;

    (void)state;
    table_take(&t, text);
    assert_true(at(&t, 1, "nis_mean0") > 1);
    assert_close(at(&t, 2, "nis_mean0"), 0, 0);
    table_free(&t);
    free(text);
}

/* --- wrong use ----------------------------------------------------------- */

#define refused(words, ...) do { \
    run_jumplink("filter", __VA_ARGS__); \
    check_refused(&ran, 2, words); \
} while (0)

static void test_diagnostics_wrong_use(void **state)
{
    const char *data = program_head("f.csv", DATA "sightseeing_1hz.csv", 11);

    (void)state;
    refused("--diagnostics|PE0|same bits", TWO, data, FLIGHT, "--diagnostics",
            "--pes", "2");
    refused("--diagnostics|PE0|same bits", TWO, data, FLIGHT, "--diagnostics",
            "--port", "loop");
    refused("--truth goes with --diagnostics", TWO, data, FLIGHT, "--truth",
            "-,-,-,alt_m");
    refused("--truth names 2 |two_modes.json has 4", TWO, data, FLIGHT,
            "--diagnostics", "--truth", "-,v_east_mps");
    refused("--truth names 5 |two_modes.json has 4", TWO, data, FLIGHT,
            "--diagnostics", "--truth", "-,-,-,-,v_east_mps");
    refused("--truth|no component", TWO, data, FLIGHT, "--diagnostics",
            "--truth", "-,-,-,-");
    refused("--truth|empty", TWO, data, FLIGHT, "--diagnostics", "--truth",
            "-,,-,-");
    refused("--truth|empty", TWO, data, FLIGHT, "--diagnostics", "--truth",
            "");
    refused("f.csv:1: up|no such column", TWO, data, FLIGHT, "--diagnostics",
            "--truth", "-,up,-,-");
    refused("f.csv:1: alt_m|twice", TWO, data, FLIGHT, "--diagnostics",
            "--truth", "-,alt_m,-,alt_m");
    run_jumplink("sim", "--diagnostics");
    check_refused(&ran, 2, "unknown option --diagnostics");
    run_jumplink("filter", "--help");
    assert_non_null(strstr(ran.out, "--diagnostics"));
    assert_non_null(strstr(ran.out, "--truth"));
}

/* --- consistency --------------------------------------------------------- */

/* Uniform in (0, 1), the same on every machine (Knuth's MMIX); normal. */
static double uniform(void)
{
    static uint64_t state = 7;

    state = state * 6364136223846793005u + 1442695040888963407u;
    return ((double)(state >> 11) + 0.5) / 9007199254740992.0;
}

static double normal(void)
{
    double r = sqrt(-2 * log(uniform()));

    return r * cos(2 * acos(-1) * uniform());
}

enum { RUNS = 400, STEPS = 25 };

#define MODEL "{ \"kind\": \"imm\", \"n\": 3, \"m\": 2, \"Pi\": [[1]]," \
    " \"mu0\": [1], \"x0\": [1, -2, 0.5]," \
    " \"P0\": [[4, 0, 0], [0, 1, 0], [0, 0, 0.25]]," \
    " \"modes\": [ {\"Phi\": [[1, 0.5, 0.125], [0, 1, 0.5], [0, 0, 0.9]]," \
    " \"Gamma\": [[0.1, 0], [0.5, 0], [0, 1]]," \
    " \"Q\": [[0.36, 0], [0, 0.04]]," \
    " \"H\": [[1, 0, 0], [0, 1, 0]]," \
    " \"R\": [[%s, 0], [0, %s]]} ] }"

static double truth_of[RUNS * STEPS][3];

/* Runs of a truth that does what MODEL says with R = 1, 4, and what is
 * measured of it. */
static const char *simulate(void)
{
    const char *path = scratch_path("simulated.csv");
    FILE *out = fopen(path, "w");
    int r, k;

    assert_non_null(out);
    fprintf(out, "run,k,z0,z1,p,v,a\n");
    for (r = 0; r < RUNS; r++) {
        double p = 1 + 2 * normal(), v = -2 + normal();
        double a = 0.5 + 0.5 * normal();

        for (k = 1; k <= STEPS; k++) {
            double w = 0.6 * normal();

            p += 0.5 * v + 0.125 * a + 0.1 * w;
            v += 0.5 * a + 0.5 * w;
            a = 0.9 * a + 0.2 * normal();
            truth_of[r * STEPS + k - 1][0] = p;
            truth_of[r * STEPS + k - 1][2] = a;
            fprintf(out, "%d,%d,%.12g,%.12g,%.12g,%.12g,%.12g\n", r, k,
                    p + normal(), v + 2 * normal(), p, v, a);
        }
    }
    assert_int_equal(fclose(out), 0);
    return path;
}

/* e' P^-1 e of the components 0 and 2, as Cramer's rule has it. */
static void check_nees(const struct table *t)
{
    int k;

    for (k = 0; k < t->rows; k++) {
        double e = at(t, k, "x0") - truth_of[k][0];
        double f = at(t, k, "x2") - truth_of[k][2];
        double P = at(t, k, "P00"), Q = at(t, k, "P02"), R = at(t, k, "P22");
        double nees = (e * e * R - 2 * e * f * Q + f * f * P)
            / (P * R - Q * Q);

        assert_close(at(t, k, "nees"), nees,
                     (JL_REAL_FLOAT ? 1e-4 : 1e-9) * (1 + nees));
    }
}

struct means {
    double nis, nees;           /* over all steps; over the last of each run */
};

static struct means filter_simulated(const char *data, const char *r0,
                                     const char *r1, const char *truth)
{
    struct means means = { 0, 0 };
    struct table t;
    char model[600], *text;
    int k, nis, nees;

    snprintf(model, sizeof model, MODEL, r0, r1);
    text = filtered(scratch_write("right.json", model), data, "--diagnostics",
                    "--truth", truth);
    table_take(&t, text);
    assert_int_equal(t.rows, RUNS * STEPS);
    nis = column_of(&t, "nis0");
    nees = column_of(&t, "nees");
    for (k = 0; k < t.rows; k++) {
        means.nis += table_at(&t, k, nis) / (RUNS * STEPS);
        if (k % STEPS == STEPS - 1)
            means.nees += table_at(&t, k, nees) / RUNS;
    }
    if (strcmp(truth, "p,-,a") == 0)
        check_nees(&t);
    table_free(&t);
    free(text);
    return means;
}

/* A mean of N independent chi-squares of d degrees, times N, is one of N d: its
 * deviation is sqrt(2 d / N).  Innovations are independent; errors are from run
 * to run.  4 deviations: one seed in 16000 fails. */
static double bound(double d, double N)
{
    return 4 * sqrt(2 * d / N);
}

static void test_right_model_is_consistent(void **state)
{
    const char *data = simulate();
    struct means all = filter_simulated(data, "1", "4", "p,v,a");
    struct means one = filter_simulated(data, "1", "4", "-,v,-");
    struct means two = filter_simulated(data, "1", "4", "p,-,a");

    (void)state;
    assert_close(all.nis, 2, bound(2, RUNS * STEPS));
    assert_close(all.nees, 3, bound(3, RUNS));
    assert_close(one.nees, 1, bound(1, RUNS));
    assert_close(two.nees, 2, bound(2, RUNS));
}

/* R too small: the filter is too sure of itself; too large: too modest. */
static void test_wrong_noise_shows(void **state)
{
    const char *data = simulate();
    struct means sure = filter_simulated(data, "0.25", "1", "p,v,a");
    struct means modest = filter_simulated(data, "4", "16", "p,v,a");

    (void)state;
    assert_true(sure.nis > 2 + 10 * bound(2, RUNS * STEPS));
    assert_true(sure.nees > 3 + 2 * bound(3, RUNS));
    assert_true(modest.nis < 2 - 10 * bound(2, RUNS * STEPS));
    assert_true(modest.nees < 3 - bound(3, RUNS));
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_diagnostics_are_more_columns),
        cmocka_unit_test(test_diagnostics_by_hand),
        cmocka_unit_test(test_diagnostics_of_rows_without),
        cmocka_unit_test(test_diagnostics_of_several_runs),
        cmocka_unit_test(test_diagnostics_wrong_use),
        cmocka_unit_test(test_right_model_is_consistent),
        cmocka_unit_test(test_wrong_noise_shows),
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
