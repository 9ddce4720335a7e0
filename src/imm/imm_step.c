/* Stages 2 and 3, and the four in one. */
#include "imm/imm_stage.h"

#include "mat/mat_k.h"

int jl_imm_predict_mode(jl_imm *imm, int j, jl_real *scratch)
{
    int n = imm->n, status;
    jl_real *x = imm->xw + j * n, *P = imm->Pw + j * n * n;
    jl_real *xp = scratch, *Pp = xp + n;

    JL_ASSERT(j >= 0 && j < imm->M);
    status = imm->form->predict(xp, Pp, &imm->modes[j], x, P, Pp + n * n);
    if (status == JL_OK) {
        jli_copy(x, xp, n);
        jli_copy(P, Pp, n * n);
    } else {
        imm->stage = JLI_FAILED;
    }
    return status;
}

int jl_imm_update_mode(jl_imm *imm, int j, const jl_real *z,
                       jl_real *scratch)
{
    int n = imm->n, status;
    jl_real *x = imm->xw + j * n, *P = imm->Pw + j * n * n;
    jl_real *xu = scratch, *Pu = xu + n;

    JL_ASSERT(j >= 0 && j < imm->M);
    if (imm->stage == JLI_MIXED)
        imm->stage = JLI_FILTERED;
    imm->missing = z == NULL;
    if (z == NULL) {
        imm->l[j] = 0;
        return JL_OK;
    }
    status = imm->form->update(xu, Pu, &imm->l[j], &imm->modes[j], x, P, z,
                               Pu + n * n);
    if (status == JL_OK) {
        jli_copy(x, xu, n);
        jli_copy(P, Pu, n * n);
    } else {
        imm->stage = JLI_FAILED;
    }
    return status;
}

int jl_imm_filter(jl_imm *imm, const jl_real *z, jl_real *scratch)
{
    int j, status = JL_OK;

    if (imm->stage != JLI_MIXED)
        return JL_EORDER;
    for (j = 0; j < imm->M && status == JL_OK; j++) {
        status = jl_imm_predict_mode(imm, j, scratch);
        if (status == JL_OK)
            status = jl_imm_update_mode(imm, j, z, scratch);
    }
    return status;
}

static void swap(jl_real **a, jl_real **b)
{
    jl_real *t = *a;

    *a = *b;
    *b = t;
}

/* The largest log-likelihood of a mode that is possible.  Differences to it
 * keep the digits of log c, however large a likelihood's logarithm is: after an
 * outlier of 1e5 sigma that is 1e10. */
static jl_real best_likelihood(const jl_imm *imm)
{
    jl_real best = -JL_REAL_MAX;
    int j;

    for (j = 0; j < imm->M; j++)
        if (imm->logc[j] >= -JL_REAL_MAX && imm->l[j] > best)
            best = imm->l[j];
    return best;
}

int jl_imm_weigh(jl_imm *imm)
{
    int j, M = imm->M;
    jl_real *e = imm->e, best, sum, lse;

    if (imm->stage != JLI_FILTERED)
        return JL_EORDER;
    best = best_likelihood(imm);
    for (j = 0; j < M; j++) {
        imm->logmu[j] = imm->logc[j] + (imm->l[j] - best);
        e[j] = imm->logmu[j];
    }
    lse = jli_log_sum_exp(e, M, &sum);
    for (j = 0; j < M; j++) {
        imm->logmu[j] -= lse;
        imm->mu[j] = e[j] / sum;
    }
    imm->loglik = imm->missing ? 0 : best + lse;
    swap(&imm->x, &imm->xw);
    swap(&imm->P, &imm->Pw);
    imm->stage = JLI_IDLE;
    imm->combined = 0;
    return JL_OK;
}

int jl_imm_step(jl_imm *imm, const jl_real *z, jl_real *scratch)
{
    int status = jl_imm_mix(imm, scratch);

    if (status == JL_OK)
        status = jl_imm_filter(imm, z, scratch);
    if (status == JL_OK)
        status = jl_imm_weigh(imm);
    if (status == JL_OK)
        jl_imm_combine(imm);
    return status;
}
