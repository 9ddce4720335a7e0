/* The systolic array on the MEKF's reference cases: in every step it gives what
 * jl_mekf_step gives, and in the end what 60 digits give. */
#include "close.h"

#include "jumplink/systolic.h"
#include "mekf_case.h"

/* How far off each may be; measured are, over all cases of a kind,
 *                      double                           float
 *     step, to filter  2.4e-15 |x|, 9.5e-14 sigma,      2.3e-6, 4.5e-5,
 *                      var 2.0e-15                      1.1e-6
 *     whole case       1.7e-13 max(1, |x|), var 2.2e-14 1.3e-4, 9.2e-6
 *     stress           9.5e-10 sigma,       var 7.2e-13 0.97 sigma, 6.3e-4
 * A step's |x| is of the whole vector: a turn rate is found from what is left
 * of z - c xp, of positions.  Of whole cases the filter itself is as far
 * off (test_golden_mekf.c). */
#if JL_REAL_FLOAT
#define STEP_STATE 5e-6
#define STEP_SIGMA 5e-4
#define STEP_VAR 1e-5
#define STATE 5e-4
#define VAR 5e-5
#define VAR_STRESS 0.02
#else
#define STEP_STATE 1e-13
#define STEP_SIGMA 1e-12
#define STEP_VAR 1e-13
#define STATE 1e-12
#define VAR 1e-12
#define SIGMA_STRESS 1e-8
#define VAR_STRESS 1e-10
#endif

static int is_stress(const struct mekf_case *c)
{
    return strncmp(c->name, "stress", 6) == 0;
}

static double sigma_stress(const struct mekf_case *c)
{
#if JL_REAL_FLOAT
    return strcmp(c->name, "stress32") == 0 ? 1 : 3;
#else
    (void)c;
    return SIGMA_STRESS;
#endif
}

static jl_systolic_cell cells[2 * JL_SYSTOLIC_CELLS(4, 1, 3)
                              + 2 * JL_SYSTOLIC_CELLS(3, 2, 2)];
static jl_real mem[JL_SYSTOLIC_STATE(4, 1, 3, 2, 1)
                   + JL_SYSTOLIC_STATE(3, 2, 2, 2, 1)];

static void diagonal(double *d, const jl_real *P, int n)
{
    int i;

    for (i = 0; i < n; i++)
        d[i] = (double)P[i * (n + 1)];
}

/* |x - want| / |want|, by the largest elements. */
static double apart(const jl_real *x, const jl_real *want, int n)
{
    double error = 0, size = 0;
    int i;

    for (i = 0; i < n; i++) {
        error = fmax(error, fabs((double)x[i] - (double)want[i]));
        size = fmax(size, fabs((double)want[i]));
    }
    return error / size;
}

static void widen(double *to, const jl_real *from, int n)
{
    int i;

    for (i = 0; i < n; i++)
        to[i] = (double)from[i];
}

static int start(jl_systolic *array, const jl_mekf *filter,
                 const jl_systolic_schedule *schedule)
{
    return jl_systolic_init(array, filter, schedule, cells,
                            (int)(sizeof cells / sizeof *cells), mem,
                            (int)(sizeof mem / sizeof *mem));
}

/* Every step from the filter's state: how far from where the filter goes. */
static void step_by_step(struct mekf_worst *worst, double *relative,
                         const struct mekf_case *c,
                         const jl_systolic_schedule *schedule)
{
    static struct mekf_filter m;
    struct mekf_given g;
    jl_systolic array;
    int n = c->n, N = n + c->m, k;
    jl_real z[CASE_R], P[CASE_N * CASE_N], P1[CASE_N * CASE_N];
    double var[CASE_N], want[CASE_N], want_var[CASE_N];

    mekf_give(&g, c);
    assert_int_equal(mekf_start(&m, &g), JL_OK);
    memset(worst, 0, sizeof *worst);
    *relative = 0;
    for (k = 0; k < c->rows; k++) {
        mekf_z(z, c, k);
        assert_int_equal(start(&array, &m.f, schedule), JL_OK);
        assert_int_equal(jl_systolic_step(&array, z), JL_OK);
        assert_int_equal(jl_mekf_step(&m.f, z, m.scratch), JL_OK);
        jl_systolic_cov(&array, P, P1);
        diagonal(var, P, N);
        mekf_variances(want_var, m.f.U, N);
        widen(want, m.f.x, N);
        mekf_judge(worst, array.x, var, want, want_var, N);
        diagonal(var, P1, n);
        mekf_variances(want_var, m.f.U1, n);
        widen(want, m.f.xhat, n);
        mekf_judge(worst, array.xhat, var, want, want_var, n);
        *relative = fmax(*relative, apart(array.x, m.f.x, N));
        *relative = fmax(*relative, apart(array.xhat, m.f.xhat, n));
    }
}

