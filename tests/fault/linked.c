#include "linked.h"

#include <stdlib.h>
#include <string.h>

#define ACK_PART 4              /* an acknowledgement waits rto_us / 4      */
#define QUIET_PARTS 48          /* rto_us to repeat the last word in        */

struct end {
    jl_chan chan;               /* first: ops get a jl_chan and cast it     */
    linked *linked;
    struct peer *peer;
};

struct peer {
    jl_link link;
    unsigned char *mem;
    jl_chan *to;                /* of the carrier                           */
    int gone;                   /* its end of the carrier has closed        */
    struct end tx, rx;
};

struct linked {
    linked_config config;
    fault fault;
    struct peer *peers;         /* [nodes]; our own is not used             */
    jl_chan **open;             /* [nodes] the carrier's that may bring     */
    int *from;                  /* [nodes] something, and from whom         */
    int opens;
};

static jl_u32 now_of(const linked *l)
{
    return l->config.now(l->config.context);
}

/* --- the carrier --------------------------------------------------------- */

/* A full or a closed channel is a lost datagram. */
static void flush(linked *l)
{
    unsigned char datagram[JL_FRAME_MAX];
    jl_u32 now = now_of(l);
    int i, len;

    for (i = 0; i < l->config.nodes; i++)
        if (i != l->config.node)
            while ((len = jl_link_output(&l->peers[i].link, datagram,
                                         JL_FRAME_MAX, now)) > 0)
                fault_put(&l->fault, i, datagram, len, now);
    while ((len = fault_get(&l->fault, &i, datagram, now)) > 0)
        (void)jl_chan_send(l->peers[i].to, datagram, len, 0);
}

static void shut(linked *l, int which)
{
    l->peers[l->from[which]].gone = 1;
    l->opens--;
    l->open[which] = l->open[l->opens];
    l->from[which] = l->from[l->opens];
}

/* Take in what is there, after waiting for it up to us (-1: for ever).
 * Returns JL_OK or what the carrier says but JL_ETIMEOUT. */
static int take_in(linked *l, long us)
{
    unsigned char datagram[JL_FRAME_MAX];
    int i, len;

    while (l->opens > 0) {
        i = jl_chan_wait(l->open, l->opens, us);
        if (i < 0)
            return i == JL_ETIMEOUT ? JL_OK : i;
        len = jl_chan_recv(l->open[i], datagram, JL_FRAME_MAX, 0);
        if (len >= 0)
            (void)jl_link_input(&l->peers[l->from[i]].link, datagram, len,
                                now_of(l));
        else
            shut(l, i);
        us = 0;
    }
    return JL_OK;
}

/* -1 is never. */
static long sooner(long a, long b)
{
    return a < 0 || (b >= 0 && b < a) ? b : a;
}

/* Keep all links going until something comes, a timer runs out, or `timeout_us`
 * have passed since `since`.
 * Returns JL_OK: look again; JL_ETIMEOUT: look a last time; or an error. */
static int turn(linked *l, jl_u32 since, long timeout_us)
{
    jl_u32 now;
    long us;
    int i, status;

    flush(l);
    now = now_of(l);
    us = fault_timer(&l->fault, now);
    for (i = 0; i < l->config.nodes; i++)
        if (i != l->config.node)
            us = sooner(us, jl_link_timer(&l->peers[i].link, now));
    if (timeout_us != JL_FOREVER)
        us = sooner(us, now - since < (jl_u32)timeout_us
                    ? timeout_us - (long)(now - since) : 0);
    status = take_in(l, us);
    if (status != JL_OK)
        return status;
    if (timeout_us != JL_FOREVER && now_of(l) - since >= (jl_u32)timeout_us)
        return JL_ETIMEOUT;
    return l->opens > 0 ? JL_OK : JL_ECLOSED;
}

/* --- the operations of a channel ----------------------------------------- */

/* A peer that has gone will say no more. */
static int final(const struct peer *peer, int status)
{
    return status == JL_EAGAIN && peer->gone ? JL_ECLOSED : status;
}

static int linked_send(jl_chan *chan, const unsigned char *msg, int len,
                       long timeout_us)
{
    struct end *e = (struct end *)chan;
    jl_u32 since = now_of(e->linked);
    int status, turned = JL_OK;

    while ((status = final(e->peer, jl_link_send(&e->peer->link, msg, len)))
           == JL_EAGAIN) {
        if (turned != JL_OK)
            return turned;
        turned = turn(e->linked, since, timeout_us);
    }
    flush(e->linked);
    return status;
}

static int linked_recv(jl_chan *chan, unsigned char *msg, int cap,
                       long timeout_us)
{
    struct end *e = (struct end *)chan;
    jl_u32 since = now_of(e->linked);
    int status, turned = JL_OK;

    while ((status = final(e->peer, jl_link_recv(&e->peer->link, msg, cap)))
           == JL_EAGAIN) {
        if (turned != JL_OK)
            return turned;
        turned = turn(e->linked, since, timeout_us);
    }
    flush(e->linked);
    return status;
}

