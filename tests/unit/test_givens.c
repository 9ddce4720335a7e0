/* Triangles by Givens rotations: A'A stays, in long double; sizes, signs, and
 * numbers of all magnitudes. */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <string.h>
#include <cmocka.h>

#include "jumplink/mat.h"

#define MOST 24

static unsigned seed;

/* In -1 .. 1. */
static jl_real drawn(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / (1 << 23) - 1;
}

static void draw(jl_real *A, int count, jl_real scale)
{
    int i;

    for (i = 0; i < count; i++)
        A[i] = scale * drawn();
}

/* R is upper, its diagonal >= 0, and R'R = A'A within rounding: for columns
 * i, j within |a_i| |a_j| times as many eps as there were rotations. */
static void check(const jl_real *R, const jl_real *A, int rows, int cols)
{
    const long double near = 4.0L * (long double)JL_EPSILON * rows;
    long double norm[MOST];
    int i, j, k;

    for (i = 0; i < rows; i++)
        for (j = 0; j < cols; j++) {
            if (j < i)
                assert_true(R[i * cols + j] == 0);
            if (j == i)
                assert_true(R[i * cols + j] >= 0);
        }
    for (j = 0; j < cols; j++) {
        norm[j] = 0;
        for (k = 0; k < rows; k++)
            norm[j] = hypotl(norm[j], (long double)A[k * cols + j]);
    }
    for (i = 0; i < cols; i++)
        for (j = i; j < cols; j++) {
            long double left = 0;

            if (!(norm[i] > 0) || !(norm[j] > 0)) {
                for (k = 0; k < rows; k++)
                    assert_true(norm[j] > 0 || R[k * cols + j] == 0);
                continue;
            }
            for (k = 0; k < rows; k++)
                left += (long double)R[k * cols + i] / norm[i]
                        * ((long double)R[k * cols + j] / norm[j])
                    - (long double)A[k * cols + i] / norm[i]
                        * ((long double)A[k * cols + j] / norm[j]);
            assert_true(fabsl(left) <= near);
        }
}

static void triangularise(int rows, int cols, jl_real *A)
{
    jl_real R[MOST * MOST + 2];
    int count = rows * cols;

    R[0] = R[count + 1] = 77;
    memcpy(R + 1, A, (size_t)count * sizeof *A);
    jl_mat_givens(R + 1, rows, cols);
    assert_true(R[0] == 77 && R[count + 1] == 77);
    check(R + 1, A, rows, cols);
}

static void test_givens_keeps_the_product(void **state)
{
    jl_real A[MOST * MOST];
    int rows, cols;

    (void)state;
    for (rows = 1; rows <= 17; rows++)
        for (cols = 1; cols <= 13; cols++) {
            draw(A, rows * cols, 1);
            triangularise(rows, cols, A);
        }
}

/* Numbers whose squares are no normal numbers, alone and among others. */
static void test_givens_of_any_magnitude(void **state)
{
    const jl_real tiny = JL_REAL_MIN / JL_EPSILON, large = JL_LARGE;
    const jl_real scales[] = { tiny, jl_sqrt(JL_REAL_MIN), 1, large };
    jl_real A[MOST * MOST];
    int s, t, i;

    (void)state;
    for (s = 0; s < 4; s++) {
        draw(A, 9 * 6, scales[s]);
        triangularise(9, 6, A);
        for (t = 0; t < 4; t++) {
            draw(A, 9 * 6, scales[s]);
            for (i = 0; i < 9 * 6; i += 3)      /* columns 0 and 3 */
                A[i] = scales[t] * drawn();
            triangularise(9, 6, A);
            draw(A, 9 * 6, scales[s]);
            draw(A + 12, 3 * 6, scales[t]);     /* rows 2 to 4 */
            triangularise(9, 6, A);
        }
    }
}

static void test_givens_of_dependent_columns(void **state)
{
    jl_real A[MOST * MOST];
    int i;

    (void)state;
    draw(A, 9 * 6, 1);
    for (i = 0; i < 9; i++) {
        A[6 * i + 2] = A[6 * i] + A[6 * i + 1];
        A[6 * i + 4] = 0;
    }
    triangularise(9, 6, A);
    memset(A, 0, sizeof A);
    triangularise(9, 6, A);
    A[6 * 8] = -1;              /* one number, to be carried up */
    triangularise(9, 6, A);
    draw(A, 9, 1);
    for (i = 9; i < 9 * 6; i++)
        A[i] = A[i % 9];
    triangularise(6, 9, A);
}

/* A triangle with a diagonal >= 0 is what it is; with others rows turn. */
static void test_givens_leaves_triangles(void **state)
{
    jl_real A[6 * 6], B[6 * 6];
    int i, j;

    (void)state;
    for (i = 0; i < 6; i++)
        for (j = 0; j < 6; j++) {
            A[6 * i + j] = j < i ? 0 : drawn();
            if (i == j)
                A[6 * i + j] = j == 3 ? 0 : (jl_real)(j + 1);
        }
    memcpy(B, A, sizeof B);
    jl_mat_givens(B, 6, 6);
    for (i = 0; i < 36; i++)
        assert_true(A[i] == B[i]);
    for (j = 1; j < 6; j++)
        B[6 + j] = -B[6 + j];
    jl_mat_givens(B, 6, 6);
    for (i = 0; i < 36; i++)
        assert_true(A[i] == B[i]);
}

static void test_givens_fixed_same_bits(void **state)
{
    static const int sizes[][2] = {
#define JL_GIVENS_SIZE(rows, cols) { rows, cols },
#include JL_GIVENS_SIZES_FILE
    };
    jl_real A[MOST * MOST], B[MOST * MOST];
    int s, k, i;

    (void)state;
    assert_true(jl_mat_givens_fixed(2, 5) == jl_mat_givens);
    for (s = 0; s < (int)(sizeof sizes / sizeof *sizes); s++) {
        const int rows = sizes[s][0], cols = sizes[s][1];
        jl_givens *fixed = jl_mat_givens_fixed(rows, cols);

        assert_true(fixed != jl_mat_givens);
        for (k = 0; k < 100; k++) {
            draw(A, rows * cols, 1);
            for (i = 0; i < k % 10; i++)
                A[7 * (i + k) % (rows * cols)] = 0;
            memcpy(B, A, sizeof B);
            jl_mat_givens(A, rows, cols);
            fixed(B, rows, cols);
            assert_memory_equal(A, B, (size_t)(rows * cols) * sizeof *A);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_givens_keeps_the_product),
        cmocka_unit_test(test_givens_of_any_magnitude),
        cmocka_unit_test(test_givens_of_dependent_columns),
        cmocka_unit_test(test_givens_leaves_triangles),
        cmocka_unit_test(test_givens_fixed_same_bits),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
