/* Kernels of sums over estimates, written once, with the sizes as last
 * arguments.  The contract is kf.h's (jl_cov). */
#ifndef JL_COV_K_H
#define JL_COV_K_H

#include "jumplink/kf.h"

#include "mat/mat_k.h"

#if JL_REAL_FLOAT
#define jli_full_take jli_full_take_f32
#define jli_full_give jli_full_give_f32
#define jli_full_part jli_full_part_f32
#define jli_full_whole jli_full_whole_f32
#endif

void jli_full_take(jl_real *S, const jl_real *P, jl_real *scratch, int n);
void jli_full_give(jl_real *P, const jl_real *S, int n);
void jli_full_part(jl_real *S, const jl_real *Sn, const int *map,
                   jl_real *scratch, int k, int n);
void jli_full_whole(jl_real *Sn, const jl_real *S, const int *map,
                    const jl_real *var, int k, int n);

JL_INLINE void jli_mean(jl_real *mean, const jl_real *w, const jl_real *x,
                        int M, int n)
{
    int i, a;

    memset(mean, 0, (size_t)n * sizeof *mean);
    for (i = 0; i < M; i++)
        for (a = 0; a < n; a++)
            mean[a] += w[i] * x[i * n + a];
}

/* d = x1 - x2, and a x1 + b x2, for a + b = 1, from where more weight is: near
 * x2 an x1 far away does no harm. */
JL_INLINE void jli_between(jl_real *x, jl_real *d, jl_real a,
                           const jl_real *x1, jl_real b, const jl_real *x2,
                           int n)
{
    int r;

    for (r = 0; r < n; r++)
        d[r] = x1[r] - x2[r];
    for (r = 0; r < n; r++)
        x[r] = a < b ? x2[r] + a * d[r] : x1[r] - b * d[r];
}

JL_INLINE void jli_full_pool(jl_real *mean, jl_real *P, const jl_real *w,
                             const jl_real *x, const jl_real *Ps, jl_real *d,
                             int M, int n)
{
    int i, a, b;

    jli_mean(mean, w, x, M, n);
    memset(P, 0, (size_t)(n * n) * sizeof *P);
    for (i = 0; i < M; i++) {
        const jl_real *Pi = Ps + i * n * n;

        for (a = 0; a < n; a++)
            d[a] = x[i * n + a] - mean[a];
        for (a = 0; a < n; a++)
            for (b = a; b < n; b++)
                P[a * n + b] += w[i] * (Pi[a * n + b] + d[a] * d[b]);
    }
    for (a = 0; a < n; a++)
        for (b = 0; b < a; b++)
            P[a * n + b] = P[b * n + a];
}

JL_INLINE void jli_full_blend(jl_real *x, jl_real *P, jl_real a,
                              const jl_real *x1, const jl_real *P1, jl_real b,
                              const jl_real *x2, const jl_real *P2, jl_real *d,
                              int n)
{
    int r, s;

    jli_between(x, d, a, x1, b, x2, n);
    for (r = 0; r < n; r++)
        for (s = r; s < n; s++) {
            P[r * n + s] = a * P1[r * n + s] + b * P2[r * n + s]
                + a * b * (d[r] * d[s]);
            P[s * n + r] = P[r * n + s];
        }
}

#endif
