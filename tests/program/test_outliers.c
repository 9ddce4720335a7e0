/* `--gate`: its limits, the same octets however it runs, and what it is worth
 * on a recorded flight with outliers (a table, when run by itself). */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#include "chi_square.h"
#include "jumplink/base.h"

#define GOLDEN TOP_DIR "/tests/golden/imm/"
#define DATA TOP_DIR "/sim/data/"
#define TWO DATA "two_modes.json"
#define EIGHT DATA "eight_modes.json"
#define FLIGHT "--z", "east_m,north_m"

/* What `jumplink filter` writes, to be freed, after a line about the gate. */
static long rejected, judged;

static char *gated(void)
{
    const char *line = strstr(ran.err, ": the gate rejected ");
    char *out = ran.out;

    if (ran.status != 0 || line == NULL || table_count(ran.err, '\n') != 1
        || sscanf(line, ": the gate rejected %ld of %ld measurements\n",
                  &rejected, &judged) != 2)
        program_fail(&ran, "success, and a line about the gate");
    ran.out = NULL;
    return out;
}

#define filtered(...) (run_jumplink("filter", __VA_ARGS__), gated())

/* --- the limits ---------------------------------------------------------- */

/* NIST's table, and exp(-x/2) of two degrees. */
static void test_chi_square_quantiles(void **state)
{
    static const struct {
        double p;
        int m;
        double x;
    } known[] = {
        { 0.90, 1, 2.706 }, { 0.95, 1, 3.841 }, { 0.999, 1, 10.828 },
        { 0.99, 3, 11.345 }, { 0.975, 7, 16.013 }, { 0.99, 10, 23.209 },
        { 0.95, 30, 43.773 }, { 0.99, 61, 89.591 }, { 0.05, 5, 1.145 },
        { 0.01, 30, 14.953 },
    };
    size_t i;
    int m;

    (void)state;
    for (i = 0; i < sizeof known / sizeof *known; i++)
        assert_close(chi_square_quantile(known[i].p, known[i].m), known[i].x,
                     6e-4);
    for (i = 1; i < 14; i++) {
        double q = pow(10, -(double)i), p = 1 - q;

        assert_close(chi_square_quantile(p, 2), -2 * log(1 - p), 1e-9);
        for (m = 1; m <= 64; m += 3)
            assert_close(chi_square_tail(chi_square_quantile(p, m), m)
                         / (1 - p), 1, 1e-8);
    }
    assert_true(chi_square_quantile(1e-300, 1) > 0);
}

/* What kf.h says that good measurements pass with. */
static void test_gate_table_of_the_header(void **state)
{
    char *text = program_file(TOP_DIR "/include/jumplink/kf.h");
    const char *row = text;
    int rows = 0, m, used;
    double p, x;

    (void)state;
    while ((row = strstr(row, " *     p 0.9")) != NULL) {
        assert_int_equal(sscanf(row, " *     p %lf%n", &p, &used), 1);
        for (row += used, m = 1; m <= 6; m++, row += used) {
            assert_int_equal(sscanf(row, "%lf%n", &x, &used), 1);
            assert_close(chi_square_quantile(p, m), x, 0.005001);
        }
        rows++;
    }
    assert_int_equal(rows, 3);
    free(text);
}

/* --- wrong use ----------------------------------------------------------- */

#define refused(words, ...) do { \
    run_jumplink(__VA_ARGS__); \
    check_refused(&ran, 2, words); \
} while (0)

static void test_gate_wrong_use(void **state)
{
    static const char *const bad[] = {
        "0", "1", "-0.5", "1.5", "nan", "inf", "0.9x", "", "99%",
        "0.99999999999999999999",
    };
    const char *model = GOLDEN "cvca3/model.json", *z = GOLDEN "cvca3/z.csv";
    size_t i;

    (void)state;
    for (i = 0; i < sizeof bad / sizeof *bad; i++)
        refused("--gate |above 0 and below 1", "filter", model, z, "--gate",
                bad[i]);
    refused("--gate-most 0|from 1", "filter", model, z, "--gate", "0.9",
            "--gate-most", "0");
    refused("--gate-most x|whole", "filter", model, z, "--gate", "0.9",
            "--gate-most", "x");
    refused("--gate-most goes with --gate", "filter", model, z,
            "--gate-most", "3");
    refused("--gate needs --exchange gather", "filter", model, z, "--gate",
            "0.99", "--port", "loop", "--exchange", "reduce");
    refused("--gate needs --exchange gather", "sim", "--gate", "0.99",
            "--exchange", "reduce");
    refused("--gate needs --exchange gather", "pe", "--pe", "0", "--pes", "1",
            "--model", model, "--lcm-url", "udpm://239.255.76.67:7667?ttl=0",
            "--gate", "0.99", "--exchange", "reduce");
    refused("--gate-most goes with --gate", "host", model, z, "--pes", "1",
            "--lcm-url", "udpm://239.255.76.67:7667?ttl=0", "--gate-most",
            "2");
}

