/* `jumplink sim --scenario ar1|spring2|turn`: figures beside those of a
 * simulation apart from ours, files that say the same as the table, verdicts
 * that follow the figures, and what it refuses. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#include "jumplink/base.h"
#include "rivals.h"

/* --- figures ------------------------------------------------------------- */

enum { RUNS = 1000 };

/* 1000 runs a situation of a simulation apart from this one: filters by
 * covariances, another language's random numbers.  Of MEKF and MEKF with spread:
 * ratio to the EKF in a run, its standard error, part of runs nearer. */
static const struct other {
    const char *scenario;
    int situation, quantity;
    double ratio[2], error[2], nearer[2];
} others[] = {
    { "ar1", AS_MODELLED, OF_STATE,
      { 1.3050, 1.0008 }, { 0.0231, 0.0002 }, { 0.001, 0.471 } },
    { "ar1", AS_MODELLED, OF_PARAMETER,
      { 1.2321, 1.0002 }, { 0.0132, 0.0004 }, { 0.258, 0.468 } },
    { "ar1", TOO_SURE, OF_STATE,
      { 1.2276, 1.0159 }, { 0.0197, 0.0002 }, { 0.000, 0.002 } },
    { "ar1", TOO_SURE, OF_PARAMETER,
      { 0.9837, 0.9926 }, { 0.0008, 0.0002 }, { 0.733, 0.932 } },
    { "ar1", TOO_NOISY, OF_PARAMETER,
      { 0.9975, 1.0000 }, { 0.0001, 0.0001 }, { 0.971, 0.962 } },
    { "spring2", AS_MODELLED, OF_STATE,
      { 1.1893, 1.0535 }, { 0.0070, 0.0029 }, { 0.164, 0.286 } },
    { "spring2", AS_MODELLED, OF_PARAMETER,
      { 1.3741, 1.1158 }, { 0.0170, 0.0080 }, { 0.237, 0.355 } },
    { "spring2", TOO_SURE, OF_STATE,
      { 1.0590, 1.0493 }, { 0.0007, 0.0006 }, { 0.002, 0.002 } },
    { "spring2", TOO_SURE, OF_PARAMETER,
      { 0.9590, 0.9644 }, { 0.0003, 0.0002 }, { 1.000, 1.000 } },
    { "spring2", TOO_NOISY, OF_STATE,
      { 0.9931, 0.9957 }, { 0.0001, 0.0001 }, { 1.000, 1.000 } },
    { "spring2", TOO_NOISY, OF_PARAMETER,
      { 0.9720, 0.9777 }, { 0.0003, 0.0002 }, { 1.000, 1.000 } },
    { "turn", AS_MODELLED, OF_STATE,
      { 2.8500, 1.2996 }, { 0.0462, 0.0095 }, { 0.025, 0.133 } },
    { "turn", AS_MODELLED, OF_PARAMETER,
      { 2.0616, 1.2655 }, { 0.0203, 0.0058 }, { 0.018, 0.058 } },
    { "turn", TOO_SURE, OF_STATE,
      { 1.7666, 1.3699 }, { 0.0144, 0.0080 }, { 0.013, 0.037 } },
    { "turn", TOO_SURE, OF_PARAMETER,
      { 1.3259, 1.1445 }, { 0.0067, 0.0039 }, { 0.033, 0.093 } },
    { "turn", TOO_NOISY, OF_STATE,
      { 0.9962, 0.9928 }, { 0.0008, 0.0004 }, { 0.664, 0.760 } },
    { "turn", TOO_NOISY, OF_PARAMETER,
      { 1.2081, 1.0924 }, { 0.0065, 0.0034 }, { 0.151, 0.201 } },
};
enum { OTHERS = sizeof others / sizeof *others };

/* Within four standard errors of the difference, and a few runs. */
static void check_other(const struct rivals *r, const struct other *o, int f)
{
    struct rivals_figure ratio = rivals_ratio(r, o->situation, 1 + f,
                                              o->quantity);
    double nearer = (double)rivals_nearer(r, o->situation, 1 + f, o->quantity)
        / RUNS, p = o->nearer[f];

    assert_close(ratio.value, o->ratio[f], 4 * sqrt(2) * o->error[f] + 1e-4);
    assert_true(ratio.error < 1.5 * o->error[f] + 1e-4);
    assert_true(ratio.error > o->error[f] / 1.5 - 1e-4);
    assert_close(nearer, p, 4 * sqrt(2 * p * (1 - p) / RUNS) + 0.005);
}

