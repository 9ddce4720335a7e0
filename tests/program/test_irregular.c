/* `jumplink filter` over a record with gaps: a glider heard every 7 s or so,
 * but once not for 957 s.  All motions of the catalogue, both forms. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#include "jumplink/base.h"

#define GLIDER TOP_DIR "/sim/data/glider_irregular.csv"
#define ROWS 2697
#define BEFORE_THE_GAP 932      /* rows before the 957 s without a report */
#define M 4                     /* modes of each model */

/* In the gap one mode turns by 2871 rad. */
static const char order_2[] =
    "{ \"kind\": \"imm\", \"axes\": 2, \"order\": 2, \"sigma_z\": 20,\n"
    "  \"sojourn_s\": [60, 10, 20, 20], \"modes\": [\n"
    "  {\"type\": \"cv\", \"accel_std\": 0.3},\n"
    "  {\"type\": \"cv\", \"accel_std\": 4},\n"
    "  {\"type\": \"ct\", \"accel_std\": 0.5, \"turn_rate\": 0.3},\n"
    "  {\"type\": \"ct\", \"accel_std\": 0.5, \"turn_rate\": -3} ] }\n";

static const char order_3[] =
    "{ \"kind\": \"imm\", \"axes\": 2, \"order\": 3, \"sigma_z\": 20,\n"
    "  \"sojourn_s\": [60, 10, 20, 20], \"modes\": [\n"
    "  {\"type\": \"cv\", \"accel_std\": 0.3},\n"
    "  {\"type\": \"ca\", \"accel_std\": 1},\n"
    "  {\"type\": \"singer\", \"accel_std\": 3, \"tau_s\": 8},\n"
    "  {\"type\": \"ct\", \"accel_std\": 0.5, \"turn_rate\": 0.3} ] }\n";

static const double sojourn_s[M] = { 60, 10, 20, 20 };

static const struct {
    const char *model;
    int n;
    const char *form;
    double accel_std[M];        /* of white acceleration */
} ways[] = {
    { order_2, 4, "joseph", { 0.3, 4, 0.5, 0.5 } },
    { order_2, 4, "standard", { 0.3, 4, 0.5, 0.5 } },
    { order_3, 6, "joseph", { 0.3, 1, 0, 0.5 } },
    { order_3, 6, "standard", { 0.3, 1, 0, 0.5 } }
};

#define WAYS (sizeof ways / sizeof *ways)

static void run(struct table *t, size_t way, const char *data)
{
    run_jumplink("filter", scratch_write("model.json", ways[way].model), data,
                 "--z", "east_m,north_m", "--form", ways[way].form);
    check_good(&ran);
    table_take(t, ran.out);
}

/* The columns: t_s, x [n], P packed, mu [M], loglik. */
static int column_P(int n, int i)
{
    return 1 + n + i * n - i * (i - 1) / 2;
}

static int column_mu(int n, int j)
{
    return 1 + n + n * (n + 1) / 2 + j;
}

static void check_probabilities(const struct table *t, int row, int n)
{
    double sum = 0;
    int j;

    for (j = 0; j < M; j++) {
        const double mu = table_at(t, row, column_mu(n, j));

        assert_true(mu >= 0 && mu <= 1);
        sum += mu;
    }
    assert_close(sum, 1, 4 * (double)JL_EPSILON);
}

/* --- the whole record ---------------------------------------------------- */

/* The form standard subtracts: in float, nothing of 20 m is left beside a
 * million after the gap, and that variance has no digit (kf.h). */
static int keeps_digits(size_t way)
{
    return !JL_REAL_FLOAT || strcmp(ways[way].form, "joseph") == 0;
}

static void test_irregular_every_row_is_an_estimate(void **state)
{
    size_t way;
    int row, i;

    (void)state;
    for (way = 0; way < WAYS; way++) {
        const int n = ways[way].n;
        struct table t;

        run(&t, way, GLIDER);
        assert_int_equal(t.rows, ROWS);
        assert_int_equal(t.columns, column_mu(n, M) + 1);
        for (row = 0; row < t.rows; row++) {
            for (i = 0; i < t.columns; i++)
                assert_true(isfinite(table_at(&t, row, i)));
            for (i = 0; i < n && keeps_digits(way); i++)
                assert_true(table_at(&t, row, column_P(n, i)) > 0);
            check_probabilities(&t, row, n);
        }
        table_free(&t);
    }
}

/* --- the gap ------------------------------------------------------------- */

/* The record up to the gap, and then `count` rows without a position, `step`
 * apart: to be freed. */
