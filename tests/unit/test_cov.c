/* How forms keep covariances: the sums over estimates against long double, in
 * any of the ways that a table allows. */
#include "close.h"

#include <stdint.h>

#include "jumplink/kf.h"

#define MAX JL_MAX_STATES
#define EPS ((double)JL_EPSILON)
#define NAN_ ((jl_real)NAN)
#define EDGE 4

enum { MODES = 7 };

typedef long double wide;

static const jl_cov *const covs[] = { &jl_cov_full };
#define COVS ((int)(sizeof covs / sizeof covs[0]))

static const int sizes[] = { 1, 2, 3, 4, 6, 9, MAX };
#define SIZES ((int)(sizeof sizes / sizeof sizes[0]))

static uint32_t seed = 3;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

/* A = B B' / n + c I */
static void make_cov(jl_real *A, int n, jl_real c)
{
    static jl_real B[MAX * MAX];
    int i, j, k;

    for (i = 0; i < n * n; i++)
        B[i] = rnd();
    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) {
            A[i * n + j] = i == j ? c : 0;
            for (k = 0; k < n; k++)
                A[i * n + j] += B[i * n + k] * B[j * n + k] / (jl_real)n;
            A[j * n + i] = A[i * n + j];
        }
}

/* --- scratch and results with NaN around them ------------------------------ */

static jl_real scratch[MAX * MAX + 2 * MAX + 2 * EDGE];
static jl_real out_x[MAX + 2 * EDGE], out_S[MAX * MAX + 2 * EDGE];
static jl_real *const mean = out_x + EDGE, *const S = out_S + EDGE;

static jl_real *spoilt(int count)
{
    int i;

    for (i = 0; i < count + 2 * EDGE; i++)
        scratch[i] = NAN_;
    for (i = 0; i < MAX + 2 * EDGE; i++)
        out_x[i] = NAN_;
    for (i = 0; i < MAX * MAX + 2 * EDGE; i++)
        out_S[i] = NAN_;
    return scratch + EDGE;
}

/* n: of the results. */
static void check_edges(int count, int n)
{
    int i;

    for (i = 0; i < EDGE; i++) {
        assert_true(isnan(scratch[i]) && isnan(scratch[EDGE + count + i]));
        assert_true(isnan(out_x[i]) && isnan(out_x[EDGE + n + i]));
        assert_true(isnan(out_S[i]) && isnan(out_S[EDGE + n * n + i]));
    }
}

/* What S stands for is the covariance want, exactly symmetric; of a factor, the
 * lower half is zero. */
static void check_cov(const jl_cov *cov, const jl_real *kept,
                      const wide *want, int n, double tolerance)
{
    static jl_real P[MAX * MAX];
    int i, j;

    cov->give(P, kept, n);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            assert_close(P[i * n + j], want[i * n + j], tolerance);
            assert_same_bits(&P[i * n + j], &P[j * n + i], sizeof *P);
            assert_true(!cov->factored || j >= i || kept[i * n + j] == 0);
        }
}

/* --- take, give ------------------------------------------------------------ */

static void test_cov_take_and_give(void **state)
{
    static jl_real P[MAX * MAX];
    static wide want[MAX * MAX];
    int c, s, n, i;

    (void)state;
    for (c = 0; c < COVS; c++)
        for (s = 0; s < SIZES; s++) {
            n = sizes[s];
            make_cov(P, n, JL_C(0.1));
            for (i = 0; i < n * n; i++)
                want[i] = P[i];
            covs[c]->take(S, P, spoilt(n * n + 2 * n), n);
            for (i = 0; i < n; i++)
                mean[i] = 0;
            check_edges(n * n + 2 * n, n);
            check_cov(covs[c], S, want, n, 16 * n * EPS);
            memcpy(S, P, (size_t)(n * n) * sizeof *P);  /* in place */
            covs[c]->take(S, S, scratch + EDGE, n);
            check_cov(covs[c], S, want, n, 16 * n * EPS);
            if (n > 1)                  /* as symmetric as a set allows */
                S[n] *= 1 + 8 * JL_EPSILON;
            if (!covs[c]->factored) {
                covs[c]->take(S, S, scratch + EDGE, n);
                check_cov(covs[c], S, want, n, 16 * n * EPS);
            }
        }
}

/* --- pool ------------------------------------------------------------------- */

static struct {
    jl_real w[MODES], x[MODES * MAX], P[MODES * MAX * MAX];
    jl_real S[MODES * MAX * MAX];       /* P as a form keeps it */
} in;

static struct { wide mean[MAX], P[MAX * MAX]; } book;

static void make(const jl_cov *cov, int M, int n, jl_real apart)
{
    jl_real total = 0;
    int i;

    for (i = 0; i < M; i++)
        total += in.w[i] = JL_C(1.1) + rnd();
    for (i = 0; i < M; i++) {
        in.w[i] /= total;
        make_cov(in.P + i * n * n, n, JL_C(0.1));
        cov->take(in.S + i * n * n, in.P + i * n * n, scratch, n);
    }
    for (i = 0; i < M * n; i++)
        in.x[i] = apart * rnd();
}

