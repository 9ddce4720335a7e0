/* What the Kalman filter with factors can do and others cannot; and how far
 * those go. */
#include "close.h"

#include <stdint.h>

#include "jumplink/kf.h"

#define EPS ((double)JL_EPSILON)

enum { N = 3, Z = 2 };                  /* at most */

static jl_real mode_mem[JL_MODE_MEM(N, Z, N)], mem[2][JL_KF_STATE(N, Z)];
static jl_real scratch[JL_MODE_SCRATCH(N, Z, N) + JL_KF_SCRATCH(N, Z)];
static jl_mode mode;
static jl_kf kf, other;
static uint32_t seed = 3;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

/* D > 0 and finite, zeros below. */
static void check_factor(const jl_kf *f)
{
    int n = f->mode->n, i, j;

    assert_true(jl_vec_within(f->P, n * n, JL_REAL_MAX));
    for (i = 0; i < n; i++) {
        assert_true(f->P[i * (n + 1)] > 0);
        for (j = 0; j < i; j++)
            assert_true(f->P[i * n + j] == 0);
    }
}

/* --- a start from next to nothing ----------------------------------------- */

/* Constant acceleration, dt = 1, no noise; three positions measured with
 * variance R, from variances P0.  The worst relative error of a variance, or
 * 1e9 if a step fails.  For R / P0 -> 0 the states are differences:
 *     p = z3,  v = (z1 - 4 z2 + 3 z3) / 2,  a = z1 - 2 z2 + z3 */
static double error_at_start(const jl_kf_form *form, jl_real R, jl_real P0)
{
    static const double want[N * N] = { 1, 1.5, 1, 1.5, 6.5, 6, 1, 6, 6 };
    static const jl_real F[N * N] = { 1, 1, JL_C(0.5), 0, 1, 1, 0, 0, 1 };
    static const jl_real G[N] = { 0, 0, 1 }, H[N] = { 1, 0, 0 };
    const jl_real zero[N] = { 0, 0, 0 };
    jl_real P[N * N] = { 0 };
    double worst = 0, e;
    int i, status;

    P[0] = P[4] = P[8] = P0;
    jl_mode_init(&mode, N, 1, 1, mode_mem, JL_MODE_MEM(N, 1, 1));
    assert_int_equal(jl_mode_set(&mode, F, G, zero, NULL, H, &R, scratch),
                     JL_OK);
    assert_int_equal(jl_kf_init(&kf, &mode, form, mem[0], JL_KF_STATE(N, 1)),
                     JL_OK);
    assert_int_equal(jl_kf_set(&kf, zero, P, scratch), JL_OK);
    status = jl_kf_update(&kf, NULL, zero, scratch);
    for (i = 0; i < 2 && status == JL_OK; i++)
        status = jl_kf_step(&kf, NULL, zero, scratch);
    if (status != JL_OK)
        return 1e9;
    jl_kf_cov(&kf, P);
    for (i = 0; i < N * N; i++) {
        e = fabs((double)(P[i] / R) / want[i] - 1);
        if (i % (N + 1) == 0 && !(e <= worst))
            worst = e;
        if (form == &jl_kf_sqrt)
            assert_close(P[i] / R, want[i], 64 * EPS + 200 * (double)(R / P0));
    }
    return worst;
}

/* However much better the measurements are than the prior. */
static void test_sqrt_starts_from_next_to_nothing(void **state)
{
    jl_real ratio;

    (void)state;
    for (ratio = JL_C(1.0e-3); 10 / ratio < JL_LARGE * JL_LARGE; ratio /= 10) {
        (void)error_at_start(&jl_kf_sqrt, 1, 1 / ratio);
        check_factor(&kf);
        (void)error_at_start(&jl_kf_sqrt, ratio, 1);
        check_factor(&kf);
    }
    /* R / P0 is nothing to the number type */
    for (ratio = JL_C(1.0e-3); ratio * ratio > JL_EPSILON * JL_REAL_MIN;
         ratio /= 10) {
        (void)error_at_start(&jl_kf_sqrt, ratio / 100, 1 / ratio);
        check_factor(&kf);
    }
}

