/* `jumplink filter` as a user meets it: right numbers, the same octets however
 * it runs, and a clear word about every mistake. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#include "jumplink/base.h"
#include "jumplink/config.h"

#define GOLDEN TOP_DIR "/tests/golden/imm/"
#define DATA TOP_DIR "/sim/data/"
#define CVCA3 GOLDEN "cvca3/model.json", GOLDEN "cvca3/z.csv"
#define TWO DATA "two_modes.json"
#define EIGHT DATA "eight_modes.json"
#define FLIGHT "--z", "east_m,north_m"

/* What the program writes on standard output, to be freed. */
static char *said(void)
{
    char *out = ran.out;

    check_good(&ran);
    ran.out = NULL;
    return out;
}

#define filtered(...) (run_jumplink("filter", __VA_ARGS__), said())

/* --- the reference cases ------------------------------------------------- */

struct tolerance {
    double x, P, mu, loglik;
};

#if JL_REAL_FLOAT
static const struct tolerance ordinary = { 2e-2, 2e-3, 2e-3, 1e-3 };
#else
static const struct tolerance ordinary = { 1e-10, 1e-11, 1e-11, 1e-11 };
static const struct tolerance hard = { 5e-3, 2e-4, 5e-6, 5e-7 };
static const struct tolerance hard_sqrt = { 5e-3, 2e-7, 5e-8, 2e-7 };
static const struct tolerance hardest = { 1e-4, 1e-5, 1e-9, 1e-7 };
#endif

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

/* sqrt(P_aa) in every row, not below 1e-6 of its median; to be freed. */
static double *sigma_of(const struct table *t, int column)
{
    size_t rows = (size_t)t->rows;
    double *sigma = calloc(2 * rows, sizeof *sigma), *sorted = sigma + rows;
    double least;
    int k;

    assert_non_null(sigma);
    for (k = 0; k < t->rows; k++)
        sorted[k] = sigma[k] = sqrt(table_at(t, k, column));
    qsort(sorted, rows, sizeof *sorted, ascending);
    least = 1e-6 * sorted[rows / 2];
    for (k = 0; k < t->rows; k++)
        if (sigma[k] < least)
            sigma[k] = least;
    return sigma;
}

/* A column named by one letter and its subscript: how far apart, in its
 * unit. */
static void check_column(const struct table *got, const struct table *want,
                         int column, double *const *sigma, const char *name,
                         const struct tolerance *t)
{
    int k, a = name[0] == 'm' ? 0 : name[1] - '0', b = name[2] - '0';

    for (k = 0; k < want->rows; k++) {
        double w = table_at(want, k, column), unit = 1, tolerance = t->mu;

        if (name[0] == 'x') {
            unit = sigma[a][k];
            tolerance = t->x;
        } else if (name[0] == 'P') {
            unit = sigma[a][k] * sigma[b][k];
            tolerance = t->P;
        } else if (name[0] == 'l') {
            unit = 1 + fabs(w);
            tolerance = t->loglik;
        } else if (name[0] == 'k') {
            tolerance = 0;
        }
        assert_close(table_at(got, k, column) / unit, w / unit, tolerance);
    }
}

static void check_close(const char *got_text, const char *want_text, int n,
                        const struct tolerance *t)
{
    struct table got, want;
    double *sigma[8];
    char *names, *rest, *name;
    int a, column = 0, diagonal = 1 + n;

    table_take(&got, got_text);
    table_take(&want, want_text);
    assert_string_equal(got.header, want.header);
    assert_int_equal(got.rows, want.rows);
    for (a = 0; a < n; diagonal += n - a, a++)
        sigma[a] = sigma_of(&want, diagonal);
    names = rest = strdup(want.header);
    while ((name = strsep(&rest, ",")) != NULL)
        check_column(&got, &want, column++, sigma, name, t);
    assert_int_equal(column, got.columns);
    for (a = 0; a < n; a++)
        free(sigma[a]);
    free(names);
    table_free(&got);
    table_free(&want);
}

static void check_case(const char *name, int n, const char *form,
                       const struct tolerance *t)
{
    char model[400], data[400], expected[400];
    char *got, *want;

    snprintf(model, sizeof model, GOLDEN "%s/model.json", name);
    snprintf(data, sizeof data, GOLDEN "%s/z.csv", name);
    snprintf(expected, sizeof expected, GOLDEN "%s/expected.csv", name);
    got = filtered(model, data, "--form", form);
    want = program_file(expected);
    check_close(got, want, n, t);
    free(got);
    free(want);
}

static const struct {
    const char *name;
    int n;
} cases[] = {
    { "bank12", 4 }, { "cvca3", 3 }, { "cvct4", 4 }, { "evidence", 2 },
    { "meannoise", 2 },
};

#define CASES (sizeof cases / sizeof *cases)

