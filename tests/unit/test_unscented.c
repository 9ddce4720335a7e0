/* The form unscented: closed forms, quadrature, singular covariances, angles,
 * and that covariances stay covariances whatever a function does.  (Failures of
 * functions are test_nonlinear's, an independent filter tests/examples'.) */
#include "close.h"

#include <stdint.h>
#include <stdlib.h>

#include "jumplink/kf.h"

#define MAX JL_MAX_STATES
#define EPS ((double)JL_EPSILON)
#define NAN_ ((jl_real)NAN)
#define PI_ 3.14159265358979323846
#define EDGE 4

static uint32_t seed = 3;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

/* --- a filter ------------------------------------------------------------- */

struct rig {
    jl_mode mode;
    jl_nonlinear nonlinear;
    jl_kf kf;
    jl_real mode_mem[JL_MODE_MEM(MAX, MAX, 1)];
    jl_real mem[JL_KF_STATE(MAX, MAX)];
    jl_real P[MAX * MAX];       /* of the filter, when asked for            */
};

static struct rig rig, other;
static jl_real scratch[JL_KF_SCRATCH(MAX, MAX) + 2 * EDGE];
static jl_real work[JL_MODE_SCRATCH(MAX, MAX, 1)];

static jl_real *spoilt(const struct rig *r)
{
    int i;

    for (i = 0; i < JL_KF_SCRATCH(r->mode.n, r->mode.m) + 2 * EDGE; i++)
        scratch[i] = NAN_;
    return scratch + EDGE;
}

static void check_edges(const struct rig *r)
{
    int i;

    for (i = 0; i < EDGE; i++) {
        assert_true(isnan(scratch[i]));
        assert_true(isnan(scratch[EDGE + JL_KF_SCRATCH(r->mode.n, r->mode.m)
                                  + i]));
    }
}

/* From x and P, with a noise of variance q in the first state, F = I, H = the
 * first states, R = r I, and the functions of *how. */
static void make(struct rig *r, const jl_kf_form *form, int n, int m,
                 const jl_real *x, const jl_real *P, jl_real q, jl_real var,
                 const jl_nonlinear *how)
{
    static jl_real I[MAX * MAX], R[MAX * MAX], G[MAX];
    int i;

    memset(I, 0, sizeof I);
    memset(R, 0, sizeof R);
    for (i = 0; i < n; i++)
        I[i * (n + 1)] = 1;
    for (i = 0; i < m; i++)
        R[i * (m + 1)] = var;
    G[0] = 1;
    assert_int_equal(jl_mode_init(&r->mode, n, m, 1, r->mode_mem,
                                  JL_MODE_MEM(n, m, 1)), JL_OK);
    assert_int_equal(jl_mode_set(&r->mode, I, G, &q, NULL, m <= n ? I : NULL,
                                 R, work), JL_OK);
    if (how != NULL) {
        r->nonlinear = *how;
        assert_int_equal(jl_mode_nonlinear(&r->mode, &r->nonlinear), JL_OK);
    }
    assert_int_equal(jl_kf_init(&r->kf, &r->mode, form, r->mem,
                                JL_KF_STATE(n, m)), JL_OK);
    assert_int_equal(jl_kf_set(&r->kf, x, P, spoilt(r)), JL_OK);
}

static void predict(struct rig *r)
{
    assert_int_equal(jl_kf_predict(&r->kf, spoilt(r)), JL_OK);
    check_edges(r);
    jl_kf_cov(&r->kf, r->P);
}

static void update(struct rig *r, const jl_real *z)
{
    assert_int_equal(jl_kf_update(&r->kf, NULL, z, spoilt(r)), JL_OK);
    check_edges(r);
    jl_kf_cov(&r->kf, r->P);
}

/* --- closed forms --------------------------------------------------------- */

/* context: counts the calls, or NULL */
static int square(jl_real *y, const jl_real *x, void *context)
{
    if (context != NULL)
        ++*(int *)context;
    y[0] = x[0] * x[0];
    return JL_OK;
}

static const jl_nonlinear squares = { square, NULL, NULL, NULL, NULL, NULL, 0 };
static const jl_nonlinear sees_square = { NULL, NULL, square, NULL, NULL, NULL,
                                          0 };

