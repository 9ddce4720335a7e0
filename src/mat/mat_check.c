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

static void swap(jl_real *a, jl_real *b)
{
    jl_real t = *a;

    *a = *b;
    *b = t;
}

/* Bring element (best, best) to (k, k) by exchanging rows and columns. */
static void bring(jl_real *B, int n, int k, int best)
{
    int i;

    for (i = 0; i < n; i++)
        swap(&B[k * n + i], &B[best * n + i]);
    for (i = 0; i < n; i++)
        swap(&B[i * n + k], &B[i * n + best]);
}

/* Eliminate by the largest pivot left; when none is above rounding, what is
 * left must vanish.  Without pivoting a small pivot would magnify rounding
 * until a valid matrix of low rank looks indefinite.  B is overwritten. */
static int semidefinite(jl_real *B, int n)
{
    jl_real tol = 64 * (jl_real)n * JL_EPSILON;
    int i, j, k, best;

    for (k = 0; k < n; k++) {
        best = k;
        for (i = k + 1; i < n; i++)
            if (B[i * n + i] > B[best * n + best])
                best = i;
        bring(B, n, k, best);
        if (B[k * n + k] <= tol)
            break;
        for (i = k + 1; i < n; i++)
            for (j = k + 1; j < n; j++)
                B[i * n + j] -= B[i * n + k] * B[k * n + j] / B[k * n + k];
    }
    for (i = k; i < n; i++)
        for (j = k; j < n; j++)
            if (jli_abs(B[i * n + j]) > 2 * tol)
                return 0;
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