static void test_filter_meets_reference(void **state)
{
    size_t i;

    (void)state;
    for (i = 0; i < CASES; i++) {
        check_case(cases[i].name, cases[i].n, "joseph", &ordinary);
        check_case(cases[i].name, cases[i].n, "standard", &ordinary);
        check_case(cases[i].name, cases[i].n, "sqrt", &ordinary);
    }
    check_case("hard_near", 3, "sqrt", &ordinary);
#if !JL_REAL_FLOAT
    check_case("hard", 3, "joseph", &hard);
    check_case("hard", 3, "sqrt", &hard_sqrt);
    check_case("hardest", 3, "sqrt", &hardest);
    check_case("hardest_near", 3, "sqrt", &ordinary);
#endif
}

/* What is written is the number itself: read and written again it is the
 * same, and nothing is missing of it. */
static void test_filter_writes_17_digits(void **state)
{
    char *text = filtered(GOLDEN "bank12/model.json", GOLDEN "bank12/z.csv");
    char *rest = strchr(text, '\n') + 1, *field;
    int full = 0, fields = 0;

    (void)state;
    while ((field = strsep(&rest, ",\n")) != NULL && field[0] != '\0') {
        char again[40];
        double v = strtod(field, NULL);

        snprintf(again, sizeof again, "%.17g", v);
        assert_string_equal(field, again);
#if JL_REAL_FLOAT
        assert_true((double)(float)v >= v && (double)(float)v <= v);
#endif
        snprintf(again, sizeof again, "%.15g", v);
        full += strcmp(field, again) != 0;
        fields++;
    }
    assert_true(fields > 1000);
    assert_true(full > fields / 2);
    free(text);
}

/* --- parallel ------------------------------------------------------------ */

#define PATIENTLY "--timeout", "20"     /* on a machine that is busy */

#define same_on(port, pes, serial, ...) do { \
    char *parallel_ = filtered(__VA_ARGS__, "--port", port, "--pes", pes, \
                               PATIENTLY); \
    check_same_text(serial, parallel_); \
    free(parallel_); \
} while (0)

#define same_for_all_pes(port, serial, ...) do { \
    same_on(port, "1", serial, __VA_ARGS__); \
    same_on(port, "2", serial, __VA_ARGS__); \
    same_on(port, "3", serial, __VA_ARGS__); \
    same_on(port, "4", serial, __VA_ARGS__); \
    same_on(port, "8", serial, __VA_ARGS__); \
} while (0)

static const char *const topologies[] = { "full", "star", "ring", "chain" };

static void test_filter_parallel_on_every_topology(void **state)
{
    const char *model = GOLDEN "bank12/model.json";
    const char *data = program_head("bank12.csv", GOLDEN "bank12/z.csv", 31);
    char *serial = filtered(model, data);
    int t;

    (void)state;
    for (t = 0; t < 4; t++) {
        same_for_all_pes("loop", serial, model, data, "--topology",
                         topologies[t]);
        same_on("lcm", "5", serial, model, data, "--topology", topologies[t]);
    }
    free(serial);
}

/* The chains of the ordinary cases are all sticky. */
static void test_filter_all_reduce_meets_serial(void **state)
{
    static const char *const pes[] = { "2", "3", "5" };
#if JL_REAL_FLOAT
    static const struct tolerance close = { 2e-2, 2e-3, 2e-3, 1e-3 };
#else
    static const struct tolerance close = { 1e-11, 1e-11, 1e-11, 1e-11 };
#endif
    char model[400], data[400], *serial, *reduced;
    size_t i;
    int k;

    (void)state;
    for (i = 0; i < CASES; i++) {
        snprintf(model, sizeof model, GOLDEN "%s/model.json", cases[i].name);
        snprintf(data, sizeof data, GOLDEN "%s/z.csv", cases[i].name);
        serial = filtered(model, data);
        for (k = 0; k < 24; k++) {
            reduced = filtered(model, data, "--port", "loop", "--pes",
                               pes[k % 3], "--topology", topologies[k / 6],
                               "--exchange", "reduce", "--form",
                               k / 3 % 2 ? "sqrt" : "joseph");
            check_close(reduced, serial, cases[i].n, &close);
            free(reduced);
        }
        free(serial);
    }
}

static void test_filter_all_reduce_refuses_other_chains(void **state)
{
    (void)state;
    run_jumplink("filter", DATA "eight_modes.json", DATA
                 "carrier_held_1hz.csv", "--z", "east_m,north_m", "--port",
                 "loop", "--exchange", "reduce");
    assert_int_equal(ran.status, 1);
    assert_non_null(strstr(ran.err, "carrier_held_1hz.csv:3: the step fails: "
                           "the chain is not diag(lambda) + 1 v'"));
}

static void test_filter_parallel_sticky_chain(void **state)
{
    const char *model = GOLDEN "bank12/model.json";
    const char *data = program_head("bank12.csv", GOLDEN "bank12/z.csv", 101);
    char *serial = filtered(model, data);
    char *standard = filtered(model, data, "--form", "standard");
    char *factors = filtered(model, data, "--form", "sqrt");

    (void)state;
    same_for_all_pes("loop", serial, model, data);
    same_for_all_pes("threads", serial, model, data);
    same_for_all_pes("lcm", serial, model, data);
    same_on("loop", "4", standard, model, data, "--form", "standard");
    same_on("threads", "4", standard, model, data, "--form", "standard");
    same_on("lcm", "4", standard, model, data, "--form", "standard");
    same_on("loop", "4", factors, model, data, "--form", "sqrt");
    same_on("threads", "4", factors, model, data, "--form", "sqrt");
    same_on("lcm", "4", factors, model, data, "--form", "sqrt");
    assert_true(strcmp(serial, standard) != 0);
    assert_true(strcmp(serial, factors) != 0);
    free(serial);
    free(standard);
    free(factors);
}