/* A covariance has R / P0 as a difference of numbers of size 1: what it keeps
 * of it has an error of some eps P0 / R, and from eps on there is nothing. */
static void test_covariances_lose_it(void **state)
{
    const jl_kf_form *const forms[] = { &jl_kf_joseph, &jl_kf_standard };
    jl_real ratio;
    int f, k;

    (void)state;
    for (f = 0; f < 2; f++) {
        for (ratio = JL_C(0.01); ratio > 1000 * JL_EPSILON; ratio /= 10)
            assert_true(error_at_start(forms[f], 1, 1 / ratio)
                        < 16 * EPS / (double)ratio + 20 * (double)ratio);
        for (k = 0; k < 5; k++, ratio /= 10)
            ;
        assert_true(ratio < JL_EPSILON / 8);
        for (k = 0; k < 5; k++, ratio /= 10) {
            assert_true(error_at_start(forms[f], 1, 1 / ratio) > 0.25);
            assert_true(error_at_start(&jl_kf_sqrt, 1, 1 / ratio) < 16 * EPS);
        }
    }
}

/* --- measurements of no noise --------------------------------------------- */

/* Two measurements of two states of covariance I, with R = [1 1; 1 1]: their
 * difference is exact.  jl_mode_set takes no such R; the kernel must. */
static int difference_is_exact(const jl_real *H, const jl_real *z)
{
    static const jl_real I[4] = { 1, 0, 0, 1 }, zero[4] = { 0, 0, 0, 0 };
    static const jl_real R[4] = { 1, 1, 1, 2 };

    jl_mode_init(&mode, 2, 2, 2, mode_mem, JL_MODE_MEM(2, 2, 2));
    assert_int_equal(jl_mode_set(&mode, I, I, zero, NULL, H, R, scratch),
                     JL_OK);
    mode.R[3] = 1;
    mode.V[3] = 0;
    jl_kf_init(&kf, &mode, &jl_kf_sqrt, mem[0], JL_KF_STATE(2, 2));
    return jl_kf_update(&kf, NULL, z, scratch);
}

static void check_estimate(double x0, double x1, double P00, double P01,
                           double P11)
{
    jl_real P[4];

    jl_kf_cov(&kf, P);
    assert_close(kf.x[0], x0, 16 * EPS);
    assert_close(kf.x[1], x1, 16 * EPS);
    assert_close(P[0], P00, 16 * EPS);
    assert_close(P[1], P01, 16 * EPS);
    assert_close(P[3], P11, 16 * EPS);
}

static void test_sqrt_takes_exact_measurements(void **state)
{
    static const jl_real each[4] = { 1, 0, 0, 1 }, last[4] = { 1, 0, 1, 1 };
    static const jl_real first[4] = { 0, 1, 1, 1 }, same[4] = { 1, 2, 1, 2 };
    const jl_real z[2] = { 2, 5 };

    (void)state;
    assert_int_equal(difference_is_exact(each, z), JL_OK);
    check_estimate(-1 / 3.0, 8 / 3.0, 1 / 3.0, 1 / 3.0, 1 / 3.0);
    assert_int_equal(difference_is_exact(last, z), JL_OK);  /* x1 is 3 */
    check_estimate(1, 3, 0.5, 0, 0);
    assert_int_equal(difference_is_exact(first, z), JL_OK); /* x0 is 3 */
    check_estimate(3, 1, 0, 0, 0.5);
    assert_int_equal(difference_is_exact(same, z), JL_ESINGULAR);
    check_estimate(0, 0, 1, 0, 1);
}

/* --- nonlinear modes ------------------------------------------------------ */

static int swings(jl_real *y, const jl_real *x, void *context)
{
    (void)context;
    y[0] = x[0] + JL_C(0.1) * x[1];
    y[1] = x[1] - JL_C(0.1) * (x[0] - x[0] * x[0] * x[0] / 6);
    return x[0] > 100 ? JL_ERANGE : JL_OK;
}

