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

        two[0] = jl_log(imm->lambda[j]) + imm->logmu[j];
        two[1] = jl_log(imm->v[j]);
        return jli_log_sum_exp(two, 2, &sum);
    }
    for (i = 0; i < M; i++)
        e[i] = jl_log(imm->Pi[i * M + j]) + imm->logmu[i];
    return jli_log_sum_exp(e, M, &sum);
}

void jl_imm_foresee(jl_imm *imm)
{
    int i, j, M = imm->M;

    if (imm->sticky && !imm->combined)
        jl_imm_combine(imm);
    for (j = 0; j < M; j++) {
        jl_real c = 0;

        if (imm->sticky)
            c = imm->lambda[j] * imm->mu[j] + imm->v[j];
        else
            for (i = 0; i < M; i++)
                c += imm->Pi[i * M + j] * imm->mu[i];
        if (c > JLI_SMALL) {
            imm->c[j] = c;
            imm->logc[j] = jl_log(c);
        } else {
            imm->logc[j] = log_foresee(imm, j);
            imm->c[j] = jl_exp(imm->logc[j]);
        }
    }
    imm->stage = JLI_MIXED;
}

/* mu_ij = p mu_i / c_j for a jump of probability p from mode i to mode j */
static jl_real share(const jl_imm *imm, jl_real p, int i, int j)
{
    if (imm->c[j] > JLI_SMALL)
        return p * imm->mu[i] / imm->c[j];
    return jl_exp(jl_log(p) + imm->logmu[i] - imm->logc[j]);
}

/* The same for the jump out of the combined estimate, of probability v_j. */
static jl_real share_combined(const jl_imm *imm, int j)
{
    if (imm->c[j] > JLI_SMALL)
        return imm->v[j] / imm->c[j];
    return jl_exp(jl_log(imm->v[j]) - imm->logc[j]);
}

/* --- mixing -------------------------------------------------------------- */

/* a (x_j, P_j) + b (xhat, Phat) + a b d d' */
static void mix_sticky(jl_real *x0, jl_real *P0, const jl_imm *imm, int j,
                       jl_real *d)
{
    int n = imm->n, r, s;
    const jl_real *x = imm->x + j * n, *P = imm->P + j * n * n;
    jl_real a = share(imm, imm->lambda[j], j, j);
    jl_real b = share_combined(imm, j);

    for (r = 0; r < n; r++) {
        x0[r] = a * x[r] + b * imm->xhat[r];
        d[r] = x[r] - imm->xhat[r];
    }
    for (r = 0; r < n; r++)
        for (s = r; s < n; s++) {
            P0[r * n + s] = a * P[r * n + s] + b * imm->Phat[r * n + s]
                + a * b * (d[r] * d[s]);
            P0[s * n + r] = P0[r * n + s];
        }
}

void jl_imm_mix_mode(jl_imm *imm, int j, jl_real *scratch)
{
    int i, M = imm->M, n = imm->n;
    jl_real *x0 = imm->xw + j * n, *P0 = imm->Pw + j * n * n;
    jl_real *w = scratch, *d = w + M;

    if (imm->logc[j] < -JL_REAL_MAX) {          /* cannot be entered */
        jli_copy(x0, imm->x + j * n, n);
        jli_copy(P0, imm->P + j * n * n, n * n);
    } else if (imm->sticky) {
        mix_sticky(x0, P0, imm, j, d);
    } else {
        for (i = 0; i < M; i++)
            w[i] = share(imm, imm->Pi[i * M + j], i, j);
        jli_pool(x0, P0, w, imm->x, imm->P, d, M, n);
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