static void test_filter_parallel_general_chain(void **state)
{
    const char *data = program_head("sight.csv", DATA "sightseeing_1hz.csv",
                                    201);
    char *serial = filtered(EIGHT, data, FLIGHT);
    char *all = filtered(EIGHT, DATA "sightseeing_1hz.csv", FLIGHT);

    (void)state;
    same_for_all_pes("loop", serial, EIGHT, data, FLIGHT);
    same_for_all_pes("threads", serial, EIGHT, data, FLIGHT);
    same_for_all_pes("lcm", serial, EIGHT, data, FLIGHT);
    same_on("loop", "3", all, EIGHT, DATA "sightseeing_1hz.csv", FLIGHT);
    same_on("threads", "3", all, EIGHT, DATA "sightseeing_1hz.csv", FLIGHT);
    free(serial);
    free(all);
}

static void test_filter_parallel_kf(void **state)
{
    const char *data = program_head("kf.csv", DATA "carrier_held_1hz.csv",
                                    101);
    char *serial = filtered(TWO, data, FLIGHT, "--filter", "kf", "--mode",
                            "1");

    (void)state;
    same_for_all_pes("loop", serial, TWO, data, FLIGHT, "--filter", "kf",
                     "--mode", "1");
    same_for_all_pes("threads", serial, TWO, data, FLIGHT, "--filter", "kf",
                     "--mode", "1");
    same_for_all_pes("lcm", serial, TWO, data, FLIGHT, "--filter", "kf",
                     "--mode", "1");
    free(serial);
}

static void test_filter_parallel_irregular_times(void **state)
{
    const char *data = program_head("glider.csv", DATA "glider_irregular.csv",
                                    301);
    char *serial = filtered(EIGHT, data, FLIGHT);
    char *all = filtered(EIGHT, DATA "glider_irregular.csv", FLIGHT);

    (void)state;
    same_on("loop", "1", serial, EIGHT, data, FLIGHT);
    same_on("loop", "8", serial, EIGHT, data, FLIGHT);
    same_on("threads", "8", serial, EIGHT, data, FLIGHT);
    same_on("lcm", "3", serial, EIGHT, data, FLIGHT);
    same_on("loop", "4", all, EIGHT, DATA "glider_irregular.csv", FLIGHT);
    free(serial);
    free(all);
}

/* Modes of the catalogue with different numbers of noises. */
static void test_filter_parallel_singer(void **state)
{
    const char *model = scratch_write("singer.json",
        "{ \"kind\": \"imm\", \"axes\": 2, \"order\": 3, \"sigma_z\": 20,\n"
        "  \"sojourn_s\": [40, 20, 10], \"modes\": [\n"
        "  {\"type\": \"singer\", \"accel_std\": 3, \"tau_s\": 8},\n"
        "  {\"type\": \"cv\", \"accel_std\": 0.3},\n"
        "  {\"type\": \"ca\", \"accel_std\": 1} ] }\n");
    const char *data = program_head("glide.csv", DATA "glider_irregular.csv",
                                    301);
    char *serial = filtered(model, data, FLIGHT);
    char *one = filtered(model, data, FLIGHT, "--filter", "kf", "--mode", "0");

    (void)state;
    same_on("loop", "2", serial, model, data, FLIGHT);
    same_on("threads", "3", serial, model, data, FLIGHT);
    same_on("lcm", "2", serial, model, data, FLIGHT);
    same_on("loop", "2", one, model, data, FLIGHT, "--filter", "kf", "--mode",
            "0");
    free(serial);
    free(one);
}

static void test_filter_parallel_held_positions(void **state)
{
    const char *data = program_head("held.csv", DATA "carrier_held_1hz.csv",
                                    301);
    char *detect = filtered(EIGHT, data, FLIGHT, "--hold", "detect");
    char *none = filtered(EIGHT, data, FLIGHT, "--hold", "none");

    (void)state;
    assert_true(strcmp(detect, none) != 0);
    same_on("loop", "4", detect, EIGHT, data, FLIGHT, "--hold", "detect");
    same_on("threads", "4", detect, EIGHT, data, FLIGHT, "--hold", "detect");
    same_on("lcm", "4", detect, EIGHT, data, FLIGHT, "--hold", "detect");
    same_on("loop", "4", none, EIGHT, data, FLIGHT, "--hold", "none");
    free(detect);
    free(none);
}

/* --port without --pes, and the reverse, are the same too. */
static void test_filter_parallel_default_pes(void **state)
{
    char *serial = filtered(CVCA3);
    char *loop = filtered(CVCA3, "--port", "loop");
    char *threads = filtered(CVCA3, "--port", "threads");
    char *lcm = filtered(CVCA3, "--port", "lcm", PATIENTLY);
    char *three = filtered(CVCA3, "--pes", "3", PATIENTLY);

    (void)state;
    check_same_text(serial, loop);
    check_same_text(serial, threads);
    check_same_text(serial, lcm);
    check_same_text(serial, three);
    free(serial);
    free(loop);
    free(threads);
    free(lcm);
    free(three);
    check_nobody_left();
}

