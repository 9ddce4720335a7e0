/* Singer's motion against the integral that defines it, its limits, and the
 * identities of any motion that goes on in time. */
#include "close.h"

#include "jumplink/model.h"

#define EPS ((double)JL_EPSILON)
#define DIM 3
#define AXES 2

/* --- the definition, in long double --------------------------------------- */

/* (exp(-x) - 1 + x) / x^2 */
static long double phi2(long double x)
{
    long double s = 1;
    int k;

    if (x > 1)
        return (expl(-x) - 1 + x) / (x * x);
    for (k = 30; k > 2; k--)
        s = 1 - x / k * s;
    return s / 2;
}

/* Where an acceleration of 1 at the start leads to over t: F's last column. */
static void led_to(long double f[DIM], long double t, long double tau)
{
    f[0] = t * t * phi2(t / tau);
    f[1] = -tau * expm1l(-t / tau);
    f[2] = expl(-t / tau);
}

/* Gauss and Legendre's nodes in (-1, 1) and weights, by Newton's iteration. */
#define NODES 12

static void legendre(long double *x, long double *w)
{
    const long double pi = acosl(-1);
    int i, k, step;

    for (i = 0; i < NODES; i++) {
        long double p = 0, slope = 1;

        x[i] = cosl(pi * (i + 0.75L) / (NODES + 0.5L));
        for (step = 0; step < 20; step++) {
            long double before = 1, next;

            p = x[i];
            for (k = 2; k <= NODES; k++) {
                next = ((2 * k - 1) * x[i] * p - (k - 1) * before) / k;
                before = p;
                p = next;
            }
            slope = NODES * (x[i] * p - before) / (x[i] * x[i] - 1);
            x[i] -= p / slope;
        }
        w[i] = 2 / ((1 - x[i] * x[i]) * slope * slope);
    }
}

/* W = 2 s^2 / tau * integral over 0..T of f f', in panels of tau / 2. */
static void integral(long double W[DIM][DIM], long double s, long double tau,
                     long double T)
{
    const int panels = (int)(2 * T / tau) + 1;
    long double x[NODES], w[NODES], f[DIM];
    int p, k, i, j;

    memset(W, 0, DIM * DIM * sizeof W[0][0]);
    legendre(x, w);
    for (p = 0; p < panels; p++)
        for (k = 0; k < NODES; k++) {
            led_to(f, T * (p + (x[k] + 1) / 2) / panels, tau);
            for (i = 0; i < DIM; i++)
                for (j = 0; j < DIM; j++)
                    W[i][j] += w[k] / 2 * T / panels * f[i] * f[j]
                        * 2 * s * s / tau;
        }
}

/* --- the catalogue's ------------------------------------------------------ */

struct filled {
    jl_mode mode;
    jl_real mem[JL_MODE_MEM(DIM * AXES, AXES, DIM * AXES)];
};

static jl_motion singer(jl_real accel_std, jl_real tau_s)
{
    jl_motion motion = { JL_MOTION_SINGER, 1, 3, 0, 0, JL_C(0.7), 0 };

    motion.accel_std = accel_std;
    motion.tau_s = tau_s;
    return motion;
}

static void fill(struct filled *to, const jl_motion *motion, jl_real dt)
{
    int n = DIM * motion->axes;

    assert_int_equal(jl_motion_noises(motion), n);
    assert_int_equal(jl_mode_init(&to->mode, n, motion->axes, n, to->mem,
                                  JL_MODE_MEM(n, motion->axes, n)), JL_OK);
    assert_int_equal(jl_mode_motion(&to->mode, motion, dt), JL_OK);
}

static void fill_one(struct filled *to, jl_real accel_std, jl_real tau_s,
                     jl_real dt)
{
    jl_motion motion = singer(accel_std, tau_s);

    fill(to, &motion, dt);
}

/* A number right to its own last digits. */
#define assert_digits(got, want, epsilons) \
    assert_close((long double)(got) / (want), 1, (epsilons) * EPS)

