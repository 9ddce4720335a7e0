/* Stages 2 and 3, and the four in one. */
#include "imm/imm_stage.h"

#include "kf/kf_gate.h"
#include "mat/mat_k.h"

/* Where a mode's own estimate is, and where what becomes of it goes first. */
struct place {
    const jl_real *x, *P;       /* [k], [k,k]                               */
    jl_real *new_x, *new_P;
    jl_real *rest;              /* scratch                                  */
};

static struct place own(const jl_imm *imm, int j, jl_real *scratch)
{
    int n = imm->n, k = imm->modes[j].n;
    struct place p;

    p.new_x = scratch;
    p.new_P = p.new_x + k;
    p.rest = p.new_P + k * k;
    p.x = imm->xw + j * n;
    p.P = imm->Pw + j * n * n;
    if (JLI_LACKS(imm, j)) {
        jl_real *x = p.rest, *P = x + k;

        jli_own_states(x, P, imm, j, p.x, p.P, P + k * k);
        p.x = x;
        p.P = P;
        p.rest = P + k * k;
    }
    return p;
}

static void put_back(jl_imm *imm, int j, const struct place *p)
{
    int n = imm->n;
    jl_real *x = imm->xw + j * n, *P = imm->Pw + j * n * n;

    if (JLI_LACKS(imm, j)) {
        jli_all_states(x, P, imm, j, p->new_x, p->new_P);
    } else {
        jli_copy(x, p->new_x, n);
        jli_copy(P, p->new_P, n * n);
    }
}

int jl_imm_predict_mode(jl_imm *imm, int j, jl_real *scratch)
{
    struct place p = own(imm, j, scratch);
    int status;

    JL_ASSERT(j >= 0 && j < imm->M);
    status = imm->form->predict(p.new_x, p.new_P, &imm->modes[j], p.x, p.P,
                                p.rest);
    if (status == JL_OK)
        put_back(imm, j, &p);
    else
        imm->stage = JLI_FAILED;
    return status;
}

int jli_imm_update(jl_imm *imm, int j, const jl_real *z, jl_real gate,
                   jl_real *scratch)
{
    struct place p = own(imm, j, scratch);
    jl_innovation got;
    int status;

    got.nu = imm->nu + j * imm->m;
    status = jli_gated_update(p.new_x, p.new_P, &got, imm->form,
                              &imm->modes[j], p.x, p.P, z, gate, p.rest);
    if (status != JL_OK) {
        imm->stage = JLI_FAILED;
        return status;
    }
    imm->l[j] = got.loglik;
    imm->nis[j] = got.nis;
    if (!(gate > 0 && jli_imm_waits(imm, j)))
        put_back(imm, j, &p);
    return JL_OK;
}

int jl_imm_update_mode(jl_imm *imm, int j, const jl_real *z,
                       jl_real *scratch)
{
    JL_ASSERT(j >= 0 && j < imm->M);
    if (imm->stage == JLI_MIXED)
        imm->stage = JLI_FILTERED;
    if (z == NULL) {
        imm->l[j] = 0;
        imm->nis[j] = 0;
        return JL_OK;
    }
    return jli_imm_update(imm, j, z, imm->gate, scratch);
}

/* Predict and update in one: from xw into scratch, and back. */
static int filter_mode(jl_imm *imm, int j, const jl_real *z, jl_real *scratch)
{
    const jl_mode *mode = &imm->modes[j];
    int n = imm->n, status;
    jl_real *x = imm->xw + j * n, *P = imm->Pw + j * n * n;
    jl_real *xp = scratch, *Pp = xp + n, *rest = Pp + n * n;
    jl_innovation got;

    got.nu = imm->nu + j * imm->m;
    status = imm->form->predict(xp, Pp, mode, x, P, rest);
    if (status == JL_OK)
        status = imm->gate > 0
            ? jli_gated_update(x, P, &got, imm->form, mode, xp, Pp, z,
                               imm->gate, rest)
            : imm->form->update(x, P, &got, mode, xp, Pp, z, rest);
    if (status != JL_OK) {
        imm->stage = JLI_FAILED;
        return status;
    }
    imm->stage = JLI_FILTERED;
    imm->l[j] = got.loglik;
    imm->nis[j] = got.nis;
    if (imm->gate > 0 && jli_imm_waits(imm, j)) {
        jli_copy(x, xp, n);
        jli_copy(P, Pp, n * n);
    }
    return JL_OK;
}

int jl_imm_filter(jl_imm *imm, const jl_real *z, jl_real *scratch)
{
    int j, status = JL_OK;

    if (imm->stage != JLI_MIXED)
        return JL_EORDER;
    for (j = 0; j < imm->M && status == JL_OK; j++) {
        if (z != NULL && !JLI_LACKS(imm, j)) {
            status = filter_mode(imm, j, z, scratch);
            continue;
        }
        status = jl_imm_predict_mode(imm, j, scratch);
        if (status == JL_OK)
            status = jl_imm_update_mode(imm, j, z, scratch);
    }
    return status == JL_OK ? jl_imm_judge(imm, z, scratch) : status;
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

/* As in kf.c, counts stay where they are as large as can be. */
static void count(jl_imm *imm)
{
    jl_real part;
    int j;

    if (imm->verdict == JL_REJECTED) {
        imm->run += imm->run < INT_MAX;
        imm->rejected++;
    } else if (imm->verdict == JL_ACCEPTED) {
        imm->run = 0;
        imm->accepted += imm->accepted < ULONG_MAX;
        part = 1 / (jl_real)imm->accepted;
        for (j = 0; j < imm->M; j++)
            imm->nis_mean[j] += (imm->nis[j] - imm->nis_mean[j]) * part;
    }
}

int jl_imm_weigh(jl_imm *imm)
{
    int j, M = imm->M;
    jl_real *e = imm->e, best, sum, lse;

    if (imm->stage != JLI_JUDGED)
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
    imm->loglik = imm->verdict == JL_ACCEPTED ? best + lse : 0;
    count(imm);
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
