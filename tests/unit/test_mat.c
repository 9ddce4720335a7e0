/* Matrices: against sums in long double, identities, and what may not pass. */
#include "close.h"

#include <stdint.h>
#include <stdlib.h>

#include "jumplink/mat.h"

#define N JL_MAX_STATES
#define EDGE 3                          /* reals before and after an array */
#define BIG (JL_LARGE * JL_LARGE)       /* the largest a covariance may be */

static const int sizes[] = { 1, 2, 3, 7, N };
#define SIZES ((int)(sizeof sizes / sizeof *sizes))

/* --- arrays whose edges are watched ------------------------------------- */

#define ROOM (N * N + 2 * N)            /* the largest array of a test */

static jl_real block[6][ROOM + 2 * EDGE];
static uint32_t seed = 1;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

static void fill(jl_real *a, int count, jl_real value)
{
    int i;

    for (i = 0; i < count; i++)
        a[i] = value;
}

/* Array k of count reals, random, with NaN around. */
static jl_real *array(int k, int count)
{
    int i;

    fill(block[k], ROOM + 2 * EDGE, (jl_real)NAN);
    for (i = 0; i < count; i++)
        block[k][EDGE + i] = rnd();
    return block[k] + EDGE;
}

static void check_edges(int k, int count)
{
    int i;

    for (i = 0; i < EDGE; i++) {
        assert_true(isnan(block[k][i]));
        assert_true(isnan(block[k][EDGE + count + i]));
    }
}

static void check_symmetric(const jl_real *A, int n)
{
    int i, j;

    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++)
            assert_same_bits(&A[i * n + j], &A[j * n + i], sizeof *A);
}

/* A = B B' + c I, B [n,rank] */
static void make_cov(jl_real *A, int n, int rank, jl_real c)
{
    static jl_real B[N * N];
    int i, j, k;

    for (i = 0; i < n * rank; i++)
        B[i] = rnd();
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            A[i * n + j] = i == j ? c : 0;
            for (k = 0; k < rank; k++)
                A[i * n + j] += B[i * rank + k] * B[j * rank + k];
        }
}

/* --- products ----------------------------------------------------------- */

static void check_products(int n, int m, int p)
{
    jl_real *A = array(0, n * m), *B = array(1, m * p), *C = array(2, n * p);
    jl_real *Bt = array(3, m * p), *D = array(4, n * p);
    jl_real sum;
    int i, j, k;

    for (k = 0; k < m; k++)
        for (j = 0; j < p; j++)
            Bt[j * m + k] = B[k * p + j];
    jl_mat_mul(C, A, B, n, m, p);
    jl_mat_mul_t(D, A, Bt, n, m, p);
    for (i = 0; i < n; i++)
        for (j = 0; j < p; j++) {
            for (sum = 0, k = 0; k < m; k++)
                sum += A[i * m + k] * B[k * p + j];
            assert_same_bits(&C[i * p + j], &sum, sizeof sum);
            assert_same_bits(&D[i * p + j], &sum, sizeof sum);
        }
    check_edges(2, n * p);
    check_edges(4, n * p);
}

static void test_mat_mul_sums_in_index_order(void **state)
{
    jl_real A[3], B[3] = { 1, 1, 1 }, c = 7;
    int i, j, k;

    (void)state;
    for (i = 0; i < SIZES; i++)
        for (j = 0; j < SIZES; j++)
            for (k = 0; k < SIZES; k++)
                check_products(sizes[i], sizes[j], sizes[k]);
    A[0] = 1;                           /* 1 + big - big is 0, not 1 */
    A[1] = 4 / JL_EPSILON;
    A[2] = -A[1];
    jl_mat_mul(&c, A, B, 1, 3, 1);
    assert_true(c == 0);
    c = 7;
    jl_mat_mul_t(&c, A, B, 1, 3, 1);
    assert_true(c == 0);
}