/* --- the same however it runs -------------------------------------------- */

#define PATIENTLY "--timeout", "20"

#define same_on(port, pes, serial, ...) do { \
    long rejected_ = rejected, judged_ = judged; \
    char *parallel_ = filtered(__VA_ARGS__, "--port", port, "--pes", pes, \
                               PATIENTLY); \
    check_same_text(serial, parallel_); \
    assert_int_equal(rejected, rejected_); \
    assert_int_equal(judged, judged_); \
    free(parallel_); \
} while (0)

static void test_gate_is_the_same_in_parallel(void **state)
{
    const char *data = program_head("sight.csv", DATA "sightseeing_1hz.csv",
                                    301);
    char *serial;

    (void)state;
    serial = filtered(EIGHT, data, FLIGHT, "--gate", "0.999");
    assert_true(rejected > 20 && rejected < 60);
    assert_int_equal(judged, 299);
    same_on("loop", "1", serial, EIGHT, data, FLIGHT, "--gate", "0.999");
    same_on("loop", "3", serial, EIGHT, data, FLIGHT, "--gate", "0.999");
    same_on("loop", "8", serial, EIGHT, data, FLIGHT, "--gate", "0.999");
    same_on("threads", "4", serial, EIGHT, data, FLIGHT, "--gate", "0.999");
    same_on("lcm", "2", serial, EIGHT, data, FLIGHT, "--gate", "0.999");
    same_on("lcm", "5", serial, EIGHT, data, FLIGHT, "--gate", "0.999",
            "--topology", "star");
    free(serial);
    serial = filtered(TWO, data, FLIGHT, "--filter", "kf", "--mode", "0",
                      "--gate", "0.99", "--gate-most", "2");
    same_on("lcm", "1", serial, TWO, data, FLIGHT, "--filter", "kf", "--mode",
            "0", "--gate", "0.99", "--gate-most", "2");
    free(serial);
}

/* The limit and the patience both count, and 5 is the default. */
static void test_gate_most(void **state)
{
    const char *data = scratch_write("step.csv", "t_s,z0,z1\n0,0,0\n1,0,0\n"
        "2,0,0\n3,9e3,0\n4,9e3,0\n5,9e3,0\n6,9e3,0\n7,9e3,0\n8,9e3,0\n");
    char *five, *again, *one;
    struct table t;

    (void)state;
    five = filtered(TWO, data, "--gate", "0.999");
    assert_int_equal(rejected, 5);
    assert_int_equal(judged, 8);
    again = filtered(TWO, data, "--gate", "0.999", "--gate-most", "5");
    check_same_text(five, again);
    table_take(&t, five);
    assert_true(fabs(table_at(&t, 7, 1)) < 1);
    assert_true(table_at(&t, 7, t.columns - 1) >= 0);   /* loglik 0 */
    assert_true(table_at(&t, 7, t.columns - 1) <= 0);
    assert_true(table_at(&t, 8, 1) > 5000);
    one = filtered(TWO, data, "--gate", "0.999", "--gate-most", "1");
    assert_true(strcmp(five, one) != 0);
    table_free(&t);
    free(five);
    free(again);
    free(one);
}

/* What is beyond all numbers of the filter ends a run without a gate, and none
 * with one; in parallel, too. */