/* x ~ N(a, s^2): x^2 has mean a^2 + s^2 and variance 4 a^2 s^2 + 2 s^4.  Of the
 * fourth moment 3 s^4 the points have (1 + kappa) s^4: all with kappa = 2. */
static void test_unscented_square_has_its_moments(void **state)
{
    const jl_real a = 3, s2 = JL_C(0.5), q = JL_C(0.125);
    jl_nonlinear how = squares;
    double want;
    int k;

    (void)state;
    for (k = 0; k < 5; k++) {
        how.kappa = (jl_real)k / 2;
        make(&rig, &jl_kf_unscented, 1, 1, &a, &s2, q, 1, &how);
        predict(&rig);
        want = 4 * 9 * 0.5 + (double)how.kappa * 0.25 + 0.125;
        assert_close(rig.kf.x[0], 9.5, 16 * 9.5 * EPS);
        assert_close(rig.P[0], want, 16 * want * EPS);
    }
}

/* z = x^2 + v: S = 4 a^2 s^2 + kappa s^4 + r, Pxz = 2 a s^2. */
static void test_unscented_square_is_observed(void **state)
{
    const jl_real a = 3, s2 = JL_C(0.5), z = 8;
    jl_nonlinear how = sees_square;
    double S, nu = 8 - 9.5, gain;
    int k;

    (void)state;
    for (k = 0; k < 5; k++) {
        how.kappa = (jl_real)k / 2;
        make(&rig, &jl_kf_unscented, 1, 1, &a, &s2, 0, 4, &how);
        update(&rig, &z);
        S = 4 * 9 * 0.5 + (double)how.kappa * 0.25 + 4;
        gain = 2 * 3 * 0.5 / S;
        assert_close(rig.kf.innovation.nu[0], nu, 32 * EPS);
        assert_close(rig.kf.innovation.nis, nu * nu / S, 32 * EPS);
        assert_close(rig.kf.innovation.loglik,
                     -(log(2 * PI_ * S) + nu * nu / S) / 2, 32 * EPS);
        assert_close(rig.kf.x[0], 3 + gain * nu, 32 * EPS);
        assert_close(rig.P[0], 0.5 - gain * gain * S, 32 * EPS);
    }
}

/* (r, angle) to (x, y) */
static int to_cartesian(jl_real *y, const jl_real *x, void *context)
{
    jl_real s, c;
    int status = jl_sincos(&s, &c, x[1]);

    (void)context;
    y[0] = x[0] * c;
    y[1] = x[0] * s;
    return status;
}

static const jl_nonlinear polar = { to_cartesian, NULL, NULL, NULL, NULL, NULL,
                                    0 };

/* How far off a prediction of to_cartesian is: mean, variances of x and y. */
static void polar_errors(double *off, const jl_kf_form *form, double kappa)
{
    const double s = 15 * PI_ / 180, var = 0.0004, y = exp(-s * s / 2);
    const double xx = (1 + var) / 2 * (1 - exp(-2 * s * s));
    const double yy = (1 + var) / 2 * (1 + exp(-2 * s * s)) - y * y;
    const jl_real x[2] = { 1, (jl_real)(PI_ / 2) };
    const jl_real P[4] = { (jl_real)var, 0, 0, (jl_real)(s * s) };
    jl_nonlinear how = polar;

    how.kappa = (jl_real)kappa;
    make(&rig, form, 2, 1, x, P, 0, 1, &how);
    predict(&rig);
    assert_close(rig.kf.x[0], 0, 8 * EPS);
    off[0] = fabs((double)rig.kf.x[1] - y);
    off[1] = fabs((double)rig.P[0] / xx - 1);
    off[2] = fabs((double)rig.P[3] / yy - 1);
}

/* Julier and Uhlmann's example: a range of 1 +- 0.02 at 90 +- 15 degrees.  With
 * s the latter in radians, the mean is at y = exp(-s^2/2) = 0.966: linearised,
 * it is at 1; points see all but s^4/24, and with kappa = 1 all but s^6/120. */