static int linked_wait(jl_chan *const *chans, int n, long timeout_us)
{
    linked *l = ((struct end *)chans[0])->linked;
    jl_u32 since = now_of(l);
    int i, turned = JL_OK;

    for (;;) {
        for (i = 0; i < n; i++) {
            struct peer *peer = ((struct end *)chans[i])->peer;

            if (final(peer, jl_link_peek(&peer->link)) != JL_EAGAIN)
                return i;
        }
        if (turned != JL_OK)
            return turned;
        turned = turn(l, since, timeout_us);
    }
}

static const jl_chan_ops linked_ops = {
    linked_send, linked_recv, linked_wait
};

/* --- open and close ------------------------------------------------------ */

static int peer_init(linked *l, int node)
{
    const linked_config *c = &l->config;
    struct peer *p = &l->peers[node];
    int slots = 2 * c->slots;   /* one half may be waiting to be acknowledged */
    int octets = JL_LINK_MEM(c->max_len, slots);
    jl_link_config link = { 0 };

    link.number = 8;
    link.from = c->node;
    link.to = node;
    link.session = (jl_u32)c->node + 1;
    link.max_len = c->max_len;
    link.slots = slots;
    link.rto_us = c->rto_us;
    link.ack_us = c->rto_us / ACK_PART;
    p->mem = malloc((size_t)octets);
    if (p->mem == NULL
        || jl_link_init(&p->link, &link, p->mem, octets, now_of(l)) != JL_OK)
        return 0;
    jl_chan_init(&p->tx.chan, &linked_ops, c->max_len, c->slots);
    jl_chan_init(&p->rx.chan, &linked_ops, c->max_len, c->slots);
    p->tx.linked = p->rx.linked = l;
    p->tx.peer = p->rx.peer = p;
    p->to = c->to[node];
    l->open[l->opens] = c->from[node];
    l->from[l->opens++] = node;
    return 1;
}

static void free_all(linked *l)
{
    int i;

    for (i = 0; l->peers != NULL && i < l->config.nodes; i++)
        free(l->peers[i].mem);
    free(l->peers);
    free(l->open);
    free(l->from);
    free(l);
}

linked *linked_open(const linked_config *config)
{
    size_t n = (size_t)config->nodes;
    linked *l = calloc(1, sizeof *l);
    int i, ok;

    if (l == NULL)
        return NULL;
    l->config = *config;
    fault_init(&l->fault, config->set, (unsigned)config->node + 1);
    l->peers = calloc(n, sizeof *l->peers);
    l->open = calloc(n, sizeof *l->open);
    l->from = calloc(n, sizeof *l->from);
    ok = l->peers != NULL && l->open != NULL && l->from != NULL;
    for (i = 0; ok && i < config->nodes; i++)
        ok = i == config->node || peer_init(l, i);
    if (ok)
        return l;
    free_all(l);
    return NULL;
}

/* Everybody who is there knows that we have closed. */
static int told(const linked *l)
{
    int i;

    for (i = 0; i < l->config.nodes; i++) {
        const struct peer *p = &l->peers[i];

        if (i != l->config.node && !p->gone
            && p->link.out_first != p->link.out_end)
            return 0;
    }
    return 1;
}

static int settled(const linked *l)
{
    int i;

    for (i = 0; i < l->config.nodes; i++) {
        const struct peer *p = &l->peers[i];
        const jl_link *link = &p->link;

        if (i != l->config.node && !p->gone && !jl_link_idle(link)
            && !(link->failed != JL_OK && link->ack_due == 0
                 && !link->ack_now))
            return 0;
    }
    return 1;
}

void linked_close(linked *l, long linger_us)
{
    jl_u32 since = now_of(l);
    int i;

    for (i = 0; i < l->config.nodes; i++)
        if (i != l->config.node)
            jl_link_close(&l->peers[i].link);
    flush(l);
    while (!settled(l) && turn(l, since, linger_us) == JL_OK)
        flush(l);
    since = now_of(l);
    while (!told(l)
           && turn(l, since, QUIET_PARTS * (long)l->config.rto_us) == JL_OK)
        ;
    flush(l);
    free_all(l);
}

jl_chan *linked_tx(linked *l, int node)
{
    return &l->peers[node].tx.chan;
}

jl_chan *linked_rx(linked *l, int node)
{
    return &l->peers[node].rx.chan;
}

const jl_link *linked_link(const linked *l, int node)
{
    return &l->peers[node].link;
}

jl_link_count linked_count(const linked *l)
{
    jl_link_count sum = { 0 };
    int i;

    for (i = 0; i < l->config.nodes; i++)
        jl_link_count_add(&sum, &l->peers[i].link.count);
    return sum;
}

const fault *linked_fault(const linked *l)
{
    return &l->fault;
}
