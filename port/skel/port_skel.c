#include "port_skel.h"

#include <limits.h>
#include <string.h>

#define HANDLE_MAX 64           /* datagrams taken in before links answer   */

static jl_u32 now(const jl_skel *s)
{
    return s->config.carrier.now(s->config.carrier.context)
        & (jl_u32)0xffffffffUL;
}

/* --- what goes out ------------------------------------------------------ */

static int note(jl_skel *s, int status)
{
    if (status < 0 && s->failed == JL_OK)
        s->failed = status;
    return s->failed;
}

/* Send all that is due. */
static void flush(jl_skel *s)
{
    const jl_skel_carrier *carrier = &s->config.carrier;
    unsigned char datagram[JL_FRAME_MAX];
    jl_u32 time = now(s);
    int i, len;

    for (i = 0; i < s->config.nodes; i++) {
        if (i == s->config.node)
            continue;
        while (s->failed == JL_OK
               && (len = jl_link_output(&s->peers[i].link, datagram,
                                        sizeof datagram, time)) > 0)
            note(s, carrier->put(carrier->context, i, datagram, len));
    }
}

/* The shorter of us and the time until a link wants to send by time alone;
 * negative ones have no end. */
static long until_timer(const jl_skel *s, long us)
{
    jl_u32 time = now(s);
    int i;

    for (i = 0; i < s->config.nodes; i++) {
        long t = i == s->config.node
            ? -1 : jl_link_timer(&s->peers[i].link, time);

        if (t >= 0 && (us < 0 || t < us))
            us = t;
    }
    return us;
}

/* --- what comes in ------------------------------------------------------ */

/* Who says to have sent it; the link looks at all the rest. */
static void take(jl_skel *s, const unsigned char *datagram, int len)
{
    int from = len > JL_FRAME_FROM ? datagram[JL_FRAME_FROM] : s->config.nodes;

    if (from == s->config.node || from >= s->config.nodes)
        s->strays++;
    else
        jl_link_input(&s->peers[from].link, datagram, len, now(s));
}

/* Wait up to wait_us for a datagram, take in what is there, and only then
 * judge who is silent. */
static void take_in(jl_skel *s, long wait_us)
{
    const jl_skel_carrier *carrier = &s->config.carrier;
    unsigned char datagram[JL_FRAME_MAX];
    int i, n, len;

    for (n = 0; n < HANDLE_MAX && s->failed == JL_OK; n++) {
        len = carrier->get(carrier->context, datagram, sizeof datagram,
                           n == 0 ? wait_us : 0);
        if (len > 0)
            take(s, datagram, len);
        else if (note(s, len) == JL_OK)
            break;
    }
    for (i = 0; i < s->config.nodes && n < HANDLE_MAX; i++)
        if (i != s->config.node)
            jl_link_judge(&s->peers[i].link, now(s));
}

/* --- a call that blocks ------------------------------------------------- */

/* What is left of a timeout; the clock may wrap many times before it ends. */
struct patience {
    jl_u32 at;
    long left_us;               /* JL_FOREVER stays                         */
};

static struct patience patience(const jl_skel *s, long timeout_us)
{
    struct patience p;

    p.at = now(s);
    p.left_us = timeout_us;
    return p;
}

static void pass(struct patience *p, jl_u32 time)
{
    jl_u32 passed = (time - p->at) & (jl_u32)0xffffffffUL;

    p->at = time;
    if (p->left_us > 0)
        p->left_us = passed < (unsigned long)p->left_us
            ? p->left_us - (long)passed : 0;
}

/* Keep all links going, and block until a datagram comes, a link's timer or
 * the end of patience.
 * Returns JL_OK: look again; JL_ETIMEOUT: look a last time; JL_EIO. */
static int turn(jl_skel *s, struct patience *p)
{
    flush(s);
    take_in(s, until_timer(s, p->left_us));
    flush(s);
    pass(p, now(s));
    if (s->failed != JL_OK)
        return s->failed;
    return p->left_us == 0 ? JL_ETIMEOUT : JL_OK;
}

/* --- the operations of a channel ---------------------------------------- */

static int skel_send(jl_chan *chan, const unsigned char *msg, int len,
                     long timeout_us)
{
    jl_skel_end *e = (jl_skel_end *)chan;
    struct patience p = patience(e->skel, timeout_us);
    int status, turned = JL_OK;

    while ((status = jl_link_send(e->link, msg, len)) == JL_EAGAIN) {
        if (turned != JL_OK)
            return turned;
        turned = turn(e->skel, &p);
    }
    flush(e->skel);
    return e->skel->failed != JL_OK ? e->skel->failed : status;
}

static int skel_recv(jl_chan *chan, unsigned char *msg, int cap,
                     long timeout_us)
{
    jl_skel_end *e = (jl_skel_end *)chan;
    struct patience p = patience(e->skel, timeout_us);
    int status, turned = JL_OK;

    while ((status = jl_link_recv(e->link, msg, cap)) == JL_EAGAIN) {
        if (turned != JL_OK)
            return turned;
        turned = turn(e->skel, &p);
    }
    flush(e->skel);             /* there may be room again: say so */
    return status;
}

static int skel_wait(jl_chan *const *chans, int n, long timeout_us)
{
    jl_skel *s = ((jl_skel_end *)chans[0])->skel;
    struct patience p = patience(s, timeout_us);
    int i, turned = JL_OK;

    for (;;) {
        for (i = 0; i < n; i++)
            if (jl_link_peek(((jl_skel_end *)chans[i])->link) != JL_EAGAIN)
                return i;
        if (turned != JL_OK)
            return turned;
        turned = turn(s, &p);
    }
}

