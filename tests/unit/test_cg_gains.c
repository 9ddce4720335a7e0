/* Gains of the constant-gain IMM against Kalman filters in long double that run
 * until nothing changes, stability against the closed loop, coupling against
 * norms found otherwise; and the figures of the paper. */
#include "close.h"

#include "jumplink/cgimm.h"

#define EPS ((double)JL_EPSILON)
#define STEPS 25

typedef long double real;
typedef real matrix[3][3];

/* --- a Kalman filter with T = R = 1 -------------------------------------- */

static const matrix F = { { 1, 1, 0.5L }, { 0, 1, 1 }, { 0, 0, 1 } };

/* One step: w [order] and P, which is kept symmetric: what rounding leaves
 * otherwise grows, to 1e-8 of P. */
static void kalman(real *w, matrix P, int order, real lambda)
{
    const real G[3] = { 0.5L, 1, 1 };
    matrix FP = { { 0 } }, M = { { 0 } };
    int i, j, k;

    for (i = 0; i < order; i++)
        for (j = 0; j < order; j++)
            for (k = 0; k < order; k++)
                FP[i][j] += F[i][k] * P[k][j];
    for (i = 0; i < order; i++)
        for (j = 0; j < order; j++) {
            M[i][j] = G[i] * G[j] * lambda * lambda;
            for (k = 0; k < order; k++)
                M[i][j] += FP[i][k] * F[j][k];
        }
    for (i = 0; i < order; i++)
        w[i] = M[i][0] / (M[0][0] + 1);
    for (i = 0; i < order; i++)
        for (j = 0; j <= i; j++)
            P[i][j] = P[j][i] = M[i][j] - w[i] * M[j][0];
}

/* The covariance of a fit of `order` positions at 0, -1, ..: by the inverse of
 * the matrix that makes positions of a state. */
static void fitted(matrix P, int order)
{
    static const real two[2][2] = { { 1, 0 }, { 1, -1 } };
    static const real three[3][3] = { { 1, 0, 0 }, { 1.5L, -2, 0.5L },
                                      { 1, -2, 1 } };
    int i, j, k;

    for (i = 0; i < order; i++)
        for (j = 0; j < order; j++)
            for (k = 0, P[i][j] = 0; k < order; k++)
                P[i][j] += order == 2 ? two[i][k] * two[j][k]
                    : three[i][k] * three[j][k];
}

static void settled(real *w, matrix P, int order, real lambda)
{
    int k;

    memset(P, 0, sizeof(matrix));
    fitted(P, order);
    for (k = 0; k < 20000; k++)
        kalman(w, P, order, lambda);
}

/* --- steady -------------------------------------------------------------- */

static void test_cg_steady_meets_riccati(void **state)
{
    int order, i, e;
    real w[3];
    matrix P;

    (void)state;
    for (order = 2; order <= 3; order++)
        for (e = -12; e <= 12; e++) {
            const jl_real lambda = (jl_real)pow(10, e / 4.0);
            jl_real got[3];

            settled(w, P, order, (real)lambda);
            assert_int_equal(jl_cg_steady(got, order, lambda), JL_OK);
            for (i = 0; i < order; i++)
                assert_close((double)((real)got[i] / w[i]), 1, 16 * EPS);
        }
}

/* The formulas divide by 1 - alpha, whose digits alpha has not all. */
static void test_cg_cov_meets_riccati(void **state)
{
    static const double times[] = { 0.01, 1, 100 };
    int order, i, j, e, t;
    real w[3];
    matrix P;

    (void)state;
    for (order = 2; order <= 3; order++)
        for (e = -12; e <= 12; e++)
            for (t = 0; t < 3; t++) {
                const jl_real lambda = (jl_real)pow(10, e / 4.0);
                const jl_real T = (jl_real)times[t], R = 2500;
                jl_real gains[3], got[9];

                settled(w, P, order, (real)lambda);
                for (i = 0; i < order; i++)
                    gains[i] = (jl_real)w[i];
                assert_int_equal(jl_cg_cov(got, gains, order, T, R), JL_OK);
                for (i = 0; i < order; i++)
                    for (j = 0; j < order; j++)
                        assert_close((double)(got[i * order + j]
                                     * powl((real)T, i + j)
                                     / ((real)R * P[i][j])),
                                     1, 32 * EPS / (double)(1 - w[0]));
            }
}

