/* Kernels of sums over estimates that keep factors, written once, with the
 * sizes as last arguments.  The contract is kf.h's (jl_cov).  A sum is the
 * factor of all rows together: it only adds, so no difference of scales can make
 * it indefinite. */
#ifndef JL_COV_UD_K_H
#define JL_COV_UD_K_H

#include "kf/cov_k.h"
#include "mat/ud_k.h"

#if JL_REAL_FLOAT
#define jli_ud_take jli_ud_take_f32
#define jli_ud_part jli_ud_part_f32
#define jli_ud_whole jli_ud_whole_f32
#endif

void jli_ud_take(jl_real *S, const jl_real *P, jl_real *scratch, int n);
void jli_ud_part(jl_real *S, const jl_real *Sn, const int *map,
                 jl_real *scratch, int k, int n);
void jli_ud_whole(jl_real *Sn, const jl_real *S, const int *map,
                  const jl_real *var, int k, int n);

/* S = w S1; may be S1 */
JL_INLINE void jli_ud_scale(jl_real *S, const jl_real *S1, jl_real w, int n)
{
    int k;

    if (S != S1)
        jli_copy(S, S1, n * n);
    for (k = 0; k < n; k++)
        S[k * (n + 1)] *= w;
}

/* S = S + wd d' d + w S1; d [n] is 0 then, whatever way it went, for it is part
 * of what an IMM keeps.                                             n^3 / 2 */
JL_INLINE void jli_ud_add(jl_real *S, jl_real *d, jl_real wd,
                          const jl_real *S1, jl_real w, int n)
{
    int k;

    if (JLI_KNOWN(n) && n <= JLI_AT_ONCE) {
        jli_ud_absorb_all(S, d, wd, S1, w, n);
    } else {
        jli_ud_absorb(S, d, wd, 0, n);
        for (k = 0; k < n && w > 0; k++) {
            jli_copy(d, S1 + k * n, n);
            d[k] = 1;
            jli_ud_absorb(S, d, w * S1[k * (n + 1)], k, n);
        }
    }
    memset(d, 0, (size_t)n * sizeof *d);
}

JL_INLINE int jli_heaviest(const jl_real *w, int M)
{
    int i, best = 0;

    for (i = 1; i < M; i++)
        if (w[i] > w[best])
            best = i;
    return best;
}

/* The heaviest comes first and costs nothing. */
JL_INLINE void jli_ud_pool(jl_real *mean, jl_real *S, const jl_real *w,
                           const jl_real *x, const jl_real *Ss, jl_real *d,
                           int M, int n)
{
    int first = jli_heaviest(w, M), i, j;

    jli_mean(mean, w, x, M, n);
    jli_ud_scale(S, Ss + first * n * n, w[first], n);
    for (i = 0; i < M; i++) {
        const jl_real *xi = x + i * n;

        j = 0;
        JLI_BY_LANES(JLI_DIFF, n)
        jli_ud_add(S, d, w[i], Ss + i * n * n, i == first ? 0 : w[i], n);
    }
}

JL_INLINE void jli_ud_blend(jl_real *x, jl_real *S, jl_real a,
                            const jl_real *x1, const jl_real *S1, jl_real b,
                            const jl_real *x2, const jl_real *S2, jl_real *d,
                            int n)
{
    jli_between(x, d, a, x1, b, x2, n);
    jli_ud_scale(S, S1, a, n);
    jli_ud_add(S, d, a * b, S2, b, n);
}

#endif
