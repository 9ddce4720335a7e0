/* What all ports have in common: arguments checked once, and counters. */
#include "jumplink/chan.h"

void jl_chan_init(jl_chan *chan, const jl_chan_ops *ops, int max_len,
                  int slots)
{
    chan->ops = ops;
    chan->max_len = max_len;
    chan->slots = slots;
    chan->messages = 0;
    chan->octets = 0;
}

static int timeout_ok(long timeout_us)
{
    return timeout_us >= 0 || timeout_us == JL_FOREVER;
}

static void count(jl_chan *chan, int len)
{
    chan->messages++;
    chan->octets += (unsigned long)len;
}

int jl_chan_send(jl_chan *chan, const unsigned char *msg, int len,
                 long timeout_us)
{
    int status;

    if (len < 0 || !timeout_ok(timeout_us))
        return JL_ERANGE;
    if (len > chan->max_len)
        return JL_ETOOLONG;
    status = chan->ops->send(chan, msg, len, timeout_us);
    if (status == JL_OK)
        count(chan, len);
    return status;
}

int jl_chan_recv(jl_chan *chan, unsigned char *msg, int cap, long timeout_us)
{
    int len;

    if (cap < 0 || !timeout_ok(timeout_us))
        return JL_ERANGE;
    len = chan->ops->recv(chan, msg, cap, timeout_us);
    if (len >= 0)
        count(chan, len);
    return len;
}

int jl_chan_wait(jl_chan *const *chans, int n, long timeout_us)
{
    if (n < 1 || !timeout_ok(timeout_us))
        return JL_ERANGE;
    return chans[0]->ops->wait(chans, n, timeout_us);
}