/* --- rows ---------------------------------------------------------------- */

/* What stands after the n-th comma of every row, below the header. */
static char *cut_columns(const char *text, int n)
{
    char *cut = strdup(""), *line, *copy = strdup(text), *rest;

    rest = strchr(copy, '\n') + 1;
    while ((line = strsep(&rest, "\n")) != NULL && line[0] != '\0') {
        char *longer;
        int i;

        for (i = 0; i < n; i++)
            line = strchr(line, ',') + 1;
        scratch_must(asprintf(&longer, "%s%s\n", cut, line) >= 0, "memory");
        free(cut);
        cut = longer;
    }
    free(copy);
    return cut;
}

static void test_filter_runs_are_filtered_on_their_own(void **state)
{
    static const char a[] = "0,1,2\n1,9,-3\n2.5,20,7\n4,28,4\n";
    static const char b[] = "0,100,50\n2,90,60\n3,,\n5,80,71\n";
    char text[400], *both, *one, *two, *cut, *rest;
    const char *path;

    (void)state;
    snprintf(text, sizeof text, "t_s,z0,z1\n%s", a);
    one = filtered(TWO, scratch_write("a.csv", text));
    snprintf(text, sizeof text, "t_s,z0,z1\n%s", b);
    two = filtered(TWO, scratch_write("b.csv", text));
    path = scratch_write("ab.csv", "t_s,run,z0,z1\n"
                         "0,7,1,2\n1,7,9,-3\n2.5,7,20,7\n4,7,28,4\n"
                         "0,-2,100,50\n2,-2,90,60\n3,-2,,\n5,-2,80,71\n");
    both = filtered(TWO, path);
    assert_int_equal(strncmp(both, "run,t_s,x0,", 11), 0);
    assert_non_null(strstr(both, "\n7,2.5,"));
    assert_non_null(strstr(both, "\n-2,5,"));
    cut = cut_columns(both, 1);
    rest = strchr(one, '\n') + 1;
    assert_int_equal(strncmp(cut, rest, strlen(rest)), 0);
    check_same_text(cut + strlen(rest), strchr(two, '\n') + 1);
    same_on("loop", "2", both, TWO, path);
    same_on("threads", "2", both, TWO, path);
    same_on("lcm", "2", both, TWO, path);
    free(both);
    free(one);
    free(two);
    free(cut);
}

/* The matrices' start, too, is every run's. */
static void test_filter_runs_with_matrices(void **state)
{
    const char *model = GOLDEN "cvca3/model.json";
    char *one = filtered(model, scratch_write("m1.csv", "k,z0\n1,5\n2,900\n"));
    char *two = filtered(model, scratch_write("m2.csv", "run,k,z0\n"
                                              "0,1,5\n0,2,900\n"
                                              "1,1,5\n1,2,900\n"));
    char *cut = cut_columns(two, 1), *want = strchr(one, '\n') + 1;

    (void)state;
    assert_int_equal(strncmp(cut, want, strlen(want)), 0);
    check_same_text(cut + strlen(want), want);
    free(one);
    free(two);
    free(cut);
}

/* The same estimates as of rows whose lost measurements are left out. */
static void check_hold(const char *data, const char *plain, const char *hold)
{
    char *want, *got;

    want = filtered(TWO, scratch_write("plain.csv", plain), "--hold", "none");
    got = hold == NULL ? filtered(TWO, scratch_write("hold.csv", data))
        : filtered(TWO, scratch_write("hold.csv", data), "--hold", hold);
    check_same_text(got, want);
    free(got);
    free(want);
}

static const char all_rows[] = "t_s,z0,z1\n0,1,2\n1,1,2\n2,1,3\n3,1,3\n4,4,5\n"
                               "5,,\n6,4,5\n";

static void test_filter_hold_detect(void **state)
{
    (void)state;
    /* One that repeats only in part is no repetition; neither is one that
     * repeats what stood before a gap. */
    check_hold(all_rows, "t_s,z0,z1\n0,1,2\n1,,\n2,1,3\n3,,\n4,4,5\n5,,\n"
               "6,4,5\n", "detect");
    /* A run does not repeat the one before. */
    check_hold("run,t_s,z0,z1\n0,0,1,2\n0,1,1,2\n1,0,1,2\n1,1,4,5\n",
               "run,t_s,z0,z1\n0,0,1,2\n0,1,,\n1,0,1,2\n1,1,4,5\n", "detect");
}

static const char flagged[] = "t_s,arrived,z0,z1\n0,0,9,9\n1,1,1,2\n2,0,1,3\n"
                              "3,1,1,3\n4,0,4,5\n5,1,,\n6,1,4,5\n";

