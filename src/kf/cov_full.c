/* Estimates that keep the covariance itself. */
#include "kf/cov_k.h"

void jli_full_take(jl_real *S, const jl_real *P, jl_real *scratch, int n)
{
    jl_mat_pack(scratch, P, n);         /* exactly symmetric from here on */
    jl_mat_unpack(S, scratch, n);
}

void jli_full_give(jl_real *P, const jl_real *S, int n)
{
    jli_copy(P, S, n * n);
}

static void pool(jl_real *mean, jl_real *S, const jl_real *w,
                 const jl_real *x, const jl_real *Ss, jl_real *scratch,
                 int M, int n)
{
    jli_full_pool(mean, S, w, x, Ss, scratch, M, n);
}

static void blend(jl_real *x, jl_real *S, jl_real a, const jl_real *x1,
                  const jl_real *S1, jl_real b, const jl_real *x2,
                  const jl_real *S2, jl_real *scratch, int n)
{
    jli_full_blend(x, S, a, x1, S1, b, x2, S2, scratch, n);
}

void jli_full_part(jl_real *S, const jl_real *Sn, const int *map,
                   jl_real *scratch, int k, int n)
{
    int i, j;

    (void)scratch;
    for (i = 0; i < k; i++)
        for (j = 0; j < k; j++)
            S[i * k + j] = Sn[map[i] * n + map[j]];
}

void jli_full_whole(jl_real *Sn, const jl_real *S, const int *map,
                    const jl_real *var, int k, int n)
{
    int i, j;

    memset(Sn, 0, (size_t)(n * n) * sizeof *Sn);
    for (i = 0; i < n; i++)
        Sn[i * (n + 1)] = var[i];
    for (i = 0; i < k; i++)
        for (j = 0; j < k; j++)
            Sn[map[i] * n + map[j]] = S[i * k + j];
}

const jl_cov jl_cov_full = {
    0, jli_full_take, jli_full_give, pool, blend, jli_full_part, jli_full_whole
};