/* --- stability ----------------------------------------------------------- */

/* log of the spectral radius of (I - K H) F, nearly: by its power 2^20. */
static double log_radius(const jl_real *w, int order)
{
    matrix A = { { 0 } }, B;
    real most, log_norm = 0;
    int i, j, k, n;

    for (i = 0; i < order; i++)
        for (j = 0; j < order; j++)
            A[i][j] = F[i][j] - (real)w[i] * F[0][j];
    for (n = 0; n <= 20; n++) {
        for (most = 0, i = 0; i < order; i++)
            for (j = 0; j < order; j++)
                most = fmaxl(most, fabsl(A[i][j]));
        log_norm = log_norm + logl(most);
        if (n == 20)
            break;
        for (i = 0; i < order; i++)
            for (j = 0; j < order; j++)
                A[i][j] /= most;
        log_norm *= 2;
        memcpy(B, A, sizeof B);
        for (i = 0; i < order; i++)
            for (j = 0; j < order; j++)
                for (k = 0, A[i][j] = 0; k < order; k++)
                    A[i][j] += B[i][k] * B[k][j];
    }
    return (double)log_norm / (1 << 20);
}

static void check_stability(const jl_real *w, int order, int *stable,
                            int *unstable)
{
    jl_real P[9];
    double radius = log_radius(w, order);
    int status = jl_cg_cov(P, w, order, 1, 1);

    if (fabs(radius) < 1e-3)
        return;
    assert_int_equal(status, radius < 0 ? JL_OK : JL_ERANGE);
    *(radius < 0 ? stable : unstable) += 1;
}

static void test_cg_gains_are_stable_or_refused(void **state)
{
    int a, b, c, stable = 0, unstable = 0;

    (void)state;
    for (a = 1; a < 20; a++)
        for (b = 1; b < 48; b++) {
            jl_real w[3] = { (jl_real)(a * 0.0503), (jl_real)(b * 0.0907), 0 };

            check_stability(w, 2, &stable, &unstable);
        }
    assert_true(stable > 300 && unstable > 100);
    stable = unstable = 0;
    for (a = 1; a < 20; a++)
        for (b = 1; b < 48; b += 2)
            for (c = 1; c < 40; c++) {
                jl_real w[3] = { (jl_real)(a * 0.0503), (jl_real)(b * 0.0907),
                                 (jl_real)(c * 0.0711) };

                check_stability(w, 3, &stable, &unstable);
            }
    assert_true(stable > 1000 && unstable > 1000);
}

/* --- design -------------------------------------------------------------- */

static const jl_real paper_Q[2] = { 100, 4000 };
static const double paper_k[2][3] = { { 2.9697, 1.4008, 0 },
                                      { 1.8704, 1.1684, 0.8446 } };
static const real start[2][3] = { { 1, 1, 0 }, { 1, 1.5L, 1 } };

static void design(jl_cg_gains *g, int order)
{
    assert_int_equal(jl_cg_design(g, order, 1, paper_Q[order - 2], 10000),
                     JL_OK);
    assert_int_equal(g->order, order);
}

/* The Kalman filter's gains on their way. */
static void transient(real gain[STEPS][3], int order, real lambda)
{
    matrix P = { { 0 } };
    int k;

    fitted(P, order);
    for (k = 0; k < STEPS; k++)
        kalman(gain[k], P, order, lambda);
}

/* Gain i at step n, from 1, with k. */
static real fit(int order, int i, real steady, real k, int n)
{
    return steady + (start[order - 2][i] - steady) * expl(-n / k);
}

static real misfit(real gain[STEPS][3], int order, int i, real steady, real k)
{
    real sum = 0;
    int n;

    for (n = 1; n <= STEPS; n++) {
        const real e = fit(order, i, steady, k, n) - gain[n - 1][i];

        sum += e * e;
    }
    return sum;
}

