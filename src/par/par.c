/* A PE's life: set up, say ready, serve measurements until the stop. */
#include "par/par_msg.h"

#include "mat/mat_k.h"

void jl_par_deal(unsigned char *owner, int M, int npe)
{
    int j;

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

int jl_par_init(jl_par *par, jl_imm *imm, const jl_par_config *config,
                unsigned char *buf, int cap, int *status, jl_real *z)
{
    int pe, need = JL_PAR_MSG(imm->M, imm->n, imm->m), active;

    if (config->npe < 1 || config->npe > JL_MAX_PES || config->pe < 0
        || config->pe >= config->npe)
        return JL_EDIM;
    active = count_active(config->owner, imm->M, config->npe);
    if (active == 0)
        return JL_EDIM;
    if (cap < 2 * need)
        return JL_ENOMEM;
    for (pe = 0; pe < config->npe; pe++)
        if (pe != config->pe && (config->to[pe]->max_len < need
                                 || config->from[pe]->max_len < need))
            return JL_ETOOLONG;
    if (config->pe == 0 && config->to_host != NULL
        && config->to_host->max_len < need)
        return JL_ETOOLONG;
    memset(par, 0, sizeof *par);
    par->config = *config;
    par->imm = imm;
    par->active = active;
    par->buf = buf;
    par->cap = cap;
    par->status = status;
    par->z = z;
    return JL_OK;
}

/* --- ready --------------------------------------------------------------- */

/* PE0 hears of every PE and tells the host.  If one has another model, the
 * host hears a fingerprint that is not its own. */
static int gather_ready(jl_par *par)
{
    const jl_par_config *config = &par->config;
    jl_u32 fingerprint = config->fingerprint;
    int pe, len, status;

    for (pe = 1; pe < config->npe; pe++) {
        len = jl_chan_recv(config->from[pe], par->buf, par->cap,
                           config->timeout_us);
        if (len < 0)
            return len;
        if (len != JLI_MSG_HEADER || par->buf[0] != JLI_READY
            || par->buf[1] != pe
            || (int)jl_get_u16(par->buf + 2) != config->npe)
            return JL_EMSG;
        if (jl_get_u32(par->buf + 4) != config->fingerprint)
            fingerprint = ~config->fingerprint & 0xFFFFFFFFUL;
    }
    len = jli_msg_plain(par->buf, JLI_READY, 0, config->npe, fingerprint);
    status = jl_chan_send(config->to_host, par->buf, len, config->timeout_us);
    if (status != JL_OK)
        return status;
    return fingerprint == config->fingerprint ? JL_OK : JL_EMODEL;
}

static int ready(jl_par *par)
{
    const jl_par_config *config = &par->config;
    int len;

    if (config->pe == 0)
        return gather_ready(par);
    len = jli_msg_plain(par->buf, JLI_READY, config->pe, config->npe,
                        config->fingerprint);
    return jl_chan_send(config->to[0], par->buf, len, config->timeout_us);
}

/* --- serve --------------------------------------------------------------- */

/* Pass a message of the host's on, from PE0 to PEs first .. last-1. */
static int pass_on(jl_par *par, int len, int last)
{
    int pe, status = JL_OK;

    if (par->config.pe != 0)
        return JL_OK;
    for (pe = 1; pe < last && status == JL_OK; pe++)
        status = jl_chan_send(par->config.to[pe], par->buf, len,
                              par->config.timeout_us);
    return status;
}

/* Read a measurement from buf, or say why it is refused. */
static int accept_meas(jl_par *par, jl_meas *meas, int len)
{
    int m = par->imm->m;
    int status = jli_msg_meas_read(meas, par->z, m, par->buf, len);

    if (status != JL_OK)
        return status;
    if (par->steps + par->refused > 0 && meas->seq <= par->seq)
        return JL_EMSG;
    if (!jli_finite(meas->dt)
        || (meas->z != NULL && !jl_vec_within(par->z, m, JL_LARGE)))
        return JL_ENONFINITE;
    return meas->dt < 0 ? JL_ETIME : JL_OK;
}

static int answer(jl_par *par, jl_u32 seq, int status)
{
    int len;

    if (par->config.pe != 0)
        return JL_OK;
    len = jli_msg_estimate(par->buf, par->imm, seq, status);
    return jl_chan_send(par->config.to_host, par->buf, len,
                        par->config.timeout_us);
}

/* One measurement, in buf [len]: refused, or a step.  Returns the error of a
 * channel; a failed step is no error here, the host is told. */
static int serve_meas(jl_par *par, int len, jl_real *scratch)
{
    jl_meas meas;
    int status;

    meas.seq = 0;
    status = accept_meas(par, &meas, len);
    if (status != JL_OK) {
        par->refused++;
        return answer(par, meas.seq, status);
    }
    status = pass_on(par, len, par->active);
    if (status != JL_OK)
        return status;
    status = jl_par_step(par, &meas, scratch);
    par->steps++;
    if (par->failed != JL_OK) {
        (void)answer(par, meas.seq, par->failed);
        return par->failed;
    }
    status = answer(par, meas.seq, status);
    jl_par_ahead(par, scratch);
    return status;
}

int jl_par_serve(jl_par *par, jl_real *scratch)
{
    jl_chan *from = par->config.pe == 0 ? par->config.from_host
                                        : par->config.from[0];
    int status = ready(par), len;

    while (status == JL_OK) {
        len = jl_chan_recv(from, par->buf, par->cap, JL_FOREVER);
        if (len < 0)
            return len;
        if (len == JLI_MSG_HEADER && par->buf[0] == JLI_STOP)
            return pass_on(par, len, par->config.npe);
        status = serve_meas(par, len, scratch);
    }
    return status;
}