static void check_sandwich(int n, int m)
{
    jl_real *A = array(0, n * m), *P = array(1, m * m), *Q = array(2, n * n);
    jl_real *C = array(3, n * n), *bare = array(4, n * n);
    jl_real *work = array(5, n * m);
    long double want;
    double tolerance = 4.0 * (m + 1) * (m + 1) * (double)JL_EPSILON;
    int i, j, k, l;

    make_cov(P, m, 2, 0);
    make_cov(Q, n, 2, 0);
    fill(work, n * m, (jl_real)NAN);
    jl_mat_sandwich(bare, A, P, NULL, work, n, m);
    jl_mat_sandwich(C, A, P, Q, work, n, m);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            want = 0;
            for (k = 0; k < m; k++)
                for (l = 0; l < m; l++)
                    want += (long double)A[i * m + k] * P[k * m + l]
                        * A[j * m + l];
            assert_close(bare[i * n + j], want, tolerance);
            assert_close(C[i * n + j], want + Q[i * n + j], tolerance);
        }
    check_symmetric(C, n);
    check_symmetric(bare, n);
    check_edges(3, n * n);
    check_edges(4, n * n);
    check_edges(5, n * m);
    jl_mat_sandwich(Q, A, P, Q, work, n, m);
    assert_same_bits(Q, C, (size_t)(n * n) * sizeof *Q);
    check_edges(2, n * n);
}

static void test_mat_sandwich(void **state)
{
    static const int small[] = { 1, 2, 3, 5, 11 };
    int i, j;

    (void)state;
    for (i = 0; i < 5; i++)
        for (j = 0; j < 5; j++)
            check_sandwich(small[i], small[j]);
    check_sandwich(N, 1);
    check_sandwich(1, N);
    check_sandwich(N, 9);
}

static void check_apply(int n, int m)
{
    jl_real *A = array(0, n * m), *x = array(1, m), *b = array(2, n);
    jl_real *y = array(3, n), *bare = array(4, n);
    double tolerance = 2.0 * (m + 1) * (double)JL_EPSILON;
    long double want;
    int i, k;

    jl_mat_apply(bare, A, x, NULL, n, m);
    jl_mat_apply(y, A, x, b, n, m);
    for (i = 0; i < n; i++) {
        for (want = 0, k = 0; k < m; k++)
            want += (long double)A[i * m + k] * x[k];
        assert_close(bare[i], want, tolerance);
        assert_close(y[i], want + b[i], tolerance);
    }
    jl_mat_apply(b, A, x, b, n, m);
    assert_same_bits(b, y, (size_t)n * sizeof *y);
    check_edges(2, n);
    check_edges(3, n);
    check_edges(4, n);
}

static void test_mat_apply(void **state)
{
    int i, j;

    (void)state;
    for (i = 0; i < SIZES; i++)
        for (j = 0; j < SIZES; j++)
            check_apply(sizes[i], sizes[j]);
}

/* --- triangular --------------------------------------------------------- */

static void test_mat_cholesky_every_size(void **state)
{
    jl_real *A, *L, *copy;
    long double sum;
    int n, i, j, k;

    (void)state;
    for (n = 1; n <= N; n++) {
        A = array(0, n * n);
        L = array(1, n * n);
        copy = array(2, n * n);
        make_cov(A, n, n, 1);
        for (i = 0; i < n; i++)         /* only the lower triangle is read */
            for (j = i + 1; j < n; j++)
                A[i * n + j] = (jl_real)NAN;
        memcpy(copy, A, (size_t)(n * n) * sizeof *A);
        assert_int_equal(jl_mat_cholesky(L, A, n), JL_OK);
        assert_same_bits(A, copy, (size_t)(n * n) * sizeof *A);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                for (sum = 0, k = 0; k < n; k++)
                    sum += (long double)L[i * n + k] * L[j * n + k];
                if (j <= i)
                    assert_close(sum, A[i * n + j],
                                 4.0 * (n + 1) * n * (double)JL_EPSILON);
                else
                    assert_true(L[i * n + j] == 0);
            }
        check_edges(1, n * n);
        assert_int_equal(jl_mat_cholesky(A, A, n), JL_OK);
        assert_same_bits(A, L, (size_t)(n * n) * sizeof *A);
        check_edges(0, n * n);
    }
}