static void test_cg_design_is_the_paper(void **state)
{
    const double near = JL_REAL_FLOAT ? 2e-3 : 5.1e-5;   /* their last digit */
    jl_cg_gains g;
    int order, i;

    (void)state;
    for (order = 2; order <= 3; order++) {
        design(&g, order);
        for (i = 0; i < order; i++) {
            assert_close(g.k[i], paper_k[order - 2][i], near);
            assert_close(g.start[i], start[order - 2][i], 0);
        }
    }
    design(&g, 2);
    assert_close(g.steady[0], 0.36, 4 * EPS);
    assert_close(g.steady[1], 0.08, 4 * EPS);
    design(&g, 3);
    assert_close(g.steady[0], 0.820132, 5.1e-7 + 4 * EPS);
    assert_close(g.steady[1], 0.663301, 5.1e-7 + 4 * EPS);
    assert_close(g.steady[2], 0.536460 / 2, 5.1e-7 + 4 * EPS);
}

/* No other k fits better, near or far; nor is the fit far off. */
static void test_cg_design_is_a_minimum(void **state)
{
    static const double near[] = { 0.5, 0.9, 0.99, 1.01, 1.1, 2 };
    real gain[STEPS][3], worst = 0;
    jl_cg_gains g;
    int order, i, n;

    (void)state;
    for (order = 2; order <= 3; order++) {
        design(&g, order);
        transient(gain, order, sqrtl((real)paper_Q[order - 2] / 10000));
        for (i = 0; i < order; i++) {
            const real steady = (real)g.steady[i], k = (real)g.k[i];
            const real least = misfit(gain, order, i, steady, k);

            for (n = 0; n < (int)(sizeof near / sizeof *near); n++)
                assert_true(misfit(gain, order, i, steady, k * near[n])
                            > least);
            for (n = -30; n < 60; n++)
                assert_true(misfit(gain, order, i, steady, expl(n / 10.0L))
                            >= least * (JL_REAL_FLOAT ? 0.9999L : 1));
            for (n = 1; n <= STEPS; n++)
                worst = fmaxl(worst, fabsl(fit(order, i, steady, k, n)
                                           - gain[n - 1][i]));
        }
    }
    assert_close((double)worst, 0.036, 5.1e-4);
}

/* Of T, Q, R only lambda matters. */
static void test_cg_design_takes_any_units(void **state)
{
    jl_cg_gains a, b;
    int order, i;

    (void)state;
    for (order = 2; order <= 3; order++) {
        design(&a, order);
        assert_int_equal(jl_cg_design(&b, order, JL_C(0.25),
                                      paper_Q[order - 2] * 256 * 4, 40000),
                         JL_OK);
        for (i = 0; i < order; i++) {
            assert_close(b.steady[i], a.steady[i], 0);
            assert_close(b.k[i], a.k[i], 0);
        }
    }
}

static void test_cg_gains_refuse(void **state)
{
    const jl_real nan_ = (jl_real)NAN, inf_ = (jl_real)INFINITY;
    const jl_real good[3] = { JL_C(0.5), JL_C(0.25), JL_C(0.125) };
    const jl_real one[3] = { 1, 1, JL_C(0.5) };
    jl_real w[9], same[9];
    jl_cg_gains g, before;
    int i;

    (void)state;
    for (i = 0; i < 9; i++)
        w[i] = same[i] = (jl_real)(i + 1);
    assert_int_equal(jl_cg_steady(w, 1, 1), JL_EDIM);
    assert_int_equal(jl_cg_steady(w, 4, 1), JL_EDIM);
    assert_int_equal(jl_cg_steady(w, 2, 0), JL_ERANGE);
    assert_int_equal(jl_cg_steady(w, 2, -1), JL_ERANGE);
    assert_int_equal(jl_cg_steady(w, 3, JL_C(1e-7)), JL_ERANGE);
    assert_int_equal(jl_cg_steady(w, 3, JL_C(1e7)), JL_ERANGE);
    assert_int_equal(jl_cg_steady(w, 2, nan_), JL_ERANGE);
    assert_int_equal(jl_cg_cov(w, good, 4, 1, 1), JL_EDIM);
    assert_int_equal(jl_cg_cov(w, one, 2, 1, 1), JL_ERANGE);
    assert_int_equal(jl_cg_cov(w, good, 2, 0, 1), JL_ERANGE);
    assert_int_equal(jl_cg_cov(w, good, 3, 1, -1), JL_ERANGE);
    assert_int_equal(jl_cg_cov(w, good, 3, nan_, 1), JL_ERANGE);
    assert_int_equal(jl_cg_cov(w, good, 3, 1, inf_), JL_ERANGE);
    assert_same_bits(w, same, sizeof w);
    memset(&g, 7, sizeof g);
    before = g;
    assert_int_equal(jl_cg_design(&g, 1, 1, 1, 1), JL_EDIM);
    assert_int_equal(jl_cg_design(&g, 2, nan_, 1, 1), JL_ENONFINITE);
    assert_int_equal(jl_cg_design(&g, 2, 1, inf_, 1), JL_ENONFINITE);
    assert_int_equal(jl_cg_design(&g, 2, 0, 1, 1), JL_ERANGE);
    assert_int_equal(jl_cg_design(&g, 2, 1, -1, 1), JL_ERANGE);
    assert_int_equal(jl_cg_design(&g, 3, 1, 1, 0), JL_ERANGE);
    assert_int_equal(jl_cg_design(&g, 3, 1, JL_C(1e14), 1), JL_ERANGE);
    assert_same_bits(&g, &before, sizeof g);
}

