#include "bank.h"

#include <stdlib.h>
#include <string.h>

/* --- open and close ------------------------------------------------------ */

/* Modes may differ in their number of noises, so each has its own place. */
static int copy_modes(struct bank *bank)
{
    const struct model *model = bank->model;
    jl_real *mem;
    int j;
    size_t need = 0;

    for (j = 0; j < model->M; j++)
        need += (size_t)JL_MODE_MEM(model->modes[j].n, model->m,
                                    model->modes[j].p);
    bank->modes = calloc((size_t)model->M, sizeof *bank->modes);
    bank->mode_mem = calloc(need, sizeof *mem);
    if (bank->modes == NULL || bank->mode_mem == NULL)
        return -1;
    mem = bank->mode_mem;
    for (j = 0; j < model->M; j++) {
        const jl_mode *from = &model->modes[j];
        int size = JL_MODE_MEM(from->n, from->m, from->p);

        if (jl_mode_init(&bank->modes[j], from->n, from->m, from->p, mem,
                         size) != JL_OK)
            return -1;
        memcpy(mem, from->F, (size_t)size * sizeof *mem);
        mem += size;
    }
    return 0;
}

/* Of fixed size if there is one; the bits are the same. */
static const jl_kf_form *form_of(const struct bank *bank,
                                 const struct options *options)
{
    const struct model *model = bank->model;
    int j;

    for (j = 0; j < model->M; j++)
        if (bank->modes[j].n != model->n)
            return options->form;
    return jl_kf_fixed(options->form, model->n, model->m);
}

static int open_imm(struct bank *bank, const struct options *options)
{
    const struct model *model = bank->model;
    int M = model->M, n = model->n, m = model->m;
    size_t size = sizeof(jl_real);

    bank->mem = calloc((size_t)JL_IMM_STATE(M, n, m), size);
    bank->scratch = calloc((size_t)JL_IMM_SCRATCH(M, n, m), size);
    bank->Pi = calloc((size_t)(M * M), size);
    bank->x = calloc((size_t)(M * n), size);
    bank->P = calloc((size_t)(M * n * n), size);
    if (bank->mem == NULL || bank->scratch == NULL || bank->Pi == NULL
        || bank->x == NULL || bank->P == NULL)
        return -1;
    return jl_imm_init_sizes(&bank->imm, M, n, bank->modes, model->map,
                             model->prior_x, model->prior_var,
                             form_of(bank, options), JL_MIX_AUTO,
                             bank->mem, JL_IMM_STATE(M, n, m))
            == JL_OK
        && jl_imm_gate(&bank->imm, options_gate(options, m),
                       options->gate_most) == JL_OK ? 0 : -1;
}

static int open_cg(struct bank *bank)
{
    const struct model *model = bank->model;
    int M = model->M, m = model->m, cap = JL_CGIMM_STATE(M, m);

    bank->mem = calloc((size_t)cap, sizeof(jl_real));
    bank->scratch = calloc((size_t)(3 * m), sizeof(jl_real));
    bank->x = calloc((size_t)(M * model->n), sizeof(jl_real));
    if (bank->mem == NULL || bank->scratch == NULL || bank->x == NULL)
        return -1;
    return jl_cgimm_init(&bank->cg, M, model->gains, m, model->T, model->R,
                         model->Pi, bank->mem, cap) == JL_OK ? 0 : -1;
}

static int open_mekf(struct bank *bank)
{
    bank->mekf = malloc(sizeof *bank->mekf);
    return bank->mekf != NULL ? 0 : -1;
}

int bank_open(struct bank *bank, const struct model *model,
              const struct options *options)
{
    memset(bank, 0, sizeof *bank);
    bank->model = model;
    bank->dt = -1;
    if (model->M < 1 && model->mekf == NULL)
        return -1;
    if (model->mekf != NULL ? open_mekf(bank) != 0
        : model->gains != NULL ? open_cg(bank) != 0
        : copy_modes(bank) != 0 || open_imm(bank, options) != 0) {
        bank_close(bank);
        return -1;
    }
    return 0;
}

void bank_close(struct bank *bank)
{
    free(bank->modes);
    free(bank->mode_mem);
    free(bank->mem);
    free(bank->mekf);
    free(bank->scratch);
    free(bank->Pi);
    free(bank->x);
    free(bank->P);
    memset(bank, 0, sizeof *bank);
}

/* --- kind imm ------------------------------------------------------------ */

/* Every mode starts from the same first measurement; one that lacks the
 * acceleration as if it had it: then that is the prior. */
static int start_from(struct bank *bank, jl_imm *imm, const jl_real *z)
{
    const struct model *model = bank->model;
    int j, n = model->n, status;

    if (z == NULL)
        return JL_EORDER;               /* the feed does not let that happen */
    for (j = 0; j < model->M; j++) {
        jl_motion motion = model->motions[j];

        motion.order = n / model->m;
        status = jl_motion_start(bank->x + j * n, bank->P + j * n * n, &motion,
                                 z, model->v0_std, model->a0_std);
        if (status != JL_OK)
            return status;
    }
    status = jl_imm_set(imm, bank->x, bank->P, model->mu0, bank->scratch);
    return status == JL_OK ? JL_STARTED : status;
}

