/* A bank of CV and CT modes with factors follows a target round and round:
 * however long, its estimate is that of a textbook IMM in long double within
 * stated bounds, and its covariance is one.
 *
 *     STEPS=10000000 build/tests_f32/test_endurance
 *
 * runs so many steps instead of the usual, and prints what was met. */
#include "close.h"

#include <stdint.h>
#include <stdlib.h>

#include "jumplink/imm.h"

enum { M = 4, N = 4, Z = 2, LAP = 220, USUAL = 50000 };

typedef long double wide;

static jl_mode modes[M];
static jl_real Pi[M * M];

static long steps_asked(void)
{
    const char *asked = getenv("STEPS");

    return asked != NULL ? atol(asked) : USUAL;
}

/* --- the target ---------------------------------------------------------- */

static uint64_t seed = 1;

/* Normal enough: the sum of twelve uniform numbers, less six. */
static double noise(void)
{
    double sum = -6;
    int i;

    for (i = 0; i < 12; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        sum += (double)(seed >> 40) / 16777216;
    }
    return sum;
}

/* Two straights of 50 s and two half turns of 60 s, at 150 m/s. */
static void fly_lap(double (*at)[2])
{
    double pi = acos(-1), heading = 0, x = -3750, y = -2866;
    int k;

    for (k = 0; k < LAP; k++) {
        int turning = k % (LAP / 2) >= 50;

        at[k][0] = x;
        at[k][1] = y;
        heading += turning ? pi / 60 : 0;
        x += 150 * cos(heading - (turning ? pi / 120 : 0));
        y += 150 * sin(heading - (turning ? pi / 120 : 0));
    }
}

struct worst {
    double x, P, mu;                    /* x, P in sigmas */
};

/* A sensor; and how far from the textbook an estimate may be: usually, and in
 * the third of the time behind an outlier, for what that says of the modes is a
 * difference of large numbers. */
struct scene {
    const char *name;
    int mixing;
    double sigma;                       /* of a position [m] */
    int quiet, of;                      /* the last steps of so many */
    double outlier;                     /* in sigmas, every 997 steps */
    struct worst calm, shaken;
};

static int is_shaken(const struct scene *s, long k)
{
    return s->outlier > 0 && k % 997 >= 665;
}

/* What is measured at step k; NULL: nothing. */
static const jl_real *measure(jl_real *z, const struct scene *s,
                              double (*lap)[2], long k)
{
    int i;

    for (i = 0; i < Z; i++)
        z[i] = (jl_real)(lap[k % LAP][i] + s->sigma * noise()
                         + (k % 997 == 665 ? s->outlier * s->sigma : 0));
    return k % 17 == 3 || k % s->of >= s->of - s->quiet ? NULL : z;
}

/* --- the textbook --------------------------------------------------------- */

static struct {
    wide x[M][N], P[M][N][N], mu[M], xhat[N], Phat[N][N];
} book;

static void book_pool(wide *mean, wide (*cov)[N], const wide *w)
{
    int i, a, b;

    memset(mean, 0, N * sizeof *mean);
    memset(cov, 0, N * sizeof *cov);
    for (i = 0; i < M; i++)
        for (a = 0; a < N; a++)
            mean[a] += w[i] * book.x[i][a];
    for (i = 0; i < M; i++)
        for (a = 0; a < N; a++)
            for (b = 0; b < N; b++)
                cov[a][b] += w[i] * (book.P[i][a][b]
                                     + (book.x[i][a] - mean[a])
                                     * (book.x[i][b] - mean[b]));
}

static void book_predict(const jl_mode *mode, wide *x, wide (*P)[N])
{
    wide y[N] = { 0 }, T[N][N] = { { 0 } };
    int a, b, c;

    for (a = 0; a < N; a++)
        for (c = 0; c < N; c++) {
            y[a] += mode->F[a * N + c] * x[c];
            for (b = 0; b < N; b++)
                T[a][b] += mode->F[a * N + c] * P[c][b];
        }
    memcpy(x, y, sizeof y);
    for (a = 0; a < N; a++)
        for (b = 0; b < N; b++)
            for (P[a][b] = mode->W[a * N + b], c = 0; c < N; c++)
                P[a][b] += T[a][c] * mode->F[b * N + c];
}

