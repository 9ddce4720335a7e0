/* A channel with slots: a ring of places, each [length, message].  Its two
 * counts go round 2^32; each end writes its own, and looks at the other's only
 * when what it saw of it before does not let it go on. */
#include "threads_parts.h"

#include <string.h>

static unsigned own_count(const struct end *end)
{
    return atomic_load_explicit(&end->count, memory_order_relaxed);
}

static int has_room(struct end *tx)
{
    const struct ring *r = tx->ring;

    if (own_count(tx) - tx->seen < r->places)
        return 1;
    tx->seen = atomic_load(&r->rx.count);
    return own_count(tx) - tx->seen < r->places;
}

static int has_message(struct end *rx)
{
    if (own_count(rx) != rx->seen)
        return 1;
    rx->seen = atomic_load(&rx->ring->tx.count);
    return own_count(rx) != rx->seen;
}

static int sendable(struct end *tx)
{
    return has_room(tx) || jli_closed(&tx->ring->rx);
}

static int receivable(struct end *rx)
{
    return has_message(rx) || jli_closed(&rx->ring->tx);
}

/* The place of this end's next message. */
static unsigned char *place(const struct end *end)
{
    return end->ring->data + end->place * end->ring->stride;
}

static void go_on(struct end *end, struct end *other)
{
    end->place = end->place + 1 < end->ring->places ? end->place + 1 : 0;
    atomic_store(&end->count, own_count(end) + 1);
    jli_wake(other);
}

static int ring_send(jl_chan *chan, const unsigned char *msg, int len,
                     long timeout_us)
{
    struct end *tx = jli_end(chan), *rx = &tx->ring->rx;

    if (!has_room(tx) && timeout_us != 0)
        (void)jli_await(&chan, 1, sendable, jli_deadline(timeout_us));
    if (jli_closed(rx))
        return JL_ECLOSED;
    if (!has_room(tx))
        return JL_ETIMEOUT;
    memcpy(place(tx), &len, sizeof len);
    if (len > 0)
        memcpy(place(tx) + sizeof len, msg, (size_t)len);
    go_on(tx, rx);
    return JL_OK;
}

static int ring_recv(jl_chan *chan, unsigned char *msg, int cap,
                     long timeout_us)
{
    struct end *rx = jli_end(chan), *tx = &rx->ring->tx;
    int len;

    if (!receivable(rx)
        && (timeout_us == 0
            || jli_await(&chan, 1, receivable, jli_deadline(timeout_us)) < 0))
        return JL_ETIMEOUT;
    if (!has_message(rx))       /* looked at after it was seen to be closed */
        return JL_ECLOSED;
    memcpy(&len, place(rx), sizeof len);
    if (len > cap)
        return JL_ETOOLONG;
    if (len > 0)
        memcpy(msg, place(rx) + sizeof len, (size_t)len);
    go_on(rx, tx);
    return len;
}

static int ring_wait(jl_chan *const *chans, int n, long timeout_us)
{
    return jli_wait(chans, n, receivable, timeout_us);
}

const jl_chan_ops jli_ring_ops = { ring_send, ring_recv, ring_wait };
