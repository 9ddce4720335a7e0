/* The folded MEKF's channels, and whose fault it is when one fails. */
#include "par/fold_parts.h"

static jl_chan *channel(const jl_fold *fold, int pe, int sending)
{
    const jl_fold_config *c = &fold->config;

    if (pe < c->pe)
        return sending ? c->to_prev : c->from_prev;
    return sending ? c->to_next : c->from_next;
}

int jli_fold_fault(jl_fold *fold, int pe, int status)
{
    fold->failed = status;
    fold->failed_pe = pe;
    return status;
}

static int is_told(jl_fold *fold, int len)
{
    int culprit, status;

    if (jli_msg_fault_read(&culprit, &status, fold->config.npe - 1,
                           JLI_IN(fold), len) != JL_OK)
        return 0;
    (void)jli_fold_fault(fold, culprit, status);
    return 1;
}

/* Who does not take a message may have said why. */
int jli_fold_send(jl_fold *fold, int pe, int len, long timeout_us)
{
    int status = jl_chan_send(channel(fold, pe, 1), JLI_OUT(fold), len,
                              timeout_us);

    if (status == JL_OK)
        return JL_OK;
    do
        len = jl_chan_recv(channel(fold, pe, 0), JLI_IN(fold), fold->cap / 2,
                           0);
    while (len >= 0 && !is_told(fold, len));
    return len >= 0 ? fold->failed : jli_fold_fault(fold, pe, status);
}

int jli_fold_recv(jl_fold *fold, int pe, long timeout_us, int level)
{
    int len = jl_chan_recv(channel(fold, pe, 0), JLI_IN(fold), fold->cap / 2,
                           jli_patience(timeout_us, level));

    if (len < 0)
        return jli_fold_fault(fold, pe, len);
    return is_told(fold, len) ? fold->failed : len;
}

/* As jli_par_tell_fault: a neighbour that is waiting to send must be heard
 * before it listens. */
static void tell(jl_fold *fold, int pe, int len)
{
    long timeout_us = fold->config.timeout_us == JL_FOREVER
        ? 0 : fold->config.timeout_us / 64;
    int tries = 4;

    if (pe < 0 || pe >= fold->config.npe || pe == fold->failed_pe)
        return;
    while (tries-- > 0
           && jl_chan_send(channel(fold, pe, 1), JLI_OUT(fold), len,
                           timeout_us) == JL_ETIMEOUT)
        (void)jl_chan_recv(channel(fold, pe, 0), JLI_IN(fold), fold->cap / 2,
                           0);
}

void jli_fold_tell_fault(jl_fold *fold)
{
    int len = jli_msg_plain(JLI_OUT(fold), JLI_FAULT, fold->failed_pe,
                            -fold->failed, 0);

    tell(fold, fold->config.pe + 1, len);
    tell(fold, fold->config.pe - 1, len);
}
