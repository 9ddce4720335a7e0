/* Messages with a deadline, and whose fault it is when one does not come. */
#include "par/par_parts.h"

static jl_chan *channel(const jl_par *par, int pe, int sending)
{
    const jl_par_config *c = &par->config;

    if (pe == c->npe)
        return sending ? c->to_host : c->from_host;
    return sending ? c->to[pe] : c->from[pe];
}

int jli_par_fault(jl_par *par, int pe, int status)
{
    par->failed = status;
    par->failed_pe = pe;
    return status;
}

/* Of all messages that do not come, the first that could have come is the one
 * whose sender is to blame.  Its receiver must have the time to say so before
 * those who wait for later ones lose patience. */
long jli_patience(long timeout_us, int level)
{
    long more = timeout_us / 8;

    if (timeout_us == JL_FOREVER)
        return JL_FOREVER;
    return level > 0 && more > (LONG_MAX - timeout_us) / level
        ? LONG_MAX : timeout_us + more * level;
}

/* 1, and it is noted, if what came from a neighbour [len] tells of a failure
 * elsewhere. */
static int is_told(jl_par *par, int pe, int len)
{
    int culprit, status;

    if (pe == par->config.npe
        || jli_msg_fault_read(&culprit, &status, par->config.npe, JLI_IN(par),
                              len) != JL_OK)
        return 0;
    (void)jli_par_fault(par, culprit, status);
    return 1;
}

/* Who does not take a message may have said why. */
int jli_par_send(jl_par *par, int pe, const unsigned char *msg, int len,
                 long timeout_us, int level)
{
    int status = jl_chan_send(channel(par, pe, 1), msg, len,
                              jli_patience(timeout_us, level));

    if (status == JL_OK)
        return JL_OK;
    do
        len = jl_chan_recv(channel(par, pe, 0), JLI_IN(par), par->cap / 2, 0);
    while (len >= 0 && !is_told(par, pe, len));
    return len >= 0 ? par->failed : jli_par_fault(par, pe, status);
}

int jli_par_recv(jl_par *par, int pe, long timeout_us, int level)
{
    int len = jl_chan_recv(channel(par, pe, 0), JLI_IN(par), par->cap / 2,
                           jli_patience(timeout_us, level));

    if (len < 0)
        return jli_par_fault(par, pe, len);
    return is_told(par, pe, len) ? par->failed : len;
}

static int is_neighbour(const jl_par_config *config, int pe)
{
    if (pe == config->npe)
        return config->pe == 0;
    return pe != config->pe && jl_topo_relays(config->topology, config->npe,
                                              config->pe, pe) == 0;
}

/* A neighbour may be waiting to send: what it has is of no use any more, but
 * must be taken before it listens: a few tries, none long. */
void jli_par_tell_fault(jl_par *par)
{
    const jl_par_config *config = &par->config;
    unsigned char told[JL_MAX_PES + 1] = { 0 };
    int pe, tries, status, len = jli_msg_plain(JLI_OUT(par), JLI_FAULT,
                                               par->failed_pe, -par->failed,
                                               0);
    long timeout_us = config->timeout_us == JL_FOREVER
        ? 0 : config->timeout_us / 64;

    told[par->failed_pe] = 1;
    for (tries = 0; tries < config->npe + 2; tries++)
        for (pe = 0; pe <= config->npe; pe++)
            if (!told[pe] && is_neighbour(config, pe)) {
                status = jl_chan_send(channel(par, pe, 1), JLI_OUT(par), len,
                                      timeout_us);
                told[pe] = status != JL_ETIMEOUT;
                if (!told[pe])
                    (void)jl_chan_recv(channel(par, pe, 0), JLI_IN(par),
                                       par->cap / 2, 0);
            }
}
