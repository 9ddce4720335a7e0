/* Matrix kernels, written once, with the sizes as last arguments: called with
 * constants they unroll.  The contract is mat.h's. */
#ifndef JL_MAT_K_H
#define JL_MAT_K_H

#include <string.h>

#include "base/lanes.h"
#include "base/mathx.h"
#include "jumplink/mat.h"

JL_INLINE void jli_copy(jl_real *to, const jl_real *from, int n)
{
    memcpy(to, from, (size_t)n * sizeof *to);
}

/* A row of a product: c = sum_k a_k B_k, or q plus or minus that; B_k [p] are
 * the rows of B, the a_k lie `step` apart, and c may be q.  Several columns at a
 * time, each sum in order of k. */
enum { JLI_ROW, JLI_PLUS_ROW, JLI_MINUS_ROW };

#define JLI_COLUMNS(type, width) \
    for (; j + width <= p; j += width) { \
        const jl_real *b = B + j; \
        type s; \
        if (how == JLI_ROW) { \
            s = a[0] * *(const type *)b; \
            for (k = 1; k < m; k++) \
                s += a[k * step] * *(const type *)(b + k * p); \
        } else { \
            s = *(const type *)(q + j); \
            for (k = 0; k < m; k++) \
                if (how == JLI_PLUS_ROW) \
                    s += a[k * step] * *(const type *)(b + k * p); \
                else \
                    s -= a[k * step] * *(const type *)(b + k * p); \
        } \
        *(type *)(c + j) = s; \
    }

JL_INLINE void jli_row(jl_real *c, const jl_real *q, int how,
                       const jl_real *JL_RESTRICT a, int step,
                       const jl_real *JL_RESTRICT B, int m, int p)
{
    int j = 0, k;

    JLI_COLUMNS(jli_wide, JLI_WIDE)
    JLI_COLUMNS(jli_pack, JLI_PACK)
    JLI_COLUMNS(jl_real, 1)
}

/* C = A B; B and C apart from each other */
JL_INLINE void jli_mul(jl_real *JL_RESTRICT C, const jl_real *JL_RESTRICT A,
                       const jl_real *JL_RESTRICT B, int n, int m, int p)
{
    int i;

    for (i = 0; i < n; i++)
        jli_row(C + i * p, NULL, JLI_ROW, A + i * m, 1, B, m, p);
}

/* T = A', A [n,m] */
JL_INLINE void jli_transpose(jl_real *JL_RESTRICT T,
                             const jl_real *JL_RESTRICT A, int n, int m)
{
    int i, j;

    for (j = 0; j < m; j++)
        for (i = 0; i < n; i++)
            T[j * n + i] = A[i * m + j];
}

/* Make A [n,n] symmetric by its upper triangle. */
JL_INLINE void jli_mirror(jl_real *A, int n)
{
    int i, j;

    for (i = 1; i < n; i++)
        for (j = 0; j < i; j++)
            A[i * n + j] = A[j * n + i];
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

/* A = L D L' in place, without square roots: below A's diagonal L, whose
 * diagonal is 1, above it D L'; d [n] = D, r [n] = D^-1.  The lower triangle of
 * A is read.  Returns JL_OK, JL_EDEF, JL_ENONFINITE. */
JL_INLINE int jli_ldl(jl_real *JL_RESTRICT A, jl_real *JL_RESTRICT d,
                      jl_real *JL_RESTRICT r, int n)
{
    int i, j, k;

    for (j = 0; j < n; j++) {
        jl_real s = A[j * n + j];

        for (k = 0; k < j; k++)
            s -= A[j * n + k] * A[k * n + j];
        if (!(s >= JL_REAL_MIN && s <= JL_REAL_MAX))
            return jli_finite(s) ? JL_EDEF : JL_ENONFINITE;
        d[j] = s;
        r[j] = 1 / s;
        for (i = j + 1; i < n; i++) {
            s = A[i * n + j];
            for (k = 0; k < j; k++)
                s -= A[i * n + k] * A[k * n + j];
            A[j * n + i] = s;
            A[i * n + j] = s * r[j];
        }
    }
    return JL_OK;
}

/* L Y = B in place, Y [n,m], L with a diagonal of 1 */
JL_INLINE void jli_unit_solve(const jl_real *L, jl_real *Y, int n, int m)
{
    int i;

    for (i = 1; i < n; i++)
        jli_row(Y + i * m, Y + i * m, JLI_MINUS_ROW, L + i * n, 1, Y, i, m);
}

/* L' X = Y in place, the same way */
JL_INLINE void jli_unit_t_solve(const jl_real *L, jl_real *X, int n, int m)
{
    int i;

    for (i = n - 2; i >= 0; i--)
        jli_row(X + i * m, X + i * m, JLI_MINUS_ROW, L + (i + 1) * n + i, n,
                X + (i + 1) * m, n - 1 - i, m);
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