static char *up_to_the_gap(double step, int count)
{
    char *all = program_file(GLIDER), *end = all, *text;
    double last;
    size_t used;
    int i;

    for (i = 0; i < BEFORE_THE_GAP; i++)
        end = strchr(end, '\n') + 1;
    last = strtod(end, NULL);
    used = (size_t)(strchr(end, '\n') + 1 - all);
    text = malloc(used + (size_t)count * 40);
    scratch_must(text != NULL, "memory");
    memcpy(text, all, used);
    for (i = 1; i <= count; i++)
        used += (size_t)snprintf(text + used, 40, "%.3f,,,,,\n",
                                 last + i * step);
    free(all);
    return text;
}

/* The estimates over such a record, in the last two rows and before them. */
static void run_gap(struct table *t, size_t way, double step, int count)
{
    char *text = up_to_the_gap(step, count);

    run(t, way, scratch_write("gap.csv", text));
    free(text);
    assert_int_equal(t->rows, BEFORE_THE_GAP + count);
}

/* What the noise of the modes alone makes of a position's variance. */
static double noise_over(const struct table *t, size_t way, double gap)
{
    double sum = 0;
    int j;

    for (j = 0; j < M; j++)
        sum += table_at(t, t->rows - 1, column_mu(ways[way].n, j))
            * pow(ways[way].accel_std[j] * gap * gap / 2, 2);
    return sum;
}

static void test_irregular_variance_grows_with_the_gap(void **state)
{
    static const double gaps[] = { 1, 3, 7, 20, 60, 204, 396, 954, 957, 4000 };
    size_t way, g;
    int i;

    (void)state;
    for (way = 0; way < WAYS; way++) {
        double before[6] = { 0 };

        for (g = 0; g < sizeof gaps / sizeof *gaps; g++) {
            struct table t;

            run_gap(&t, way, gaps[g], 1);
            for (i = 0; i < ways[way].n; i += ways[way].n / 2) {
                const double P = table_at(&t, t.rows - 1,
                                          column_P(ways[way].n, i));

                assert_true(P > before[i]);
                assert_true(P > noise_over(&t, way, gaps[g]));
                before[i] = P;
            }
            table_free(&t);
        }
    }
}

/* mu_j = sum_i Pi[i][j] mu_i of the row before: stay exp(-gap / sojourn_s), or
 * jump anywhere alike. */
static void test_irregular_probabilities_follow_the_chain(void **state)
{
    static const double gaps[] = { 1, 7, 60, 957 };
    size_t way, g;
    int i, j;

    (void)state;
    for (way = 0; way < WAYS; way++)
        for (g = 0; g < sizeof gaps / sizeof *gaps; g++) {
            const int n = ways[way].n;
            struct table t;

            run_gap(&t, way, gaps[g], 1);
            check_probabilities(&t, t.rows - 1, n);
            for (j = 0; j < M; j++) {
                double want = 0;

                for (i = 0; i < M; i++) {
                    const double stay = exp(-gaps[g] / sojourn_s[i]);

                    want += table_at(&t, t.rows - 2, column_mu(n, i))
                        * (i == j ? stay : (1 - stay) / (M - 1));
                }
                assert_close(table_at(&t, t.rows - 1, column_mu(n, j)), want,
                             16 * (double)JL_EPSILON);
            }
            table_free(&t);
        }
}

/* A gap of rows without a measurement: the probabilities go where the chain
 * rests, sojourn_s / sum, within a tenth of step / shortest sojourn (model.h),
 * and nothing that comes between breaks the estimates. */
static void test_irregular_small_steps_go_to_the_stationary(void **state)
{
    static const double steps[] = { 1, 0.25 };
    size_t way, s;
    int j, row;

    (void)state;
    for (way = 0; way < WAYS; way++)
        for (s = 0; s < sizeof steps / sizeof *steps; s++) {
            const int n = ways[way].n;
            struct table t;

            run_gap(&t, way, steps[s], (int)(957 / steps[s]));
            for (j = 0; j < M; j++)
                assert_close(table_at(&t, t.rows - 1, column_mu(n, j)),
                             sojourn_s[j] / 110, steps[s] / 100);
            for (row = BEFORE_THE_GAP; row < t.rows; row++) {
                check_probabilities(&t, row, n);
                assert_true(table_at(&t, row, column_P(n, 0))
                            > table_at(&t, row - 1, column_P(n, 0)));
            }
            table_free(&t);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_irregular_every_row_is_an_estimate),
        cmocka_unit_test(test_irregular_variance_grows_with_the_gap),
        cmocka_unit_test(test_irregular_probabilities_follow_the_chain),
        cmocka_unit_test(test_irregular_small_steps_go_to_the_stationary),
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
