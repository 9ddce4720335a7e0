/* Sums over modes, always in index order; and stage 4, which is one. */
#include "imm/imm_stage.h"

#include "mat/mat_k.h"

jl_real jli_log_sum_exp(jl_real *v, int n, jl_real *sum)
{
    jl_real max = v[0];
    int i;

    for (i = 1; i < n; i++)
        if (v[i] > max)
            max = v[i];
    *sum = 0;
    if (max < -JL_REAL_MAX) {                   /* all are log 0 */
        for (i = 0; i < n; i++)
            v[i] = 0;
        return max;
    }
    for (i = 0; i < n; i++) {
        v[i] = jl_exp(v[i] - max);
        *sum += v[i];
    }
    return max + jl_log(*sum);
}

void jli_pool(jl_real *mean, jl_real *cov, const jl_real *w,
              const jl_real *x, const jl_real *P, jl_real *d, int M, int n)
{
    int i, a, b;

    memset(mean, 0, (size_t)n * sizeof *mean);
    memset(cov, 0, (size_t)(n * n) * sizeof *cov);
    for (i = 0; i < M; i++)
        for (a = 0; a < n; a++)
            mean[a] += w[i] * x[i * n + a];
    for (i = 0; i < M; i++) {
        const jl_real *Pi = P + i * n * n;

        for (a = 0; a < n; a++)
            d[a] = x[i * n + a] - mean[a];
        for (a = 0; a < n; a++)
            for (b = a; b < n; b++)
                cov[a * n + b] += w[i] * (Pi[a * n + b] + d[a] * d[b]);
    }
    for (a = 0; a < n; a++)
        for (b = 0; b < a; b++)
            cov[a * n + b] = cov[b * n + a];
}

void jl_imm_combine(jl_imm *imm)
{
    jli_pool(imm->xhat, imm->Phat, imm->mu, imm->x, imm->P, imm->d,
             imm->M, imm->n);
    imm->combined = 1;
}
