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

jl_real jli_log_weight(const jl_imm *imm, int j, jl_real best)
{
    return jli_log_of(imm->c[j], imm->logc[j]) + (imm->l[j] - best);
}

jl_real jli_weights(jl_imm *imm, const unsigned char *owner, int pe,
                    jl_real *best, jl_real *sum)
{
    jl_real *e = imm->e;
    int j, M = imm->M;

    *best = -JL_REAL_MAX;
    for (j = 0; j < M; j++)
        if ((owner == NULL || owner[j] == pe) && jli_is_possible(imm, j)
            && imm->l[j] > *best)
            *best = imm->l[j];
    *sum = 0;
    for (j = 0; j < M; j++) {
        e[j] = owner != NULL && owner[j] != pe ? 0
            : imm->c[j] > JLI_SMALL ? imm->c[j] * jl_exp(imm->l[j] - *best)
            : jl_exp(jli_log_weight(imm, j, *best));
        *sum += e[j];
    }
    if (*sum > JL_EPSILON * JL_EPSILON)
        return jl_log(*sum);
    for (j = 0; j < M; j++)
        e[j] = owner != NULL && owner[j] != pe ? jl_log(0)
            : jli_log_weight(imm, j, *best);
    return jli_log_sum_exp(e, M, sum);
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
