/* `jumplink sim --scenario manoeuvre1d`: its random numbers, its figures beside
 * those of a simulation apart from ours, its files, and what it refuses. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#include "jumplink/base.h"
#include "manoeuvre.h"
#include "philox.h"

#define SCENARIO "sim", "--scenario", "manoeuvre1d"

/* --- random numbers ------------------------------------------------------ */

static void check_philox(const uint32_t *counter, const uint32_t *key,
                         const uint32_t *want)
{
    uint32_t c[4];

    memcpy(c, counter, sizeof c);
    philox(c, key);
    assert_memory_equal(c, want, sizeof c);
}

/* The known answers of the authors' own library, Random123. */
static void test_philox_known_answers(void **state)
{
    static const uint32_t zeros[4] = { 0, 0, 0, 0 };
    static const uint32_t ones[4] = {
        0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff
    };
    static const uint32_t pi[6] = {
        0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344, 0xa4093822, 0x299f31d0
    };
    static const uint32_t of_zeros[4] = {
        0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8
    };
    static const uint32_t of_ones[4] = {
        0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd
    };
    static const uint32_t of_pi[4] = {
        0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1
    };

    (void)state;
    check_philox(zeros, zeros, of_zeros);
    check_philox(ones, ones, of_ones);
    check_philox(pi, pi + 4, of_pi);
}

/* Moments within five of their own deviations, and neighbours that know nothing
 * of each other. */
static void test_philox_is_normal(void **state)
{
    enum { N = 200000 };
    double sum[5] = { 0, 0, 0, 0, 0 }, along = 0, across = 0, root = sqrt(N);
    uint32_t i;

    (void)state;
    for (i = 0; i < N; i++) {
        double v = (double)philox_normal(5, i, 3), power = 1;
        int k;

        for (k = 0; k < 5; k++, power *= v)
            sum[k] += power;
        along += v * (double)philox_normal(5, i, 4);
        across += v * (double)philox_normal(5, i + 1, 3);
    }
    assert_close(sum[1] / N, 0, 5 / root);
    assert_close(sum[2] / N, 1, 5 * sqrt(2) / root);
    assert_close(sum[3] / N, 0, 5 * sqrt(15) / root);
    assert_close(sum[4] / N, 3, 5 * sqrt(96) / root);
    assert_close(along / N, 0, 5 / root);
    assert_close(across / N, 0, 5 / root);
    assert_true(philox_normal(5, 1, 1) < philox_normal(6, 1, 1)
                || philox_normal(5, 1, 1) > philox_normal(6, 1, 1));
}

/* --- figures ------------------------------------------------------------- */

static struct manoeuvre m;

enum { RUNS = 4000, LATE = 4, TURN = 2, ALL = MAN_PHASES - 1 };

/* Ours has RUNS runs, the other 2000, with noise of its own. */
static double room_for(double error)
{
    return 4 * error * sqrt(1 + RUNS / 2000.0);
}

static void check_ratio(int of, int phase, double want)
{
    struct man_figure ratio = manoeuvre_ratio(&m, of, phase);

    assert_true(ratio.error > 0 && ratio.error < 0.01);
    assert_close(ratio.value, want, room_for(ratio.error) + 0.005);
}

/* 2000 runs of a simulation apart from this one gave these, to two digits. */
static void test_manoeuvre_agrees_with_another_simulation(void **state)
{
    (void)state;
    check_ratio(MAN_POSITION, ALL, 1.00);
    check_ratio(MAN_VELOCITY, ALL, 1.02);
    check_ratio(MAN_ACCELERATION, ALL, 1.03);
    check_ratio(MAN_VELOCITY, LATE, 1.18);
    check_ratio(MAN_ACCELERATION, LATE, 1.36);
    assert_true(manoeuvre_ratio(&m, MAN_POSITION, TURN).value < 1.02);
}

static void check_mean(int filter, int of, double want, double room)
{
    struct man_figure mean = manoeuvre_phase_mean(&m, filter, of, TURN);

    assert_true(mean.error > 0 && mean.error < 1);
    assert_close(mean.value, want, room_for(mean.error) + room);
}

