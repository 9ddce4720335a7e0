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

/* --- products ------------------------------------------------------------ */

/* C = A B, or Q plus or minus that: C, Q [n,p], B [m,p], element (i,k) of A at
 * A[i * next + k * step]; C may be Q.  With `upper`, n = p and only the upper
 * triangle, and a little beside it.  Columns are taken as many at a time as the
 * machine can, the widest last; each sum is in order of k.
 * The squares of the elements are added to *sum, unless it is NULL. */
enum { JLI_PRODUCT, JLI_PLUS, JLI_MINUS };

struct jli_squares {
    jl_real of_jl_real;
    jli_pack of_jli_pack;
    jli_wide of_jli_wide;
};

#define JLI_COLUMNS(type, width, end) \
    for (; j < end; j += width) \
        for (i = 0; i < (upper ? j + width : n); i++) { \
            const jl_real *a = A + i * next, *b = B + j; \
            type s; \
            if (how == JLI_PRODUCT) { \
                s = a[0] * *(const type *)b; \
                for (k = 1; k < m; k++) \
                    s += a[k * step] * *(const type *)(b + k * p); \
            } else { \
                s = *(const type *)(Q + i * p + j); \
                for (k = 0; k < m; k++) \
                    if (how == JLI_PLUS) \
                        s += a[k * step] * *(const type *)(b + k * p); \
                    else \
                        s -= a[k * step] * *(const type *)(b + k * p); \
            } \
            *(type *)(C + i * p + j) = s; \
            if (sum != NULL) \
                sum->of_##type += s * s; \
        }

JL_INLINE void jli_product(jl_real *C, const jl_real *Q, int how,
                           const jl_real *JL_RESTRICT A, int next, int step,
                           const jl_real *JL_RESTRICT B, int upper,
                           struct jli_squares *sum, int n, int m, int p)
{
    int i, j = 0, k;

    JLI_BY_LANES(JLI_COLUMNS, p)
}

/* One row: c = sum_k a_k B_k, or q plus or minus that; the a_k `step` apart. */
JL_INLINE void jli_row(jl_real *c, const jl_real *q, int how,
                       const jl_real *JL_RESTRICT a, int step,
                       const jl_real *JL_RESTRICT B, int m, int p)
{
    jli_product(c, q, how, a, 0, step, B, 0, NULL, 1, m, p);
}

/* C = A B */
JL_INLINE void jli_mul(jl_real *JL_RESTRICT C, const jl_real *JL_RESTRICT A,
                       const jl_real *JL_RESTRICT B, int n, int m, int p)
{
    jli_product(C, NULL, JLI_PRODUCT, A, m, 1, B, 0, NULL, n, m, p);
}

/* y = a x */
#define JLI_SCALE(type, width, end) \
    for (; i < end; i += width) \
        *(type *)(y + i) = a * *(const type *)(x + i);

JL_INLINE void jli_scale(jl_real *y, jl_real a, const jl_real *x, int n)
{
    int i = 0;

    JLI_BY_LANES(JLI_SCALE, n)
}

/* B = A [n,m], in the pieces in which a product stores it */
#define JLI_MOVE(type, width, end) \
    for (; j < end; j += width) \
        for (i = 0; i < n; i++) \
            *(type *)(B + i * m + j) = *(const type *)(A + i * m + j);

JL_INLINE void jli_move(jl_real *B, const jl_real *A, int n, int m)
{
    int i, j = 0;

    JLI_BY_LANES(JLI_MOVE, m)
}

/* T = A', A [n,m]; stored in the pieces in which a product loads it. */
#define JLI_GATHER(type, width, end) \
    for (; i < end; i += width) { \
        type s = JLI_NOUGHT; \
        for (k = 0; k < width; k++) \
            JLI_LANE(s, k) = A[(i + k) * m + j]; \
        *(type *)(T + j * n + i) = s; \
    }

JL_INLINE void jli_transpose(jl_real *JL_RESTRICT T,
                             const jl_real *JL_RESTRICT A, int n, int m)
{
    int i, j, k;

    for (j = 0; j < m; j++) {
        for (i = 0; i < n % JLI_PACK; i++)
            T[j * n + i] = A[i * m + j];
        JLI_GATHER(jli_pack, JLI_PACK, n % JLI_WIDE)
        JLI_GATHER(jli_wide, JLI_WIDE, n)
    }
}

/* Make A [n,n] symmetric by its upper triangle.  Stored in the pieces in which
 * a product loads it: a load of several stores has to wait for the cache. */
#define JLI_REFLECT(type, width, end) \
    for (; j < end; j += width) \
        for (i = j + 1; i < n; i++) { \
            type s = *(type *)(A + i * n + j); \
            for (k = 0; k < width && j + k < i; k++) \
                JLI_LANE(s, k) = A[(j + k) * n + i]; \
            *(type *)(A + i * n + j) = s; \
        }

JL_INLINE void jli_mirror(jl_real *A, int n)
{
    int i, j, k;

    for (j = 0; j < n % JLI_PACK; j++)
        for (i = j + 1; i < n; i++)
            A[i * n + j] = A[j * n + i];
    JLI_REFLECT(jli_pack, JLI_PACK, n % JLI_WIDE)
    JLI_REFLECT(jli_wide, JLI_WIDE, n)
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
JL_INLINE void jli_mul_t_sym(jl_real *JL_RESTRICT C,
                             const jl_real *JL_RESTRICT T,
                             const jl_real *JL_RESTRICT A, const jl_real *Q,
                             int n, int m)
{
    int i, j, k;

    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) {
            jl_real s = T[i * m] * A[j * m];

            for (k = 1; k < m; k++)
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
        jl_real s = A[i * m] * x[0];

        for (k = 1; k < m; k++)
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
        jli_row(Y + i * m, Y + i * m, JLI_MINUS, L + i * n, 1, Y, i, m);
}

/* L' X = Y in place, the same way */
JL_INLINE void jli_unit_t_solve(const jl_real *L, jl_real *X, int n, int m)
{
    int i;

    for (i = n - 2; i >= 0; i--)
        jli_row(X + i * m, X + i * m, JLI_MINUS, L + (i + 1) * n + i, n,
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