static void test_filter_hold_column(void **state)
{
    static const char plain[] = "t_s,z0,z1\n0,,\n1,1,2\n2,,\n3,1,3\n4,,\n"
                                "5,,\n6,4,5\n";

    (void)state;
    check_hold(flagged, plain, "column");
    check_hold(flagged, plain, NULL);   /* the default, as there is one */
}

static void test_filter_hold_none(void **state)
{
    static const char plain[] = "t_s,z0,z1\n0,9,9\n1,1,2\n2,1,3\n3,1,3\n"
                                "4,4,5\n5,,\n6,4,5\n";

    (void)state;
    check_hold(flagged, plain, "none");
    check_hold(all_rows, all_rows, NULL);
}

/* Column by name in a table. */
static int find_column(const struct table *t, const char *name)
{
    char *copy = strdup(t->header), *rest = copy, *word;
    int i, found = -1;

    for (i = 0; (word = strsep(&rest, ",")) != NULL; i++)
        if (strcmp(word, name) == 0)
            found = i;
    free(copy);
    assert_true(found >= 0);
    return found;
}

static double value(const struct table *t, int row, const char *name)
{
    return table_at(t, row, find_column(t, name));
}

static void check_start_row(const struct table *t, int row)
{
    assert_close(value(t, row, "x0"), 5, 0);
    assert_close(value(t, row, "x1"), 0, 0);
    assert_close(value(t, row, "x2"), -7, 0);
    assert_close(value(t, row, "x3"), 0, 0);
    assert_close(value(t, row, "P00"), 400, 0);
    assert_close(value(t, row, "P11"), 10000, 0);
    assert_close(value(t, row, "P22"), 400, 0);
    assert_close(value(t, row, "P01"), 0, 0);
    assert_close(value(t, row, "mu0"), 0.5, 0);
    assert_close(value(t, row, "mu1"), 0.5, 0);
    assert_close(value(t, row, "loglik"), 0, 0);
}

static void test_filter_starts_at_the_first_measurement(void **state)
{
    char *text = filtered(TWO, scratch_write("late.csv", "t_s,z0,z1\n0,,\n"
                                             "1,nan,NaN\n5,5,-7\n6,,\n"
                                             "7,6,1\n"));
    struct table t;
    int i;

    (void)state;
    table_take(&t, text);
    assert_int_equal(t.rows, 5);
    for (i = 1; i < t.columns; i++) {
        assert_true(isnan(table_at(&t, 0, i)));
        assert_true(isnan(table_at(&t, 1, i)));
    }
    assert_non_null(strstr(text, "\n1,nan,nan,"));
    check_start_row(&t, 2);
    /* Lost: predicted only.  Mixing weights sum to 1 but for rounding. */
    assert_close(value(&t, 3, "x0"), 5, 5 * 4 * JL_EPSILON);
    assert_close(value(&t, 3, "loglik"), 0, 0);
    assert_true(value(&t, 3, "P00") > 10000);
    assert_true(value(&t, 4, "P00") < 400);
    assert_true(value(&t, 4, "loglik") < 0);
    table_free(&t);
    free(text);
}

static void test_filter_without_any_measurement(void **state)
{
    char *text = filtered(TWO, scratch_write("empty.csv",
                                             "t_s,z0,z1\n0,,\n1,,\n"));
    const char *path = scratch_write("lost.csv", "k,z0\n1,\n2,\n");
    struct table t;

    (void)state;
    table_take(&t, text);
    assert_int_equal(t.rows, 2);
    assert_true(isnan(table_at(&t, 1, 1)));
    table_free(&t);
    free(text);
    text = filtered(GOLDEN "cvca3/model.json", path);   /* has its x0 */
    table_take(&t, text);
    assert_close(value(&t, 1, "loglik"), 0, 0);
    assert_true(isfinite(value(&t, 0, "x0")));
    table_free(&t);
    free(text);
}

/* Columns by name; the time is written as it was read. */
static void test_filter_columns_by_name(void **state)
{
    char *plain = filtered(TWO, scratch_write("p.csv", "t_s,z1,z0\n"
                                              "0.50,2,1\n1e1,3,4\n"));
    char *named = filtered(TWO, scratch_write("n.csv", "north,k,at,east\n"
                                              "2,x,0.50,1\n3,y,1e1,4\n"),
                           "--z", "east,north", "--time", "at");

    (void)state;
    assert_non_null(strstr(plain, "\n0.50,1,0,2,0,"));
    assert_non_null(strstr(plain, "\n1e1,"));
    assert_int_equal(strncmp(named, "at,", 3), 0);
    check_same_text(strchr(plain, '\n'), strchr(named, '\n'));
    free(plain);
    free(named);
}

/* --- kf ------------------------------------------------------------------ */

static const char agitated[] = "{ \"kind\": \"imm\", \"axes\": 2, \"order\": 2,"
    " \"sigma_z\": 20.0, \"sojourn_s\": [20],"
    " \"modes\": [ {\"type\": \"cv\", \"accel_std\": 4.0} ] }";