static struct filled rig;

static void check_definition(jl_real accel_std, jl_real tau_s, jl_real dt)
{
    const jl_mode *a = &rig.mode;
    long double W[DIM][DIM], f[DIM];
    int i, j;

    fill_one(&rig, accel_std, tau_s, dt);
    integral(W, accel_std, tau_s, dt);
    led_to(f, dt, tau_s);
    for (i = 0; i < DIM; i++)
        for (j = 0; j < DIM; j++) {
            assert_digits(a->W[i * DIM + j], W[i][j], 5);
            if (j < i)
                assert_true(a->F[i * DIM + j] == 0);
        }
    assert_true(a->F[0] == 1 && a->F[1] == dt && a->F[4] == 1);
    assert_digits(a->F[2], f[0], 4);
    assert_digits(a->F[5], f[1], 4);
    assert_close(a->F[8], f[2], EPS);
    assert_digits(a->F[8], f[2], 2 + (double)(dt / tau_s));
}

static void test_singer_is_the_integral(void **state)
{
    static const jl_real dts[] = { JL_C(0.03), 1, 17 };
    jl_real theta;
    int k;

    (void)state;
    for (k = 0; k < 3; k++)
        for (theta = JL_C(1.0e-7); theta < 60; theta *= JL_C(1.31))
            check_definition(JL_C(1.7), dts[k] / theta, dts[k]);
    for (theta = 1; theta < 12; theta += JL_C(0.05))    /* 2 and 8: borders */
        check_definition(JL_C(0.3), 2 / theta, 2);
}

/* The factor: N_0 from the acceleration, N_1 from the velocity, N_2. */
static void test_singer_factor_gives_W(void **state)
{
    jl_real theta;
    int i, j, k;

    (void)state;
    for (theta = JL_C(1.0e-6); theta < JL_C(1.0e6); theta *= JL_C(1.7)) {
        const jl_mode *a = &rig.mode;

        fill_one(&rig, 2, 5, 5 * theta);
        for (k = 0; k < DIM; k++) {
            assert_true(a->q[k] > 0);
            assert_true(a->N[k * DIM + 2 - k] == 1);
            for (i = 3 - k; i < DIM; i++)
                assert_true(a->N[k * DIM + i] == 0);
        }
        for (i = 0; i < DIM; i++)
            for (j = 0; j < DIM; j++) {
                long double s = 0;

                for (k = 0; k < DIM; k++)
                    s += (long double)a->q[k] * a->N[k * DIM + i]
                        * a->N[k * DIM + j];
                assert_digits(a->W[i * DIM + j], s, 3);
            }
    }
}

/* What elimination in the integral's W leaves, pivot by pivot: to their own
 * last digits while long double has some to lose. */
static void test_singer_factor_is_eliminations(void **state)
{
    jl_real theta;

    (void)state;
    if (LDBL_MANT_DIG < 64)
        skip();
    for (theta = JL_C(1.0e-6); theta < 50; theta *= JL_C(1.013)) {
        const jl_mode *a = &rig.mode;
        long double W[DIM][DIM], va, pa, pv;

        fill_one(&rig, 2, 5, 5 * theta);
        integral(W, 2, 5, 5 * theta);
        va = W[1][2] / W[2][2];
        pa = W[0][2] / W[2][2];
        assert_digits(a->q[0], W[2][2], 4);
        assert_digits(a->N[0], pa, 4);
        assert_digits(a->N[1], va, 4);
        W[1][1] -= va * W[1][2];
        W[0][1] -= pa * W[1][2];
        W[0][0] -= pa * W[0][2];
        pv = W[0][1] / W[1][1];
        assert_digits(a->q[1], W[1][1], 4);
        assert_digits(a->N[3], pv, 1);
        W[0][0] -= pv * W[0][1];
        assert_digits(a->q[2], W[0][0], 4);
    }
}

