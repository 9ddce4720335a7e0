/* One parallel step: own modes, one exchange, the same weighing everywhere. */
#include "par/par_parts.h"

static int first_failure(const jl_par *par)
{
    int j;

    for (j = 0; j < par->M; j++)
        if (par->status[j] != JL_OK)
            return par->status[j];
    return JL_OK;
}

void jl_par_ahead(jl_par *par, jl_real *scratch)
{
    if (par->config.pe < par->active)
        par->kind->ahead(par, scratch);
    par->ahead = 1;
}

int jl_par_step(jl_par *par, const jl_meas *meas, jl_real *scratch)
{
    int status;

    par->seq = meas->seq;
    par->verdict = JL_MISSING;
    if (par->config.pe >= par->active)
        return JL_OK;
    status = par->kind->prepare(par, meas);
    if (status != JL_OK)
        return status == JL_STARTED ? JL_OK : status;
    par->kind->ahead(par, scratch);
    par->ahead = 0;
    par->kind->update(par, meas->z, scratch);
    status = jli_par_exchange(par);
    if (status != JL_OK)
        return status;
    status = first_failure(par);
    return status == JL_OK ? par->kind->commit(par, meas->z, scratch)
        : status;
}