/* In a long turn alpha-beta filters lag by the textbook's (1 - alpha) a T^2 /
 * beta and a T (2 alpha - beta) / 2 beta. */
static void test_manoeuvre_bias(void **state)
{
    double lambda = sqrt(0.4), s, alpha, beta;

    (void)state;
    s = (4 + lambda - sqrt(lambda * lambda + 8 * lambda)) / 4;
    alpha = 1 - s * s;
    beta = 2 * (1 - s) * (1 - s);
    check_mean(MAN_ADAPTIVE, MAN_POSITION, -80 * (1 - alpha) / beta, 2);
    check_mean(MAN_ADAPTIVE, MAN_VELOCITY,
               -80 * (2 * alpha - beta) / (2 * beta), 4);
    check_mean(MAN_CGIMM, MAN_POSITION, -2.8, 0.1);
    check_mean(MAN_CGIMM, MAN_VELOCITY, -4.2, 0.1);
}

/* The standard errors are those that other seeds show. */
static void test_manoeuvre_knows_its_errors(void **state)
{
    enum { SEEDS = 40 };
    double ratio[3] = { 0, 0, 0 }, mean[3] = { 0, 0, 0 };
    static struct manoeuvre one;
    uint64_t seed;

    (void)state;
    for (seed = 100; seed < 100 + SEEDS; seed++) {
        struct man_figure r, b;

        assert_int_equal(manoeuvre_run(&one, 50, seed), 0);
        r = manoeuvre_ratio(&one, MAN_VELOCITY, LATE);
        b = manoeuvre_phase_mean(&one, MAN_IMM, MAN_POSITION, ALL);
        ratio[0] += r.value / SEEDS;
        ratio[1] += r.value * r.value / SEEDS;
        ratio[2] += r.error * r.error / SEEDS;
        mean[0] += b.value / SEEDS;
        mean[1] += b.value * b.value / SEEDS;
        mean[2] += b.error * b.error / SEEDS;
    }
    /* A variance of 40 is within a factor of 2 but for 1 in 500. */
    assert_true(ratio[1] - ratio[0] * ratio[0] < 2 * ratio[2]);
    assert_true(ratio[1] - ratio[0] * ratio[0] > ratio[2] / 2);
    assert_true(mean[1] - mean[0] * mean[0] < 2 * mean[2]);
    assert_true(mean[1] - mean[0] * mean[0] > mean[2] / 2);
}

/* --- files --------------------------------------------------------------- */

static char *file_of(const char *folder, const char *name)
{
    char path[400];

    snprintf(path, sizeof path, "%s/%s", folder, name);
    return program_file(path);
}

static void same_file(const char *a, const char *b, const char *name, int same)
{
    char *x = file_of(a, name), *y = file_of(b, name);

    if (same)
        check_same_text(x, y);
    else
        assert_true(strcmp(x, y) != 0);
    free(x);
    free(y);
}

static void run_into(const char *folder, const char *seed)
{
    run_jumplink(SCENARIO, "--runs", "20", "--seed", seed, "-o", folder);
    check_good(&ran);
}

static void test_manoeuvre_is_determined_by_its_seed(void **state)
{
    char a[400], b[400], c[400];

    (void)state;
    snprintf(a, sizeof a, "%s", scratch_path("a"));
    snprintf(b, sizeof b, "%s", scratch_path("b"));
    snprintf(c, sizeof c, "%s", scratch_path("c"));
    run_into(a, "7");
    run_into(b, "7");
    run_into(c, "8");
    same_file(a, b, "table.txt", 1);
    same_file(a, b, "table.csv", 1);
    same_file(a, b, "curves.csv", 1);
    same_file(a, c, "table.csv", 0);
    same_file(a, c, "curves.csv", 0);
}

static void check_picture(const char *folder, const char *name)
{
    char file[64], *text;

    snprintf(file, sizeof file, "%s.svg", name);
    text = file_of(folder, file);
    assert_non_null(strstr(text, "IMM"));
    assert_non_null(strstr(text, "</svg>"));
    free(text);
    snprintf(file, sizeof file, "%s.png", name);
    text = file_of(folder, file);
    assert_memory_equal(text, "\211PNG", 4);
    free(text);
}

