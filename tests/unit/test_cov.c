/* How forms keep covariances, and what an IMM does with them: the covariance
 * itself and the factor, against sums in long double. */
#include "close.h"

#include <stdint.h>

#include "jumplink/kf.h"

#define N 7
#define M_MAX 6
#define EDGE 3
#define EPS ((double)JL_EPSILON)

typedef long double wide;

static const jl_cov *const covs[] = { &jl_cov_full, &jl_cov_ud };
static uint32_t seed = 5;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

static void spoil(jl_real *a, int count)
{
    while (count-- > 0)
        *a++ = (jl_real)NAN;
}

/* --- estimates ----------------------------------------------------------- */

/* M estimates of n components, and what comes of them, with NaN around. */
static jl_real x[M_MAX * N], P[M_MAX * N * N], S[M_MAX * N * N], w[M_MAX];
static jl_real mean[N], out[N * N + 2 * EDGE], scratch[N * N + 2 * N + EDGE];
static const jl_cov *cov;

/* Scratch of so many reals. */
static jl_real *room(int count)
{
    spoil(scratch, N * N + 2 * N + EDGE);
    scratch[count] = 77;
    return scratch;
}

static void check_room(int count)
{
    assert_true(scratch[count] == 77);
}

/* A = B B', B [n,rank], in units of 10^+-decades */
static void make_cov(jl_real *A, int n, int rank, int decades)
{
    jl_real B[N * N];
    int i, j, k;

    for (i = 0; i < n; i++)
        for (k = 0; k < rank; k++)
            B[i * rank + k] = rnd()
                * (jl_real)pow(10, i * 5 % (2 * decades + 1) - decades);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            A[i * n + j] = 0;
            for (k = 0; k < rank; k++)
                A[i * n + j] += B[i * rank + k] * B[j * rank + k];
        }
}

/* Estimates of several ranks, some with a component that is known exactly;
 * weights of which some are small or 0. */
static void make(int M, int n, int decades)
{
    jl_real sum = 0;
    int i, a, known;

    for (i = 0; i < M; i++) {
        make_cov(P + i * n * n, n, 1 + (int)(seed % (unsigned)n), decades);
        known = (int)(seed % (unsigned)(2 * n));
        for (a = 0; a < n && known < n; a++)
            P[i * n * n + a * n + known] = P[i * n * n + known * n + a] = 0;
        for (a = 0; a < n; a++)
            x[i * n + a] = 4 * rnd() * (jl_real)pow(10, a * 5
                                                % (2 * decades + 1) - decades);
        w[i] = 1 + rnd();
        if (i > 0 && seed % 4 == 0)
            w[i] *= seed % 8 ? JL_C(1.0e-9) : 0;
        sum += w[i];
        cov->take(S + i * n * n, P + i * n * n, room(n * n + 2 * n), n);
        check_room(n * n + 2 * n);
    }
    for (i = 0; i < M; i++)
        w[i] /= sum;
}

/* Element (i, j) of what S stands for. */
static wide element(const jl_real *s, int n, int i, int j)
{
    wide sum = 0;
    int k;

    if (!cov->factored)
        return s[i * n + j];
    for (k = 0; k <= i && k <= j; k++)
        sum += (wide)s[k * n + k] * (k == i ? 1 : s[k * n + i])
            * (k == j ? 1 : s[k * n + j]);
    return sum;
}

/* Symmetric; or D >= 0 and zeros below. */
static void check_kept(const jl_real *s, int n)
{
    int i, j;

    assert_true(jl_vec_within(s, n * n, JL_REAL_MAX));
    for (i = 0; i < n; i++) {
        assert_true(s[i * (n + 1)] >= 0);
        for (j = 0; j < i; j++)
            assert_true(s[i * n + j] == (cov->factored ? 0 : s[j * n + i]));
    }
}

/* s stands for `want` [n,n], in units of its sigma_i sigma_j. */
static void check_cov(const jl_real *s, wide (*want)[N], int n,
                      double tolerance)
{
    int i, j;

    check_kept(s, n);
    for (i = 0; i < n; i++)
        for (j = i; j < n; j++)
            assert_close(element(s, n, i, j) - want[i][j], 0,
                         tolerance * (double)(sqrtl(want[i][i])
                                              * sqrtl(want[j][j])));
}