static void book_pool(int M, int n)
{
    int i, a, b;

    memset(&book, 0, sizeof book);
    for (i = 0; i < M; i++)
        for (a = 0; a < n; a++)
            book.mean[a] += (wide)in.w[i] * in.x[i * n + a];
    for (i = 0; i < M; i++)
        for (a = 0; a < n; a++)
            for (b = 0; b < n; b++)
                book.P[a * n + b] += in.w[i]
                    * (in.P[(i * n + a) * n + b]
                       + (in.x[i * n + a] - book.mean[a])
                       * (in.x[i * n + b] - book.mean[b]));
}

static void check_pool(const jl_cov *cov, int M, int n, double size)
{
    int a;

    for (a = 0; a < n; a++)
        assert_close(mean[a], book.mean[a], 8 * M * size * EPS);
    check_cov(cov, S, book.P, n, 32 * (M + n) * (1 + size * size) * EPS);
}

static void pool(const jl_cov *cov, int M, int n, double size)
{
    book_pool(M, n);
    cov->pool(mean, S, in.w, in.x, in.S, spoilt(2 * n), M, n);
    check_edges(2 * n, n);
    check_pool(cov, M, n, size);
}

static void test_cov_pool(void **state)
{
    int c, s, M;

    (void)state;
    for (c = 0; c < COVS; c++)
        for (s = 0; s < SIZES; s++)
            for (M = 1; M <= MODES; M += 1 + (sizes[s] == MAX)) {
                make(covs[c], M, sizes[s], 3);
                pool(covs[c], M, sizes[s], 3);
                make(covs[c], M, sizes[s], 1000);
                pool(covs[c], M, sizes[s], 1000);
            }
}

/* Weights of 0 and 1: one estimate, to the last digits. */
static void test_cov_pool_of_one(void **state)
{
    int c, k, i;

    (void)state;
    for (c = 0; c < COVS; c++)
        for (k = 0; k < MODES; k++) {
            make(covs[c], MODES, 4, 1000);
            for (i = 0; i < MODES; i++)
                in.w[i] = i == k;
            book_pool(MODES, 4);
            covs[c]->pool(mean, S, in.w, in.x, in.S, spoilt(2 * 4), MODES, 4);
            assert_same_bits(mean, in.x + k * 4, 4 * sizeof *mean);
            check_cov(covs[c], S, book.P, 4, 16 * EPS);
        }
}

/* Agreement is no spread. */
static void test_cov_pool_of_those_that_agree(void **state)
{
    int c, i;

    (void)state;
    for (c = 0; c < COVS; c++) {
        make(covs[c], MODES, 4, 0);
        for (i = 0; i < MODES * 4; i++)
            in.x[i] = 8;
        for (i = 0; i < MODES; i++)
            memcpy(in.P + i * 16, in.P, 16 * sizeof *in.P);
        for (i = 1; i < MODES; i++)
            memcpy(in.S + i * 16, in.S, 16 * sizeof *in.S);
        pool(covs[c], MODES, 4, 8);
        for (i = 0; i < 16; i++)
            assert_close(book.P[i], in.P[i], 16 * EPS);
    }
}

/* Far from zero, near each other: the spread keeps its digits. */
static void test_cov_pool_far_from_zero(void **state)
{
    int c, i;

    (void)state;
    for (c = 0; c < COVS; c++) {
        make(covs[c], MODES, 4, 1);
        for (i = 0; i < MODES * 4; i++)
            in.x[i] += 1000;
        book_pool(MODES, 4);
        covs[c]->pool(mean, S, in.w, in.x, in.S, spoilt(2 * 4), MODES, 4);
        check_cov(covs[c], S, book.P, 4, 64 * 1000 * EPS);
    }
}

/* --- blend ------------------------------------------------------------------- */

/* a of the first estimate and 1 - a of the second, apart and in place. */
static void check_blend(const jl_cov *cov, jl_real a, int n, jl_real apart)
{
    static jl_real same[MAX * MAX];

    make(cov, 2, n, apart);
    in.w[0] = a;
    in.w[1] = 1 - a;
    book_pool(2, n);
    cov->blend(mean, S, in.w[0], in.x, in.S, in.w[1], in.x + n, in.S + n * n,
               spoilt(2 * n), n);
    check_edges(2 * n, n);
    check_pool(cov, 2, n, (double)apart);
    memcpy(same, S, (size_t)(n * n) * sizeof *same);
    cov->blend(in.x, in.S, in.w[0], in.x, in.S, in.w[1], in.x + n,
               in.S + n * n, scratch + EDGE, n);
    assert_same_bits(in.x, mean, (size_t)n * sizeof *mean);
    assert_same_bits(in.S, same, (size_t)(n * n) * sizeof *same);
}

