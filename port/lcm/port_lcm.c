#include "port_lcm.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

#include <lcm/lcm.h>

#define QUIET_PARTS 48          /* repeats come after 1, 3, 7, 15, 31, 47   */
#define HANDLE_MAX 64           /* messages between two looks at the clock  */
#define RUN_MAX 16
#define NODES_MAX 256
#define NEVER LLONG_MAX

/* "JL." run "." node and its 0; LCM's own header before it has 8 octets.  A
 * message longer than 1400 in all would be cut up by networks, and a lossy one
 * then stops receiving: the kernel waits for too many missing pieces. */
#define CHANNEL_MAX (3 + RUN_MAX + 1 + 3 + 1)
JL_STATIC_ASSERT(8 + CHANNEL_MAX + JL_FRAME_MAX < 1400, frame_fits_a_datagram);

struct end {
    jl_chan chan;               /* first: ops get a jl_chan and cast it     */
    jl_lcm *lcm;
    jl_link *link;
};

struct peer {
    jl_link link;
    unsigned char *mem;
    char channel[CHANNEL_MAX];
    struct end tx, rx;
};

struct jl_lcm {
    lcm_t *lcm;
    struct pollfd readable;
    int node, nodes;
    struct peer *peers;         /* [nodes]; our own is not used             */
    jl_u32 rto_us;
    const jl_lcm_carrier *carrier;
    unsigned long strays;       /* messages that belong to no link          */
};

static long long clock_us(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000LL + t.tv_nsec / 1000;
}

/* A link's time is modulo 2^32. */
static jl_u32 link_time(long long now)
{
    return (jl_u32)(now & 0xffffffffLL);
}

/* --- what goes out ------------------------------------------------------ */

/* A publish that fails is a lost datagram. */
static void publish(jl_lcm *l, int to, const unsigned char *datagram, int len)
{
    lcm_publish(l->lcm, l->peers[to].channel, datagram, (unsigned)len);
}

/* Send all that is due. */
static void flush(jl_lcm *l)
{
    const jl_lcm_carrier *carrier = l->carrier;
    unsigned char datagram[JL_FRAME_MAX];
    jl_u32 now = link_time(clock_us());
    int i, len;

    for (i = 0; i < l->nodes; i++) {
        if (i == l->node)
            continue;
        while ((len = jl_link_output(&l->peers[i].link, datagram,
                                     sizeof datagram, now)) > 0)
            if (carrier == NULL)
                publish(l, i, datagram, len);
            else
                carrier->put(carrier->context, i, datagram, len, now);
    }
    while (carrier != NULL
           && (len = carrier->get(carrier->context, &i, datagram, now)) > 0)
        publish(l, i, datagram, len);
}

/* Microseconds until there is something to do by time alone; -1: never. */
static long next_timer(const jl_lcm *l, long long now)
{
    long next = l->carrier == NULL
        ? -1 : l->carrier->timer(l->carrier->context, link_time(now));
    int i;

    for (i = 0; i < l->nodes; i++) {
        long t = i == l->node
            ? -1 : jl_link_timer(&l->peers[i].link, link_time(now));

        if (t >= 0 && (next < 0 || t < next))
            next = t;
    }
    return next;
}

/* --- what comes in ------------------------------------------------------ */

/* Anybody may send to a multicast address.  The link looks at all of the
 * frame; here, only at who says to have sent it (WIRE.md). */
static void on_message(const lcm_recv_buf_t *buf, const char *channel,
                       void *context)
{
    jl_lcm *l = context;
    const unsigned char *frame = buf->data;
    int from;

    (void)channel;
    from = buf->data_size > JL_FRAME_FROM ? frame[JL_FRAME_FROM] : l->nodes;
    if (from == l->node || from >= l->nodes || buf->data_size > JL_FRAME_MAX)
        l->strays++;
    else
        jl_link_input(&l->peers[from].link, frame, (int)buf->data_size,
                      link_time(clock_us()));
}

/* Wait up to us (-1: for ever) for a message; 1: there is one. */
static int await_message(jl_lcm *l, long us)
{
    struct timespec t;

    t.tv_sec = us / 1000000;
    t.tv_nsec = us % 1000000 * 1000;
    return ppoll(&l->readable, 1, us < 0 ? NULL : &t, NULL) > 0;
}