static void test_mat_cholesky_refuses(void **state)
{
    static const jl_real bad[] = { (jl_real)NAN, (jl_real)INFINITY,
                                   -(jl_real)INFINITY };
    jl_real A[16], L[16], one;
    int i, j, k;

    (void)state;
    for (k = 0; k < 3; k++) {
        assert_int_equal(jl_mat_cholesky(L, &bad[k], 1), JL_EDEF);
        for (i = 0; i < 4; i++)
            for (j = 0; j <= i; j++) {
                make_cov(A, 4, 4, 1);
                A[i * 4 + j] = bad[k];
                assert_int_equal(jl_mat_cholesky(L, A, 4), JL_EDEF);
            }
    }
    for (i = 0; i < 4; i++) {
        make_cov(A, 4, 4, 1);
        A[i * 4 + i] = 0;
        assert_int_equal(jl_mat_cholesky(L, A, 4), JL_EDEF);
        make_cov(A, 4, 4, 1);
        A[i * 4 + i] = -A[i * 4 + i];
        assert_int_equal(jl_mat_cholesky(L, A, 4), JL_EDEF);
    }
    for (i = 0; i < 16; i++)
        A[i] = 1;                       /* semidefinite is not enough */
    assert_int_equal(jl_mat_cholesky(L, A, 4), JL_EDEF);
    one = JL_REAL_MIN;
    assert_int_equal(jl_mat_cholesky(L, &one, 1), JL_OK);
    one = -JL_REAL_MIN;
    assert_int_equal(jl_mat_cholesky(L, &one, 1), JL_EDEF);
    one = -0.0f;
    assert_int_equal(jl_mat_cholesky(L, &one, 1), JL_EDEF);
    one = JL_REAL_MAX;
    assert_int_equal(jl_mat_cholesky(L, &one, 1), JL_OK);
}

static void check_solves(int n, int m)
{
    jl_real *A = array(0, n * n), *L = array(1, n * n), *X = array(2, n * m);
    jl_real *B = array(3, n * m), *y = array(4, n), *b = array(5, n);
    long double sum;
    double tolerance = 16.0 * n * n * (double)JL_EPSILON;
    int i, j, k;

    make_cov(A, n, n, 1);
    assert_int_equal(jl_mat_cholesky(L, A, n), JL_OK);
    memcpy(X, B, (size_t)(n * m) * sizeof *X);
    jl_mat_cholesky_solve(L, X, n, m);
    for (i = 0; i < n; i++)
        for (j = 0; j < m; j++) {
            for (sum = 0, k = 0; k < n; k++)
                sum += (long double)A[i * n + k] * X[k * m + j];
            assert_close(sum, B[i * m + j], tolerance);
        }
    memcpy(y, b, (size_t)n * sizeof *y);
    jl_mat_lower_solve(L, y, n);
    for (i = 0; i < n; i++) {
        for (sum = 0, k = 0; k <= i; k++)
            sum += (long double)L[i * n + k] * y[k];
        assert_close(sum, b[i], tolerance);
    }
    check_edges(2, n * m);
    check_edges(4, n);
    /* the inverse of A times A, column by column */
    if (m == n) {
        memcpy(X, A, (size_t)(n * n) * sizeof *X);
        jl_mat_cholesky_solve(L, X, n, n);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                assert_close(X[i * n + j], i == j, tolerance);
    }
}

static void test_mat_solves(void **state)
{
    int i, j;

    (void)state;
    for (i = 0; i < SIZES; i++)
        for (j = 0; j < SIZES; j++)
            check_solves(sizes[i], sizes[j]);
}

/* --- factors U' D U ------------------------------------------------------ */