/* --- there and back ------------------------------------------------------ */

static void test_cov_take_and_give(void **state)
{
    jl_real back[N * N], again[N * N];
    int run, n, i, j;

    (void)state;
    for (run = 0; run < 4000; run++) {
        cov = covs[run % 2];
        n = 1 + run / 2 % N;
        make(1, n, run % 3 ? 12 : 0);
        P[n > 1 ? n : 0] *= 1 + 4 * JL_EPSILON;     /* as good as symmetric */
        cov->take(S, P, room(n * n + 2 * n), n);
        check_room(n * n + 2 * n);
        check_kept(S, n);
        cov->give(back, S, n);
        for (i = 0; i < n; i++)
            for (j = i; j < n; j++) {
                double scale = sqrt((double)P[i * (n + 1)])
                    * sqrt((double)P[j * (n + 1)]);

                assert_same_bits(&back[i * n + j], &back[j * n + i],
                                 sizeof *back);
                assert_close(back[i * n + j], P[i * n + j],
                             cov->factored ? 128 * n * EPS * scale : 0);
                assert_close(back[i * n + j], element(S, n, i, j),
                             4 * n * EPS * scale);
            }
        memcpy(again, P, sizeof again);
        cov->take(again, again, room(n * n + 2 * n), n);
        assert_same_bits(again, S, (size_t)(n * n) * sizeof *S);
    }
}

/* --- sums over estimates -------------------------------------------------- */

static void pooled(wide *m, wide (*want)[N], int M, int n)
{
    wide sum = 0;
    int i, a, b;

    for (i = 0; i < M; i++)
        sum += w[i];
    for (a = 0; a < n; a++)
        for (m[a] = 0, i = 0; i < M; i++)
            m[a] += w[i] * (wide)x[i * n + a] / sum;
    for (a = 0; a < n; a++)
        for (b = 0; b < n; b++)
            for (want[a][b] = 0, i = 0; i < M; i++)
                want[a][b] += w[i] / sum
                    * (element(S + i * n * n, n, a, b)
                       + (x[i * n + a] - m[a]) * (x[i * n + b] - m[b]));
}

static void test_cov_pool(void **state)
{
    wide m[N], want[N][N];
    int run, n, M, i, decades;

    (void)state;
    for (run = 0; run < 6000; run++) {
        cov = covs[run % 2];
        M = 1 + run / 2 % M_MAX;
        n = 1 + run / 3 % N;
        decades = run % 5 ? 0 : 12;
        make(M, n, decades);
        spoil(out, N * N + 2 * EDGE);
        spoil(mean, N);
        cov->pool(mean, out + EDGE, w, x, S, room(2 * n), M, n);
        check_room(2 * n);
        assert_true(isnan(out[EDGE - 1]) && isnan(out[EDGE + n * n]));
        pooled(m, want, M, n);
        for (i = 0; i < n; i++)
            assert_close(mean[i], m[i], 8 * M * EPS
                         * (double)sqrtl(want[i][i] + m[i] * m[i]));
        check_cov(out + EDGE, want, n, 16 * (M + n) * EPS);
    }
}

static void test_cov_blend_is_a_pool_of_two(void **state)
{
    wide m[N], want[N][N];
    jl_real bx[N], bS[N * N];
    int run, n, i, nn;

    (void)state;
    for (run = 0; run < 4000; run++) {
        cov = covs[run % 2];
        n = 1 + run / 2 % N;
        nn = n * n;
        make(2, n, run % 5 ? 0 : 12);
        if (run % 7 == 0) {
            w[run % 2] = 0;
            w[1 - run % 2] = 1;
        }
        spoil(bS, N * N);
        cov->blend(bx, bS, w[0], x, S, w[1], x + n, S + nn, room(2 * n), n);
        check_room(2 * n);
        pooled(m, want, 2, n);
        for (i = 0; i < n; i++)
            assert_close(bx[i], m[i], 8 * EPS
                         * (double)sqrtl(want[i][i] + m[i] * m[i]));
        check_cov(bS, want, n, 32 * (1 + n) * EPS);
        cov->blend(x, S, w[0], x, S, w[1], x + n, S + nn, room(2 * n), n);
        assert_same_bits(x, bx, (size_t)n * sizeof *x);
        assert_same_bits(S, bS, (size_t)nn * sizeof *S);
    }
}