/* Returns how many messages were there, or JL_EIO. */
static int take_in(jl_lcm *l)
{
    int n;

    for (n = 0; n < HANDLE_MAX && await_message(l, 0); n++)
        if (lcm_handle(l->lcm) != 0)
            return JL_EIO;
    return n;
}

/* Take in, and only then judge who is silent.  LCM's thread may still be about
 * to hand over what came while we were stopped: the link allows for that. */
static int listen_in(jl_lcm *l)
{
    int n = take_in(l), i;
    jl_u32 now = link_time(clock_us());

    for (i = 0; i < l->nodes && n >= 0 && n < HANDLE_MAX; i++)
        if (i != l->node)
            jl_link_judge(&l->peers[i].link, now);
    return n;
}

/* Keep all links going, and if nothing has come in, block until something
 * does, a link's timer, or the deadline.
 * There is no spinning: it takes the core from LCM's reader thread, and made a
 * round trip of 64 octets 85 us instead of 55 (2 nodes, 2 cores).
 * Returns JL_OK: look again; JL_ETIMEOUT: look a last time; JL_EIO. */
static int turn(jl_lcm *l, long long deadline)
{
    long long now;
    int n;

    flush(l);
    n = listen_in(l);
    now = clock_us();
    if (n == 0 && now < deadline) {
        long us = next_timer(l, now);

        if (deadline != NEVER && (us < 0 || deadline - now < us))
            us = (long)(deadline - now);
        await_message(l, us);
        n = listen_in(l);
    }
    if (n < 0)
        return JL_EIO;
    return now < deadline ? JL_OK : JL_ETIMEOUT;
}

/* --- the operations of a channel ---------------------------------------- */

static long long deadline_of(long timeout_us)
{
    long long now = clock_us();

    return timeout_us == JL_FOREVER || timeout_us > NEVER - now
        ? NEVER : now + timeout_us;
}

static int lcm_chan_send(jl_chan *chan, const unsigned char *msg, int len,
                         long timeout_us)
{
    struct end *e = (struct end *)chan;
    long long deadline = deadline_of(timeout_us);
    int status, turned = JL_OK;

    while ((status = jl_link_send(e->link, msg, len)) == JL_EAGAIN) {
        if (turned != JL_OK)
            return turned;
        turned = turn(e->lcm, deadline);
    }
    flush(e->lcm);
    return status;
}

static int lcm_chan_recv(jl_chan *chan, unsigned char *msg, int cap,
                         long timeout_us)
{
    struct end *e = (struct end *)chan;
    long long deadline = deadline_of(timeout_us);
    int status, turned = JL_OK;

    while ((status = jl_link_recv(e->link, msg, cap)) == JL_EAGAIN) {
        if (turned != JL_OK)
            return turned;
        turned = turn(e->lcm, deadline);
    }
    flush(e->lcm);
    return status;
}

static int lcm_chan_wait(jl_chan *const *chans, int n, long timeout_us)
{
    jl_lcm *l = ((struct end *)chans[0])->lcm;
    long long deadline = deadline_of(timeout_us);
    int i, turned = JL_OK;

    for (;;) {
        for (i = 0; i < n; i++)
            if (jl_link_peek(((struct end *)chans[i])->link) != JL_EAGAIN)
                return i;
        if (turned != JL_OK)
            return turned;
        turned = turn(l, deadline);
    }
}

static const jl_chan_ops lcm_ops = {
    lcm_chan_send, lcm_chan_recv, lcm_chan_wait
};

/* --- open and close ----------------------------------------------------- */

static int run_ok(const char *run)
{
    size_t i, n = strlen(run);

    for (i = 0; i < n; i++)
        if (!isalnum((unsigned char)run[i]) && run[i] != '_')
            return 0;
    return n >= 1 && n <= RUN_MAX;
}

static const char *wrong_with(const jl_lcm_config *c)
{
    if (c->url == NULL || strncmp(c->url, "udpm://", 7) != 0)
        return "bad LCM address: udpm://ADDRESS:PORT?ttl=N";
    if (c->run == NULL || !run_ok(c->run))
        return "bad name of the run: 1 to 16 letters, digits or _";
    if (c->nodes < 1 || c->nodes > NODES_MAX || c->node < 0
        || c->node >= c->nodes)
        return "node out of range";
    if (c->max_len < 0 || c->slots < 1
        || JL_LINK_PIECES(c->max_len)
               > INT_MAX / 4 / JL_LINK_PIECE / c->slots)
        return "length or number of messages out of range";
    if (c->rto_us > JL_LINK_MAX_US || c->beat_us > JL_LINK_MAX_US
        || c->silence_us > JL_LINK_MAX_US)
        return "time out of range: at most 67 s";
    return NULL;
}

