/* One parallel step: own modes, one exchange, the same weighing everywhere. */
#include "par/par_msg.h"

#include "imm/imm_stage.h"

/* --- the exchange -------------------------------------------------------- */

/* The circle method: with an odd number of seats, seat i meets seat j in round
 * (i + j) mod seats, and the one that would meet itself meets the last PE. */
int jli_hop_rounds(int n)
{
    return n % 2 == 0 ? n - 1 : n;
}

int jli_hop_partner(int n, int pe, int r)
{
    int seats = jli_hop_rounds(n), j;

    if (pe == seats)                            /* the last of an even n */
        j = r % 2 == 0 ? r / 2 : (r + seats) / 2;
    else
        j = (r - pe + seats) % seats;
    if (j == pe)
        j = seats;
    return j < n ? j : -1;
}

/* A channel that holds the messages of two steps never makes a sender wait in
 * the exchange, so sending first cannot deadlock and saves a turn. */
static int sends_early(const jl_chan *chan)
{
    return chan->slots >= 2;
}

static int receive_modes(jl_par *par, int pe)
{
    unsigned char *in = par->buf + par->cap / 2;
    int len = jl_chan_recv(par->config.from[pe], in, par->cap / 2,
                           par->config.timeout_us);

    return len < 0 ? len : jli_msg_modes_read(par, pe, in, len);
}

/* Returns JL_OK, or the error of a channel, also in failed, with failed_pe. */
static int exchange(jl_par *par)
{
    const jl_par_config *config = &par->config;
    int n = par->active, rounds = jli_hop_rounds(n), pe = config->pe;
    int len = jli_msg_modes(par->buf, par);
    int r, other, status = JL_OK;

    for (r = 0; r < rounds && status == JL_OK; r++) {
        other = jli_hop_partner(n, pe, r);
        if (other >= 0 && sends_early(config->to[other])) {
            par->failed_pe = other;
            status = jl_chan_send(config->to[other], par->buf, len,
                                  config->timeout_us);
        }
    }
    for (r = 0; r < rounds && status == JL_OK; r++) {
        int early;

        other = jli_hop_partner(n, pe, r);
        if (other < 0)
            continue;
        par->failed_pe = other;
        early = sends_early(config->to[other]);
        if (!early && pe < other)
            status = jl_chan_send(config->to[other], par->buf, len,
                                  config->timeout_us);
        if (status == JL_OK)
            status = receive_modes(par, other);
        if (status == JL_OK && !early && pe > other)
            status = jl_chan_send(config->to[other], par->buf, len,
                                  config->timeout_us);
    }
    par->failed = status;
    return status;
}

/* --- the step ------------------------------------------------------------ */

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

int jl_par_step(jl_par *par, const jl_meas *meas, jl_real *scratch)
{
    jl_imm *imm = par->imm;
    int j, status;

    par->seq = meas->seq;
    if (par->config.pe >= par->active)
        return JL_OK;
    if (par->config.prepare != NULL) {
        status = par->config.prepare(par->config.context, imm, meas);
        if (status != JL_OK)
            return status == JL_STARTED ? JL_OK : status;
    }
    if (!par->ahead || imm->stage != JLI_MIXED)
        go_ahead(par, scratch);
    par->ahead = 0;
    for (j = 0; j < imm->M; j++)
        if (par->config.owner[j] == par->config.pe
            && par->status[j] == JL_OK)
            par->status[j] = jl_imm_update_mode(imm, j, meas->z, scratch);
    if (par->active > 1) {
        status = exchange(par);
        if (status != JL_OK)
            return status;
    }
    status = first_failure(par);
    if (status == JL_OK)
        status = jl_imm_weigh(imm);
    if (status == JL_OK && par->config.pe == 0)
        jl_imm_combine(imm);
    return status;
}
