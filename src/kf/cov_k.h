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
    jli_row(mean, NULL, JLI_PRODUCT, w, 1, x, M, n);
}

/* d = x1 - x2, and a x1 + b x2, for a + b = 1, from where more weight is: near
 * x2 an x1 far away does no harm. */
#define JLI_BETWEEN(type, width, end) \
    for (; i < end; i += width) { \
        const type v = *(const type *)(x1 + i) - *(const type *)(x2 + i); \
        *(type *)(d + i) = v; \
        *(type *)(x + i) = *(const type *)(from + i) + part * v; \
    }

JL_INLINE void jli_between(jl_real *x, jl_real *d, jl_real a,
                           const jl_real *x1, jl_real b, const jl_real *x2,
                           int n)
{
    const jl_real *from = a < b ? x2 : x1;
    const jl_real part = a < b ? a : -b;
    int i = 0;

    JLI_BY_LANES(JLI_BETWEEN, n)
}

#define JLI_POOL_COLUMNS(type, width, end) \
    for (; j < end; j += width) { \
        const type dj = *(const type *)(xi + j) - *(const type *)(mean + j); \
        for (r = 0; r < j + width; r++) \
            *(type *)(P + r * n + j) += w[i] \
                * (*(const type *)(Pi + r * n + j) + d[r] * dj); \
    }

#define JLI_DIFF(type, width, end) \
    for (; j < end; j += width) \
        *(type *)(d + j) = *(const type *)(xi + j) - *(const type *)(mean + j);

JL_INLINE void jli_full_pool(jl_real *JL_RESTRICT mean,
                             jl_real *JL_RESTRICT P,
                             const jl_real *JL_RESTRICT w,
                             const jl_real *JL_RESTRICT x,
                             const jl_real *JL_RESTRICT Ps,
                             jl_real *JL_RESTRICT d, int M, int n)
{
    int i, r, j;

    jli_mean(mean, w, x, M, n);
    memset(P, 0, (size_t)(n * n) * sizeof *P);
    for (i = 0; i < M; i++) {
        const jl_real *xi = x + i * n, *Pi = Ps + i * n * n;

        j = 0;
        JLI_BY_LANES(JLI_DIFF, n)
        j = 0;
        JLI_BY_LANES(JLI_POOL_COLUMNS, n)
    }
    jli_mirror(P, n);
}

/* All of P at once; symmetric because its terms are. */
#define JLI_BLEND_COLUMNS(type, width, end) \
    for (; s < end; s += width) \
        *(type *)(P + r * n + s) = a * *(const type *)(P1 + r * n + s) \
            + b * *(const type *)(P2 + r * n + s) \
            + a * b * (d[r] * *(const type *)(d + s));

JL_INLINE void jli_full_blend(jl_real *x, jl_real *P, jl_real a,
                              const jl_real *x1, const jl_real *P1, jl_real b,
                              const jl_real *x2, const jl_real *P2,
                              jl_real *JL_RESTRICT d, int n)
{
    int r, s;

    jli_between(x, d, a, x1, b, x2, n);
    for (r = 0; r < n; r++) {
        s = 0;
        JLI_BY_LANES(JLI_BLEND_COLUMNS, n)
    }
}

#endif