/* New for every start, so that nothing from an earlier run is taken. */
static jl_u32 new_session(void)
{
    jl_u32 session = 0;

    while (session == 0)
        if (getrandom(&session, sizeof session, 0) != sizeof session
            && errno != EINTR)
            session = link_time(clock_us()) ^ (jl_u32)getpid();
    return session;
}

static void channel_name(char *name, const char *run, int node)
{
    snprintf(name, CHANNEL_MAX, "JL.%.*s.%u", RUN_MAX, run,
             (unsigned)node & 0xff);
}

static int peer_init(jl_lcm *l, int node, const jl_lcm_config *c,
                     jl_u32 session)
{
    struct peer *p = &l->peers[node];
    int slots = 2 * c->slots;
    int octets = JL_LINK_MEM(c->max_len, slots);
    jl_link_config link;

    /* Twice the slots promised: a link acknowledges at half a window, and what
     * was received but not acknowledged yet still fills the sender's. */
    link.number = c->number;
    link.from = c->node;
    link.to = node;
    link.session = session;
    link.max_len = c->max_len;
    link.slots = slots;
    link.rto_us = l->rto_us;
    link.ack_us = l->rto_us / 8 * 5;
    link.beat_us = c->beat_us;
    link.silence_us = c->silence_us;
    p->mem = malloc((size_t)octets);
    if (p->mem == NULL
        || jl_link_init(&p->link, &link, p->mem, octets,
                        link_time(clock_us())) != JL_OK)
        return 0;
    channel_name(p->channel, c->run, node);
    jl_chan_init(&p->tx.chan, &lcm_ops, c->max_len, c->slots);
    jl_chan_init(&p->rx.chan, &lcm_ops, c->max_len, c->slots);
    p->tx.lcm = p->rx.lcm = l;
    p->tx.link = p->rx.link = &p->link;
    return 1;
}

static const char *subscribe(jl_lcm *l, const jl_lcm_config *c)
{
    char url[256], name[CHANNEL_MAX];
    const char *more = "recv_buf_size=4194304";
    lcm_subscription_t *sub;
    int len;

    if (strstr(c->url, "recv_buf_size=") != NULL)
        len = snprintf(url, sizeof url, "%s", c->url);
    else
        len = snprintf(url, sizeof url, "%s%c%s", c->url,
                       strchr(c->url, '?') ? '&' : '?', more);
    if (len < 0 || len >= (int)sizeof url)
        return "bad LCM address: too long";
    l->lcm = lcm_create(url);
    if (l->lcm == NULL)
        return "no multicast route (ip route add 224.0.0.0/4 dev lo), "
               "or a bad LCM address";
    channel_name(name, c->run, c->node);
    sub = lcm_subscribe(l->lcm, name, on_message, l);
    if (sub == NULL)
        return "LCM does not hear itself: does a firewall drop multicast?";
    lcm_subscription_set_queue_capacity(sub, 0);
    l->readable.fd = lcm_get_fileno(l->lcm);
    l->readable.events = POLLIN;
    return NULL;
}

/* LCM explains its failures at length on stderr; we return a reason. */
static const char *subscribe_quietly(jl_lcm *l, const jl_lcm_config *c)
{
    int saved = dup(STDERR_FILENO);
    int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
    const char *why;

    fflush(stderr);
    if (saved >= 0 && null >= 0)
        dup2(null, STDERR_FILENO);
    why = subscribe(l, c);
    fflush(stderr);
    if (saved >= 0) {
        dup2(saved, STDERR_FILENO);
        close(saved);
    }
    if (null >= 0)
        close(null);
    return why;
}

static void free_all(jl_lcm *l)
{
    int i;

    if (l->lcm != NULL)
        lcm_destroy(l->lcm);
    for (i = 0; l->peers != NULL && i < l->nodes; i++)
        free(l->peers[i].mem);
    free(l->peers);
    free(l);
}