static void test_unscented_beats_jacobian_from_polar(void **state)
{
    const double s = 15 * PI_ / 180;
    double ekf[3], ukf[3], wide[3];

    (void)state;
    polar_errors(ekf, &jl_kf_sqrt, 0);
    polar_errors(ukf, &jl_kf_unscented, 0);
    polar_errors(wide, &jl_kf_unscented, 1);
    print_message("mean, variances off by: EKF %.5f %.3f %.3f, kappa 0 %.5f "
                  "%.3f %.3f, kappa 1 %.5f %.3f %.3f\n", ekf[0], ekf[1],
                  ekf[2], ukf[0], ukf[1], ukf[2], wide[0], wide[1], wide[2]);
    assert_close(ekf[0], 1 - exp(-s * s / 2), 8 * EPS);
    assert_close(ukf[0] / (pow(s, 4) / 24), 1, 0.05);
    assert_close(wide[0], pow(s, 6) / 120, 0.1 * pow(s, 6) / 120 + 8 * EPS);
    assert_true(ukf[1] < ekf[1] / 3 && wide[1] < ekf[1] / 30);
    assert_true(wide[2] < ekf[2] / 10);
}

/* --- quadrature ----------------------------------------------------------- */

static int range_bearing(jl_real *z, const jl_real *x, void *context)
{
    (void)context;
    z[0] = (jl_real)sqrt((double)(x[0] * x[0] + x[1] * x[1]));
    z[1] = jl_atan2(x[1], x[0]);
    return JL_OK;
}

static void difference(jl_real *d, const jl_real *a, const jl_real *b,
                       void *context)
{
    const jl_real pi = (jl_real)PI_;

    (void)context;
    d[0] = a[0] - b[0];
    d[1] = a[1] - b[1];
    if (d[1] >= pi)
        d[1] -= 2 * pi;
    else if (d[1] < -pi)
        d[1] += 2 * pi;
}

static const jl_nonlinear radar = { NULL, NULL, range_bearing, NULL, difference,
                                    NULL, 0 };

/* Mean and mean square of x[0], after a measurement, by a grid over 6 sigma. */
static void quadrature(double *mean, double *var, const double *x, double sd,
                       const double *z, const double *sigma)
{
    const int half = 300;
    double sum = 0, sum1 = 0, sum2 = 0;
    int i, j;

    for (i = -half; i <= half; i++)
        for (j = -half; j <= half; j++) {
            double dx = 6 * sd * i / half, dy = 6 * sd * j / half;
            double at = x[0] + dx, y = x[1] + dy;
            double e = (hypot(at, y) - z[0]) / sigma[0];
            double f = remainder(atan2(y, at) - z[1], 2 * PI_) / sigma[1];
            double p = exp(-(dx * dx + dy * dy) / (2 * sd * sd)
                           - (e * e + f * f) / 2);

            sum += p;
            sum1 += p * at;
            sum2 += p * at * at;
        }
    *mean = sum1 / sum;
    *var = sum2 / sum - *mean * *mean;
}

/* A target somewhere within 30 m of (100, 0), its range known to 2 m and its
 * bearing to half a radian: it lies on an arc, whose mean is nearer. */
static void test_unscented_beats_jacobian_after_update(void **state)
{
    const double x0[2] = { 100, 0 }, z0[2] = { 100, 0 };
    const double sigma0[2] = { 2, 0.5 };
    const jl_real x[2] = { 100, 0 }, P[4] = { 900, 0, 0, 900 };
    const jl_real z[2] = { 100, 0 };
    double mean, var, off_ekf, off_ukf;

    (void)state;
    quadrature(&mean, &var, x0, 30, z0, sigma0);
    make(&rig, &jl_kf_joseph, 2, 2, x, P, 0, 4, &radar);
    rig.mode.R[3] = rig.mode.V[3] = JL_C(0.25);
    update(&rig, z);
    off_ekf = fabs((double)rig.kf.x[0] - mean);
    assert_true(off_ekf > 1.5 * sqrt((double)rig.P[0])); /* and sure */
    make(&rig, &jl_kf_unscented, 2, 2, x, P, 0, 4, &radar);
    rig.mode.R[3] = rig.mode.V[3] = JL_C(0.25);
    update(&rig, z);
    off_ukf = fabs((double)rig.kf.x[0] - mean);
    print_message("mean %.2f, sigma %.2f: EKF off by %.2f, UKF by %.2f with "
                  "sigma %.2f\n", mean, sqrt(var), off_ekf, off_ukf,
                  sqrt((double)rig.P[0]));
    assert_true(off_ukf < off_ekf / 3);
    assert_true(off_ukf < 0.25 * sqrt((double)rig.P[0]));
    assert_close(sqrt((double)rig.P[0]), sqrt(var), 0.1 * sqrt(var));
}