static int swing_slope(jl_real *F, const jl_real *x, void *context)
{
    (void)context;
    F[0] = F[3] = 1;
    F[1] = JL_C(0.1);
    F[2] = JL_C(-0.1) * (1 - x[0] * x[0] / 2);
    return JL_OK;
}

static int looks(jl_real *z, const jl_real *x, void *context)
{
    (void)context;
    z[0] = x[0] + x[0] * x[0] / 10;
    return x[0] > 50 ? JL_ERANGE : JL_OK;
}

static int look_slope(jl_real *H, const jl_real *x, void *context)
{
    (void)context;
    H[0] = 1 + x[0] / 5;
    H[1] = 0;
    return JL_OK;
}

/* Linearised where joseph is. */
static void check_agree(const jl_nonlinear *given, double tolerance)
{
    static const jl_real I[4] = { 1, 0, 0, 1 }, H[2] = { 1, 0 };
    const jl_real Q[4] = { JL_C(0.01), JL_C(0.004), JL_C(0.004), JL_C(0.01) };
    const jl_real R = JL_C(0.04);
    jl_real P[4], Q2[4], before[JL_KF_STATE(2, 1)], z;
    int k, i;

    jl_mode_init(&mode, 2, 1, 2, mode_mem, JL_MODE_MEM(2, 1, 2));
    assert_int_equal(jl_mode_set(&mode, I, I, Q, NULL, H, &R, scratch), JL_OK);
    jl_mode_nonlinear(&mode, given);
    jl_kf_init(&kf, &mode, &jl_kf_sqrt, mem[0], JL_KF_STATE(2, 1));
    jl_kf_init(&other, &mode, &jl_kf_joseph, mem[1], JL_KF_STATE(2, 1));
    for (k = 0; k < 200; k++) {
        z = (jl_real)sin(k / 10.0) + rnd() / 4;
        assert_int_equal(jl_kf_step(&kf, NULL, &z, scratch), JL_OK);
        assert_int_equal(jl_kf_step(&other, NULL, &z, scratch), JL_OK);
        jl_kf_cov(&kf, P);
        jl_kf_cov(&other, Q2);
        for (i = 0; i < 4; i++) {
            assert_close(kf.x[i / 2], other.x[i / 2], tolerance);
            assert_close(P[i], Q2[i], tolerance);
        }
        assert_close(kf.innovation.loglik, other.innovation.loglik,
                     10 * tolerance);
    }
    kf.x[0] = 60;
    memcpy(before, mem[0], sizeof before);
    assert_int_equal(jl_kf_update(&kf, NULL, &z, scratch), JL_ERANGE);
    assert_int_equal(jl_kf_step(&kf, NULL, &z, scratch), JL_ERANGE);
    assert_same_bits(mem[0], before, sizeof before);
    kf.x[0] = 101;
    memcpy(before, mem[0], sizeof before);
    assert_int_equal(jl_kf_predict(&kf, scratch), JL_ERANGE);
    assert_same_bits(mem[0], before, sizeof before);
}

static void test_sqrt_linearises_as_joseph(void **state)
{
    jl_nonlinear pendulum = { 0 };

    (void)state;
    pendulum.f = swings;
    pendulum.jacobian_f = swing_slope;
    pendulum.h = looks;
    pendulum.jacobian_h = look_slope;
    check_agree(&pendulum, 2.0e4 * EPS);
    pendulum.jacobian_f = pendulum.jacobian_h = NULL;   /* by differences */
    check_agree(&pendulum, 50 * pow(EPS, 2 / 3.0));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sqrt_starts_from_next_to_nothing),
        cmocka_unit_test(test_covariances_lose_it),
        cmocka_unit_test(test_sqrt_takes_exact_measurements),
        cmocka_unit_test(test_sqrt_linearises_as_joseph),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
