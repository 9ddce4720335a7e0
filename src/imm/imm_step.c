/* Stages 2 and 3, and the four in one. */
#include "imm/imm_stage.h"

#include "mat/mat_k.h"

/* A mode's own estimate: in xw, Pw; if it lacks components, or when it is to be
 * left as it is, a copy in scratch. */
struct own {
    jl_real *x, *P;             /* [k], [k,k]                               */
    jl_real *rest;              /* scratch                                  */
};

static struct own take(const jl_imm *imm, int j, int aside, jl_real *scratch)
{
    int n = imm->n, k = imm->modes[j].n;
    jl_real *x = imm->xw + j * n, *P = imm->Pw + j * n * n;
    struct own own;

    own.x = scratch;
    own.P = own.x + k;
    own.rest = own.P + k * k;
    if (JLI_LACKS(imm, j)) {
        jli_own_states(own.x, own.P, imm, j, x, P, own.rest);
    } else if (aside) {
        jli_copy(own.x, x, n);
        jli_copy(own.P, P, n * n);
    } else {
        own.x = x;
        own.P = P;
        own.rest = scratch;
    }
    return own;
}

static void give(jl_imm *imm, int j, const struct own *own)
{
    int n = imm->n;

    if (JLI_LACKS(imm, j))
        jli_all_states(imm->xw + j * n, imm->Pw + j * n * n, imm, j, own->x,
                       own->P);
}

static int fail(jl_imm *imm, int status)
{
    imm->stage = JLI_FAILED;
    return status;
}

int jl_imm_predict_mode(jl_imm *imm, int j, jl_real *scratch)
{
    struct own own = take(imm, j, 0, scratch);
    int status;

    JL_ASSERT(j >= 0 && j < imm->M);
    status = imm->form->predict(own.x, own.P, &imm->modes[j], own.rest);
    if (status != JL_OK)
        return fail(imm, status);
    give(imm, j, &own);
    return JL_OK;
}

/* 1 if mode j must not be updated before the verdict, whatever its nis. */
static int has_no_say(const jl_imm *imm, int j, jl_real gate)
{
    return gate > 0 && !jli_is_possible(imm, j);
}

static int told(jl_imm *imm, int j, int status, const jl_innovation *got)
{
    if (status != JL_OK)
        return fail(imm, status);
    imm->l[j] = got->loglik;
    imm->nis[j] = got->nis;
    return JL_OK;
}

int jli_imm_update(jl_imm *imm, int j, const jl_real *z, jl_real gate,
                   jl_real *scratch)
{
    int aside = has_no_say(imm, j, gate), status;
    struct own own = take(imm, j, aside, scratch);
    jl_innovation got;

    got.nu = imm->nu + j * imm->m;
    status = told(imm, j, imm->form->update(own.x, own.P, &got,
                                            &imm->modes[j], z, gate,
                                            own.rest), &got);
    if (status == JL_OK && !aside)
        give(imm, j, &own);
    return status;
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

/* Predict and update in one, where a mode may. */
static int filter_mode(jl_imm *imm, int j, const jl_real *z, jl_real *scratch)
{
    int n = imm->n, status;
    jl_innovation got;

    if (z == NULL || JLI_LACKS(imm, j) || has_no_say(imm, j, imm->gate)) {
        status = jl_imm_predict_mode(imm, j, scratch);
        return status == JL_OK ? jl_imm_update_mode(imm, j, z, scratch)
            : status;
    }
    got.nu = imm->nu + j * imm->m;
    imm->stage = JLI_FILTERED;
    status = imm->form->step(imm->xw + j * n, imm->Pw + j * n * n, &got,
                             &imm->modes[j], z, imm->gate, scratch);
    return told(imm, j, status, &got);
}

int jl_imm_filter(jl_imm *imm, const jl_real *z, jl_real *scratch)
{
    int j, status = JL_OK;

    if (imm->stage != JLI_MIXED)
        return JL_EORDER;
    for (j = 0; j < imm->M && status == JL_OK; j++)
        status = filter_mode(imm, j, z, scratch);
    return status == JL_OK ? jl_imm_judge(imm, z, scratch) : status;
}

static void swap(jl_real **a, jl_real **b)
{
    jl_real *t = *a;

    *a = *b;
    *b = t;
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
    jl_real best, sum, lse;

    if (imm->stage != JLI_JUDGED)
        return JL_EORDER;
    lse = jli_weights(imm, NULL, 0, &best, &sum);
    for (j = 0; j < M; j++) {
        imm->mu[j] = imm->e[j] / sum;
        imm->logmu[j] = imm->mu[j] > JLI_SMALL ? 0
            : jli_log_weight(imm, j, best) - lse;
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