/* Positions 0 and 2 are measured; returns log N(nu; 0, S). */
static wide book_update(wide *x, wide (*P)[N], wide r, const jl_real *z)
{
    wide nu[2], a = P[0][0] + r, b = P[0][2], d = P[2][2] + r;
    wide det = a * d - b * b, K[N][2], T[N][N];
    int i, j;

    nu[0] = z[0] - x[0];
    nu[1] = z[1] - x[2];
    for (i = 0; i < N; i++) {
        K[i][0] = (P[i][0] * d - P[i][2] * b) / det;
        K[i][1] = (P[i][2] * a - P[i][0] * b) / det;
    }
    for (i = 0; i < N; i++) {
        x[i] += K[i][0] * nu[0] + K[i][1] * nu[1];
        for (j = 0; j < N; j++)
            T[i][j] = P[i][j] - K[i][0] * P[0][j] - K[i][1] * P[2][j];
        for (j = 0; j < i; j++)
            T[i][j] = T[j][i];
    }
    memcpy(P, T, sizeof T);
    return -(2 * logl(2 * acosl(-1)) + logl(det)
             + (nu[0] * nu[0] * d - 2 * nu[0] * nu[1] * b
                + nu[1] * nu[1] * a) / det) / 2;
}

static void book_step(const jl_real *z)
{
    wide x[M][N], P[M][N][N], w[M], c[M], l[M], best = -1e300L, sum = 0;
    int i, j;

    for (j = 0; j < M; j++) {
        for (c[j] = 0, i = 0; i < M; i++)
            c[j] += w[i] = Pi[i * M + j] * book.mu[i];
        for (i = 0; i < M; i++)
            w[i] /= c[j];
        book_pool(x[j], P[j], w);
        book_predict(&modes[j], x[j], P[j]);
        l[j] = z != NULL ? book_update(x[j], P[j], modes[j].R[0], z) : 0;
        best = fmaxl(best, l[j]);
    }
    for (j = 0; j < M; j++)
        sum += book.mu[j] = c[j] * expl(l[j] - best);
    for (j = 0; j < M; j++)
        book.mu[j] /= sum;
    memcpy(book.x, x, sizeof x);
    memcpy(book.P, P, sizeof P);
    book_pool(book.xhat, book.Phat, book.mu);
}

/* --- the library ---------------------------------------------------------- */

static jl_imm imm;
static jl_real mem[JL_IMM_STATE(M, N, Z)], scratch[JL_IMM_SCRATCH(M, N, Z)];

static void note(double *worst, double e)
{
    if (!(e <= *worst))                 /* NaN is worst */
        *worst = e;
}

static void compare(struct worst *w)
{
    int a, b, j;

    for (a = 0; a < N; a++) {
        double sigma = (double)sqrtl(book.Phat[a][a]);

        note(&w->x, fabs((double)(imm.xhat[a] - book.xhat[a])) / sigma);
        for (b = 0; b < N; b++)
            note(&w->P, fabs((double)(imm.Phat[a * N + b] - book.Phat[a][b]))
                        / sigma / (double)sqrtl(book.Phat[b][b]));
    }
    for (j = 0; j < M; j++)
        note(&w->mu, fabs((double)(imm.mu[j] - book.mu[j])));
}

/* Every factor is one, and Phat a covariance: symmetric and positive. */
static void check_valid(void)
{
    jl_real L[N * N];
    int i, j, k;

    for (k = 0; k < M; k++)
        for (i = 0; i < N; i++) {
            const jl_real *row = imm.P + (k * N + i) * N;

            assert_true(row[i] > 0);
            for (j = 0; j < N; j++)
                assert_true(j < i ? row[j] == 0 : isfinite(row[j]));
        }
    for (i = 0; i < N; i++)
        for (j = 0; j < i; j++)
            assert_same_bits(&imm.Phat[i * N + j], &imm.Phat[j * N + i],
                             sizeof *L);
    assert_int_equal(jl_mat_cholesky(L, imm.Phat, N), JL_OK);
}

static void set_modes(double sigma)
{
    static const jl_real accel[M] = { JL_C(0.3), 4, JL_C(0.5), JL_C(0.5) };
    static const jl_real turn[M] = { 0, 0, JL_C(0.05), JL_C(-0.05) };
    static jl_real mode_mem[M][JL_MODE_MEM(N, Z, Z)];
    int j;

    for (j = 0; j < M; j++) {
        jl_motion motion = { 0 };

        motion.kind = JL_MOTION_CT;
        motion.axes = Z;
        motion.order = 2;
        motion.accel_std = accel[j];
        motion.turn_rate = turn[j];
        motion.sigma_z = (jl_real)sigma;
        jl_mode_init(&modes[j], N, Z, Z, mode_mem[j], JL_MODE_MEM(N, Z, Z));
        assert_int_equal(jl_mode_motion(&modes[j], &motion, 1), JL_OK);
    }
}

