/* The MEKF and the plain EKF beside their textbook form in long double, on the
 * reference cases' models: what the cases leave out (spread, every choice of
 * c, steps without a measurement). */
#include "close.h"

#include "mekf_case.h"

#define TYPE long double
#define NAME(x) long_##x
#include "mekf_textbook.inc"

/* States by max(1, |x|), covariances by their deviations: measured 1.8e-13 and
 * 2.1e-14 (float: 1.0e-4, 9.7e-6). */
#if JL_REAL_FLOAT
#define NEAR 1e-3
#else
#define NEAR 1e-11
#endif

static void check(struct mekf_worst *w, const jl_real *x,
                  const long double *want, const jl_real *P,
                  long double (*P_want)[CASE_N], int n)
{
    double x_double[CASE_N], var[CASE_N], var_want[CASE_N];
    int i, j;

    for (i = 0; i < n; i++) {
        x_double[i] = (double)want[i];
        var[i] = (double)P[i * (n + 1)];
        var_want[i] = (double)P_want[i][i];
        for (j = 0; j < n; j++)
            assert_close(P[i * n + j], P_want[i][j],
                         NEAR * sqrt((double)P_want[i][i]
                                     * (double)P_want[j][j]));
    }
    mekf_judge(w, x, var, x_double, var_want, n);
}

/* All rows of a case, of which every `every`-th has no measurement; 0: none. */
static void run(struct mekf_worst *w, const struct mekf_case *c,
                struct mekf_given *g, int every)
{
    static struct mekf_filter m;
    int n = c->n, N = n + c->m, k;
    jl_real P[CASE_N * CASE_N], P1[CASE_N * CASE_N], row[CASE_R];
    long_mekf f, ekf;

    assert_int_equal(mekf_start(&m, g), JL_OK);
    assert_int_equal(mekf_start_ekf(&m, g), JL_OK);
    long_start(&f, g);
    long_start(&ekf, g);
    for (k = 0; k < c->rows; k++) {
        const jl_real *z = every > 0 && k % every == 0 ? NULL
            : mekf_z(row, c, k);

        assert_int_equal(jl_mekf_step(&m.f, z, m.scratch), JL_OK);
        long_step(&f, z, 0);
        jl_mekf_cov(&m.f, P, P1);
        check(w, m.f.x, f.x, P, f.P, N);
        check(w, m.f.xhat, f.xhat, P1, f.P1, n);
        assert_int_equal(jl_ekf_step(&m.ekf, z, m.scratch), JL_OK);
        long_step(&ekf, z, 1);
        check(w, m.ekf.x, ekf.x, m.ekf.P, ekf.P, N);
    }
    assert_close(w->state, 0, NEAR);
    assert_close(w->var, 0, NEAR);
}

static void test_mekf_meets_textbook(void **state)
{
    static const char *const names[] = {
        "ar1", "spring2_const", "ct4pos", "ct4rdc_prev", "gen32_prev"
    };
    static const jl_mekf_c choices[] = {
        JL_MEKF_PREV, JL_MEKF_PRED, JL_MEKF_FILT
    };
    struct mekf_worst w = { 0, 0, 0 };
    int i, j, spread, every;

    (void)state;
    for (i = 0; i < 5; i++)
        for (j = 0; j < 3; j++)
            for (spread = 0; spread < 2; spread++)
                for (every = 0; every <= 3; every += 3) {
                    const struct mekf_case *c = mekf_case_named(names[i]);
                    struct mekf_given g;

                    mekf_give(&g, c);
                    g.c = choices[j];
                    g.spread = spread;
                    run(&w, c, &g, every);
                }
    print_message("%.1e max(1, |x|), var %.1e\n", w.state, w.var);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mekf_meets_textbook),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
