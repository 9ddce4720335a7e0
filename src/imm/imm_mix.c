/* Stage 1: predicted mode probabilities and mixed estimates. */
#include "imm/imm_stage.h"

#include "mat/mat_k.h"

/* --- which modes a mode is mixed from ----------------------------------- */

/* log c_j where c_j is too small for sums of probabilities; e [M] work. */
static jl_real log_foresee(jl_imm *imm, int j)
{
    jl_real *e = imm->e, sum;
    int i, M = imm->M;

    if (imm->sticky) {
        jl_real two[2];

        two[0] = jl_log(imm->lambda[j]) + jl_imm_logmu(imm, j);
        two[1] = jl_log(imm->v[j]);
        return jli_log_sum_exp(two, 2, &sum);
    }
    for (i = 0; i < M; i++)
        e[i] = jl_log(imm->Pi[i * M + j]) + jl_imm_logmu(imm, i);
    return jli_log_sum_exp(e, M, &sum);
}

void jl_imm_foresee(jl_imm *imm)
{
    int j, M = imm->M;

    if (imm->sticky) {
        if (!imm->combined)
            jl_imm_combine(imm);
        for (j = 0; j < M; j++)
            imm->c[j] = imm->lambda[j] * imm->mu[j] + imm->v[j];
    } else {
        jli_row(imm->c, NULL, JLI_PRODUCT, imm->mu, 1, imm->Pi, M, M);
    }
    for (j = 0; j < M; j++)
        if (imm->c[j] > JLI_SMALL) {
            imm->logc[j] = 0;
        } else {
            imm->logc[j] = log_foresee(imm, j);
            imm->c[j] = jl_exp(imm->logc[j]);
        }
    imm->stage = JLI_MIXED;
}

/* Weights from logarithms are only as good as the logarithms are small. */
static void normalise(jl_real *w, int n)
{
    jl_real sum = 0;
    int i;

    for (i = 0; i < n; i++)
        sum += w[i];
    for (i = 0; i < n; i++)
        w[i] /= sum;
}

/* part / all, from r = 1 / all; exactly 1 for all of it, so that modes that are
 * entered from nowhere else keep their bits. */
static jl_real share(jl_real part, jl_real all, jl_real r)
{
    return part < all ? part * r : 1;
}

/* w_i = mu_ij = Pi[i][j] mu_i / c_j */
static void shares(jl_real *w, const jl_imm *imm, int j)
{
    const jl_real *Pi = imm->Pi + j;
    int i, M = imm->M;

    if (imm->c[j] > JLI_SMALL) {
        const jl_real r = 1 / imm->c[j];

        for (i = 0; i < M; i++)
            w[i] = share(Pi[i * M] * imm->mu[i], imm->c[j], r);
        return;
    }
    for (i = 0; i < M; i++)
        w[i] = jl_exp(jl_log(Pi[i * M]) + jl_imm_logmu(imm, i)
                      - imm->logc[j]);
    normalise(w, M);
}

/* w = { a, b } = { lambda_j mu_j, v_j } / c_j */
static void sticky_shares(jl_real *w, const jl_imm *imm, int j)
{
    if (imm->c[j] > JLI_SMALL) {
        const jl_real r = 1 / imm->c[j];

        w[0] = share(imm->lambda[j] * imm->mu[j], imm->c[j], r);
        w[1] = share(imm->v[j], imm->c[j], r);
        return;
    }
    w[0] = jl_exp(jl_log(imm->lambda[j]) + jl_imm_logmu(imm, j) - imm->logc[j]);
    w[1] = jl_exp(jl_log(imm->v[j]) - imm->logc[j]);
    normalise(w, 2);
}

/* --- mixing -------------------------------------------------------------- */

void jl_imm_mix_mode(jl_imm *imm, int j, jl_real *scratch)
{
    const jl_cov *cov = imm->form->cov;
    int M = imm->M, n = imm->n;
    const jl_real *x = imm->x + j * n, *P = imm->P + j * n * n;
    jl_real *x0 = imm->xw + j * n, *P0 = imm->Pw + j * n * n;
    jl_real *w = scratch;

    JL_ASSERT(j >= 0 && j < M);
    if (imm->logc[j] < -JL_REAL_MAX) {          /* cannot be entered */
        jli_copy(x0, x, n);
        jli_copy(P0, P, n * n);
    } else if (imm->sticky) {
        sticky_shares(w, imm, j);
        cov->blend(x0, P0, w[0], x, P, w[1], imm->xhat, imm->Shat, w + 2, n);
    } else {
        shares(w, imm, j);
        cov->pool(x0, P0, w, imm->x, imm->P, w + M, M, n);
    }
}

int jl_imm_mix(jl_imm *imm, jl_real *scratch)
{
    int j;

    jl_imm_foresee(imm);
    for (j = 0; j < imm->M; j++)
        jl_imm_mix_mode(imm, j, scratch);
    return JL_OK;
}