static void test_filter_kf_is_one_mode(void **state)
{
    const char *one = scratch_write("one.json", agitated);
    const char *data = program_head("k.csv", DATA "carrier_held_1hz.csv", 101);
    char *alone = filtered(one, data, FLIGHT);
    char *only = filtered(one, data, FLIGHT, "--filter", "kf");
    char *second = filtered(TWO, data, FLIGHT, "--filter", "kf", "--mode",
                            "1");
    char *first = filtered(TWO, data, FLIGHT, "--filter", "kf", "--mode", "0");

    (void)state;
    check_same_text(alone, only);
    check_same_text(alone, second);
    assert_true(strcmp(first, second) != 0);
    assert_non_null(strstr(second, ",mu0,loglik\n"));
    free(alone);
    free(only);
    free(second);
    free(first);
}

static void test_filter_kf_of_matrices(void **state)
{
    char *first = filtered(CVCA3, "--filter", "kf", "--mode", "0");
    char *second = filtered(CVCA3, "--filter", "kf", "--mode", "1");

    (void)state;
    assert_true(strcmp(first, second) != 0);
    same_on("loop", "3", second, CVCA3, "--filter", "kf", "--mode", "1");
    same_on("lcm", "2", second, CVCA3, "--filter", "kf", "--mode", "1");
    free(first);
    free(second);
}

/* --- output -------------------------------------------------------------- */

static void check_written(const char *option, const char *path,
                          const char *want)
{
    char *text;

    run_jumplink("filter", CVCA3, option, path);
    check_good(&ran);
    assert_string_equal(ran.out, "");
    text = program_file(path);
    check_same_text(text, want);
    free(text);
}

static void test_filter_output_file(void **state)
{
    char *want = filtered(CVCA3);
    const char *path = scratch_path("estimates.csv");
    int before = scratch_count();

    (void)state;
    check_written("-o", path, want);
    check_written("--out", scratch_write("estimates.csv", "old\n"), want);
    assert_int_equal(scratch_count(), before + 1);
    run_jumplink("filter", CVCA3, "-o", "-");
    check_good(&ran);
    check_same_text(ran.out, want);
    free(want);
}

static void test_filter_output_that_cannot_be_written(void **state)
{
    (void)state;
    run_jumplink("filter", CVCA3, "-o", scratch_path("no/where.csv"));
    check_refused(&ran, 1, "no/where.csv|No such file");
    run_jumplink("filter", CVCA3, "-o", scratch_dir);
    check_refused(&ran, 1, "directory");
    run_jumplink("filter", TWO, scratch_write("full.csv", "t_s,z0,z1\n1,2,3\n"),
                 "-o", "/dev/full");
    check_refused(&ran, 1, "/dev/full|No space");
    /* More than fits the stream's buffer: fails before it is closed. */
    run_jumplink("filter", CVCA3, "-o", "/dev/full");
    check_refused(&ran, 1, "/dev/full|No space");
}

/* A step that fails: a line that says why and one about what is kept; no file,
 * or the old one as it was; and beside it what was done before. */
static void check_step_failed(const char *where, const char *partial)
{
    check_ended(&ran, where);
    check_ended(&ran, "step fails");
    assert_non_null(strstr(ran.err, "partial: the first 2 of 4 rows"));
    assert_int_equal(table_count(ran.err, '\n'), 2);
    assert_non_null(strstr(partial, "# partial: 2 of 4 rows\n"));
    assert_int_equal(table_count(partial, '\n'), 4);
}

#define check_step_fails(where, ...) do { \
    int before_ = scratch_count(); \
    const char *path_ = scratch_path("unborn.csv"); \
    char *old_, *partial_; \
    run_jumplink("filter", __VA_ARGS__, "-o", path_); \
    assert_null(scratch_read(path_)); \
    partial_ = program_file(scratch_path("unborn.csv.partial")); \
    check_step_failed(where, partial_); \
    assert_string_equal(ran.out, ""); \
    assert_int_equal(remove(scratch_path("unborn.csv.partial")), 0); \
    assert_int_equal(scratch_count(), before_); \
    path_ = scratch_write("kept.csv", "old\n"); \
    run_jumplink("filter", __VA_ARGS__, "-o", path_); \
    check_step_failed(where, partial_); \
    old_ = program_file(path_); \
    assert_string_equal(old_, "old\n"); \
    free(old_); \
    free(partial_); \
    run_jumplink("filter", __VA_ARGS__); \
    check_step_failed(where, ran.out); \
} while (0)

static void test_filter_step_that_fails(void **state)
{
    const char *model = GOLDEN "cvca3/model.json";
    char *data = strdup(scratch_write("huge.csv", JL_REAL_FLOAT
                                      ? "k,z0\n1,5\n2,7\n3,1e30\n4,8\n"
                                      : "k,z0\n1,5\n2,7\n3,1e200\n4,8\n"));

    (void)state;
    check_step_fails("huge.csv:4: ", model, data);
    check_step_fails("huge.csv:4: ", model, data, "--form", "standard");
    check_step_fails("huge.csv:4: ", model, data, "--port", "loop");
    check_step_fails("huge.csv:4: ", model, data, "--port", "threads");
    check_step_fails("huge.csv:4: ", model, data, "--port", "lcm",
                     PATIENTLY);
    check_nobody_left();
    /* a run that succeeds leaves nothing of one that failed */
    free(program_file(scratch_path("kept.csv.partial")));
    run_jumplink("filter", CVCA3, "-o", scratch_path("kept.csv"));
    check_good(&ran);
    assert_null(scratch_read(scratch_path("kept.csv.partial")));
    free(data);
}