static void test_gate_of_absurd_numbers(void **state)
{
    char *data = strdup(scratch_write("absurd.csv", JL_REAL_FLOAT
        ? "t_s,z0,z1\n0,0,0\n1,1,0\n2,1e30,0\n3,3,-3e38\n4,4,1\n"
        : "t_s,z0,z1\n0,0,0\n1,1,0\n2,1e200,0\n3,3,-1e308\n4,4,1\n"));
    char *missing = strdup(scratch_write("missing.csv", "t_s,z0,z1\n0,0,0\n"
                                         "1,1,0\n2,,\n3,,\n4,4,1\n"));
    char *serial, *without;

    (void)state;
    run_jumplink("filter", TWO, data);
    assert_int_equal(ran.status, 1);
    assert_non_null(strstr(ran.err, "absurd.csv:4: the step fails"));
    serial = filtered(TWO, data, "--gate", "0.9999");
    assert_int_equal(rejected, 2);
    same_on("loop", "2", serial, TWO, data, "--gate", "0.9999");
    without = filtered(TWO, missing, "--gate", "0.9999");
    check_same_text(serial, without);
    free(serial);
    free(without);
    free(missing);
    free(data);
}

/* --- sim ----------------------------------------------------------------- */

static void test_sim_tells_what_the_gate_rejected(void **state)
{
    char *data = strdup(program_head("flight.csv", DATA "sightseeing_1hz.csv",
                                     301));
    char *folder = strdup(scratch_path("sim")), *csv, path[500], end[40];
    char *estimates, *alone;

    (void)state;
    run_jumplink("sim", "--data", data, "--model", TWO, "-o", folder, "--port",
                 "loop", "--hold", "none", "--gate", "0.999");
    check_good(&ran);
    assert_non_null(strstr(ran.out, ", gate 0.999"));
    assert_non_null(strstr(ran.out, " rejected as serial\n"));
    assert_non_null(strstr(ran.out, " yes\n"));
    snprintf(path, sizeof path, "%s/table.csv", folder);
    csv = program_file(path);
    snprintf(path, sizeof path, "%s/two_modes_fresh.csv", folder);
    estimates = program_file(path);
    alone = filtered(TWO, data, FLIGHT, "--gate", "0.999");
    check_same_text(estimates, alone);
    assert_non_null(strstr(csv, ",partial,rejected\n"));
    snprintf(end, sizeof end, ",0,%ld\n", rejected);
    assert_string_equal(csv + strlen(csv) - strlen(end), end);
    free(csv);
    free(estimates);
    free(alone);

    run_jumplink("sim", "--data", data, "--model", TWO, "-o", folder, "--port",
                 "loop", "--hold", "none");
    check_good(&ran);
    assert_null(strstr(ran.out, "gate"));
    assert_null(strstr(ran.out, "rejected"));
    free(folder);
    free(data);
}

/* --- a flight with outliers ---------------------------------------------- */

enum { ROWS = 3000 };

static struct {
    int rows;
    char time[ROWS][16];
    double z[ROWS][2], v[ROWS][2];
    int wrong[ROWS], injected;
} flight;

static void read_flight(void)
{
    FILE *in = fopen(DATA "sightseeing_1hz.csv", "r");
    char line[200];
    int k = 0;

    assert_non_null(in);
    assert_non_null(fgets(line, sizeof line, in));
    for (; fgets(line, sizeof line, in) != NULL; k++) {
        assert_in_range(k, 0, ROWS - 1);
        assert_int_equal(sscanf(line, "%15[^,],%lf,%lf,%*f,%lf,%lf",
                                flight.time[k], &flight.z[k][0],
                                &flight.z[k][1], &flight.v[k][0],
                                &flight.v[k][1]), 5);
    }
    fclose(in);
    flight.rows = k;
}

/* Uniform in [0, 1), the same on every machine (Knuth's MMIX). */
static double uniform(void)
{
    static uint64_t state = 1;

    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 9007199254740992.0;
}

/* One position in twenty is 1 to 20 km off, in any direction. */
static const char *spoil_flight(void)
{
    const char *path = scratch_path("outliers.csv");
    FILE *out = fopen(path, "w");
    int k;

    assert_non_null(out);
    fprintf(out, "t_s,east_m,north_m\n");
    for (k = 0; k < flight.rows; k++) {
        double far = 1000 + 19000 * uniform(), way = 2 * acos(-1) * uniform();

        flight.wrong[k] = uniform() < 0.05 && k > 0;
        flight.injected += flight.wrong[k];
        far *= flight.wrong[k];
        fprintf(out, "%s,%.3f,%.3f\n", flight.time[k],
                flight.z[k][0] + far * cos(way),
                flight.z[k][1] + far * sin(way));
    }
    assert_int_equal(fclose(out), 0);
    return path;
}