/* --- what is linear ------------------------------------------------------- */

/* A = B B' / n + c I */
static void make_cov(jl_real *A, int n, jl_real c)
{
    static jl_real B[MAX * MAX];
    int i, j, k;

    for (i = 0; i < n * n; i++)
        B[i] = rnd();
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            A[i * n + j] = i == j ? c : 0;
            for (k = 0; k < n; k++)
                A[i * n + j] += B[i * n + k] * B[j * n + k] / (jl_real)n;
        }
}

/* Matrices are the form sqrt's affair. */
static void test_unscented_matrices_are_sqrt(void **state)
{
    jl_real x[4] = { 1, 2, 3, 4 }, P[16], z[2];
    int k, i;

    (void)state;
    make_cov(P, 4, JL_C(0.1));
    make(&rig, &jl_kf_unscented, 4, 2, x, P, 1, 1, NULL);
    make(&other, &jl_kf_sqrt, 4, 2, x, P, 1, 1, NULL);
    for (k = 0; k < 20; k++) {
        z[0] = rnd();
        z[1] = rnd();
        for (i = 0; i < 2; i++) {
            predict(i ? &other : &rig);
            update(i ? &other : &rig, z);
        }
        assert_same_bits(rig.kf.x, other.kf.x, 4 * sizeof *x);
        assert_same_bits(rig.P, other.P, sizeof P);
        assert_same_bits(&rig.kf.innovation.loglik,
                         &other.kf.innovation.loglik, sizeof(jl_real));
    }
}

/* All values of the filter's sizes: y_i = the sum of x_i and x_(i+1). */
struct sums { int n, m; };

static int sum_f(jl_real *y, const jl_real *x, void *context)
{
    const struct sums *s = context;
    int i;

    for (i = 0; i < s->n; i++)
        y[i] = (x[i] + x[(i + 1) % s->n]) / 2;
    return JL_OK;
}

static int sum_h(jl_real *z, const jl_real *x, void *context)
{
    const struct sums *s = context;
    int i;

    for (i = 0; i < s->m; i++)
        z[i] = x[i % s->n] - x[(i + 2) % s->n] / 2;
    return JL_OK;
}

/* Through points and through Jacobians it is the same, for any kappa, up to the
 * largest sizes, which also shows that the scratch suffices. */
static void test_unscented_linear_functions(void **state)
{
    static const int n[] = { 1, 2, 5, 6, MAX, MAX, 1 };
    static const int m[] = { 1, 3, 2, 3, MAX, 1, MAX };
    static jl_real x[MAX], P[MAX * MAX], z[MAX];
    struct sums sums;
    jl_nonlinear how = { sum_f, NULL, sum_h, NULL, NULL, NULL, 0 };
    int k, i, j, step;

    (void)state;
    how.context = &sums;
    for (k = 0; k < 7; k++)
        for (j = 0; j < 3; j++) {
            sums.n = n[k];
            sums.m = m[k];
            how.kappa = (jl_real)(j * j);
            for (i = 0; i < MAX; i++)
                x[i] = rnd();
            make_cov(P, n[k], JL_C(0.1));
            make(&rig, &jl_kf_unscented, n[k], m[k], x, P, 1, JL_C(0.5), &how);
            make(&other, &jl_kf_sqrt, n[k], m[k], x, P, 1, JL_C(0.5), &how);
            for (step = 0; step < (n[k] < MAX ? 20 : 1); step++) {
                for (i = 0; i < MAX; i++)
                    z[i] = rnd();
                for (i = 0; i < 2; i++) {
                    predict(i ? &other : &rig);
                    update(i ? &other : &rig, z);
                }
                for (i = 0; i < n[k]; i++)
                    assert_close(rig.kf.x[i], other.kf.x[i],
                                 100 * cbrt(EPS * EPS));
                for (i = 0; i < n[k] * n[k]; i++)
                    assert_close(rig.P[i], other.P[i],
                                 100 * cbrt(EPS * EPS));
            }
        }
}