/* --- wrong use ----------------------------------------------------------- */

#define refused(words, ...) do { \
    run_jumplink(__VA_ARGS__); \
    check_refused(&ran, 2, words); \
} while (0)

static void test_program_wrong_use(void **state)
{
    (void)state;
    refused("unknown command 'nonsense'|--help", "nonsense");
    refused("unknown command '--nonsense'", "--nonsense");
    refused("unknown command ''", "");
    run_file_told(JUMPLINK, (const char *const[]){ NULL });
    assert_int_equal(ran.status, 2);
    assert_string_equal(ran.out, "");
    assert_non_null(strstr(ran.err, "usage: jumplink"));
    refused("MODEL.json and DATA.csv", "filter");
    refused("MODEL.json and DATA.csv", "filter", "one.json");
    refused("MODEL.json and DATA.csv", "filter", "a", "b", "c");
}

/* One line as for every other mistake, not getopt's own. */
static void test_filter_options_that_it_does_not_know(void **state)
{
    (void)state;
    refused("jumplink filter: |unknown option --bogus|--help", "filter", CVCA3,
            "--bogus");
    refused("jumplink filter: |unknown option -x|--help", "filter", CVCA3,
            "-x");
    refused("unknown option -x|--help", "filter", "--form=sqrt", "-xyz",
            CVCA3);
    refused("unknown option -d|--help", "filter", "-d", CVCA3);
    refused("--diagnostics=1|takes no value", "filter", "--diagnostics=1",
            CVCA3);
    refused("--help=1|takes no value", "filter", "--help=1", CVCA3);
    refused("jumplink filter: |--form needs a value", "filter", CVCA3,
            "--form");
    refused("jumplink filter: |-o needs a value", "filter", CVCA3, "-o");
}

static void test_filter_options_with_wrong_values(void **state)
{
    (void)state;
    refused("--filter|foo|imm, kf", "filter", CVCA3, "--filter", "foo");
    refused("--filter", "filter", CVCA3, "--filter", "");
    refused("--form|square|joseph, standard, sqrt", "filter", CVCA3, "--form",
            "square");
    refused("--hold|foo|none, detect, column", "filter", CVCA3, "--hold",
            "foo");
    refused("--port|udp|loop, threads, lcm", "filter", CVCA3, "--port", "udp");
    refused("--pes|0", "filter", CVCA3, "--port", "loop", "--pes", "0");
    refused("--pes|17|16", "filter", CVCA3, "--port", "loop", "--pes", "17");
    refused("--pes", "filter", CVCA3, "--port", "loop", "--pes", "");
    refused("--pes", "filter", CVCA3, "--port", "loop", "--pes", "2x");
    refused("--pes", "filter", CVCA3, "--port", "loop", "--pes",
            "99999999999999999999");
    refused("--mode|x", "filter", CVCA3, "--filter", "kf", "--mode", "x");
    refused("--mode|-1", "filter", CVCA3, "--filter", "kf", "--mode", "-1");
    refused("--timeout|0", "filter", CVCA3, "--timeout", "0");
    refused("--timeout|nan", "filter", CVCA3, "--timeout", "nan");
    refused("--timeout|2s", "filter", CVCA3, "--timeout", "2s");
    refused("--timeout|inf", "filter", CVCA3, "--timeout", "inf");
    refused("--out|empty", "filter", CVCA3, "--out", "");
    refused("--lcm-url foo|udpm://", "filter", CVCA3, "--port", "lcm",
            "--lcm-url", "foo");
}

static void test_filter_options_that_do_not_go_together(void **state)
{
    (void)state;
    refused("--lcm-url|--port lcm", "filter", CVCA3, "--lcm-url", "udpm://x");
    refused("--lcm-url|--port lcm", "filter", CVCA3, "--lcm-url", "udpm://x",
            "--port", "loop");
    refused("--run", "filter", CVCA3, "--run", "x");
    refused("--topology|--pes or --port", "filter", CVCA3, "--topology",
            "ring");
    refused("--exchange|--pes or --port", "filter", CVCA3, "--exchange",
            "reduce");
    refused("--mode|kf", "filter", CVCA3, "--mode", "1");
    refused("--mode|has 2", "filter", CVCA3, "--filter", "kf");
    refused("--mode 2|0 to 1", "filter", CVCA3, "--filter", "kf", "--mode",
            "2");
}

static void test_filter_files_that_do_not_fit(void **state)
{
    (void)state;
    refused("nothing.csv|No such file", "filter", TWO,
            scratch_path("nothing.csv"));
    refused("nothing.json|No such file", "filter",
            scratch_path("nothing.json"), DATA "carrier_held_1hz.csv");
    refused("z.csv:1: |2 measurements|cvca3/model.json needs 1", "filter",
            GOLDEN "cvca3/model.json", GOLDEN "bank12/z.csv");
    refused("z.csv:1: arrived|--hold column", "filter", CVCA3, "--hold",
            "column");
    refused("z.csv:1: t_s|--time", "filter", TWO, GOLDEN "bank12/z.csv");
    refused("z.csv:1: up|k, z0", "filter", CVCA3, "--z", "up");
    refused("z.csv:1: z0|twice", "filter", CVCA3, "--z", "z0,z0");
    refused("z.csv:1: at|k, z0", "filter", CVCA3, "--time", "at");
    refused("z.csv:1: ", "filter", GOLDEN "cvca3/z.csv",
            GOLDEN "cvca3/model.json");
}