/* Element (i, j) of U' D U. */
static long double ud_element(const jl_real *S, int n, int i, int j)
{
    long double sum = 0;
    int k;

    for (k = 0; k <= i && k <= j; k++)
        sum += (long double)S[k * n + k] * (k == i ? 1 : S[k * n + i])
            * (k == j ? 1 : S[k * n + j]);
    return sum;
}

/* Finite, D >= 0, zeros below. */
static void check_factor(const jl_real *S, int n)
{
    int i, j;

    assert_true(jl_vec_within(S, n * n, JL_REAL_MAX));
    for (i = 0; i < n; i++) {
        assert_true(S[i * (n + 1)] >= 0);
        for (j = 0; j < i; j++)
            assert_true(S[i * n + j] == 0);
    }
}

/* Factor A [n,n], whose lower triangle may hold anything: U' D U is A again,
 * in units of sigma_i sigma_j, but for variances below JL_REAL_MIN.  In array
 * 1. */
static jl_real *check_ud(jl_real *A, int n, double tolerance)
{
    jl_real *S = array(1, n * n), *copy = array(2, n * n);
    jl_real *work = array(3, n * n + 2 * n);
    double none = sqrt((double)JL_REAL_MIN);
    int i, j;

    memcpy(copy, A, (size_t)(n * n) * sizeof *A);
    fill(work, n * n + 2 * n, (jl_real)NAN);
    jl_mat_ud(S, A, work, n);
    assert_same_bits(A, copy, (size_t)(n * n) * sizeof *A);
    check_edges(1, n * n);
    check_edges(3, n * n + 2 * n);
    check_factor(S, n);
    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) {
            double si = sqrt((double)A[i * (n + 1)]);
            double sj = sqrt((double)A[j * (n + 1)]);

            assert_close(ud_element(S, n, i, j) - (long double)A[i * n + j], 0,
                         tolerance * si * sj + none * (si + sj + none));
        }
    jl_mat_ud(copy, copy, work, n);
    assert_same_bits(copy, S, (size_t)(n * n) * sizeof *S);
    return S;
}

/* Units of 1e-12 to 1e12 for the states. */
static void change_units(jl_real *A, int n)
{
    int i, j;

    for (i = 0; i < n; i++) {
        jl_real unit = (jl_real)pow(10, i * 5 % 25 - 12);

        for (j = 0; j < n; j++) {
            A[i * n + j] *= unit;
            A[j * n + i] *= unit;
        }
    }
}

static void test_mat_ud_every_size(void **state)
{
    jl_real *A;
    int n, i, j, units;

    (void)state;
    for (n = 1; n <= N; n++)
        for (units = 0; units < 2; units++) {
            A = array(0, n * n);
            make_cov(A, n, n, 1);
            if (units)
                change_units(A, n);
            for (i = 0; i < n; i++)
                for (j = 0; j < i; j++)
                    A[i * n + j] = (jl_real)NAN;
            check_ud(A, n, 4.0 * n * (double)JL_EPSILON);
        }
}

/* Of every rank, also with states that are known exactly: what is left beyond
 * the rank may be taken for rounding or not. */
static void test_mat_ud_semidefinite(void **state)
{
    jl_real *A;
    int n, rank, run, j;

    (void)state;
    for (run = 0; run < 20000; run++) {
        n = 1 + run % 7;
        rank = 1 + run / 7 % n;
        A = array(0, n * n);
        make_cov(A, n, rank, 0);
        for (j = 0; j < n && run % 3 == 0; j++)
            A[run / 9 % n * n + j] = A[j * n + run / 9 % n] = 0;
        if (run % 2)
            change_units(A, n);
        check_ud(A, n, 128.0 * n * (double)JL_EPSILON);
    }
    A = array(0, N * N);
    fill(A, N * N, 0);
    check_ud(A, N, 0);
    fill(A, N * N, 3);
    check_ud(A, N, 0);
}