/* The table's line with its verdict, and all the files. */
static void test_manoeuvre_says_what_does_not_hold(void **state)
{
    const char *folder = scratch_path("many");
    static struct manoeuvre few;
    char *text;
    struct table curves;
    int k;

    (void)state;
    assert_int_equal(manoeuvre_run(&few, 500, 1), 0);
    run_jumplink(SCENARIO, "--runs", "500", "--out", folder);
    check_good(&ran);
    text = file_of(folder, "table.txt");
    assert_int_equal(strncmp(ran.out, text, strlen(text)), 0);
    assert_non_null(strstr(text, "500 runs, seed 1"));
    assert_non_null(strstr(text, "position: holds in every phase"));
    assert_non_null(strstr(text, "velocity: DOES NOT HOLD in 31 to 40 s (1."));
    assert_non_null(strstr(text, "acceleration: DOES NOT HOLD in "));
    assert_non_null(strstr(text, "velocity: holds, less than a tenth: -"));
    free(text);
    text = file_of(folder, "curves.csv");
    table_take(&curves, text);
    assert_int_equal(curves.rows, MAN_STEPS);
    assert_int_equal(strncmp(curves.header, "t_s,acceleration_mps2,"
                             "imm_mean_position,imm_rms_position,", 54), 0);
    for (k = 0; k < MAN_STEPS; k++) {
        assert_close(table_at(&curves, k, 0), k + 1, 0);
        assert_close(table_at(&curves, k, 1), k >= 10 && k < 25 ? 80 : 0, 0);
        assert_close(table_at(&curves, k, 2),
                     manoeuvre_mean(&few, MAN_IMM, MAN_POSITION, k), 1e-6);
        assert_close(table_at(&curves, k, 3),
                     manoeuvre_rms(&few, MAN_IMM, MAN_POSITION, k), 1e-6);
    }
    table_free(&curves);
    free(text);
    text = file_of(folder, "table.csv");
    assert_int_equal(table_count(text, '\n'), 1 + MAN_PHASES * MAN_FILTERS);
    free(text);
    check_picture(folder, "position_error");
    check_picture(folder, "velocity_error");
    check_picture(folder, "compression");
    check_picture(folder, "acceleration");
}

/* --- wrong use ----------------------------------------------------------- */

static void test_manoeuvre_wrong_use(void **state)
{
    (void)state;
    run_jumplink("sim", "--scenario", "bend");
    check_refused(&ran, 2, "--scenario bend|manoeuvre1d");
    run_jumplink(SCENARIO, "--runs", "1");
    check_refused(&ran, 2, "--runs 1: must be a whole number from 2");
    run_jumplink(SCENARIO, "--seed", "-3");
    check_refused(&ran, 2, "--seed -3");
    run_jumplink(SCENARIO, "--pes", "2");
    check_refused(&ran, 2, "--pes is not for --scenario");
    run_jumplink(SCENARIO, "--data=x.csv");
    check_refused(&ran, 2, "--data=x.csv is not for --scenario");
    run_jumplink("sim", "--seed", "3");
    check_refused(&ran, 2, "--runs and --seed go with --scenario");
    run_jumplink(SCENARIO, "-o", "/dev/null/x");
    check_refused(&ran, 1, "/dev/null|cannot create the folder");
}

static int setup(void **state)
{
    scratch_setup(state);
    return manoeuvre_run(&m, RUNS, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_philox_known_answers),
        cmocka_unit_test(test_philox_is_normal),
        cmocka_unit_test(test_manoeuvre_agrees_with_another_simulation),
        cmocka_unit_test(test_manoeuvre_bias),
        cmocka_unit_test(test_manoeuvre_knows_its_errors),
        cmocka_unit_test(test_manoeuvre_is_determined_by_its_seed),
        cmocka_unit_test(test_manoeuvre_says_what_does_not_hold),
        cmocka_unit_test(test_manoeuvre_wrong_use),
    };

    return cmocka_run_group_tests(tests, setup, scratch_teardown);
}