/* What both agree in stays, to the bit. */
static void test_cov_blend_of_two_that_agree(void **state)
{
    int run, n;

    (void)state;
    for (run = 0; run < 400; run++) {
        cov = covs[run % 2];
        n = 1 + run / 2 % N;
        make(2, n, run % 5 ? 0 : 12);
        memcpy(x + n, x, (size_t)n * sizeof *x);
        cov->blend(mean, out, w[0], x, S, w[1], x + n, S + n * n, room(2 * n),
                   n);
        assert_same_bits(mean, x, (size_t)n * sizeof *x);
    }
}

/* Far from zero, near each other: the spread keeps its digits. */
static void test_cov_pool_far_from_zero(void **state)
{
    wide m[N], want[N][N];
    int run, n, i;

    (void)state;
    for (run = 0; run < 400; run++) {
        cov = covs[run % 2];
        n = 1 + run / 2 % N;
        make(M_MAX, n, 0);
        for (i = 0; i < M_MAX * n; i++)
            x[i] += 1000;
        cov->pool(mean, out, w, x, S, room(2 * n), M_MAX, n);
        pooled(m, want, M_MAX, n);
        check_cov(out, want, n, 64 * 1000 * EPS);
    }
}

/* Estimates as far apart, and variances as large, as they may be. */
static void test_cov_sums_cannot_overflow(void **state)
{
    int c, n, i, k;

    (void)state;
    for (c = 0; c < 2; c++)
        for (n = 1; n <= 2; n++)
            for (k = 0; k < 4; k++) {
                cov = covs[c];
                make(M_MAX, n, 0);
                for (i = 0; i < M_MAX * n; i++) {
                    x[i] = i / n % 2 ? JL_LARGE : -JL_LARGE;
                    w[i / n] = (jl_real)(1.0 / M_MAX);
                }
                w[0] = k % 2 ? JL_REAL_MIN : w[0];
                for (i = 0; i < M_MAX; i++) {
                    P[i * n * n] = JL_LARGE * JL_LARGE;
                    if (n == 2) {       /* two as good as one, or nothing */
                        P[i * n * n + 3] = k > 1 ? JL_REAL_MIN
                            : JL_LARGE * JL_LARGE;
                        P[i * n * n + 1] = P[i * n * n + 2]
                            = (jl_real)sqrt((double)P[i * n * n + 3])
                            * JL_LARGE;
                    }
                    cov->take(S + i * n * n, P + i * n * n,
                              room(n * n + 2 * n), n);
                }
                cov->pool(mean, out, w, x, S, room(2 * n), M_MAX, n);
                check_kept(out, n);
                assert_true(jl_vec_within(mean, n, JL_LARGE));
                cov->blend(mean, out, w[0], x, S, w[1], x + n, S + n * n,
                           room(2 * n), n);
                check_kept(out, n);
                cov->give(P, out, n);
                assert_true(jl_vec_within(P, n * n, JL_REAL_MAX));
            }
}

/* --- components ----------------------------------------------------------- */

/* A map of k out of n. */
static int choose(int *map, int n)
{
    int i, k = 0;

    for (i = 0; i < n; i++)
        if (rnd() > 0)
            map[k++] = i;
    if (k == 0)
        map[k++] = n - 1;
    return k;
}

static void test_cov_part(void **state)
{
    wide want[N][N];
    int map[N], run, n, k, i, j;

    (void)state;
    for (run = 0; run < 4000; run++) {
        cov = covs[run % 2];
        n = 1 + run / 2 % N;
        make(1, n, run % 5 ? 0 : 12);
        k = choose(map, n);
        for (i = 0; i < k; i++)
            for (j = 0; j < k; j++)
                want[i][j] = element(S, n, map[i], map[j]);
        spoil(out, N * N + 2 * EDGE);
        cov->part(out + EDGE, S, map, room(n), k, n);
        check_room(n);
        assert_true(isnan(out[EDGE - 1]) && isnan(out[EDGE + k * k]));
        check_cov(out + EDGE, want, k, 8 * n * EPS);
    }
}

