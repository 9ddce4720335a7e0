/* Kernels of factored covariances U' D U (mat.h), written once, with the sizes
 * as last arguments. */
#ifndef JL_UD_K_H
#define JL_UD_K_H

#include "mat/mat_k.h"

/* For sizes that the compiler knows code is written out where there are lanes;
 * elsewhere memory is dearer than time. */
#if defined(JLI_WIDEST)
#  define JLI_KNOWN(n) __builtin_constant_p(n)
#else
#  define JLI_KNOWN(n) 0
#endif
#if defined(JLI_WIDEST) && __GNUC__ >= 8
#  define JLI_UNROLL _Pragma("GCC unroll 16")
#else
#  define JLI_UNROLL
#endif

/* a b / c, given q = b / c, for 0 <= b <= c, where q may underflow: scales of
 * 1e-12 and 1e12 in one covariance are 1e-48 to each other, nothing to a
 * float. */
JL_INLINE jl_real jli_shrink(jl_real a, jl_real q, jl_real b, jl_real c)
{
    return q < JL_REAL_MIN ? a * JL_REAL_MIN * (b / JL_REAL_MIN / c) : a * q;
}

/* S = the factor of U' D U + w v' v, where S has the factor U' D U; w >= 0, and
 * v [n], zeros before k, is overwritten.  A rotation for each column mixes row
 * k of U with v so that v_k vanishes, without square roots (Gentleman 1973, J.
 * Inst. Maths Applics 12, 329):
 *     d' = d + w v_k^2,  c = d / d',  g = w v_k / d'
 *     U_k = c U_k + g v,  v = v - v_k U_k,  w = c w
 * D only grows, and stays >= 0.  (U_k + g (v - v_k U_k), a multiplication less,
 * has no digit left where c is small.)  Rows may come in any order.  A row is
 * done with when its weight is below JL_REAL_MIN, before v_k U_k could
 * overflow.
 *
 * c is a quotient, not d times 1 / d', and rows are not kept times d: where
 * nothing is added to d, U_k must keep its bits, for the next row like it is to
 * leave no rest.  (Either cost two digits of a float where variances differ by
 * 1e24.)                                                    3 (n - k)^2 / 2 */
JL_INLINE void jli_ud_absorb(jl_real *S, jl_real *v, jl_real w, int k, int n)
{
    int j;

    JLI_UNROLL
    for (; k < n; k++) {
        jl_real *U = S + k * n, d = U[k], p = v[k], wp = w * p;
        jl_real more = wp * p, sum = d + more, c, g;

        if (w < JL_REAL_MIN)
            return;
        if (more <= 0 || sum < JL_REAL_MIN)     /* nothing there; not NaN */
            continue;
        U[k] = sum;
        if (!(d > 0)) {                 /* U has no such row yet */
            g = 1 / p;
            for (j = k + 1; j < n; j++)
                U[j] = 0 * U[j] + g * v[j];
            return;
        }
        c = d / sum;
        g = wp / sum;
        w = jli_shrink(w, c, d, sum);
        for (j = k + 1; j < n; j++) {
            jl_real u = U[j];

            U[j] = c * u + g * v[j];
            v[j] -= p * u;
        }
    }
}

/* --- many rows at once ---------------------------------------------------- */

/* Where the piece of JLI_BY_LANES starts that has column k of n in it. */
JL_INLINE int jli_piece(int k, int n)
{
    if (k < n % JLI_PACK)
        return k;
    if (k < n % JLI_WIDE)
        return k - (k - n % JLI_PACK) % JLI_PACK;
    return k - (k - n % JLI_WIDE) % JLI_WIDE;
}

#define JLI_TURN(type, width, end) \
    for (; j < end; j += width) { \
        type u = *(const type *)(U + j); \
        for (i = 0; i < rows; i++) { \
            const type b = *(const type *)(V + i * n + j); \
            if (turned >> i & 1) { \
                *(type *)(V + i * n + j) = b - p[i] * u; \
                u = c[i] * u + g[i] * b; \
            } \
        } \
        *(type *)(U + j) = u; \
    }

/* The rotations for column k of rows V [rows,n], rows <= 16, of weights w
 * [rows], with the bits of jli_ud_absorb of one row after the other: first all
 * that is scalar, then columns, as many at a time as the machine can.  Those up
 * to k are of no use in V then.  The last row's v_k is 1, whatever is there.
 * turn [3 rows] work */