/* There is one such U and D: these. */
static void test_mat_ud_is_unique(void **state)
{
    static const jl_real S[16] = { 2, 3, -1, 4,  0, 5, 7, -2,
                                   0, 0, 1, JL_C(0.5),  0, 0, 0, 3 };
    jl_real A[16], back[16], *got;
    int i, j;

    (void)state;
    jl_mat_ud_product(A, S, 4);
    for (i = 0; i < 4; i++)
        for (j = 0; j < 4; j++)
            assert_true(A[i * 4 + j] == (jl_real)ud_element(S, 4, i, j));
    got = check_ud(A, 4, 16 * (double)JL_EPSILON);
    for (i = 0; i < 16; i++)
        assert_close(got[i], S[i], 4000 * (double)JL_EPSILON);
    jl_mat_ud_product(back, got, 4);
    for (i = 0; i < 16; i++)
        assert_close(back[i], A[i], 400 * (double)JL_EPSILON);
}

/* Two states so alike that only a little above rounding tells them apart, or
 * less: their difference is still not known. */
static void test_mat_ud_keeps_what_is_small(void **state)
{
    jl_real A[4] = { 1, 1, 1, 1 }, *S;
    int k;

    (void)state;
    for (k = 256; k >= 4; k /= 4) {
        A[3] = 1 + (jl_real)k * JL_EPSILON;
        S = check_ud(A, 2, 4 * (double)JL_EPSILON);
        assert_close(S[3] / JL_EPSILON, k, k / 64);
    }
}

/* Of three, the variances of what is left, and not the covariance. */
static void test_mat_ud_leaves_variances(void **state)
{
    jl_real A[9], *S;
    int i;

    (void)state;
    fill(A, 9, 1);
    A[4] = A[8] = 1 + 32 * JL_EPSILON;
    A[5] = A[7] = 1 + 8 * JL_EPSILON;
    S = check_ud(A, 3, 9 * (double)JL_EPSILON);
    for (i = 0; i < 3; i++)
        assert_close(S[i], 1, 0);
    assert_close(S[4], 32 * (double)JL_EPSILON, 0);
    assert_close(S[5], 0, 0);
    assert_close(S[8], 32 * (double)JL_EPSILON, 0);
}

static void test_mat_ud_extreme_scales(void **state)
{
    const jl_real scales[] = { BIG, 1, JL_REAL_MIN };
    jl_real A[9];
    int a, b, c;

    (void)state;
    for (a = 0; a < 3; a++)
        for (b = 0; b < 3; b++)
            for (c = 0; c < 3; c++) {
                fill(A, 9, 0);
                A[0] = scales[a];
                A[4] = scales[b];
                A[8] = scales[c];
                check_ud(A, 3, 0);
                A[1] = (jl_real)(sqrt((double)A[0]) * sqrt((double)A[4]) / 2);
                A[5] = (jl_real)(sqrt((double)A[4]) * sqrt((double)A[8]) / 2);
                check_ud(A, 3, 64 * (double)JL_EPSILON);
            }
}

static void test_mat_ud_product(void **state)
{
    jl_real *S, *P;
    int n, i, j;

    (void)state;
    for (n = 1; n <= N; n++) {
        S = array(0, n * n);
        P = array(1, n * n);
        for (i = 0; i < n; i++) {
            S[i * (n + 1)] += 1;        /* D >= 0 */
            for (j = 0; j < i; j++)
                S[i * n + j] = (jl_real)NAN;    /* not read */
        }
        jl_mat_ud_product(P, S, n);
        for (i = 0; i < n; i++)
            for (j = i; j < n; j++)
                assert_close(P[i * n + j], ud_element(S, n, i, j),
                             2.0 * (n + 1) * (n + 1) * (double)JL_EPSILON);
        check_symmetric(P, n);
        check_edges(1, n * n);
    }
}

/* --- symmetric ---------------------------------------------------------- */

