/* A PE's life: set up, say ready, serve measurements until the stop. */
#include "par/par_msg.h"

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

/* --- channels, and whose fault it is ------------------------------------- */

static jl_chan *channel(const jl_par *par, int pe, int sending)
{
    const jl_par_config *c = &par->config;

    if (pe == c->npe)
        return sending ? c->to_host : c->from_host;
    return sending ? c->to[pe] : c->from[pe];
}

static int fault(jl_par *par, int pe, int status)
{
    par->failed = status;
    par->failed_pe = pe;
    return status;
}

/* Send buf [len] to a PE, or to the host (npe). */
static int send_to(jl_par *par, int pe, int len, long timeout_us)
{
    int status = jl_chan_send(channel(par, pe, 1), par->buf, len, timeout_us);

    return status == JL_OK ? JL_OK : fault(par, pe, status);
}

/* Receive into buf; returns the length, or the channel's error. */
static int receive_from(jl_par *par, int pe, long timeout_us)
{
    int len = jl_chan_recv(channel(par, pe, 0), par->buf, par->cap,
                           timeout_us);

    return len >= 0 ? len : fault(par, pe, len);
}

/* --- ready --------------------------------------------------------------- */

static int send_ready(jl_par *par, int to, jl_u32 fingerprint)
{
    const jl_par_config *config = &par->config;
    int len = jli_msg_plain(par->buf, JLI_READY, config->pe, config->npe,
                            fingerprint);

    return send_to(par, to, len, config->start_us);
}

/* Returns JL_OK, JL_EMODEL, or an error. */
static int receive_ready(jl_par *par, int from)
{
    int len = receive_from(par, from, par->config.start_us);

    if (len < 0)
        return len;
    if (len != JLI_MSG_HEADER || par->buf[0] != JLI_READY
        || par->buf[1] != from)
        return fault(par, from, JL_EMSG);
    if ((int)jl_get_u16(par->buf + 2) != par->config.npe
        || jl_get_u32(par->buf + 4) != par->config.fingerprint)
        return fault(par, from, JL_EMODEL);
    return JL_OK;
}

/* PE0 hears of every PE, then tells every PE and the host.  If one has another
 * model, they hear a fingerprint that is nobody's. */
static int gather_ready(jl_par *par)
{
    const jl_par_config *config = &par->config;
    jl_u32 fingerprint = config->fingerprint;
    int pe, status, odd = 0;

    for (pe = 1; pe < config->npe; pe++) {
        status = receive_ready(par, pe);
        if (status == JL_EMODEL)
            odd = pe;
        else if (status != JL_OK)
            return status;
    }
    if (odd > 0)
        fingerprint = ~fingerprint & (jl_u32)0xFFFFFFFFUL;
    for (pe = config->npe; pe > 0; pe--) {
        status = send_ready(par, pe, fingerprint);
        if (status != JL_OK && odd == 0)
            return status;
    }
    return odd > 0 ? fault(par, odd, JL_EMODEL) : JL_OK;
}

static int ready(jl_par *par)
{
    int status;

    if (par->config.pe == 0)
        return gather_ready(par);
    status = send_ready(par, 0, par->config.fingerprint);
    return status == JL_OK ? receive_ready(par, 0) : status;
}

/* --- serve --------------------------------------------------------------- */

/* Pass a message of the host's on, from PE0 to PEs 1 .. last-1. */
static int pass_on(jl_par *par, int len, int last)
{
    int pe, status = JL_OK;

    if (par->config.pe != 0)
        return JL_OK;
    for (pe = 1; pe < last && status == JL_OK; pe++)
        status = send_to(par, pe, len, par->config.timeout_us);
    return status;
}

/* Read a measurement from buf, or say why it is refused. */
static int accept_meas(jl_par *par, jl_meas *meas, int len)
{
    int m = par->imm->m;
    int status = jli_msg_meas_read(meas, par->z, m, par->buf, len);

    if (status != JL_OK)
        return status;
    if (par->steps > 0 && meas->seq <= par->seq)
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
    return send_to(par, par->config.npe, len, par->config.timeout_us);
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
        int pe = par->failed_pe;

        (void)answer(par, meas.seq, status);
        return fault(par, pe, status);
    }
    status = answer(par, meas.seq, status);
    jl_par_ahead(par, scratch);
    return status;
}

int jl_par_serve(jl_par *par, jl_real *scratch)
{
    int from = par->config.pe == 0 ? par->config.npe : 0;
    int status = ready(par), len;

    while (status == JL_OK) {
        len = receive_from(par, from, JL_FOREVER);
        if (len < 0)
            return len;
        if (len == JLI_MSG_HEADER && par->buf[0] == JLI_STOP)
            return pass_on(par, len, par->config.npe);
        status = serve_meas(par, len, scratch);
    }
    return status;
}