static struct rivals all[3];

static const struct rivals *of(const char *name)
{
    int i = 0;

    while (i < 2 && strcmp(all[i].scenario->name, name) != 0)
        i++;
    return &all[i];
}

static void test_rivals_agree_with_another_simulation(void **state)
{
    int i;

    (void)state;
    for (i = 0; i < OTHERS; i++) {
        check_other(of(others[i].scenario), &others[i], 0);
        check_other(of(others[i].scenario), &others[i], 1);
    }
}

static void check_rms(const char *name, int situation, int rival, int quantity,
                      double want, double error)
{
    struct rivals_figure rms = rivals_rms(of(name), situation, rival, quantity,
                                          0);

    assert_close(rms.value, want, 4 * sqrt(2) * error);
    assert_true(rms.error < 1.5 * error && rms.error > error / 1.5);
}

static void check_mean(int situation, int rival, int quantity, double want,
                       double error)
{
    struct rivals_figure mean = rivals_mean(of("spring2"), situation, rival,
                                            quantity);

    assert_close(mean.value, want, 4 * sqrt(2) * error);
    assert_true(mean.error < 1.5 * error && mean.error > error / 1.5);
}

/* Of the same simulation: errors themselves. */
static void test_rivals_errors_agree(void **state)
{
    (void)state;
    check_rms("ar1", AS_MODELLED, RIVAL_EKF, OF_STATE, 0.080095, 0.00023);
    check_rms("ar1", AS_MODELLED, RIVAL_MEKF, OF_PARAMETER, 0.070021, 0.00078);
    check_rms("spring2", AS_MODELLED, RIVAL_EKF, OF_PARAMETER, 0.48707, 0.0036);
    check_rms("spring2", TOO_SURE, RIVAL_MEKF, OF_PARAMETER, 1.0161, 0.0038);
    check_rms("turn", AS_MODELLED, RIVAL_EKF, OF_STATE, 7.427, 0.032);
    check_rms("turn", AS_MODELLED, RIVAL_MEKF, OF_STATE, 26.883, 0.46);
    check_rms("turn", AS_MODELLED, RIVAL_SPREAD, OF_STATE, 10.287, 0.10);
    check_rms("turn", TOO_NOISY, RIVAL_MEKF, OF_PARAMETER, 0.018027, 0.00023);
    check_mean(AS_MODELLED, RIVAL_MEKF, OF_STATE, 0.01433, 0.00047);
    check_mean(TOO_SURE, RIVAL_EKF, OF_PARAMETER, -0.8227, 0.0046);
}

/* --- verdicts ------------------------------------------------------------ */

static struct rivals_figure figure(double value, double error)
{
    struct rivals_figure f = { value, error };

    return f;
}

static void test_rivals_verdict_follows_the_ratio(void **state)
{
    static const char same[] = "no different";

    (void)state;
    assert_string_equal(rivals_verdict(figure(0.9, 0.04)), "better");
    assert_string_equal(rivals_verdict(figure(0.9, 0.05)), same);
    assert_string_equal(rivals_verdict(figure(1.1, 0.04)), "worse");
    assert_string_equal(rivals_verdict(figure(1.1, 0.05)), same);
    assert_string_equal(rivals_verdict(figure(0.995, 0)), same);
    assert_string_equal(rivals_verdict(figure(1.005, 0)), same);
    assert_string_equal(rivals_verdict(figure(1, 0)), same);
}

/* Runs in which the MEKF's errors are chosen times the EKF's 2, 3, 2, 3.. */
static struct rivals_figure made_up(long *nearer, double a, double b)
{
    enum { N = 50 };
    static struct rivals_run runs[N];
    struct rivals r = { .runs = N, .run = runs };
    int i;