static void test_mat_pack_is_the_upper_triangle(void **state)
{
    static const jl_real A[9] = { 1, 2, 3, (jl_real)NAN, 4, 5,
                                  (jl_real)NAN, (jl_real)NAN, 6 };
    static const jl_real packed[6] = { 1, 2, 3, 4, 5, 6 };
    static const jl_real full[9] = { 1, 2, 3, 2, 4, 5, 3, 5, 6 };
    jl_real p[6], B[9];

    (void)state;
    jl_mat_pack(p, A, 3);
    assert_same_bits(p, packed, sizeof p);
    jl_mat_unpack(B, p, 3);
    assert_same_bits(B, full, sizeof B);
}

static void test_mat_pack_every_size(void **state)
{
    jl_real *A, *p, *back;
    int n;

    (void)state;
    for (n = 1; n <= N; n++) {
        A = array(0, n * n);
        p = array(1, JL_PACKED(n));
        back = array(2, n * n);
        make_cov(A, n, 1, 0);
        jl_mat_pack(p, A, n);
        jl_mat_unpack(back, p, n);
        assert_same_bits(back, A, (size_t)(n * n) * sizeof *A);
        check_edges(1, JL_PACKED(n));
        check_edges(2, n * n);
    }
}

/* --- questions ---------------------------------------------------------- */

static void test_mat_within(void **state)
{
    jl_real v[5] = { 0, 3, -3, JL_C(-0.5), 1 }, keep;
    const jl_real bad[] = { (jl_real)NAN, (jl_real)INFINITY,
                            -(jl_real)INFINITY, 3 + 4 * JL_EPSILON,
                            -3 - 4 * JL_EPSILON, JL_REAL_MAX };
    int i, k;

    (void)state;
    assert_int_equal(jl_vec_within(v, 5, 3), 1);
    for (i = 0; i < 5; i++)
        for (k = 0; k < 6; k++) {
            keep = v[i];
            v[i] = bad[k];
            assert_int_equal(jl_vec_within(v, 5, 3), 0);
            assert_int_equal(jl_vec_within(v, i + 1, 3), 0);
            if (i > 0)
                assert_int_equal(jl_vec_within(v, i, 3), 1);
            v[i] = keep;
        }
    v[0] = JL_LARGE;
    assert_int_equal(jl_vec_within(v, 5, JL_LARGE), 1);
}

/* What jl_mat_check_cov says of A, whatever is in work; A stays as it is. */
static int check(const jl_real *A, int n)
{
    jl_real *work = array(5, n * n), *copy = array(4, n * n);
    int status, again;

    memcpy(copy, A, (size_t)(n * n) * sizeof *A);
    fill(work, n * n, (jl_real)NAN);
    status = jl_mat_check_cov(A, work, n);
    check_edges(5, n * n);
    fill(work, n * n, 0);
    again = jl_mat_check_cov(A, work, n);
    assert_int_equal(status, again);
    assert_same_bits(A, copy, (size_t)(n * n) * sizeof *A);
    return status;
}

static int check2(jl_real a, jl_real b, jl_real c, jl_real d)
{
    jl_real A[4];

    A[0] = a;
    A[1] = b;
    A[2] = c;
    A[3] = d;
    return check(A, 2);
}

static int check3(jl_real a, jl_real b, jl_real c, jl_real d, jl_real e,
                  jl_real f)
{
    jl_real p[6], A[9];

    p[0] = a;
    p[1] = b;
    p[2] = c;
    p[3] = d;
    p[4] = e;
    p[5] = f;
    jl_mat_unpack(A, p, 3);
    return check(A, 3);
}