struct outcome {
    double velocity_rms, position_rms;  /* against the flight as recorded */
    int rejected, of_injected;
};

static struct outcome measure(const char *text, int spoilt)
{
    struct outcome o = { 0, 0, 0, 0 };
    double velocity = 0, position = 0;
    struct table t;
    int k;

    table_take(&t, text);
    assert_int_equal(t.rows, flight.rows);
    for (k = 1; k < t.rows; k++) {
        double at[4];
        int i, out = table_at(&t, k, t.columns - 1) > 0;

        for (i = 0; i < 4; i++)
            at[i] = table_at(&t, k, 1 + i);
        velocity += pow(at[1] - flight.v[k][0], 2)
            + pow(at[3] - flight.v[k][1], 2);
        position += pow(at[0] - flight.z[k][0], 2)
            + pow(at[2] - flight.z[k][1], 2);
        o.rejected += out;
        o.of_injected += out && spoilt && flight.wrong[k];
    }
    o.velocity_rms = sqrt(velocity / (t.rows - 1));
    o.position_rms = sqrt(position / (t.rows - 1));
    table_free(&t);
    return o;
}

static struct outcome fly(const char *model, const char *data, int gate)
{
    int spoilt = strstr(data, "outliers") != NULL;
    struct outcome o;
    char *text;

    if (gate) {
        text = filtered(model, data, FLIGHT, "--diagnostics", "--gate",
                        "0.9999");
    } else {
        run_jumplink("filter", model, data, FLIGHT, "--diagnostics");
        check_good(&ran);
        text = ran.out;
        ran.out = NULL;
    }
    o = measure(text, spoilt);
    free(text);
    if (gate)
        assert_int_equal(o.rejected, rejected);
    print_message("%-12s %-8s %-4s %9.2f %9.1f %8d %8d\n",
                  strstr(model, "two") != NULL ? "two_modes" : "eight_modes",
                  spoilt ? "5%" : "none", gate ? "yes" : "no",
                  o.velocity_rms, o.position_rms, o.rejected, o.of_injected);
    return o;
}

static void check_flight(const char *model, const char *spoilt)
{
    struct outcome plain = fly(model, DATA "sightseeing_1hz.csv", 0);
    struct outcome gate = fly(model, DATA "sightseeing_1hz.csv", 1);
    struct outcome ruined = fly(model, spoilt, 0);
    struct outcome saved = fly(model, spoilt, 1);

    assert_true(ruined.velocity_rms > 10 * plain.velocity_rms);
    assert_true(ruined.position_rms > 1000);
    assert_true(saved.velocity_rms < plain.velocity_rms);
    assert_true(saved.velocity_rms < 1.5 * gate.velocity_rms);
    assert_true(saved.position_rms < 2 * gate.position_rms);
    assert_true(saved.of_injected >= flight.injected * 95 / 100);
    /* the flight has wrong positions of its own: hardly more are rejected */
    assert_true(saved.rejected - saved.of_injected < 1.2 * gate.rejected);
    assert_true(gate.rejected < flight.rows / 10);
}

static void test_gate_saves_a_flight(void **state)
{
    const char *spoilt;

    (void)state;
    read_flight();
    spoilt = spoil_flight();
    assert_in_range(flight.injected, flight.rows / 25, flight.rows / 17);
    print_message("%d of %d positions 1 to 20 km off\n"
                  "%-12s %-8s %-4s %9s %9s %8s %8s\n", flight.injected,
                  flight.rows, "", "", "", "velocity", "position", "", "");
    print_message("%-12s %-8s %-4s %9s %9s %8s %8s\n", "model", "outliers",
                  "gate", "rms, m/s", "rms, m", "rejected", "of them");
    check_flight(TWO, spoilt);
    check_flight(EIGHT, spoilt);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chi_square_quantiles),
        cmocka_unit_test(test_gate_table_of_the_header),
        cmocka_unit_test(test_gate_wrong_use),
        cmocka_unit_test(test_gate_is_the_same_in_parallel),
        cmocka_unit_test(test_gate_most),
        cmocka_unit_test(test_gate_of_absurd_numbers),
        cmocka_unit_test(test_sim_tells_what_the_gate_rejected),
        cmocka_unit_test(test_gate_saves_a_flight),
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