static void test_cov_blend_is_the_pool_of_two(void **state)
{
    int c, s, k;

    (void)state;
    for (c = 0; c < COVS; c++)
        for (s = 0; s < SIZES; s++)
            for (k = 0; k <= 8; k++) {
                check_blend(covs[c], (jl_real)k / 8, sizes[s], 3);
                check_blend(covs[c], (jl_real)k / 8, sizes[s], 1000);
            }
}

/* Nothing of an estimate without weight, however far away it is. */
static void test_cov_blend_keeps_what_has_all_the_weight(void **state)
{
    int c, k;

    (void)state;
    for (c = 0; c < COVS; c++)
        for (k = 0; k < 2; k++) {
            make(covs[c], 2, 3, 1);
            in.x[3 * k] = in.x[3 * k + 1] = in.x[3 * k + 2] = 1.0e15f;
            covs[c]->blend(mean, S, (jl_real)k ? 1 : 0, in.x, in.S,
                           (jl_real)k ? 0 : 1, in.x + 3, in.S + 9,
                           spoilt(6), 3);
            assert_same_bits(mean, in.x + 3 * (1 - k), 3 * sizeof *mean);
            assert_true(covs[c]->factored
                        || memcmp(S, in.S + 9 * (1 - k), 9 * sizeof *S) == 0);
        }
}

/* What both agree in stays, to the bit. */
static void test_cov_blend_of_two_that_agree(void **state)
{
    int c, k;

    (void)state;
    for (c = 0; c < COVS; c++)
        for (k = 1; k < 100; k++) {
            make(covs[c], 2, 4, 1000);
            memcpy(in.x + 4, in.x, 4 * sizeof *in.x);
            covs[c]->blend(mean, S, (jl_real)k / 100, in.x, in.S,
                           1 - (jl_real)k / 100, in.x + 4, in.S + 16,
                           spoilt(8), 4);
            assert_same_bits(mean, in.x, 4 * sizeof *mean);
        }
}

/* --- part, whole --------------------------------------------------------------- */

/* Every subset of the n components, in order. */
static int subset(int *map, unsigned bits, int n)
{
    int i, k = 0;

    for (i = 0; i < n; i++)
        if (bits >> i & 1)
            map[k++] = i;
    return k;
}

static void check_part(const jl_cov *cov, const int *map, int k, int n)
{
    static jl_real var[MAX], kept[MAX * MAX], keep[MAX * MAX];
    static wide want[MAX * MAX];
    int i, j;

    make(cov, 1, n, 1);
    for (i = 0; i < k; i++)
        for (j = 0; j < k; j++)
            want[i * k + j] = in.P[map[i] * n + map[j]];
    memcpy(keep, in.S, (size_t)(n * n) * sizeof *keep);
    cov->part(S, in.S, map, spoilt(n), k, n);
    for (i = 0; i < k; i++)
        mean[i] = 0;
    check_edges(n, k);
    assert_same_bits(keep, in.S, (size_t)(n * n) * sizeof *keep);
    check_cov(cov, S, want, k, 16 * n * EPS);

    for (i = 0; i < n; i++)
        var[i] = JL_C(1.5) + rnd();
    memset(want, 0, sizeof want);
    for (i = 0; i < n; i++)
        want[i * (n + 1)] = var[i];
    for (i = 0; i < k; i++)
        for (j = 0; j < k; j++)
            want[map[i] * n + map[j]] = in.P[map[i] * n + map[j]];
    memcpy(kept, S, (size_t)(k * k) * sizeof *kept);
    spoilt(n);
    cov->whole(S, kept, map, var, k, n);
    for (i = 0; i < n; i++)
        mean[i] = 0;
    check_edges(n, n);
    check_cov(cov, S, want, n, 16 * n * EPS);
}

static void test_cov_part_and_whole(void **state)
{
    int map[MAX], c, n, k;
    unsigned bits;

    (void)state;
    for (c = 0; c < COVS; c++) {
        for (n = 1; n <= 6; n++)
            for (bits = 1; bits < 1u << n; bits++) {
                k = subset(map, bits, n);
                check_part(covs[c], map, k, n);
            }
        for (k = 0; k < MAX / 2; k++)
            map[k] = 2 * k + 1;
        check_part(covs[c], map, MAX / 2, MAX);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cov_take_and_give),
        cmocka_unit_test(test_cov_pool),
        cmocka_unit_test(test_cov_pool_of_one),
        cmocka_unit_test(test_cov_pool_of_those_that_agree),
        cmocka_unit_test(test_cov_pool_far_from_zero),
        cmocka_unit_test(test_cov_blend_is_the_pool_of_two),
        cmocka_unit_test(test_cov_blend_keeps_what_has_all_the_weight),
        cmocka_unit_test(test_cov_blend_of_two_that_agree),
        cmocka_unit_test(test_cov_part_and_whole),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