/* Over no time no mode jumps. */
static int chain_over(struct bank *bank, jl_real dt)
{
    const struct model *model = bank->model;
    int i, M = model->M;

    if (model->Pi == NULL)
        return jl_chain_sojourn(bank->Pi, model->sojourn_s, M, dt);
    memcpy(bank->Pi, model->Pi, (size_t)(M * M) * sizeof *bank->Pi);
    if (model->motions != NULL && !(dt > 0))
        for (i = 0; i < M * M; i++)
            bank->Pi[i] = i % (M + 1) == 0;
    return JL_OK;
}

static int rebuild(struct bank *bank, jl_imm *imm, jl_real dt)
{
    const struct model *model = bank->model;
    int j, status = chain_over(bank, dt);

    for (j = 0; model->motions != NULL && j < model->M && status == JL_OK; j++)
        status = jl_mode_motion(&bank->modes[j], &model->motions[j], dt);
    if (status == JL_OK)
        status = jl_imm_chain(imm, bank->Pi);
    bank->dt = status == JL_OK ? dt : -1;
    return status;
}

int bank_prepare(void *context, jl_imm *imm, const jl_meas *meas)
{
    struct bank *bank = context;
    const struct model *model = bank->model;
    int status = JL_OK;

    if (meas->first) {
        if (model->x0 == NULL)
            return start_from(bank, imm, meas->z);
        status = jl_imm_set(imm, model->x0, model->P0, model->mu0,
                            bank->scratch);
        bank->dt = -1;
    }
    /* Matrices hold for a step, whatever its length; motions for a time. */
    if (status == JL_OK && (bank->dt < 0 || (model->motions != NULL
                                             && (meas->dt < bank->dt
                                                 || meas->dt > bank->dt))))
        status = rebuild(bank, imm, meas->dt);
    return status;
}

/* --- kind cgimm ---------------------------------------------------------- */

/* From a first measurement all modes start at rest. */
static int start_cg(struct bank *bank, jl_cgimm *cg, const jl_real *z)
{
    const struct model *model = bank->model;
    int i, n = model->n, order = n / model->m, status;

    if (z == NULL)
        return JL_EORDER;               /* the feed does not let that happen */
    for (i = 0; i < model->M * n; i++)
        bank->x[i] = i % order == 0 ? z[i % n / order] : 0;
    status = jl_cgimm_set(cg, bank->x, model->mu0);
    return status == JL_OK ? JL_STARTED : status;
}

int bank_prepare_cg(void *context, jl_cgimm *cg, const jl_meas *meas)
{
    struct bank *bank = context;
    const struct model *model = bank->model;

    if (!meas->first)
        return JL_OK;
    return model->x0 == NULL ? start_cg(bank, cg, meas->z)
        : jl_cgimm_set(cg, model->x0, model->mu0);
}

/* --- a step -------------------------------------------------------------- */

static int step_imm(struct bank *bank, jl_estimate *estimate,
                    const jl_meas *meas)
{
    jl_imm *imm = &bank->imm;
    int status = bank_prepare(bank, imm, meas);

    if (status == JL_OK)
        status = jl_imm_step(imm, meas->z, bank->scratch);
    estimate->verdict = imm->verdict;
    estimate->loglik = imm->loglik;
    estimate->x = imm->xhat;
    estimate->P = imm->Phat;
    estimate->mu = imm->mu;
    return status;
}

static int step_cg(struct bank *bank, jl_estimate *estimate,
                   const jl_meas *meas)
{
    jl_cgimm *cg = &bank->cg;
    int status = bank_prepare_cg(bank, cg, meas);

    estimate->verdict = status == JL_OK && meas->z != NULL ? JL_ACCEPTED
                                                           : JL_MISSING;
    if (status == JL_OK)
        status = jl_cgimm_step(cg, meas->z);
    jl_cgimm_estimate(cg, bank->scratch);
    estimate->loglik = jl_cgimm_loglik(cg);
    estimate->x = bank->scratch;
    estimate->P = NULL;
    estimate->mu = cg->mu;
    return status;
}

/* A row is a step, whatever its length. */
static int step_mekf(struct bank *bank, jl_estimate *estimate,
                     const jl_meas *meas)
{
    int status = meas->first
        ? mekf_filter_start(bank->mekf, bank->model->mekf) : JL_OK;

    if (status == JL_OK)
        status = mekf_filter_step(bank->mekf, meas->z);
    if (status != JL_OK)
        return status;
    estimate->verdict = meas->z != NULL ? JL_ACCEPTED : JL_MISSING;
    estimate->loglik = 0;
    estimate->x = mekf_filter_row(bank->mekf);
    estimate->P = estimate->mu = NULL;
    return JL_OK;
}

int bank_step(struct bank *bank, jl_estimate *estimate, const jl_meas *meas)
{
    if (bank->model->mekf != NULL)
        return step_mekf(bank, estimate, meas);
    return (bank->model->gains != NULL ? step_cg : step_imm)(bank, estimate,
                                                             meas);
}