static const jl_chan_ops skel_ops = { skel_send, skel_recv, skel_wait };

/* --- init and close ----------------------------------------------------- */

static int config_is_good(const jl_skel_config *c)
{
    return c->nodes >= 1 && c->nodes <= JL_SKEL_NODES && c->node >= 0
        && c->node < c->nodes && c->max_len >= 0 && c->slots >= 1
        && JL_LINK_PIECES(c->max_len)
               <= INT_MAX / 4 / JL_SKEL_NODES / JL_LINK_PIECE / c->slots;
}

static int peer_init(jl_skel *s, int node, unsigned char *mem, int cap)
{
    const jl_skel_config *c = &s->config;
    jl_skel_peer *p = &s->peers[node];
    jl_link_config link;

    memset(&link, 0, sizeof link);
    link.number = c->number;
    link.from = c->node;
    link.to = node;
    link.session = c->session;
    link.max_len = c->max_len;
    link.slots = 2 * c->slots;
    link.rto_us = c->rto_us;
    link.ack_us = c->ack_us;
    link.beat_us = c->beat_us;
    link.silence_us = c->silence_us;
    jl_chan_init(&p->tx.chan, &skel_ops, c->max_len, c->slots);
    jl_chan_init(&p->rx.chan, &skel_ops, c->max_len, c->slots);
    p->tx.skel = p->rx.skel = s;
    p->tx.link = p->rx.link = &p->link;
    return jl_link_init(&p->link, &link, mem, cap, now(s));
}

int jl_skel_init(jl_skel *skel, const jl_skel_config *config,
                 unsigned char *mem, int cap)
{
    int i, octets, status = JL_OK;

    if (!config_is_good(config))
        return JL_EDIM;
    if (cap < JL_SKEL_MEM(config->nodes, config->max_len, config->slots))
        return JL_ENOMEM;
    memset(skel, 0, sizeof *skel);
    skel->config = *config;
    octets = JL_LINK_MEM(config->max_len, 2 * config->slots);
    for (i = 0; i < config->nodes && status == JL_OK; i++)
        if (i != config->node) {
            status = peer_init(skel, i, mem, octets);
            mem += octets;
        }
    return status;
}

static jl_skel_peer *peer_at(jl_skel *skel, int node)
{
    if (node < 0 || node >= skel->config.nodes || node == skel->config.node)
        return NULL;
    return &skel->peers[node];
}

jl_chan *jl_skel_tx(jl_skel *skel, int node)
{
    jl_skel_peer *p = peer_at(skel, node);

    return p == NULL ? NULL : &p->tx.chan;
}

jl_chan *jl_skel_rx(jl_skel *skel, int node)
{
    jl_skel_peer *p = peer_at(skel, node);

    return p == NULL ? NULL : &p->rx.chan;
}

int jl_skel_poll(jl_skel *skel)
{
    struct patience none = patience(skel, 0);
    int status = turn(skel, &none);

    return status == JL_ETIMEOUT ? JL_OK : status;
}

/* Every link has nothing left to wait for. */
static int settled(const jl_skel *s)
{
    int i;

    for (i = 0; i < s->config.nodes; i++)
        if (i != s->config.node && !jl_link_idle(&s->peers[i].link)
            && s->peers[i].link.failed == JL_OK)
            return 0;
    return 1;
}

int jl_skel_close(jl_skel *skel, long linger_us)
{
    struct patience p = patience(skel, linger_us);
    int i, all;

    for (i = 0; i < skel->config.nodes; i++)
        if (i != skel->config.node)
            jl_link_close(&skel->peers[i].link);
    while (!settled(skel) && turn(skel, &p) == JL_OK)
        ;
    all = settled(skel);
    p = patience(skel, 3 * (long)skel->config.rto_us);
    while (turn(skel, &p) == JL_OK)
        ;
    if (skel->failed != JL_OK)
        return skel->failed;
    return all ? JL_OK : JL_ETIMEOUT;
}

/* --- the carrier of this machine ---------------------------------------- */

static int machine_put(void *context, int to, const unsigned char *datagram,
                       int len)
{
    /* Here: copy the datagram to the driver's queue, or to the transmit buffer
     * of the UART or radio that leads to `to`, and start it.  If the queue is
     * full, drop the datagram and return JL_OK: it is sent again. */
    (void)context;
    (void)to;
    (void)datagram;
    (void)len;
    return JL_EIO;
}

static int machine_get(void *context, unsigned char *datagram, int cap,
                       long wait_us)
{
    /* Here: copy the oldest datagram from the driver's queue and return its
     * length.  If there is none, sleep (wait for an interrupt, poll a file)
     * until one comes or wait_us has passed, and return 0 then.  One longer
     * than cap is none of ours: drop it. */
    (void)context;
    (void)datagram;
    (void)cap;
    (void)wait_us;
    return JL_EIO;
}

static jl_u32 machine_now(void *context)
{
    /* Here: read a timer that is never set back.  It may wrap at 2^32 us, but
     * not earlier: extend a shorter one by counting its overflows. */
    (void)context;
    return 0;
}

const jl_skel_carrier jl_skel_machine = {
    machine_put, machine_get, machine_now, NULL
};
