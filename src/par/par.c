/* A PE's life: set up, say ready, serve measurements until the stop. */
#include "par/par_parts.h"

#include "mat/mat_k.h"

void jl_par_deal(unsigned char *owner, int M, int npe)
{
    int j;

    JL_ASSERT(npe >= 1 && npe <= JL_MAX_PES);
    for (j = 0; j < M; j++)
        owner[j] = (unsigned char)(j % npe);
}

/* PEs that own modes, or 0 if they are not 0 .. A-1. */
static int count_active(const unsigned char *owner, int M, int npe)
{
    int pe, j, count[JL_MAX_PES], active = 0;

    for (pe = 0; pe < npe; pe++)
        count[pe] = 0;
    for (j = 0; j < M; j++) {
        if (owner[j] >= npe)
            return 0;
        count[owner[j]]++;
        if (owner[j] >= active)
            active = owner[j] + 1;
    }
    for (pe = 0; pe < active; pe++)
        if (count[pe] == 0)
            return 0;
    return active;
}

/* The channels of the neighbours can hold the messages. */
static int channels_hold(const jl_par_config *c, int need)
{
    int pe;

    for (pe = 0; pe < c->npe; pe++)
        if (pe != c->pe
            && jl_topo_relays(c->topology, c->npe, c->pe, pe) == 0
            && (c->to[pe]->max_len < need || c->from[pe]->max_len < need))
            return 0;
    return c->pe != 0 || c->to_host == NULL || c->to_host->max_len >= need;
}

int jli_par_bind(jl_par *par, int M, int n, int m, int need,
                 const jl_par_config *config, unsigned char *buf, int cap,
                 int *status, jl_real *z)
{
    jl_par_config copy = *config;
    int active;

    if (copy.npe < 1 || copy.npe > JL_MAX_PES || copy.pe < 0
        || copy.pe >= copy.npe || copy.topology < JL_TOPO_FULL
        || copy.topology > JL_TOPO_CHAIN
        || (copy.exchange != JL_EXCHANGE_GATHER
            && copy.exchange != JL_EXCHANGE_REDUCE))
        return JL_EDIM;
    active = count_active(copy.owner, M, copy.npe);
    if (active == 0)
        return JL_EDIM;
    if (cap < 2 * need)
        return JL_ENOMEM;
    if (copy.topology == JL_TOPO_RING && active < copy.npe)
        copy.topology = JL_TOPO_CHAIN;
    if (!channels_hold(&copy, need))
        return JL_ETOOLONG;
    memset(par, 0, sizeof *par);
    par->config = copy;
    par->M = M;
    par->n = n;
    par->m = m;
    par->active = active;
    par->buf = buf;
    par->cap = cap;
    par->status = status;
    par->z = z;
    jli_par_order(par);
    return JL_OK;
}

/* --- serve --------------------------------------------------------------- */

static int parent(const jl_par *par)
{
    const jl_par_config *config = &par->config;

    return config->pe == 0 ? config->npe
        : jl_topo_parent(config->topology, config->npe, config->pe);
}

/* Pass a message of the host's on, down the tree of PEs 0 .. last-1. */
static int pass_on(jl_par *par, int len, int last)
{
    const jl_par_config *config = &par->config;
    int pe, status = JL_OK;

    for (pe = 1; pe < last && status == JL_OK; pe++)
        if (jl_topo_parent(config->topology, config->npe, pe) == config->pe)
            status = jli_par_send(par, pe, JLI_IN(par), len,
                                  config->timeout_us, 0);
    return status;
}

/* Read a measurement, or say why it is refused. */
static int accept_meas(jl_par *par, jl_meas *meas, int len)
{
    int status = jli_msg_meas_read(meas, par->z, par->m, JLI_IN(par), len);

    if (status != JL_OK)
        return status;
    if (par->steps > 0 && meas->seq <= par->seq)
        return JL_EMSG;
    if (!jli_finite(meas->dt)
        || (meas->z != NULL
            && !jl_vec_within(par->z, par->m, par->kind->largest(par))))
        return JL_ENONFINITE;
    return meas->dt < 0 ? JL_ETIME : JL_OK;
}

static int answer(jl_par *par, jl_u32 seq, int status, jl_real *scratch)
{
    jl_estimate estimate;
    int len;

    if (par->config.pe != 0)
        return JL_OK;
    memset(&estimate, 0, sizeof estimate);
    estimate.seq = seq;
    estimate.status = status;
    if (status == JL_OK)
        estimate.verdict = par->verdict;
    par->kind->answer(par, &estimate, scratch);
    len = jli_msg_estimate(JLI_OUT(par), &estimate, par->M, par->n);
    return jli_par_send(par, par->config.npe, JLI_OUT(par), len,
                        par->config.timeout_us, 0);
}

/* One measurement that came [len]: refused, or a step.  Returns the error of a
 * channel; a failed step is no error here, the host is told. */
static int serve_meas(jl_par *par, int len, jl_real *scratch)
{
    jl_meas meas;
    int status;

    meas.seq = 0;
    status = accept_meas(par, &meas, len);
    if (status != JL_OK) {
        par->refused++;
        return answer(par, meas.seq, status, scratch);
    }
    status = pass_on(par, len, par->active);
    if (status != JL_OK)
        return status;
    status = jl_par_step(par, &meas, scratch);
    par->steps++;
    if (par->failed != JL_OK)
        return status;
    status = answer(par, meas.seq, status, scratch);
    jl_par_ahead(par, scratch);
    return status;
}

static int serve(jl_par *par, jl_real *scratch)
{
    int status = jli_par_ready(par), len;

    while (status == JL_OK) {
        len = jli_par_recv(par, parent(par), JL_FOREVER, 0);
        if (len < 0)
            return len;
        if (len == JLI_MSG_HEADER && JLI_IN(par)[0] == JLI_STOP)
            return pass_on(par, len, par->config.npe);
        status = serve_meas(par, len, scratch);
    }
    return status;
}

int jl_par_serve(jl_par *par, jl_real *scratch)
{
    int status = serve(par, scratch);

    if (par->failed != JL_OK && par->failed != JL_EMODEL)
        jli_par_tell_fault(par);
    return status;
}
