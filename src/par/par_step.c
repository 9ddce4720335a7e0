/* One parallel step: own modes, one exchange, the same weighing everywhere. */
#include "par/par_parts.h"

#include "imm/imm_stage.h"

/* Mix and predict the own modes: needs no measurement. */
static void go_ahead(jl_par *par, jl_real *scratch)
{
    jl_imm *imm = par->imm;
    int j;

    jl_imm_foresee(imm);
    for (j = 0; j < imm->M; j++)
        if (par->config.owner[j] == par->config.pe) {
            jl_imm_mix_mode(imm, j, scratch);
            par->status[j] = jl_imm_predict_mode(imm, j, scratch);
        }
    par->ahead = 1;
}

static int first_failure(const jl_par *par)
{
    int j;

    for (j = 0; j < par->imm->M; j++)
        if (par->status[j] != JL_OK)
            return par->status[j];
    return JL_OK;
}

void jl_par_ahead(jl_par *par, jl_real *scratch)
{
    if (par->config.pe < par->active && !par->ahead)
        go_ahead(par, scratch);
}

static void update(jl_par *par, const jl_real *z, jl_real *scratch)
{
    int j;

    for (j = 0; j < par->imm->M; j++)
        if (par->config.owner[j] == par->config.pe
            && par->status[j] == JL_OK)
            par->status[j] = jl_imm_update_mode(par->imm, j, z, scratch);
}

int jl_par_step(jl_par *par, const jl_meas *meas, jl_real *scratch)
{
    jl_imm *imm = par->imm;
    int reduces = par->config.exchange == JL_EXCHANGE_REDUCE
        && par->active > 1;
    int status;

    par->seq = meas->seq;
    if (par->config.pe >= par->active)
        return JL_OK;
    if (par->config.prepare != NULL) {
        status = par->config.prepare(par->config.context, imm, meas);
        if (status != JL_OK)
            return status == JL_STARTED ? JL_OK : status;
    }
    if (reduces && !imm->sticky)
        return JL_ECHAIN;
    if (reduces && imm->gate > 0)
        return JL_EGATE;
    if (!par->ahead || imm->stage != JLI_MIXED)
        go_ahead(par, scratch);
    par->ahead = 0;
    update(par, meas->z, scratch);
    if (reduces) {
        par->pool = scratch;
        jli_pool_own(par);
    }
    status = jli_par_exchange(par);
    if (status != JL_OK)
        return status;
    status = first_failure(par);
    if (status == JL_OK)
        status = jl_imm_judge(imm, meas->z, scratch);
    if (status == JL_OK)
        status = jl_imm_weigh(imm);
    if (status == JL_OK && reduces)
        jli_pool_merge(par);
    else if (status == JL_OK && par->config.pe == 0)
        jl_imm_combine(imm);
    return status;
}