JL_INLINE void jli_ud_turn(jl_real *JL_RESTRICT S, jl_real *JL_RESTRICT V,
                           jl_real *JL_RESTRICT w, jl_real *JL_RESTRICT turn,
                           int rows, int k, int n)
{
    jl_real *U = S + k * n, *p = turn, *c = p + rows, *g = c + rows;
    jl_real sum = U[k];
    unsigned turned = 0;
    int i, j;

    JLI_UNROLL
    for (i = 0; i < rows; i++) {
        jl_real vk = i < rows - 1 ? V[i * n + k] : 1, d = sum;
        jl_real wp = w[i] * vk, more = wp * vk;

        if (w[i] < JL_REAL_MIN || more <= 0 || d + more < JL_REAL_MIN)
            continue;
        turned |= 1u << i;
        sum += more;
        p[i] = vk;
        c[i] = d / sum;
        g[i] = d > 0 ? wp / sum : 1 / vk;
        w[i] = jli_shrink(w[i], c[i], d, sum);
    }
    if (turned == 0)
        return;
    j = jli_piece(k + 1, n);
    JLI_BY_LANES(JLI_TURN, n)
    for (j = jli_piece(k + 1, n); j < k; j++)
        U[j] = 0;
    U[k] = sum;
}

/* S absorbs row v [n] of weight w, and then the rows of the factor S1, of
 * weights w1 D, with the bits of jli_ud_absorb of each.  But it goes by columns:
 * a row's rotations wait for each other's divisions, a column's do not. */
enum { JLI_AT_ONCE = 9 };               /* so many states at most */

JL_INLINE void jli_ud_absorb_all(jl_real *S, const jl_real *v, jl_real w,
                                 const jl_real *S1, jl_real w1, int n)
{
    jl_real V[(JLI_AT_ONCE + 1) * JLI_AT_ONCE], ws[JLI_AT_ONCE + 1];
    jl_real turn[3 * (JLI_AT_ONCE + 1)] = { 0 };
    int k;

    jli_scale(V, 1, v, n);
    jli_copy(V + n, S1, n * n);
    ws[0] = w;
    for (k = 0; k < n; k++)
        ws[k + 1] = w1 * S1[k * (n + 1)];
    JLI_UNROLL
    for (k = 0; k < n; k++)
        jli_ud_turn(S, V, ws, turn, k + 2, k, n);
}

/* One measurement h x + e, e ~ N(0, r), of an x whose covariance P has the
 * factor S: K = P h', and S becomes the factor of P - K K' / alpha, where
 *     alpha = r + h P h' = r + sum_k D_k f_k^2,  f = U h'
 * grows term by term, so that nothing is subtracted from D: D_k is multiplied
 * by alpha without term k over alpha with it (Bierman 1977, Factorization
 * Methods for Discrete Sequential Estimation, V.3, with the states in reverse).
 * Returns alpha; if that is not above 0, S and K are undefined.   3 n^2 / 2 */
JL_INLINE jl_real jli_ud_observe(jl_real *S, jl_real *K, const jl_real *h,
                                 jl_real r, int n)
{
    jl_real alpha = r;
    int i, k;

    JLI_UNROLL
    for (k = n - 1; k >= 0; k--) {
        jl_real *U = S + k * n, f = h[k], before = alpha, t;

        for (i = k + 1; i < n; i++)
            f += U[i] * h[i];
        K[k] = U[k] * f;
        alpha += K[k] * f;
        if (alpha <= 0)                 /* r = 0, and nothing yet; not NaN */
            continue;
        U[k] = jli_shrink(U[k], before / alpha, before, alpha);
        t = U[k] < JL_REAL_MIN ? 0 : f / before;        /* 0: no such row */
        for (i = k + 1; i < n; i++) {
            jl_real u = U[i];

            U[i] = u - t * K[i];
            K[i] += u * K[k];
        }
    }
    return alpha;
}

/* P = U' D U */
JL_INLINE void jli_ud_product(jl_real *P, const jl_real *S, int n)
{
    int i, j, k;

    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) {
            jl_real s = S[i * n + i] * (i == j ? 1 : S[i * n + j]);

            for (k = 0; k < i; k++)
                s += S[k * n + k] * S[k * n + i] * S[k * n + j];
            P[i * n + j] = s;
            P[j * n + i] = s;
        }
}

#endif