static void test_singer_W_is_a_covariance(void **state)
{
    jl_real theta, work[DIM * DIM], scaled[DIM * DIM];
    int i, j;

    (void)state;
    for (theta = JL_C(1.0e-6); theta < JL_C(1.0e6); theta *= JL_C(1.7)) {
        const jl_real *W = rig.mode.W;

        fill_one(&rig, 2, 1 / theta, 1);
        for (i = 0; i < DIM; i++)
            for (j = 0; j < DIM; j++)
                assert_same_bits(&W[i * DIM + j], &W[j * DIM + i], sizeof *W);
        assert_int_equal(jl_mat_check_cov(W, work, DIM), JL_OK);
        for (i = 0; i < DIM; i++)         /* and of full rank */
            for (j = 0; j < DIM; j++)
                scaled[i * DIM + j] = W[i * DIM + j] / (jl_real)sqrt(
                    (double)W[i * DIM + i] * (double)W[j * DIM + j]);
        assert_int_equal(jl_mat_cholesky(work, scaled, DIM), JL_OK);
    }
}

/* --- identities ----------------------------------------------------------- */

/* F(a + b) = F(b) F(a), W(a + b) = F(b) W(a) F(b)' + W(b): of any linear
 * equation driven by white noise.  All terms are positive. */
static void check_composes(jl_real tau_s, jl_real a, jl_real b)
{
    static struct filled over_a, over_b, over_both;
    jl_real F[DIM * DIM], W[DIM * DIM], work[DIM * DIM];
    double exps = 8 + 2 * (double)((a + b) / tau_s);
    int i;

    fill_one(&over_a, 3, tau_s, a);
    fill_one(&over_b, 3, tau_s, b);
    fill_one(&over_both, 3, tau_s, a + b);
    jl_mat_mul(F, over_b.mode.F, over_a.mode.F, DIM, DIM, DIM);
    jl_mat_sandwich(W, over_b.mode.F, over_a.mode.W, over_b.mode.W, work, DIM,
                    DIM);
    for (i = 0; i < DIM * DIM; i++) {
        assert_digits(W[i], over_both.mode.W[i], 24);
        if (i % DIM >= i / DIM)
            assert_digits(F[i], over_both.mode.F[i], i == 8 ? exps : 8);
    }
}

static void test_singer_composes(void **state)
{
    jl_real tau_s;

    (void)state;
    for (tau_s = JL_C(0.05); tau_s < JL_C(1.0e7); tau_s *= JL_C(1.9)) {
        check_composes(tau_s, JL_C(0.5), JL_C(0.5));
        check_composes(tau_s, JL_C(0.25), 2);
        check_composes(tau_s, JL_C(0.875), JL_C(0.0078125));
    }
}

/* --- limits --------------------------------------------------------------- */

/* tau to infinity with 2 accel_std^2 / tau = 1 held: white jerk of density 1
 * on a constant acceleration. */
static void test_singer_slow_is_white_jerk(void **state)
{
    const long double T = 3, W[DIM][DIM] = {
        { T * T * T * T * T / 20, T * T * T * T / 8, T * T * T / 6 },
        { T * T * T * T / 8, T * T * T / 3, T * T / 2 },
        { T * T * T / 6, T * T / 2, T }
    };
    const long double F[DIM][DIM] = { { 1, T, T * T / 2 }, { 0, 1, T },
                                  { 0, 0, 1 } };
    jl_real tau_s;
    int i, j;

    (void)state;
    for (tau_s = 300; tau_s < JL_C(1.0e9); tau_s *= 10) {
        const double off = 6 * EPS + 2 * (double)(3 / tau_s);

        fill_one(&rig, (jl_real)sqrt((double)tau_s / 2), tau_s, 3);
        for (i = 0; i < DIM; i++)
            for (j = 0; j < DIM; j++) {
                assert_close((long double)rig.mode.W[i * DIM + j] / W[i][j], 1,
                             off);
                assert_close(rig.mode.F[i * DIM + j], F[i][j],
                             off * (double)F[i][j]);
            }
    }
}