/* --- singular covariances ------------------------------------------------- */

/* What is known exactly has no points: y = f(x), and the noise alone. */
static void test_unscented_without_variance(void **state)
{
    const jl_real x[2] = { 2, 1 }, P[4] = { 0, 0, 0, 0 }, z[2] = { 3, 1 };
    jl_real s, c;

    (void)state;
    make(&rig, &jl_kf_unscented, 2, 1, x, P, JL_C(0.25), 1, &polar);
    predict(&rig);
    jl_sincos(&s, &c, 1);
    assert_close(rig.kf.x[0], 2 * c, 4 * EPS);
    assert_close(rig.kf.x[1], 2 * s, 4 * EPS);
    assert_true(rig.P[0] == JL_C(0.25));
    assert_true(rig.P[1] == 0 && rig.P[2] == 0 && rig.P[3] == 0);

    make(&rig, &jl_kf_unscented, 2, 2, x, P, 0, 4, &radar);
    update(&rig, z);
    assert_same_bits(rig.kf.x, x, sizeof x);
    assert_same_bits(rig.P, P, sizeof P);
    assert_close(rig.kf.innovation.nu[0], 3 - sqrt(5), 8 * EPS);
    assert_close(rig.kf.innovation.nis,
                 (pow(3 - sqrt(5), 2) + pow(1 - atan2(1, 2), 2)) / 4,
                 16 * EPS);
}

/* A pair of points costs two calls, but not where it is one point. */
static void test_unscented_calls(void **state)
{
    const jl_real x[3] = { 1, 2, 3 }, P[9] = { 4, 0, 0, 0, 0, 0, 0, 0, 9 };
    const jl_real z = 1;
    jl_nonlinear how = sees_square;
    int calls = 0;

    (void)state;
    how.context = &calls;
    make(&rig, &jl_kf_unscented, 3, 1, x, P, 0, 1, &how);
    update(&rig, &z);
    assert_int_equal(calls, 1 + 2 * 2);
}

static int squares_2(jl_real *y, const jl_real *x, void *context)
{
    (void)context;
    y[0] = x[0] * x[0];
    y[1] = x[1] + x[0];
    return JL_OK;
}

static const jl_nonlinear both = { squares_2, NULL, NULL, NULL, NULL, NULL, 0 };

/* (x_0, x_1) = (3, 5) + e (1, 2), e ~ N(0, 1/2): y_0 = (3 + e)^2 has the mean
 * of one variable, while the other pair of points lies on the centre, with its
 * weights: of the fourth moment the points have (2 + kappa) s^4. */
static void test_unscented_rank_one(void **state)
{
    const jl_real x[2] = { 3, 5 }, P[4] = { JL_C(0.5), 1, 1, 2 };
    jl_nonlinear how = both;
    double want;
    int k;

    (void)state;
    for (k = 0; k < 3; k++) {
        how.kappa = (jl_real)k / 2;
        make(&rig, &jl_kf_unscented, 2, 1, x, P, 0, 1, &how);
        predict(&rig);
        want = 4 * 9 * 0.5 + (1 + (double)how.kappa) * 0.25;
        assert_close(rig.kf.x[0], 9.5, 64 * EPS);
        assert_close(rig.kf.x[1], 8, 64 * EPS);
        assert_close(rig.P[0], want, 16 * want * EPS);
        assert_close(rig.P[1], 2 * 3 * 3 * 0.5, 256 * EPS);
        assert_close(rig.P[3], 9 * 0.5, 128 * EPS);
    }
}

/* --- angles --------------------------------------------------------------- */

/* Turned by half a circle, which changes no digit of a position, a target that
 * was east, where bearings are smooth, is west, where its points lie on both
 * sides of the jump. */