static void test_mat_check_cov_accepts_definite(void **state)
{
    jl_real *A, scale;
    int n, i, j;

    (void)state;
    for (n = 1; n <= N; n++) {
        A = array(0, n * n);
        make_cov(A, n, n, 1);
        assert_int_equal(check(A, n), JL_OK);
        for (i = 0; i < n; i++) {       /* units of any size */
            scale = i % 2 ? JL_C(1.0e-15) : JL_C(1.0e15);
            for (j = 0; j < n; j++) {
                A[i * n + j] *= scale;
                A[j * n + i] *= scale;
            }
        }
        assert_int_equal(check(A, n), JL_OK);
    }
    assert_int_equal(check2(BIG, 0, 0, BIG), JL_OK);
    assert_int_equal(check2(BIG, BIG / 2, BIG / 2, BIG), JL_OK);
    assert_int_equal(check2(BIG, 0, 0, JL_REAL_MIN), JL_OK);
    assert_int_equal(check2(JL_REAL_MIN, 0, 0, JL_REAL_MIN), JL_OK);
}

static void test_mat_check_cov_accepts_semidefinite(void **state)
{
    jl_real *A;
    int n, rank, i, j, run;

    (void)state;
    for (n = 1; n <= N; n++) {
        A = array(0, n * n);
        fill(A, n * n, 0);
        assert_int_equal(check(A, n), JL_OK);
        fill(A, n * n, JL_C(0.1));
        assert_int_equal(check(A, n), JL_OK);
    }
    for (run = 0; run < 20000; run++) { /* some are of nearly a lower rank */
        n = 2 + run % 7;
        rank = 1 + run / 7 % (n - 1);
        A = array(0, n * n);
        make_cov(A, n, rank, 0);
        for (j = 0; j < n && run % 3 == 0; j++) {
            i = n - 1;                  /* with a zero row and column */
            A[i * n + j] = 0;
            A[j * n + i] = 0;
        }
        assert_int_equal(check(A, n), JL_OK);
    }
    assert_int_equal(check3(0, 0, 0, 0, 0, 0), JL_OK);
    assert_int_equal(check3(0, 0, 0, 1, JL_C(0.5), 1), JL_OK);
    assert_int_equal(check2(1, 1, 1, 1 - 8 * JL_EPSILON), JL_OK);
}

static void test_mat_check_cov_asymmetry(void **state)
{
    const jl_real in = 1 + 40 * JL_EPSILON, out = 1 + 90 * JL_EPSILON;
    const jl_real half = JL_C(0.9);
    const jl_real s[] = { 1, JL_C(1.0e-33), JL_C(1.0e33), BIG };
    int k;

    (void)state;
    for (k = 0; k < 4; k++) {
        assert_int_equal(check2(s[k], s[k] * half * in, s[k] * half, s[k]),
                         JL_OK);
        assert_int_equal(check2(s[k], s[k] * half, s[k] * half * in, s[k]),
                         JL_OK);
        assert_int_equal(check2(s[k], s[k] * half * out, s[k] * half, s[k]),
                         JL_EASYM);
        assert_int_equal(check2(s[k], s[k] * half, s[k] * half * out, s[k]),
                         JL_EASYM);
        assert_int_equal(check2(s[k], 0, s[k], s[k]), JL_EASYM);
    }
    /* sqrt |A_ii A_jj| is 1 here, too */
    assert_int_equal(check2(JL_C(1.0e-10), half * in, half, JL_C(1.0e10)),
                     JL_OK);
    assert_int_equal(check2(JL_C(1.0e-10), half * out, half, JL_C(1.0e10)),
                     JL_EASYM);
    assert_int_equal(check2(0, JL_REAL_MIN, 0, 1), JL_EASYM);
}

