/* A channel without slots: sender and receiver meet, and the later of them
 * copies the message from the sender's buffer to the receiver's.
 *
 *     FREE -> OFFERED -> TAKING -> FREE           the receiver came later
 *     FREE -> WANTED -> GIVING -> GIVEN -> FREE   the sender came later
 *
 * OFFERED and WANTED can be taken back: to FREE.  TAKING and GIVING belong to
 * the one who copies, and go back to OFFERED if the message is too long for the
 * receiver's buffer; GIVEN belongs to the receiver. */
#include "threads_parts.h"

#include <string.h>

enum { FREE, OFFERED, TAKING, WANTED, GIVING, GIVEN };

static int state_of(struct end *end)
{
    return atomic_load(&end->ring->meeting);
}

static int move(struct ring *r, int from, int to)
{
    return atomic_compare_exchange_strong(&r->meeting, &from, to);
}

/* Leave a state that is ours, which the other may wait for. */
static void leave(struct ring *r, int to, struct end *other)
{
    atomic_store(&r->meeting, to);
    jli_wake(other);
}

/* Nobody copies. */
static int settled(struct end *end)
{
    int state = state_of(end);

    return state != TAKING && state != GIVING;
}

/* The receiver has what was offered or given before, and may want more. */
static int was_had(struct end *tx)
{
    int state = state_of(tx);

    return state == FREE || state == WANTED;
}

/* ... or has gone. */
static int answered(struct end *tx)
{
    return was_had(tx) || jli_closed(&tx->ring->rx);
}

/* The sender has come, or has gone. */
static int met(struct end *rx)
{
    int state = state_of(rx);

    return state == OFFERED || state == GIVEN || jli_closed(&rx->ring->tx);
}

static void copy(unsigned char *to, const unsigned char *from, int len)
{
    if (len > 0)
        memcpy(to, from, (size_t)len);
}

/* --- send ---------------------------------------------------------------- */

/* Returns 1 if the message was taken before we could take it back.  Not while
 * it is TAKING: that may end as OFFERED. */
static int was_taken(struct end *tx)
{
    jl_chan *chan = &tx->chan;

    while (!move(tx->ring, OFFERED, FREE)) {
        if (was_had(tx))
            return 1;
        (void)jli_await(&chan, 1, settled, NEVER);
    }
    return 0;
}

/* In state GIVING.  Returns 1 if that was it, and *status is send's. */
static int give(struct ring *r, long timeout_us, int *status)
{
    int fits = r->len <= r->cap;

    if (!fits && timeout_us != 0) {
        leave(r, OFFERED, &r->rx);
        return 0;
    }
    if (fits)
        copy(r->buf, r->msg, r->len);
    r->given = fits ? r->len : JL_ETOOLONG;
    *status = fits ? JL_OK : JL_ETIMEOUT;
    leave(r, GIVEN, &r->rx);
    return 1;
}

static int meet_send(jl_chan *chan, const unsigned char *msg, int len,
                     long timeout_us)
{
    struct end *tx = jli_end(chan);
    struct ring *r = tx->ring;
    tick deadline = timeout_us == 0 ? 0 : jli_deadline(timeout_us);
    int status;

    r->msg = msg;
    r->len = len;
    for (;;) {
        if (jli_closed(&r->rx))
            return JL_ECLOSED;
        if (move(r, WANTED, GIVING)) {
            if (give(r, timeout_us, &status))
                return status;
            break;
        }
        if (timeout_us == 0)
            return JL_ETIMEOUT;
        if (move(r, FREE, OFFERED)) {
            jli_wake(&r->rx);
            break;
        }
        if (jli_await(&chan, 1, answered, deadline) < 0)
            return JL_ETIMEOUT;
    }
    status = jli_await(&chan, 1, answered, deadline);
    if (was_taken(tx))
        return JL_OK;
    return status < 0 ? JL_ETIMEOUT : JL_ECLOSED;
}

/* --- recv ---------------------------------------------------------------- */

/* In state TAKING. */
static int take(struct ring *r, unsigned char *msg, int cap)
{
    int len = r->len;

    if (len > cap) {
        leave(r, OFFERED, &r->tx);
        return JL_ETOOLONG;
    }
    copy(msg, r->msg, len);
    leave(r, FREE, &r->tx);
    return len;
}

/* Returns 1 if the sender gave something before we could go back to FREE. */
static int was_given(struct end *rx)
{
    jl_chan *chan = &rx->chan;

    if (move(rx->ring, WANTED, FREE))
        return 0;
    if (!settled(rx))
        (void)jli_await(&chan, 1, settled, NEVER);
    return state_of(rx) == GIVEN;
}

static int meet_recv(jl_chan *chan, unsigned char *msg, int cap,
                     long timeout_us)
{
    struct end *rx = jli_end(chan);
    struct ring *r = rx->ring;
    tick deadline = timeout_us == 0 ? 0 : jli_deadline(timeout_us);
    int late = timeout_us == 0;

    r->buf = msg;
    r->cap = cap;
    for (;;) {
        if (move(r, OFFERED, TAKING))
            return take(r, msg, cap);
        if (jli_closed(&r->tx))
            return JL_ECLOSED;
        if (late)
            return JL_ETIMEOUT;
        if (!move(r, FREE, WANTED))
            continue;
        late = jli_await(&chan, 1, met, deadline) < 0;
        if (was_given(rx)) {
            int given = r->given;

            leave(r, FREE, &r->tx);
            return given;
        }
    }
}

/* --- wait ---------------------------------------------------------------- */

static int offered(struct end *rx)
{
    return state_of(rx) == OFFERED || jli_closed(&rx->ring->tx);
}

static int meet_wait(jl_chan *const *chans, int n, long timeout_us)
{
    return jli_wait(chans, n, offered, timeout_us);
}

const jl_chan_ops jli_meet_ops = { meet_send, meet_recv, meet_wait };