/* The whole case: how far from 60 digits. */
static void run(struct mekf_worst *worst, const struct mekf_case *c,
                const jl_systolic_schedule *schedule)
{
    static struct mekf_filter m;
    struct mekf_given g;
    jl_systolic array;
    int n = c->n, N = n + c->m, k;
    jl_real z[CASE_R], P[CASE_N * CASE_N], P1[CASE_N * CASE_N];
    const double *want = c->expected;
    double var[CASE_N];

    mekf_give(&g, c);
    assert_int_equal(mekf_start(&m, &g), JL_OK);
    assert_int_equal(start(&array, &m.f, schedule), JL_OK);
    memset(worst, 0, sizeof *worst);
    for (k = 0; k < c->rows; k++, want += 2 * N + 2 * n) {
        assert_int_equal(jl_systolic_step(&array, mekf_z(z, c, k)), JL_OK);
        jl_systolic_cov(&array, P, P1);
        diagonal(var, P, N);
        mekf_judge(worst, array.x, var, want, want + N + n, N);
        diagonal(var, P1, n);
        mekf_judge(worst, array.xhat, var, want + N, want + 2 * N + n, n);
    }
}

static const struct way {
    const char *name;
    const jl_systolic_schedule *schedule;
} ways[] = { { "naive", &jl_systolic_naive }, { "best", &jl_systolic_best },
             { "mixed", &jl_systolic_mixed } };
#define WAYS ((int)(sizeof ways / sizeof *ways))

static void told(const struct mekf_case *c, const struct way *way,
                 const char *what, const struct mekf_worst *w)
{
    print_message("%-13s %-6s %-4s %.1e max(1, |x|), %.1e sigma, var %.1e\n",
                  c->name, way->name, what, w->state, w->sigma, w->var);
}

static void test_systolic_steps_as_filter(void **state)
{
    const struct mekf_case *c;
    struct mekf_worst w;
    double relative;
    int i, j;

    (void)state;
    for (i = 0; (c = mekf_case(i)) != NULL; i++)
        for (j = 0; j < WAYS && !is_stress(c); j++) {
            step_by_step(&w, &relative, c, ways[j].schedule);
            told(c, ways + j, "step", &w);
            print_message("%38s |x - want| / |want| %.1e\n", "", relative);
            assert_close(relative, 0, STEP_STATE);
            assert_close(w.sigma, 0, STEP_SIGMA);
            assert_close(w.var, 0, STEP_VAR);
        }
    assert_int_equal(i, 10);
}

static void test_systolic_meets_reference(void **state)
{
    const struct mekf_case *c;
    struct mekf_worst w;
    int i, j;

    (void)state;
    for (i = 0; (c = mekf_case(i)) != NULL; i++)
        for (j = 0; j < WAYS; j++) {
            run(&w, c, ways[j].schedule);
            told(c, ways + j, "case", &w);
            if (is_stress(c)) {
                assert_close(w.sigma, 0, sigma_stress(c));
                assert_close(w.var, 0, VAR_STRESS);
            } else {
                assert_close(w.state, 0, STATE);
                assert_close(w.var, 0, VAR);
            }
        }
    assert_int_equal(i, 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_systolic_steps_as_filter),
        cmocka_unit_test(test_systolic_meets_reference)
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