/* tau to 0 with 2 accel_std^2 tau = 1 held: white acceleration of density 1. */
static void test_singer_fast_is_white_acceleration(void **state)
{
    const long double T = 3, W[2][2] = {
        { T * T * T / 3, T * T / 2 }, { T * T / 2, T }
    };
    jl_real tau_s;
    int i, j;

    (void)state;
    for (tau_s = JL_C(0.03); tau_s > JL_C(1.0e-8); tau_s /= 10) {
        fill_one(&rig, (jl_real)sqrt(0.5 / (double)tau_s), tau_s, 3);
        for (i = 0; i < 2; i++)
            for (j = 0; j < 2; j++)
                assert_close((long double)rig.mode.W[i * DIM + j] / W[i][j], 1,
                             8 * EPS + 4 * (double)(tau_s / 3));
        assert_true(rig.mode.F[8] <= JL_C(1.0e-40));
        assert_digits(rig.mode.F[5], tau_s, 4);
    }
}

static void test_singer_over_no_time_stays(void **state)
{
    int i, k;

    (void)state;
    fill_one(&rig, 2, 5, 0);
    for (i = 0; i < DIM * DIM; i++) {
        assert_true(rig.mode.F[i] == (jl_real)(i % (DIM + 1) == 0));
        assert_true(rig.mode.W[i] == 0);
    }
    for (k = 0; k < DIM; k++)
        assert_true(rig.mode.q[k] == 0);
}

/* The longest gap, and the shortest correlation time: every number is one, and
 * the velocity has spread as white acceleration does. */
static void test_singer_at_the_borders(void **state)
{
    const jl_real most = (jl_real)sqrt((double)JL_LARGE);
    const jl_real least = 1 / most * (1 + 4 * JL_EPSILON);
    jl_motion motion = singer(1, least);

    (void)state;
    fill(&rig, &motion, most);
    assert_true(jl_vec_within(rig.mode.F, DIM * DIM, most));
    assert_true(jl_vec_within(rig.mode.W, DIM * DIM, JL_LARGE * JL_LARGE));
    assert_true(jl_vec_within(rig.mode.N, DIM * DIM, most));
    assert_digits(rig.mode.q[1], 2 * (long double)least * most, 8);
    assert_digits(rig.mode.q[0], 1, 2);
    motion.tau_s = most;
    fill(&rig, &motion, JL_C(1.0e-4));
    assert_digits(rig.mode.q[0], 2e-4L / most, 4);
    fill(&rig, &motion, most);
    assert_true(jl_vec_within(rig.mode.W, DIM * DIM, JL_LARGE * JL_LARGE));
}

/* --- what it fills, and refuses ------------------------------------------- */

static void test_singer_axes_are_alike(void **state)
{
    static struct filled two;
    jl_motion motion = singer(2, 5);
    const jl_mode *a = &rig.mode, *b = &two.mode;
    int n = DIM * AXES, i, j, k;

    (void)state;
    fill(&rig, &motion, JL_C(1.5));
    motion.axes = AXES;
    fill(&two, &motion, JL_C(1.5));
    for (i = 0; i < n; i++) {
        assert_true(b->u[i] == 0);
        assert_same_bits(&b->q[i], &a->q[i % DIM], sizeof *b->q);
        for (j = 0; j < n; j++) {
            const int same = i / DIM == j / DIM, at = i % DIM * DIM + j % DIM;

            k = i;
            assert_true(b->F[i * n + j] == (same ? a->F[at] : 0));
            assert_true(b->W[i * n + j] == (same ? a->W[at] : 0));
            assert_true(b->N[k * n + j] == (same ? a->N[at] : 0));
        }
    }
    for (i = 0; i < AXES; i++)
        for (j = 0; j < n; j++)
            assert_true(b->H[i * n + j] == (jl_real)(j == DIM * i));
    assert_close(b->R[0], 0.49, EPS);
    assert_true(b->R[1] == 0 && b->R[3] == b->R[0] && b->V[0] == b->R[0]);
}