/* --- coupling ------------------------------------------------------------ */

/* The largest |eigenvalue| of A, symmetric: by its square's power. */
static real norm(matrix A)
{
    real v[3] = { 1, 0.9L, 0.8L }, u[3], length = 0;
    int k, i, j;

    for (k = 0; k < 4000; k++) {
        for (length = 0, i = 0; i < 3; i++) {
            for (u[i] = 0, j = 0; j < 3; j++)
                u[i] += A[i][j] * v[j];
            length += u[i] * u[i];
        }
        length = sqrtl(length);
        for (i = 0; i < 3; i++)
            v[i] = u[i] / length;
    }
    return length;
}

/* A >= 0: no principal minor below 0. */
static int semidefinite(matrix A)
{
    const real det = A[0][0] * (A[1][1] * A[2][2] - A[1][2] * A[2][1])
        - A[0][1] * (A[1][0] * A[2][2] - A[1][2] * A[2][0])
        + A[0][2] * (A[1][0] * A[2][1] - A[1][1] * A[2][0]);
    int i, j;

    for (i = 0; i < 3; i++)
        for (j = 0; j < i; j++)
            if (A[i][i] * A[j][j] < A[i][j] * A[j][i] || A[i][i] < 0
                || A[j][j] < 0)
                return 0;
    return det >= 0;
}

static void steady_cov(matrix P, int order, real T, real Q, real R)
{
    real w[3];
    int i, j;

    settled(w, P, order, T * T * sqrtl(Q / R));
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            P[i][j] *= R / powl(T, i + j);
}

static const struct pair {
    int order_i, order_j;
    double Q_i, Q_j, T, stay, jump, mu_i, mu_j;
    double change;              /* the paper's; 0: it has none */
} pairs[] = {
    { 2, 3, 100, 4000, 1, 0.98, 0.02, 0.9, 0.1, 0.0114 },
    { 3, 2, 4000, 100, 1, 0.98, 0.02, 0.9, 0.1, 0.0021 },
    { 2, 3, 100, 4000, 1, 0.98, 0.02, 0.1, 0.9, 0.78 },
    { 3, 2, 4000, 100, 1, 0.98, 0.02, 0.1, 0.9, 0 },
    { 2, 2, 1, 400, 0.5, 0.9, 0.2, 0.5, 0.5, 0 },
    { 2, 2, 400, 1, 0.5, 0.9, 0.2, 0.5, 0.5, 0 },
    { 3, 3, 30, 9, 2, 1, 0.3, 0.7, 0.3, 0 },
    { 3, 2, 1, 1e6, 1, 0.9, 0.1, 0.5, 0.5, 0 }
};