static void test_mat_check_cov_indefinite(void **state)
{
    jl_real A[64], v[8], norm;
    int n, i, j, run;

    (void)state;
    assert_int_equal(check2(1, 2, 2, 1), JL_EDEF);
    assert_int_equal(check2(1, -2, -2, 1), JL_EDEF);
    assert_int_equal(check2(-1, 0, 0, 1), JL_EDEF);
    assert_int_equal(check2(1, 0, 0, -1), JL_EDEF);
    assert_int_equal(check2(1, 0, 0, -JL_REAL_MIN), JL_EDEF);
    assert_int_equal(check2(0, 1, 1, 1), JL_EDEF);
    assert_int_equal(check2(1, JL_REAL_MIN, JL_REAL_MIN, 0), JL_EDEF);
    assert_int_equal(check2(0, 1, 1, 0), JL_EDEF);
    assert_int_equal(check2(1, 1 + 200 * JL_EPSILON, 1 + 200 * JL_EPSILON, 1),
                     JL_EDEF);
    assert_int_equal(check2(BIG, BIG, BIG, BIG / 2), JL_EDEF);
    /* a pivot of 0, or nearly, over what is not 0 */
    assert_int_equal(check3(1, 1, 0, 1, JL_C(0.5), 1), JL_EDEF);
    assert_int_equal(check3(1, 1, 0, 1 - 4 * JL_EPSILON, JL_C(0.5), 1),
                     JL_EDEF);
    assert_int_equal(check3(1, 1, 0, 1 + 4 * JL_EPSILON, JL_C(0.5), 1),
                     JL_EDEF);
    for (run = 0; run < 2000; run++) {  /* I - 1.01 v v', |v| = 1 */
        n = 1 + run % 8;
        for (norm = 0, i = 0; i < n; i++) {
            v[i] = rnd();
            norm += v[i] * v[i];
        }
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                A[i * n + j] = (i == j) - JL_C(1.01) * (v[i] * v[j]) / norm;
        assert_int_equal(check(A, n), JL_EDEF);
    }
}

static void test_mat_check_cov_first_code(void **state)
{
    const jl_real bad[] = { (jl_real)NAN, (jl_real)INFINITY,
                            -(jl_real)INFINITY, BIG * 2, BIG * -2,
                            JL_REAL_MAX };
    jl_real A[9];
    int i, j, k;

    (void)state;
    for (k = 0; k < 6; k++) {
        assert_int_equal(check(&bad[k], 1), JL_ENONFINITE);
        for (i = 0; i < 3; i++)
            for (j = 0; j < 3; j++) {
                make_cov(A, 3, 3, 1);
                A[i * 3 + j] = bad[k];
                assert_int_equal(check(A, 3), JL_ENONFINITE);
                A[j * 3 + i] = bad[k];
                assert_int_equal(check(A, 3), JL_ENONFINITE);
                A[1] = 2;               /* also asymmetric and indefinite */
                A[4] = -1;
                A[i * 3 + j] = bad[k];
                assert_int_equal(check(A, 3), JL_ENONFINITE);
            }
    }
    assert_int_equal(check2(-1, 1, 2, -1), JL_EASYM);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mat_mul_sums_in_index_order),
        cmocka_unit_test(test_mat_sandwich),
        cmocka_unit_test(test_mat_apply),
        cmocka_unit_test(test_mat_cholesky_every_size),
        cmocka_unit_test(test_mat_cholesky_refuses),
        cmocka_unit_test(test_mat_solves),
        cmocka_unit_test(test_mat_ud_every_size),
        cmocka_unit_test(test_mat_ud_semidefinite),
        cmocka_unit_test(test_mat_ud_is_unique),
        cmocka_unit_test(test_mat_ud_keeps_what_is_small),
        cmocka_unit_test(test_mat_ud_leaves_variances),
        cmocka_unit_test(test_mat_ud_extreme_scales),
        cmocka_unit_test(test_mat_ud_product),
        cmocka_unit_test(test_mat_pack_is_the_upper_triangle),
        cmocka_unit_test(test_mat_pack_every_size),
        cmocka_unit_test(test_mat_within),
        cmocka_unit_test(test_mat_check_cov_accepts_definite),
        cmocka_unit_test(test_mat_check_cov_accepts_semidefinite),
        cmocka_unit_test(test_mat_check_cov_asymmetry),
        cmocka_unit_test(test_mat_check_cov_indefinite),
        cmocka_unit_test(test_mat_check_cov_first_code),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