static void test_unscented_angles_wrap(void **state)
{
    jl_real x[2] = { 100, 0 }, P[4] = { 400, 10, 10, 400 }, z[2], west[2];
    int k, i;

    (void)state;
    make(&rig, &jl_kf_unscented, 2, 2, x, P, 25, 4, &radar);
    rig.mode.R[3] = rig.mode.V[3] = JL_C(0.01);
    x[0] = -100;
    make(&other, &jl_kf_unscented, 2, 2, x, P, 25, 4, &radar);
    other.mode.R[3] = other.mode.V[3] = JL_C(0.01);
    for (k = 0; k < 20; k++) {
        z[0] = west[0] = 100 + 2 * rnd();
        z[1] = JL_C(0.1) * rnd();
        west[1] = (jl_real)((double)z[1] + (z[1] > 0 ? -PI_ : PI_));
        predict(&rig);
        predict(&other);
        update(&rig, z);
        update(&other, west);
        for (i = 0; i < 2; i++) {
            double s = sqrt((double)rig.P[i * 3]);

            assert_close(other.kf.x[i], -rig.kf.x[i], 400 * EPS * s);
            assert_close(other.kf.innovation.nu[i], rig.kf.innovation.nu[i],
                         200 * EPS * (i == 0 ? 20 : 1));
        }
        for (i = 0; i < 4; i++)
            assert_close(other.P[i], rig.P[i], 200 * EPS
                         * (double)(rig.P[0] + rig.P[3]));
    }
}

/* --- whatever a function does --------------------------------------------- */

/* Nothing like a smooth function: hashed octets. */
static int wild(jl_real *y, const jl_real *x, void *context)
{
    unsigned char octets[3 * sizeof(jl_real)];
    uint32_t hash = 2166136261u;
    size_t k;
    int i;

    (void)context;
    memcpy(octets, x, sizeof octets);
    for (i = 0; i < 3; i++) {
        for (k = 0; k < sizeof octets; k++)
            hash = (hash ^ octets[k]) * 16777619u;
        y[i] = (jl_real)(hash >> 8) / 8388608 - 1;
        if (hash % 5 == 0)
            y[i] *= 1000000;
    }
    return JL_OK;
}

static void test_unscented_keeps_semidefinite(void **state)
{
    static const jl_nonlinear how = { wild, NULL, wild, NULL, NULL, NULL, 0 };
    jl_real x[3] = { 0, 0, 0 }, P[9] = { 1, 0, 0, 0, 1, 0, 0, 0, 1 }, z[3];
    int k, i;

    (void)state;
    make(&rig, &jl_kf_unscented, 3, 3, x, P, JL_C(0.01), JL_C(0.01), &how);
    for (k = 0; k < 2000; k++) {
        for (i = 0; i < 3; i++)
            z[i] = rnd();
        predict(&rig);
        for (i = 0; i < 3; i++)
            assert_true(rig.kf.P[i * 4] >= 0);
        update(&rig, z);
        for (i = 0; i < 3; i++)
            assert_true(rig.kf.P[i * 4] >= 0);
        assert_int_equal(jl_mat_check_cov(rig.P, scratch, 3), JL_OK);
    }
}

/* --- what is refused ------------------------------------------------------ */

static int constant(jl_real *y, const jl_real *x, void *context)
{
    (void)x;
    y[0] = *(const jl_real *)context;
    return JL_OK;
}

static int quarter(jl_real *y, const jl_real *x, void *context)
{
    (void)context;
    y[0] = x[0] / 4;
    return JL_OK;
}

static int refuses(const jl_real *z)
{
    jl_real x = rig.kf.x[0], S = rig.kf.P[0], nu = rig.kf.innovation.nu[0];
    int status = z != NULL ? jl_kf_update(&rig.kf, NULL, z, spoilt(&rig))
        : jl_kf_predict(&rig.kf, spoilt(&rig));

    assert_true(status == JL_OK || (rig.kf.x[0] <= x && rig.kf.x[0] >= x));
    assert_true(status == JL_OK || (rig.kf.P[0] <= S && rig.kf.P[0] >= S));
    assert_true(status == JL_OK || (rig.kf.innovation.nu[0] <= nu
                                    && rig.kf.innovation.nu[0] >= nu));
    return status;
}

