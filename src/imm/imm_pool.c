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

void jl_imm_combine(jl_imm *imm)
{
    const jl_cov *cov = imm->form->cov;

    cov->pool(imm->xhat, imm->Shat, imm->mu, imm->x, imm->P, imm->d, imm->M,
              imm->n);
    if (cov->factored)
        cov->give(imm->Phat, imm->Shat, imm->n);
    imm->combined = 1;
}
