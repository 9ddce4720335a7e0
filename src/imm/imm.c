/* The IMM as an object: memory, chain, state. */
#include "imm/imm_stage.h"

#include "mat/mat_k.h"

/* Given probabilities sum to 1 within a tolerance; kept ones, exactly. */
static void set_mu(jl_imm *imm, const jl_real *mu)
{
    jl_real sum = 0;
    int j;

    for (j = 0; j < imm->M; j++)
        sum += mu != NULL ? mu[j] : 1;
    for (j = 0; j < imm->M; j++) {
        imm->mu[j] = (mu != NULL ? mu[j] : 1) / sum;
        imm->logmu[j] = imm->mu[j] > JLI_SMALL ? 0 : jl_log(imm->mu[j]);
    }
}

static void layout(jl_imm *imm, jl_real *mem)
{
    int M = imm->M, n = imm->n;

    imm->x = mem;
    imm->P = imm->x + M * n;
    imm->xw = imm->P + M * n * n;
    imm->Pw = imm->xw + M * n;
    imm->xhat = imm->Pw + M * n * n;
    imm->Phat = imm->xhat + n;
    imm->Shat = imm->form->cov->factored ? imm->Phat + n * n : imm->Phat;
    imm->d = imm->Phat + 2 * n * n;
    imm->Pi = imm->d + 2 * n;
    imm->logmu = imm->Pi + M * M;
    imm->mu = imm->logmu + M;
    imm->logc = imm->mu + M;
    imm->c = imm->logc + M;
    imm->l = imm->c + M;
    imm->nis = imm->l + M;
    imm->nis_mean = imm->nis + M;
    imm->e = imm->nis_mean + M;
    imm->lambda = imm->e + M;
    imm->v = imm->lambda + M;
    imm->nu = imm->v + M;
}

/* Of components that mode j lacks, the prior; scratch [k + k k + n], which is
 * at most [n + n n] as k < n. */
static void set_prior(jl_imm *imm, int j, jl_real *scratch)
{
    int n = imm->n, k = imm->modes[j].n;
    jl_real *x = imm->x + j * n, *P = imm->P + j * n * n;

    if (!JLI_LACKS(imm, j))
        return;
    jli_own_states(scratch, scratch + k, imm, j, x, P, scratch + k + k * k);
    jli_all_states(x, P, imm, j, scratch, scratch + k);
}

static void forget(jl_imm *imm)
{
    memset(imm->nis, 0, (size_t)(2 * imm->M) * sizeof *imm->nis);
    memset(imm->nu, 0, (size_t)(imm->M * imm->m) * sizeof *imm->nu);
    imm->accepted = 0;
    imm->rejected = 0;
    imm->run = 0;
    imm->verdict = JL_MISSING;
    imm->loglik = 0;
    imm->stage = JLI_IDLE;
}

int jl_imm_init_sizes(jl_imm *imm, int M, int n, const jl_mode *modes,
                      const int *const *map, const jl_real *prior_x,
                      const jl_real *prior_var, const jl_kf_form *form,
                      int mixing, jl_real *mem, int cap)
{
    int i, j, status;

    if (M < 1 || M > JL_MAX_MODES || n < 1 || n > JL_MAX_STATES
        || (mixing != JL_MIX_AUTO && mixing != JL_MIX_GENERAL))
        return JL_EDIM;
    status = jli_check_sizes(M, n, modes, map, prior_x, prior_var, form);
    if (status != JL_OK)
        return status;
    if (cap < JL_IMM_STATE(M, n, modes[0].m))
        return JL_ENOMEM;

    memset(mem, 0, (size_t)JL_IMM_STATE(M, n, modes[0].m) * sizeof *mem);
    memset(imm, 0, sizeof *imm);
    imm->M = M;
    imm->n = n;
    imm->m = modes[0].m;
    imm->modes = modes;
    imm->form = form;
    imm->mixing = mixing;
    imm->map = map;
    imm->prior_x = prior_x;
    imm->prior_var = prior_var;
    layout(imm, mem);
    for (j = 0; j < M; j++) {
        imm->Pi[j * M + j] = 1;
        imm->lambda[j] = 1;                     /* v = 0 */
        for (i = 0; i < n; i++)         /* a covariance, and a factor of it */
            imm->P[j * n * n + i * (n + 1)] = 1;
        set_prior(imm, j, imm->xw);
    }
    imm->sticky = mixing == JL_MIX_AUTO;
    forget(imm);
    set_mu(imm, NULL);
    jl_imm_combine(imm);
    return JL_OK;
}

int jl_imm_init(jl_imm *imm, int M, const jl_mode *modes,
                const jl_kf_form *form, int mixing, jl_real *mem, int cap)
{
    return M < 1 ? JL_EDIM
        : jl_imm_init_sizes(imm, M, modes[0].n, modes, NULL, NULL, NULL, form,
                            mixing, mem, cap);
}

jl_real jl_imm_logmu(const jl_imm *imm, int j)
{
    JL_ASSERT(j >= 0 && j < imm->M);
    return jli_log_of(imm->mu[j], imm->logmu[j]);
}

void jl_imm_cov(const jl_imm *imm, int j, jl_real *P)
{
    int n = imm->n;

    JL_ASSERT(j >= 0 && j < imm->M);
    imm->form->cov->give(P, imm->P + j * n * n, n);
}

/* v_j, the common entry of column j off the diagonal, or -1 if there is none:
 * common up to a few roundings relative to itself, as is left by an author who
 * computed (1 - p) / (M - 1). */
static jl_real common_entry(const jl_real *Pi, int M, int j)
{
    jl_real least = JL_REAL_MAX, most = 0;
    int i;

    if (M == 1)
        return 0;
    for (i = 0; i < M; i++) {
        jl_real p = Pi[i * M + j];

        if (i != j && p < least)
            least = p;
        if (i != j && p > most)
            most = p;
    }
    if (most - least > 8 * JL_EPSILON * least)
        return -1;
    return least <= Pi[j * M + j] ? least : -1;
}

int jl_imm_chain(jl_imm *imm, const jl_real *Pi)
{
    int j, M = imm->M, status = jl_chain_check(Pi, NULL, M);

    if (status != JL_OK)
        return status;
    jli_copy(imm->Pi, Pi, M * M);
    imm->sticky = imm->mixing == JL_MIX_AUTO;
    for (j = 0; j < M && imm->sticky; j++) {
        imm->v[j] = common_entry(Pi, M, j);
        imm->lambda[j] = Pi[j * M + j] - imm->v[j];
        imm->sticky = imm->v[j] >= 0;
    }
    imm->stage = JLI_IDLE;
    return JL_OK;
}

int jl_imm_set(jl_imm *imm, const jl_real *x, const jl_real *P,
               const jl_real *mu, jl_real *scratch)
{
    int j, M = imm->M, n = imm->n, status = jl_chain_check(NULL, mu, M);

    if (status == JL_OK && !jl_vec_within(x, M * n, JL_LARGE))
        status = JL_ENONFINITE;
    for (j = 0; j < M && status == JL_OK; j++)
        status = jl_mat_check_cov(P + j * n * n, scratch, n);
    if (status != JL_OK)
        return status;
    jli_copy(imm->x, x, M * n);
    for (j = 0; j < M; j++) {
        imm->form->cov->take(imm->P + j * n * n, P + j * n * n, scratch, n);
        set_prior(imm, j, scratch);
    }
    set_mu(imm, mu);
    forget(imm);
    jl_imm_combine(imm);
    return JL_OK;
}
