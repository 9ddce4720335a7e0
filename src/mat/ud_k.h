/* The kernel of factored covariances: one more row. */
#ifndef JL_UD_K_H
#define JL_UD_K_H

#include "mat/mat_k.h"

/* S = the factor of U' D U + w v' v, where S has the factor U' D U (mat.h);
 * w >= 0, and v [n], zeros before k, is overwritten.  A rotation for each column
 * mixes row k of U with v so that v_k vanishes, without square roots
 * (Gentleman 1973, J. Inst. Maths Applics 12, 329):
 *     d' = d + w v_k^2,  c = d / d',  g = w v_k / d'
 *     U_k = c U_k + g v,  v = v - v_k U_k,  w = c w
 * D only grows, and stays >= 0.  (U_k + g (v - v_k U_k), a multiplication less,
 * has no digit left where c is small.)                        3 (n - k)^2 / 2 */
JL_INLINE void jli_ud_absorb(jl_real *S, jl_real *v, jl_real w, int k, int n)
{
    int j;

    for (; k < n && w > 0; k++) {
        jl_real *U = S + k * n, d = U[k], p = v[k], sum = d + w * p * p;
        jl_real c, g;

        if (!(sum >= JL_REAL_MIN))      /* p is 0, or as good as that */
            continue;
        U[k] = sum;
        if (!(d > 0)) {                 /* U has no such row yet */
            for (j = k + 1; j < n; j++)
                U[j] = v[j] / p;
            return;
        }
        c = d / sum;
        g = w * p / sum;
        w *= c;
        for (j = k + 1; j < n; j++) {
            jl_real u = U[j];

            U[j] = c * u + g * v[j];
            v[j] -= p * u;
        }
    }
}

#endif