/* What is wrong with the files is found before anybody is started. */
static void test_filter_files_that_do_not_fit_in_parallel(void **state)
{
    static const char *const ports[] = { "loop", "threads", "lcm" };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof ports / sizeof *ports; i++) {
        refused("z.csv:1: |2 measurements|cvca3/model.json needs 1", "filter",
                GOLDEN "cvca3/model.json", GOLDEN "bank12/z.csv", "--port",
                ports[i]);
        refused("z.csv:1: arrived|--hold column", "filter", CVCA3, "--hold",
                "column", "--port", ports[i]);
    }
}

/* --- help ---------------------------------------------------------------- */

static void check_help(const char *command, const char *option,
                       const char *words)
{
    char *copy = strdup(words), *rest = copy, *word;

    if (command != NULL)
        run_jumplink(command, option);
    else
        run_jumplink(option);
    check_good(&ran);
    assert_int_equal(strncmp(ran.out, "usage: jumplink", 15), 0);
    while ((word = strsep(&rest, " ")) != NULL)
        if (strstr(ran.out, word) == NULL)
            program_fail(&ran, word);
    free(copy);
}

static void test_help_names_every_option(void **state)
{
    static const struct {
        const char *command, *words;
    } helps[] = {
        { NULL, "sim filter host pe --help --version" },
        { "sim", "--data --model --out -o --pes --port --filter --mode --form "
                 "--gate --gate-most --hold --z --time --timeout --lcm-url "
                 "--run --input --idle" },
        { "filter", "MODEL.json DATA.csv --out -o --filter --mode --form "
                    "--gate --gate-most --diagnostics --truth --hold --z "
                    "--time --port --pes --timeout --lcm-url --run "
                    /* columns, and what a model must have */
                    "nis nis_mean rejected nees arrived run nan "
                    "\"kind\": \"modes\": sigma_z sojourn_s Pi mu0 x0 P0" },
        { "host", "MODEL.json DATA.csv --out -o --filter --mode --form "
                  "--gate --gate-most --hold --z --time --pes --run --timeout "
                  "--start --lcm-url" },
        { "pe", "--pe --pes --model --run --timeout --start --lcm-url "
                "--filter --mode --form --gate --gate-most" },
    };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof helps / sizeof *helps; i++) {
        check_help(helps[i].command, "--help", helps[i].words);
        check_help(helps[i].command, "-h", helps[i].words);
    }
    run_jumplink("--version");
    check_good(&ran);
    assert_non_null(strstr(ran.out, JL_REAL_FLOAT ? "(float)" : "(double)"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_filter_meets_reference),
        cmocka_unit_test(test_filter_writes_17_digits),
        cmocka_unit_test(test_filter_parallel_on_every_topology),
        cmocka_unit_test(test_filter_all_reduce_meets_serial),
        cmocka_unit_test(test_filter_all_reduce_refuses_other_chains),
        cmocka_unit_test(test_filter_parallel_sticky_chain),
        cmocka_unit_test(test_filter_parallel_general_chain),
        cmocka_unit_test(test_filter_parallel_kf),
        cmocka_unit_test(test_filter_parallel_irregular_times),
        cmocka_unit_test(test_filter_parallel_singer),
        cmocka_unit_test(test_filter_parallel_held_positions),
        cmocka_unit_test(test_filter_parallel_default_pes),
        cmocka_unit_test(test_filter_runs_are_filtered_on_their_own),
        cmocka_unit_test(test_filter_runs_with_matrices),
        cmocka_unit_test(test_filter_hold_detect),
        cmocka_unit_test(test_filter_hold_column),
        cmocka_unit_test(test_filter_hold_none),
        cmocka_unit_test(test_filter_starts_at_the_first_measurement),
        cmocka_unit_test(test_filter_without_any_measurement),
        cmocka_unit_test(test_filter_columns_by_name),
        cmocka_unit_test(test_filter_kf_is_one_mode),
        cmocka_unit_test(test_filter_kf_of_matrices),
        cmocka_unit_test(test_filter_output_file),
        cmocka_unit_test(test_filter_output_that_cannot_be_written),
        cmocka_unit_test(test_filter_step_that_fails),
        cmocka_unit_test(test_program_wrong_use),
        cmocka_unit_test(test_filter_options_that_it_does_not_know),
        cmocka_unit_test(test_filter_options_with_wrong_values),
        cmocka_unit_test(test_filter_options_that_do_not_go_together),
        cmocka_unit_test(test_filter_files_that_do_not_fit),
        cmocka_unit_test(test_filter_files_that_do_not_fit_in_parallel),
        cmocka_unit_test(test_help_names_every_option),
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
