/* Questions about matrices that came from outside. */
#include "jumplink/mat.h"

#include "mat/mat_k.h"

int jl_vec_within(const jl_real *v, int n, jl_real limit)
{
    int i;

    for (i = 0; i < n; i++)
        if (!(v[i] >= -limit && v[i] <= limit))     /* false for NaN */
            return 0;
    return 1;
}

static int symmetric(const jl_real *A, int n)
{
    int i, j;

    for (i = 0; i < n; i++)
        for (j = i + 1; j < n; j++) {
            jl_real scale = jli_sqrt(jli_abs(A[i * n + i]))
                * jli_sqrt(jli_abs(A[j * n + j]));

            if (jli_abs(A[i * n + j] - A[j * n + i])
                > 64 * JL_EPSILON * scale)
                return 0;
        }
    return 1;
}

/* B = A scaled to a unit diagonal, so that one tolerance serves states of all
 * units.  A variance of 0 must have covariances of 0. */
static int normalise(jl_real *B, const jl_real *A, int n)
{
    int i, j;

    for (i = 0; i < n; i++)
        if (A[i * n + i] < 0)
            return JL_EDEF;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            jl_real si = jli_sqrt(A[i * n + i]), sj = jli_sqrt(A[j * n + j]);

            if (si > 0 && sj > 0)
                B[i * n + j] = A[i * n + j] / si / sj;
            else if (jli_abs(A[i * n + j]) > 0)
                return JL_EDEF;
            else
                B[i * n + j] = 0;
        }
    return JL_OK;
}

/* Cholesky of B in its lower triangle.  A pivot within tol of 0 counts as 0,
 * and then its column must vanish, up to the root of tol. */
static int semidefinite(jl_real *B, int n)
{
    jl_real tol = 64 * (jl_real)n * JL_EPSILON, root = jli_sqrt(tol);
    int i, j, k;

    for (j = 0; j < n; j++) {
        jl_real pivot = B[j * n + j];

        for (k = 0; k < j; k++)
            pivot -= B[j * n + k] * B[j * n + k];
        if (pivot < -tol)
            return 0;
        pivot = pivot > tol ? jli_sqrt(pivot) : 0;
        for (i = j + 1; i < n; i++) {
            jl_real s = B[i * n + j];

            for (k = 0; k < j; k++)
                s -= B[i * n + k] * B[j * n + k];
            if (pivot > 0)
                s /= pivot;
            else if (jli_abs(s) > root)
                return 0;
            else
                s = 0;
            B[i * n + j] = s;
        }
    }
    return 1;
}

int jl_mat_check_cov(const jl_real *A, jl_real *work, int n)
{
    if (!jl_vec_within(A, n * n, JL_LARGE * JL_LARGE))
        return JL_ENONFINITE;
    if (!symmetric(A, n))
        return JL_EASYM;
    if (normalise(work, A, n) != JL_OK || !semidefinite(work, n))
        return JL_EDEF;
    return JL_OK;
}