static void test_cov_whole(void **state)
{
    wide want[N][N];
    jl_real var[N], small[N * N];
    int map[N], run, n, k, i, j;

    (void)state;
    for (run = 0; run < 4000; run++) {
        cov = covs[run % 2];
        n = 1 + run / 2 % N;
        k = choose(map, n);
        make(1, k, run % 5 ? 0 : 12);
        memset(want, 0, sizeof want);
        for (i = 0; i < n; i++)
            want[i][i] = var[i] = run % 3 ? 1 + rnd() : 0;
        for (i = 0; i < k; i++)
            for (j = 0; j < k; j++)
                want[map[i]][map[j]] = element(S, k, i, j);
        spoil(out, N * N + 2 * EDGE);
        cov->whole(out + EDGE, S, map, var, k, n);
        assert_true(isnan(out[EDGE - 1]) && isnan(out[EDGE + n * n]));
        check_cov(out + EDGE, want, n, 0);
        cov->part(small, out + EDGE, map, room(n), k, n);
        for (i = 0; i < k; i++)         /* a row of weight 0 is not kept */
            for (j = 0; j < k && S[i * (k + 1)] > 0; j++)
                assert_same_bits(&small[i * k + j], &S[i * k + j], sizeof *S);
    }
}

/* --- what only factors can do --------------------------------------------- */

/* The determinant D_1 D_2 tells what a covariance cannot: a direction known to
 * 1e-12 beside one of 1e12. */
static void test_cov_factors_keep_what_is_small(void **state)
{
    const jl_real tiny = JL_C(1.0e-24), huge = JL_C(1.0e24);
    const jl_real half = JL_C(0.5);
    int k;

    (void)state;
    cov = &jl_cov_ud;
    x[0] = x[1] = x[2] = x[3] = 1;
    for (k = 0; k < 2; k++) {
        /* tiny I and huge (1, 1)'(1, 1), in either order */
        memset(S, 0, sizeof S);
        S[4 * k] = S[4 * k + 3] = tiny;
        S[4 * !k] = huge;
        S[4 * !k + 1] = 1;
        cov->blend(mean, out, half, x, S, half, x + 2, S + 4, room(4), 2);
        check_kept(out, 2);
        assert_close(out[0] / huge, 0.5, 4 * EPS);
        assert_close(out[1], 1, 4 * EPS);
        assert_close(out[3] / tiny, 1, 8 * EPS);        /* 1/2 + 1/2 */
        w[0] = w[1] = half;
        cov->pool(mean, out, w, x, S, room(4), 2, 2);
        assert_close(out[3] / tiny, 1, 8 * EPS);
    }
}

/* What is below JL_REAL_MIN is let go of before a quotient overflows. */
static void test_cov_factors_stay_finite(void **state)
{
    const jl_real half = JL_C(0.5);
    jl_real least = JL_REAL_MIN * JL_EPSILON;   /* the least above 0 */

    (void)state;
    cov = &jl_cov_ud;
    memset(S, 0, sizeof S);
    memset(x, 0, sizeof x);
    x[0] = (jl_real)sqrt(16 * (double)JL_REAL_MIN) * (jl_real)sqrt(EPS);
    x[1] = JL_LARGE;                    /* beside a difference of nearly none */
    cov->blend(mean, out, half, x, S, half, x + 2, S + 4, room(4), 2);
    check_kept(out, 2);
    x[0] = JL_LARGE;                    /* over a row of so small a weight */
    x[1] = 0;
    S[0] = 8 * JL_LARGE * JL_LARGE * least;
    S[1] = JL_LARGE / (jl_real)sqrt((double)S[0]);
    cov->blend(mean, out, half, x, S, half, x + 2, S + 4, room(4), 2);
    check_kept(out, 2);
    cov->blend(mean, out, half, x, S + 4, half, x + 2, S, room(4), 2);
    check_kept(out, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cov_take_and_give),
        cmocka_unit_test(test_cov_pool),
        cmocka_unit_test(test_cov_blend_is_a_pool_of_two),
        cmocka_unit_test(test_cov_blend_of_two_that_agree),
        cmocka_unit_test(test_cov_pool_far_from_zero),
        cmocka_unit_test(test_cov_sums_cannot_overflow),
        cmocka_unit_test(test_cov_part),
        cmocka_unit_test(test_cov_whole),
        cmocka_unit_test(test_cov_factors_keep_what_is_small),
        cmocka_unit_test(test_cov_factors_stay_finite),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