    for (i = 0; i < N; i++) {
        double ekf = 2 + i % 2;

        runs[i].of[TOO_SURE][RIVAL_EKF][OF_PARAMETER].rms = ekf;
        runs[i].of[TOO_SURE][RIVAL_MEKF][OF_PARAMETER].rms
            = ekf * (i % 5 == 0 ? b : a);
    }
    *nearer = rivals_nearer(&r, TOO_SURE, RIVAL_MEKF, OF_PARAMETER);
    return rivals_ratio(&r, TOO_SURE, RIVAL_MEKF, OF_PARAMETER);
}

static void test_rivals_verdict_turns(void **state)
{
    struct rivals_figure ratio;
    long nearer;

    (void)state;
    ratio = made_up(&nearer, 0.5, 2);
    assert_close(ratio.value, pow(2, -0.6), 1e-12);
    assert_close(ratio.error, ratio.value * 0.8 * log(2) / 7, 1e-12);
    assert_int_equal(nearer, 40);
    assert_string_equal(rivals_verdict(ratio), "better");
    ratio = made_up(&nearer, 2, 0.5);
    assert_close(ratio.value, pow(2, 0.6), 1e-12);
    assert_int_equal(nearer, 10);
    assert_string_equal(rivals_verdict(ratio), "worse");
    ratio = made_up(&nearer, 1.3, 0.25);
    assert_string_equal(rivals_verdict(ratio), "no different");
}

/* --- files --------------------------------------------------------------- */

enum { PROGRAM_RUNS = 60 };

static char *file_of(const char *folder, const char *name)
{
    char path[400];

    snprintf(path, sizeof path, "%s/%s", folder, name);
    return program_file(path);
}

static const char *simulated(const char *name, const char *scenario,
                             const char *runs, const char *seed)
{
    const char *folder = scratch_path(name);

    run_jumplink("sim", "--scenario", scenario, "--runs", runs, "--seed", seed,
                 "-o", folder);
    check_good(&ran);
    return folder;
}

/* What runs.csv says: columns situation, run, and of each filter rms, final,
 * mean of the state, then of the parameter. */
struct from_runs {
    double rms, final, mean, ratio;
    long nearer;
};

static struct from_runs look(const struct table *t, int situation, int filter,
                             int quantity)
{
    struct from_runs found = { 0, 0, 0, 0, 0 };
    int column = 2 + 6 * filter + 3 * quantity, ekf = 2 + 3 * quantity, i;

    for (i = 0; i < PROGRAM_RUNS; i++) {
        int row = situation * PROGRAM_RUNS + i;
        double rms = table_at(t, row, column), rival = table_at(t, row, ekf);

        assert_close(table_at(t, row, 0), situation, 0);
        assert_close(table_at(t, row, 1), i, 0);
        found.rms += rms * rms / PROGRAM_RUNS;
        found.final += pow(table_at(t, row, column + 1), 2) / PROGRAM_RUNS;
        found.mean += table_at(t, row, column + 2) / PROGRAM_RUNS;
        found.ratio += log(rms / rival) / PROGRAM_RUNS;
        found.nearer += rms < rival;
    }
    found.rms = sqrt(found.rms);
    found.final = sqrt(found.final);
    found.ratio = exp(found.ratio);
    return found;
}

/* The rest of a line of table.csv, behind the names. */
static const char *line_of(const char *table, const char *situation,
                           const char *filter, const char *quantity)
{
    char start[100];
    const char *line;

    snprintf(start, sizeof start, "\n%s,%s,%s,", situation, filter, quantity);
    line = strstr(table, start);
    assert_non_null(line);
    return line + strlen(start);
}

static void check_line_of(const char *line, struct from_runs want, int is_ekf)
{
    double v[8];
    char verdict[40] = "";
    long nearer = 0;
    int taken = sscanf(line, "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf,%ld,%39[^\n]",
                       v, v + 1, v + 2, v + 3, v + 4, v + 5, v + 6, v + 7,
                       &nearer, verdict);

    assert_close(v[0] / want.rms, 1, 1e-7);
    assert_close(v[2] / want.final, 1, 1e-7);
    assert_close(v[4], want.mean, 1e-7 * want.rms);
    assert_true(v[1] > 0 && v[3] > 0 && v[5] > 0);
    if (is_ekf)
        return;
    assert_int_equal(taken, 10);
    assert_close(v[6] / want.ratio, 1, 1e-7);
    assert_int_equal(nearer, want.nearer);
    assert_string_equal(verdict, v[6] + 2 * v[7] < 0.99 ? "better"
                        : v[6] - 2 * v[7] > 1.01 ? "worse" : "no different");
}

