/* Kernels of factored covariances U' D U (mat.h), written once, with the sizes
 * as last arguments. */
#ifndef JL_UD_K_H
#define JL_UD_K_H

#include "mat/mat_k.h"

/* a b / c for 0 <= b <= c, where b / c alone may underflow: scales of 1e-12 and
 * 1e12 in one covariance are 1e-48 to each other, nothing to a float. */
JL_INLINE jl_real jli_shrink(jl_real a, jl_real b, jl_real c)
{
    jl_real q = b / c;

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
 * overflow.                                                 3 (n - k)^2 / 2 */
JL_INLINE void jli_ud_absorb(jl_real *S, jl_real *v, jl_real w, int k, int n)
{
    int j;

    for (; k < n && !(w < JL_REAL_MIN); k++) {
        jl_real *U = S + k * n, d = U[k], p = v[k];
        jl_real more = w * p * p, sum = d + more, c, g;

        if (more <= 0 || sum < JL_REAL_MIN)     /* nothing there; not NaN */
            continue;
        U[k] = sum;
        if (!(d > 0)) {                 /* U has no such row yet */
            for (j = k + 1; j < n; j++)
                U[j] = v[j] / p;
            return;
        }
        c = d / sum;
        g = w * p / sum;
        w = jli_shrink(w, d, sum);
        for (j = k + 1; j < n; j++) {
            jl_real u = U[j];

            U[j] = c * u + g * v[j];
            v[j] -= p * u;
        }
    }
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

    for (k = n - 1; k >= 0; k--) {
        jl_real *U = S + k * n, f = h[k], before = alpha, t;

        for (i = k + 1; i < n; i++)
            f += U[i] * h[i];
        K[k] = U[k] * f;
        alpha += K[k] * f;
        if (alpha <= 0)                 /* r = 0, and nothing yet; not NaN */
            continue;
        U[k] = jli_shrink(U[k], before, alpha);
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