static const char *join(jl_lcm *l, const jl_lcm_config *c)
{
    jl_u32 session = new_session();
    int i;

    l->node = c->node;
    l->nodes = c->nodes;
    l->rto_us = c->rto_us != 0 ? c->rto_us : JL_LCM_RTO;
    l->carrier = c->carrier;
    l->peers = calloc((size_t)c->nodes, sizeof *l->peers);
    if (l->peers == NULL)
        return "no memory";
    for (i = 0; i < c->nodes; i++)
        if (i != c->node && !peer_init(l, i, c, session))
            return "no memory, or the type of number is neither 8 nor 4";
    return subscribe_quietly(l, c);
}

jl_lcm *jl_lcm_open(const jl_lcm_config *config, const char **why)
{
    jl_lcm *l;

    *why = wrong_with(config);
    if (*why != NULL)
        return NULL;
    l = calloc(1, sizeof *l);
    *why = l == NULL ? "no memory" : join(l, config);
    if (*why == NULL)
        return l;
    if (l != NULL)
        free_all(l);
    return NULL;
}

static int every_link(const jl_lcm *l, int (*is)(const jl_link *link))
{
    int i;

    for (i = 0; i < l->nodes; i++)
        if (i != l->node && !is(&l->peers[i].link))
            return 0;
    return 1;
}

static int closed(const jl_link *link)
{
    return link->failed != JL_OK;
}

/* The other end knows that we have closed, or nobody is there to know it. */
static int told(const jl_link *link)
{
    return link->out_first == link->out_end || (closed(link) && !link->up);
}

/* Nothing left to wait for: all is delivered, or the other end has closed,
 * knows that we know it, and will receive no more. */
static int settled(const jl_link *link)
{
    return jl_link_idle(link)
        || (closed(link) && link->ack_due == 0 && !link->ack_now);
}

/* Some datagram has not left the carrier. */
static int holds(const jl_lcm *l)
{
    return l->carrier != NULL
        && l->carrier->timer(l->carrier->context, link_time(clock_us())) >= 0;
}

static int lossy(const jl_lcm *l)
{
    jl_link_count count = jl_lcm_count(l);

    return count.resent + count.doubled + count.early > 0;
}

void jl_lcm_close(jl_lcm *lcm, long linger_us)
{
    long long end = clock_us() + linger_us;
    int i;

    if (lcm == NULL)
        return;
    for (i = 0; i < lcm->nodes; i++)
        if (i != lcm->node)
            jl_link_close(&lcm->peers[i].link);
    flush(lcm);                 /* here and below: it may be what settles */
    while (!every_link(lcm, settled)) {
        if (turn(lcm, end) != JL_OK)
            break;
        flush(lcm);
    }
    /* A peer that has not heard our BYE waits for it, or has left before us and
     * will never say: repeat it for a while, unless nothing was ever lost. */
    end = clock_us() + QUIET_PARTS * (long long)lcm->rto_us;
    while (holds(lcm) || (!every_link(lcm, told)
                          && (lossy(lcm) || !every_link(lcm, closed))))
        if (turn(lcm, end) != JL_OK)
            break;
    flush(lcm);
    free_all(lcm);
}

static struct peer *peer_at(const jl_lcm *lcm, int node)
{
    if (node < 0 || node >= lcm->nodes || node == lcm->node)
        return NULL;
    return &lcm->peers[node];
}

jl_chan *jl_lcm_tx(jl_lcm *lcm, int node)
{
    struct peer *p = peer_at(lcm, node);

    return p == NULL ? NULL : &p->tx.chan;
}

jl_chan *jl_lcm_rx(jl_lcm *lcm, int node)
{
    struct peer *p = peer_at(lcm, node);

    return p == NULL ? NULL : &p->rx.chan;
}

const jl_link *jl_lcm_link(const jl_lcm *lcm, int node)
{
    const struct peer *p = peer_at(lcm, node);

    return p == NULL ? NULL : &p->link;
}

long jl_lcm_silence(const jl_lcm *lcm, int node)
{
    const jl_link *link = jl_lcm_link(lcm, node);

    return link == NULL ? -1 : jl_link_silence(link, link_time(clock_us()));
}

jl_link_count jl_lcm_count(const jl_lcm *lcm)
{
    jl_link_count sum;
    int i;

    memset(&sum, 0, sizeof sum);
    for (i = 0; i < lcm->nodes; i++)
        jl_link_count_add(&sum, &lcm->peers[i].link.count);
    sum.refused += lcm->strays;
    return sum;
}