/* The table's line of the text: the same figures. */
static void check_words(const char *text, const char *situation,
                        struct from_runs want, int filter, int quantity)
{
    static const char *const names[] = { "EKF  ", "MEKF  ", "MEKF, spread" };
    const char *line = strstr(text, situation);
    double rms, rms_error;
    char share[20];
    int i;

    assert_non_null(line);
    for (i = 0; i <= 1 - quantity && line != NULL; i++) {
        char start[30];

        snprintf(start, sizeof start, "\n  %s", names[filter]);
        line = strstr(line + 1, start);
    }
    assert_non_null(line);
    assert_int_equal(sscanf(line + 3 + strlen("MEKF, spread"), "%lf +- %lf",
                            &rms, &rms_error), 2);
    assert_close(rms / want.rms, 1, 0.01);
    if (filter == RIVAL_EKF)
        return;
    snprintf(share, sizeof share, " %.0f%%  ",
             100.0 * (double)want.nearer / PROGRAM_RUNS);
    assert_non_null(strstr(line, share));
    assert_true(strstr(line, share) < strchr(line + 1, '\n'));
}

static void check_files(const char *scenario)
{
    static const char *const situations[] = {
        "as_modelled", "too_sure", "too_noisy"
    };
    static const char *const words[] = {
        "\nas modelled:", "\ntoo sure:", "\ntoo noisy:"
    };
    static const char *const filters[] = { "ekf", "mekf", "spread" };
    static const char *const quantities[] = { "state", "parameter" };
    const char *folder = simulated(scenario, scenario, "60", "5");
    char *text = file_of(folder, "runs.csv");
    char *table = file_of(folder, "table.csv");
    struct table runs;
    int s, f, q;

    table_take(&runs, text);
    free(text);
    text = file_of(folder, "table.txt");
    assert_int_equal(strncmp(ran.out, text, strlen(text)), 0);
    assert_int_equal(runs.rows, 3 * PROGRAM_RUNS);
    assert_int_equal(runs.columns, 2 + 18);
    assert_int_equal(strncmp(runs.header, "situation,run,ekf_state_rms,"
                             "ekf_state_final,ekf_state_mean,ekf_parameter_rms",
                             72), 0);
    for (s = 0; s < SITUATIONS; s++)
        for (f = 0; f < RIVALS; f++)
            for (q = 0; q < QUANTITIES; q++) {
                struct from_runs want = look(&runs, s, f, q);

                check_line_of(line_of(table, situations[s], filters[f],
                                      quantities[q]), want, f == RIVAL_EKF);
                check_words(text, words[s], want, f, q);
            }
    table_free(&runs);
    free(table);
    free(text);
}

static void test_rivals_files_agree(void **state)
{
    (void)state;
    check_files("ar1");
    check_files("spring2");
    check_files("turn");
}

/* The same filter is worse and better, by what it is told. */
static void test_rivals_say_both(void **state)
{
    const char *folder = simulated("both", "spring2", "100", "1");
    char *table = file_of(folder, "table.csv");
    const char *line;

    (void)state;
    line = line_of(table, "as_modelled", "mekf", "parameter");
    assert_int_equal(strncmp(strchr(line, '\n') - 6, ",worse", 6), 0);
    line = line_of(table, "too_sure", "mekf", "parameter");
    assert_int_equal(strncmp(strchr(line, '\n') - 7, ",better", 7), 0);
    free(table);
}

static void check_picture(const char *folder, const char *name)
{
    char file[64], *text;

    snprintf(file, sizeof file, "%s.svg", name);
    text = file_of(folder, file);
    assert_non_null(strstr(text, "MEKF, spread"));
    assert_non_null(strstr(text, "</svg>"));
    free(text);
    snprintf(file, sizeof file, "%s.png", name);
    text = file_of(folder, file);
    assert_memory_equal(text, "\211PNG", 4);
    free(text);
}

