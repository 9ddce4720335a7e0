/* The MEKF and the plain EKF against reference cases of 60 digits. */
#include "close.h"

#include "mekf_case.h"

/* How far off each may be; measured are, over all cases of a kind,
 *             double                              float
 *     MEKF    1.6e-13 max(1, |x|), var 1.7e-14    1.1e-4, 9.9e-6
 *     stress  9.1e-10 sigma,       var 6.1e-13    0.23 sigma, 3.5e-4
 *     EKF     4.1e-14 max(1, |x|), var 1.2e-14    2.8e-5, 4.0e-6
 * and with derivatives by differences
 *     MEKF    2.3e-9  max(1, |x|), var 3.2e-10    1.0e-3, 1.4e-4
 * The plain EKF is not accurate on the stress cases: test_mekf_traps.c. */
#if JL_REAL_FLOAT
#define STATE 5e-4
#define VAR 5e-5
#define VAR_STRESS 0.02
#define BY_DIFFERENCES 10
#else
#define STATE 1e-12
#define VAR 1e-12
#define SIGMA_STRESS 1e-8
#define VAR_STRESS 1e-10
#define BY_DIFFERENCES 1e4
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

static void told(const struct mekf_case *c, const char *who,
                 const struct mekf_worst *w)
{
    print_message("%-13s %-6s %.1e max(1, |x|), %.1e sigma, var %.1e\n",
                  c->name, who, w->state, w->sigma, w->var);
}

/* A case through the MEKF, from a model as it is given. */
static void run(struct mekf_worst *worst, const struct mekf_case *c,
                struct mekf_given *g)
{
    static struct mekf_filter m;
    int n = c->n, N = n + c->m, k;
    const double *want = c->expected;
    double var[CASE_N];
    jl_real z[CASE_R];

    assert_int_equal(mekf_start(&m, g), JL_OK);
    memset(worst, 0, sizeof *worst);
    for (k = 0; k < c->rows; k++, want += 2 * N + 2 * n) {
        assert_int_equal(jl_mekf_step(&m.f, mekf_z(z, c, k), m.scratch),
                         JL_OK);
        mekf_variances(var, m.f.U, N);
        mekf_judge(worst, m.f.x, var, want, want + N + n, N);
        mekf_variances(var, m.f.U1, n);
        mekf_judge(worst, m.f.xhat, var, want + N, want + 2 * N + n, n);
    }
}

static void test_mekf_meets_reference(void **state)
{
    const struct mekf_case *c;
    struct mekf_given g;
    struct mekf_worst w;
    int i;

    (void)state;
    for (i = 0; (c = mekf_case(i)) != NULL; i++) {
        mekf_give(&g, c);
        run(&w, c, &g);
        told(c, "", &w);
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

static void test_mekf_by_differences(void **state)
{
    const struct mekf_case *c;
    struct mekf_given g;
    struct mekf_worst w;
    int i;

    (void)state;
    for (i = 0; (c = mekf_case(i)) != NULL; i++) {
        if (is_stress(c))
            continue;
        mekf_give(&g, c);
        g.model.df = NULL;
        g.model.dh = NULL;
        g.model.dc = NULL;
        run(&w, c, &g);
        told(c, "diff.", &w);
        assert_close(w.state, 0, BY_DIFFERENCES * STATE);
        assert_close(w.var, 0, BY_DIFFERENCES * VAR);
    }
}

static void test_ekf_meets_reference(void **state)
{
    static struct mekf_filter m;
    const struct mekf_case *c;
    struct mekf_given g;
    int i, a, k;

    (void)state;
    for (i = 0; (c = mekf_case(i)) != NULL; i++) {
        const double *want = c->expected_ekf;
        struct mekf_worst w = { 0, 0, 0 };
        int N = c->n + c->m;
        double var[CASE_N];
        jl_real z[CASE_R];

        if (is_stress(c))
            continue;
        mekf_give(&g, c);
        assert_int_equal(mekf_start_ekf(&m, &g), JL_OK);
        for (k = 0; k < c->rows; k++, want += 2 * N) {
            assert_int_equal(jl_ekf_step(&m.ekf, mekf_z(z, c, k), m.scratch),
                             JL_OK);
            for (a = 0; a < N; a++)
                var[a] = (double)m.ekf.P[a * (N + 1)];
            mekf_judge(&w, m.ekf.x, var, want, want + N, N);
        }
        told(c, "EKF", &w);
        assert_close(w.state, 0, STATE);
        assert_close(w.var, 0, VAR);
    }
}

static void test_zoo_refuses(void **state)
{
    struct mekf_zoo zoo;
    jl_mekf_model model, before;

    (void)state;
    memset(&zoo, 0, sizeof zoo);
    memset(&model, 1, sizeof model);
    before = model;
    assert_int_equal(mekf_zoo_model(&model, "ar2", &zoo), -1);
    assert_int_equal(mekf_zoo_model(&model, "spring2", &zoo), -1);
    zoo.r = ZOO_R + 1;
    assert_int_equal(mekf_zoo_model(&model, "spring2", &zoo), -1);
    assert_same_bits(&model, &before, sizeof model);
    zoo.r = ZOO_R;
    assert_int_equal(mekf_zoo_model(&model, "spring2", &zoo), 0);
    assert_int_equal(model.r, ZOO_R);
}

/* Half the angle of the least number is 0. */
static void test_zoo_turns_by_the_least(void **state)
{
    const jl_real least = JL_REAL_MIN * JL_EPSILON;
    struct mekf_zoo zoo;
    jl_mekf_model model;
    jl_real f[16] = { 0 };

    (void)state;
    memset(&zoo, 0, sizeof zoo);
    zoo.T = 1;
    assert_true(least > 0 && least / 2 == 0);
    assert_int_equal(mekf_zoo_model(&model, "ct4pos", &zoo), 0);
    assert_int_equal(model.f(f, &least, model.context), JL_OK);
    assert_true(f[1] == 1 && f[5] == 1 && f[11] == 1 && f[15] == 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mekf_meets_reference),
        cmocka_unit_test(test_mekf_by_differences),
        cmocka_unit_test(test_ekf_meets_reference),
        cmocka_unit_test(test_zoo_refuses),
        cmocka_unit_test(test_zoo_turns_by_the_least),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