static void test_unscented_refuses(void **state)
{
    const jl_real zero = 0, one = 1, large = JL_LARGE, half = JL_LARGE / 2;
    const jl_real var = JL_LARGE * JL_LARGE / 20, small = JL_REAL_MIN * 4;
    const jl_real bad[] = { NAN_, 2 * JL_LARGE, -2 * JL_LARGE };
    jl_nonlinear how = { constant, NULL, constant, NULL, NULL, NULL, 0 };
    jl_real c = 0;
    int i;

    (void)state;
    how.context = &c;
    /* the prediction's variance is beyond, though no value is */
    make(&rig, &jl_kf_unscented, 1, 1, &zero, &var, 1, 1, &how);
    rig.mode.q[0] = 2 * JL_LARGE * JL_LARGE;
    assert_int_equal(refuses(NULL), JL_ENONFINITE);
    /* ... or its mean: f(x) + u */
    c = JL_LARGE;
    make(&rig, &jl_kf_unscented, 1, 1, &zero, &one, 1, 1, &how);
    rig.mode.u[0] = JL_LARGE;
    assert_int_equal(refuses(NULL), JL_ENONFINITE);
    /* measurements that are none */
    c = 0;
    for (i = 0; i < 3; i++) {
        make(&rig, &jl_kf_unscented, 1, 1, &zero, &one, 1, large, &how);
        assert_int_equal(refuses(&bad[i]), JL_ENONFINITE);
    }
    /* S = 0 */
    make(&rig, &jl_kf_unscented, 1, 1, &zero, &one, 1, 1, &how);
    rig.mode.R[0] = rig.mode.V[0] = 0;
    assert_int_equal(refuses(&one), JL_ESINGULAR);
    /* loglik = -z^2 / 2 R */
    make(&rig, &jl_kf_unscented, 1, 1, &zero, &one, 1, small, &how);
    assert_int_equal(refuses(&large), JL_ENONFINITE);
    /* x = 4 z */
    how.h = quarter;
    make(&rig, &jl_kf_unscented, 1, 1, &zero, &large, 1, 1, &how);
    assert_int_equal(refuses(&large), JL_ENONFINITE);
    assert_int_equal(refuses(&half), JL_ENONFINITE);
    assert_int_equal(refuses(&one), JL_OK);
}

static int bounded(jl_real *y, const jl_real *x, void *context)
{
    (void)context;
    assert_true(jl_vec_within(x, 2, JL_LARGE));
    y[0] = y[1] = 0;
    return JL_OK;
}

/* A function is never asked about what no state can be. */
static void test_unscented_points_are_within_bounds(void **state)
{
    const jl_real x[2] = { 0, JL_LARGE }, z[2] = { 0, 0 };
    const jl_real var = JL_LARGE * JL_LARGE, wide[4] = { var, 0, 0, var };
    const jl_real narrow[4] = { 1, 0, 0, 0 };
    jl_nonlinear how = { bounded, NULL, bounded, NULL, NULL, NULL, 0 };

    (void)state;
    make(&rig, &jl_kf_unscented, 2, 2, x, narrow, 1, 1, &how);
    assert_int_equal(refuses(NULL), JL_OK);
    make(&rig, &jl_kf_unscented, 2, 2, x, narrow, 1, 1, &how);
    assert_int_equal(refuses(z), JL_OK);
    for (how.kappa = 0; how.kappa < 2; how.kappa++) {
        make(&rig, &jl_kf_unscented, 2, 2, x, wide, 1, 1, &how);
        assert_int_equal(refuses(NULL), JL_ENONFINITE);
        assert_int_equal(refuses(z), JL_ENONFINITE);
    }
    how.kappa = JL_LARGE;               /* its product with a variance: inf */
    make(&rig, &jl_kf_unscented, 2, 2, x, wide, 1, 1, &how);
    assert_int_equal(refuses(NULL), JL_ENONFINITE);
    assert_int_equal(refuses(z), JL_ENONFINITE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unscented_square_has_its_moments),
        cmocka_unit_test(test_unscented_square_is_observed),
        cmocka_unit_test(test_unscented_beats_jacobian_from_polar),
        cmocka_unit_test(test_unscented_beats_jacobian_after_update),
        cmocka_unit_test(test_unscented_matrices_are_sqrt),
        cmocka_unit_test(test_unscented_linear_functions),
        cmocka_unit_test(test_unscented_without_variance),
        cmocka_unit_test(test_unscented_calls),
        cmocka_unit_test(test_unscented_rank_one),
        cmocka_unit_test(test_unscented_angles_wrap),
        cmocka_unit_test(test_unscented_keeps_semidefinite),
        cmocka_unit_test(test_unscented_refuses),
        cmocka_unit_test(test_unscented_points_are_within_bounds),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