static void test_rivals_curves_and_plots(void **state)
{
    const char *folder = simulated("curves", "turn", "1000", "1");
    const struct rivals *r = of("turn");
    char *text = file_of(folder, "curves_too_sure.csv");
    struct table curves;
    int k;

    (void)state;
    table_take(&curves, text);
    free(text);
    assert_string_equal(curves.header, "t_s,ekf_state_rms,ekf_parameter_rms,"
                        "mekf_state_rms,mekf_parameter_rms,spread_state_rms,"
                        "spread_parameter_rms");
    assert_int_equal(curves.rows, 80);
    for (k = 0; k < curves.rows; k++) {
        assert_close(table_at(&curves, k, 0), k + 1, 0);
        assert_close(table_at(&curves, k, 3)
                     / rivals_step(r, TOO_SURE, RIVAL_MEKF, OF_STATE, k), 1,
                     1e-7);
    }
    assert_close(table_at(&curves, 79, 2)
                 / rivals_rms(r, TOO_SURE, RIVAL_EKF, OF_PARAMETER, 1).value,
                 1, 1e-7);
    table_free(&curves);
    check_picture(folder, "state_as_modelled");
    check_picture(folder, "state_too_sure");
    check_picture(folder, "state_too_noisy");
    check_picture(folder, "parameter_as_modelled");
    check_picture(folder, "parameter_too_sure");
    check_picture(folder, "parameter_too_noisy");
}

static void test_rivals_are_determined_by_the_seed(void **state)
{
    char *a = file_of(simulated("a", "ar1", "3", "7"), "runs.csv");
    char *b = file_of(simulated("b", "ar1", "3", "7"), "runs.csv");
    char *c = file_of(simulated("c", "ar1", "3", "8"), "runs.csv");

    (void)state;
    check_same_text(a, b);
    assert_true(strcmp(a, c) != 0);
    free(a);
    free(b);
    free(c);
}

/* --- wrong use ----------------------------------------------------------- */

static void test_rivals_wrong_use(void **state)
{
    (void)state;
    run_jumplink("sim", "--scenario", "turns");
    check_refused(&ran, 2, "--scenario turns|manoeuvre1d|ar1, spring2 and turn");
    run_jumplink("sim", "--scenario", "turn", "--runs", "1");
    check_refused(&ran, 2, "--runs 1: must be a whole number from 2");
    run_jumplink("sim", "--scenario", "turn", "--runs", "100001");
    check_refused(&ran, 2, "--runs 100001: of --scenario turn at most 100000");
    run_jumplink("sim", "--scenario", "ar1", "--filter", "ekf");
    check_refused(&ran, 2, "--filter is not for --scenario");
    run_jumplink("sim", "--scenario", "spring2", "-o", "/dev/null/x");
    check_refused(&ran, 1, "/dev/null|cannot create the folder");
}

static int setup(void **state)
{
    static const char *const names[] = { "ar1", "spring2", "turn" };
    int i;

    scratch_setup(state);
    for (i = 0; i < 3; i++)
        if (rivals_simulate(&all[i], rivals_scenario(names[i]), RUNS, 1) != 0)
            return -1;
    return 0;
}

static int teardown(void **state)
{
    int i;

    for (i = 0; i < 3; i++)
        rivals_free(&all[i]);
    return scratch_teardown(state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rivals_agree_with_another_simulation),
        cmocka_unit_test(test_rivals_errors_agree),
        cmocka_unit_test(test_rivals_verdict_follows_the_ratio),
        cmocka_unit_test(test_rivals_verdict_turns),
        cmocka_unit_test(test_rivals_files_agree),
        cmocka_unit_test(test_rivals_say_both),
        cmocka_unit_test(test_rivals_curves_and_plots),
        cmocka_unit_test(test_rivals_are_determined_by_the_seed),
        cmocka_unit_test(test_rivals_wrong_use),
    };

    return cmocka_run_group_tests(tests, setup, teardown);
}