static void test_cg_coupling_is_what_it_says(void **state)
{
    size_t n;
    int seen[2] = { 0, 0 }, r, s;

    (void)state;
    for (n = 0; n < sizeof pairs / sizeof *pairs; n++) {
        const struct pair *p = &pairs[n];
        const double weight = p->jump * p->mu_j
            / (p->stay * p->mu_i + p->jump * p->mu_j);
        const real R = 10000;
        jl_cg_gains i, j;
        jl_cg_coupling c;
        matrix P_i, P_j, D;
        double change;

        assert_int_equal(jl_cg_design(&i, p->order_i, (jl_real)p->T,
                                      (jl_real)p->Q_i, 10000), JL_OK);
        assert_int_equal(jl_cg_design(&j, p->order_j, (jl_real)p->T,
                                      (jl_real)p->Q_j, 10000), JL_OK);
        assert_int_equal(jl_cg_coupling_of(&c, &i, &j, (jl_real)p->stay,
                                           (jl_real)p->jump, (jl_real)p->mu_i,
                                           (jl_real)p->mu_j, (jl_real)p->T,
                                           10000), JL_OK);
        steady_cov(P_i, p->order_i, p->T, p->Q_i, R);
        steady_cov(P_j, p->order_j, p->T, p->Q_j, R);
        for (r = 0; r < 3; r++)
            for (s = 0; s < 3; s++)
                D[r][s] = P_j[r][s] - P_i[r][s];
        change = weight * (double)(norm(D) / norm(P_i));
        assert_close(c.weight, weight, 8 * EPS);
        assert_close((double)c.change / change, 1, 500 * EPS);
        if (p->change > 0)
            assert_close((double)c.change / p->change, 1, 0.01);
        for (r = 0; r < 3; r++)
            for (s = 0; s < 3; s++)
                D[r][s] = -D[r][s];
        assert_int_equal(c.conservative, semidefinite(D));
        seen[c.conservative]++;
    }
    assert_true(seen[0] > 0 && seen[1] > 0);
}

static void test_cg_coupling_refuses(void **state)
{
    jl_cg_gains a, b, bad;
    jl_cg_coupling c, before;

    (void)state;
    design(&a, 2);
    design(&b, 3);
    bad = b;
    bad.steady[0] = 1;
    memset(&c, 5, sizeof c);
    before = c;
#define CALL(i, j, stay, jump, mu_i, mu_j, T, R) \
    jl_cg_coupling_of(&c, i, j, JL_C(stay), JL_C(jump), JL_C(mu_i), \
                      JL_C(mu_j), JL_C(T), JL_C(R))
    assert_int_equal(CALL(&bad, &b, 0.9, 0.1, 0.5, 0.5, 1.0, 1.0), JL_ERANGE);
    assert_int_equal(CALL(&a, &bad, 0.9, 0.1, 0.5, 0.5, 1.0, 1.0), JL_ERANGE);
    assert_int_equal(CALL(&a, &b, 0.9, 0.1, 0.5, 0.5, 0.0, 1.0), JL_ERANGE);
    assert_int_equal(CALL(&a, &b, 0.9, 0.1, 0.5, 0.5, 1.0, -1.0), JL_ERANGE);
    assert_int_equal(CALL(&a, &b, 1.1, 0.1, 0.5, 0.5, 1.0, 1.0), JL_EPROB);
    assert_int_equal(CALL(&a, &b, 0.9, -0.1, 0.5, 0.5, 1.0, 1.0), JL_EPROB);
    assert_int_equal(CALL(&a, &b, 0.9, 0.1, 1.5, 0.5, 1.0, 1.0), JL_EPROB);
    assert_int_equal(CALL(&a, &b, 0.9, 0.1, 0.5, -0.5, 1.0, 1.0), JL_EPROB);
    assert_int_equal(CALL(&a, &b, 0.0, 0.1, 1.0, 0.0, 1.0, 1.0), JL_EPROB);
    assert_int_equal(jl_cg_coupling_of(&c, &a, &b, (jl_real)NAN, 0, 1, 0, 1, 1),
                     JL_EPROB);
    assert_same_bits(&c, &before, sizeof c);
#undef CALL
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cg_steady_meets_riccati),
        cmocka_unit_test(test_cg_cov_meets_riccati),
        cmocka_unit_test(test_cg_gains_are_stable_or_refused),
        cmocka_unit_test(test_cg_design_is_the_paper),
        cmocka_unit_test(test_cg_design_is_a_minimum),
        cmocka_unit_test(test_cg_design_takes_any_units),
        cmocka_unit_test(test_cg_gains_refuse),
        cmocka_unit_test(test_cg_coupling_is_what_it_says),
        cmocka_unit_test(test_cg_coupling_refuses),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
