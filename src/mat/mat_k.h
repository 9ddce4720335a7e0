/* Matrix kernels, written once, with the sizes as last arguments: called with
 * constants they unroll.  The contract is mat.h's. */
#ifndef JL_MAT_K_H
#define JL_MAT_K_H

#include <string.h>

#include "base/mathx.h"

JL_INLINE void jli_copy(jl_real *to, const jl_real *from, int n)
{
    memcpy(to, from, (size_t)n * sizeof *to);
}

/* C = A B */
JL_INLINE void jli_mul(jl_real *C, const jl_real *A, const jl_real *B,
                       int n, int m, int p)
{
    int i, j, k;

    for (i = 0; i < n; i++)
        for (j = 0; j < p; j++) {
            jl_real s = 0;

            for (k = 0; k < m; k++)
                s += A[i * m + k] * B[k * p + j];
            C[i * p + j] = s;
        }
}

/* C = A B' */
JL_INLINE void jli_mul_t(jl_real *C, const jl_real *A, const jl_real *B,
                         int n, int m, int p)
{
    int i, j, k;

    for (i = 0; i < n; i++)
        for (j = 0; j < p; j++) {
            jl_real s = 0;

            for (k = 0; k < m; k++)
                s += A[i * m + k] * B[j * m + k];
            C[i * p + j] = s;
        }
}

/* C = T A' + Q, known to be symmetric; T, A [n,m]; Q [n,n] or NULL. */
JL_INLINE void jli_mul_t_sym(jl_real *C, const jl_real *T, const jl_real *A,
                             const jl_real *Q, int n, int m)
{
    int i, j, k;

    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) {
            jl_real s = 0;

            for (k = 0; k < m; k++)
                s += T[i * m + k] * A[j * m + k];
            if (Q != NULL)
                s += Q[i * n + j];
            C[i * n + j] = s;
            C[j * n + i] = s;
        }
}

/* y = A x + b */
JL_INLINE void jli_apply(jl_real *y, const jl_real *A, const jl_real *x,
                         const jl_real *b, int n, int m)
{
    int i, k;

    for (i = 0; i < n; i++) {
        jl_real s = 0;

        for (k = 0; k < m; k++)
            s += A[i * m + k] * x[k];
        y[i] = b != NULL ? s + b[i] : s;
    }
}

/* A = L L'.  The pivot's test is false for NaN too. */
JL_INLINE int jli_cholesky(jl_real *L, const jl_real *A, int n)
{
    int i, j, k;

    for (j = 0; j < n; j++) {
        jl_real s = A[j * n + j], r;

        for (k = 0; k < j; k++)
            s -= L[j * n + k] * L[j * n + k];
        if (!(s > 0 && s <= JL_REAL_MAX))
            return JL_EDEF;
        s = jli_sqrt(s);
        L[j * n + j] = s;
        r = 1 / s;
        for (i = j + 1; i < n; i++) {
            s = A[i * n + j];
            for (k = 0; k < j; k++)
                s -= L[i * n + k] * L[j * n + k];
            L[i * n + j] = s * r;
        }
    }
    for (i = 0; i < n; i++)
        for (j = i + 1; j < n; j++)
            L[i * n + j] = 0;
    return JL_OK;
}

/* L Y = B in place, Y [n,m] */
JL_INLINE void jli_lower_solve(const jl_real *L, jl_real *Y, int n, int m)
{
    int i, j, k;

    for (i = 0; i < n; i++) {
        jl_real r = 1 / L[i * n + i];

        for (k = 0; k < i; k++)
            for (j = 0; j < m; j++)
                Y[i * m + j] -= L[i * n + k] * Y[k * m + j];
        for (j = 0; j < m; j++)
            Y[i * m + j] *= r;
    }
}

/* L' X = Y in place, X [n,m] */
JL_INLINE void jli_lower_t_solve(const jl_real *L, jl_real *X, int n, int m)
{
    int i, j, k;

    for (i = n - 1; i >= 0; i--) {
        jl_real r = 1 / L[i * n + i];

        for (k = i + 1; k < n; k++)
            for (j = 0; j < m; j++)
                X[i * m + j] -= L[k * n + i] * X[k * m + j];
        for (j = 0; j < m; j++)
            X[i * m + j] *= r;
    }
}

#endif