static void test_singer_has_three_noises_an_axis(void **state)
{
    jl_motion motion = singer(1, 1);

    (void)state;
    assert_int_equal(jl_motion_noises(&motion), 3);
    motion.axes = 4;
    assert_int_equal(jl_motion_noises(&motion), 12);
    motion.kind = JL_MOTION_CA;
    assert_int_equal(jl_motion_noises(&motion), 4);
    motion.kind = JL_MOTION_CV;
    motion.order = 2;
    assert_int_equal(jl_motion_noises(&motion), 4);
    motion.kind = JL_MOTION_SINGER;
    assert_int_equal(jl_motion_noises(&motion), JL_EDIM);
    motion.order = 3;
    motion.axes = JL_MAX_STATES / 3 + 1;
    assert_int_equal(jl_motion_noises(&motion), JL_EDIM);
}

static int refused(const jl_motion *motion, int n, int m, int p)
{
    static jl_real before[sizeof rig.mem / sizeof *rig.mem];
    int status;

    assert_int_equal(jl_mode_init(&rig.mode, n, m, p, rig.mem,
                                  JL_MODE_MEM(DIM * AXES, AXES, DIM * AXES)),
                     JL_OK);
    memset(rig.mem, 1, sizeof rig.mem);
    memcpy(before, rig.mem, sizeof before);
    status = jl_mode_motion(&rig.mode, motion, 1);
    if (status != JL_OK)
        assert_same_bits(rig.mem, before, sizeof before);
    return status;
}

static int tau_status(jl_real tau_s)
{
    jl_motion motion = singer(1, tau_s);

    return refused(&motion, 3, 1, 3);
}

static void test_singer_refuses(void **state)
{
    jl_motion motion = singer(1, 5);

    (void)state;
    assert_int_equal(refused(&motion, 3, 1, 3), JL_OK);
    assert_int_equal(refused(&motion, 3, 1, 1), JL_EDIM);
    assert_int_equal(refused(&motion, 2, 1, 3), JL_EDIM);
    assert_int_equal(tau_status(0), JL_ERANGE);
    assert_int_equal(tau_status(-1), JL_ERANGE);
    assert_int_equal(tau_status(-JL_REAL_MIN), JL_ERANGE);
    assert_int_equal(tau_status(JL_REAL_MIN), JL_ERANGE);
    assert_int_equal(tau_status((jl_real)NAN), JL_ENONFINITE);
    assert_int_equal(tau_status((jl_real)INFINITY), JL_ENONFINITE);
    assert_int_equal(tau_status(JL_LARGE), JL_ENONFINITE);
    motion.kind = JL_MOTION_CA;         /* whose tau_s is nothing */
    motion.tau_s = (jl_real)NAN;
    assert_int_equal(refused(&motion, 3, 1, 1), JL_OK);
    assert_int_equal(refused(&motion, 3, 1, 3), JL_EDIM);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_singer_is_the_integral),
        cmocka_unit_test(test_singer_factor_gives_W),
        cmocka_unit_test(test_singer_factor_is_eliminations),
        cmocka_unit_test(test_singer_W_is_a_covariance),
        cmocka_unit_test(test_singer_composes),
        cmocka_unit_test(test_singer_slow_is_white_jerk),
        cmocka_unit_test(test_singer_fast_is_white_acceleration),
        cmocka_unit_test(test_singer_over_no_time_stays),
        cmocka_unit_test(test_singer_at_the_borders),
        cmocka_unit_test(test_singer_axes_are_alike),
        cmocka_unit_test(test_singer_has_three_noises_an_axis),
        cmocka_unit_test(test_singer_refuses),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