/* Both filters at the start of the lap. */
static void start(const struct scene *s, const jl_kf_form *form)
{
    static const jl_real sojourn[M] = { 40, 40, 40, 40 };
    const jl_real z[Z] = { -3750, -2866 };
    jl_motion motion = { 0 };
    jl_real x[M * N], P[M * N * N];
    int i, j;

    seed = 1;
    set_modes(s->sigma);
    motion.kind = JL_MOTION_CV;
    motion.axes = Z;
    motion.order = 2;
    motion.sigma_z = (jl_real)s->sigma;
    for (j = 0; j < M; j++)
        jl_motion_start(x + j * N, P + j * N * N, &motion, z, 200, 10);
    jl_chain_sojourn(Pi, sojourn, M, 1);
    jl_imm_init(&imm, M, modes, form, s->mixing, mem, JL_IMM_STATE(M, N, Z));
    jl_imm_chain(&imm, Pi);
    assert_int_equal(imm.sticky, s->mixing == JL_MIX_AUTO);
    assert_int_equal(jl_imm_set(&imm, x, P, imm.mu, scratch), JL_OK);
    for (j = 0; j < M; j++) {
        book.mu[j] = imm.mu[j];
        for (i = 0; i < N; i++)
            book.x[j][i] = x[j * N + i];
        for (i = 0; i < N * N; i++)
            book.P[j][i / N][i % N] = P[j * N * N + i];
    }
}

static void check_worst(const struct worst *worst, const struct worst *limit,
                        const char *name)
{
    if (getenv("STEPS") != NULL)
        print_message("%s: x %.2g, P %.2g, mu %.2g at most\n", name, worst->x,
                      worst->P, worst->mu);
    assert_true(worst->x <= limit->x);
    assert_true(worst->P <= limit->P);
    assert_true(worst->mu <= limit->mu);
}

static void endure(const struct scene *s)
{
    struct worst calm = { 0, 0, 0 }, shaken = { 0, 0, 0 };
    double lap[LAP][2];
    jl_real z[Z];
    long k, steps = steps_asked();

    fly_lap(lap);
    start(s, &jl_kf_sqrt);
    for (k = 1; k <= steps; k++) {
        const jl_real *given = measure(z, s, lap, k);

        assert_int_equal(jl_imm_step(&imm, given, scratch), JL_OK);
        book_step(given);
        compare(is_shaken(s, k) ? &shaken : &calm);
        check_valid();
    }
    check_worst(&calm, &s->calm, s->name);
    if (s->outlier > 0)
        check_worst(&shaken, &s->shaken, "  ... after an outlier");
}

/* --- scenes --------------------------------------------------------------- */

/* About five times the worst of 10^7 steps. */
#if JL_REAL_FLOAT
#define RADAR { 2e-3, 2e-3, 5e-4 }, { 0.1, 0.1, 0.05 }
#define LASER { 0.2, 0.05, 0.01 }, { 0, 0, 0 }
#else
#define RADAR { 4e-12, 4e-12, 1e-12 }, { 2e-10, 2e-10, 1e-10 }
#define LASER { 4e-10, 4e-9, 2e-11 }, { 0, 0, 0 }
#endif

/* 20 m, with outliers; and 5 cm after a minute of nothing, R / (H P- H') being
 * 1e-11 then.  Positions of 4 km in float have 0.2 mm. */
static const struct scene radar = {
    "radar", JL_MIX_AUTO, 20, 10, 5000, 20, RADAR
};
static const struct scene radar_general = {
    "radar, general mixing", JL_MIX_GENERAL, 20, 10, 5000, 20, RADAR
};
static const struct scene laser = {
    "laser", JL_MIX_AUTO, 0.05, 60, 500, 0, LASER
};

static void test_factors_endure_outliers(void **state)
{
    (void)state;
    endure(&radar);
    endure(&radar_general);
}

static void test_factors_endure_silence(void **state)
{
    (void)state;
    endure(&laser);
}

/* In float the standard form does not get over the first minutes. */
static void test_standard_does_not(void **state)
{
    double lap[LAP][2];
    jl_real z[Z];
    int k, status = JL_OK;

    (void)state;
    fly_lap(lap);
    start(&laser, &jl_kf_standard);
    for (k = 1; k <= 5000 && status == JL_OK; k++)
        status = jl_imm_step(&imm, measure(z, &laser, lap, k), scratch);
    assert_int_equal(status, JL_REAL_FLOAT ? JL_ESINGULAR : JL_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_factors_endure_outliers),
        cmocka_unit_test(test_factors_endure_silence),
        cmocka_unit_test(test_standard_does_not),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
