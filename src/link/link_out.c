/* What a link has to say, and when. */
#include "link/link_parts.h"

#define HELLO_MAX_US ((jl_u32)100000L)
#define BACKOFF_MAX 16
#define NEVER ((jl_u32)0xFFFFFFFFUL)

/* Something to transmit?  After a timeout one piece goes alone: if the other
 * end has no room, the rest would be sent in vain. */
static int has_piece(const jl_link *link)
{
    return link->out_next != link->out_end &&
           (link->out_next == link->out_first ||
            link->wait_us == link->config.rto_us);
}

static int put(const jl_link *link, int kind, jl_u32 peer, jl_u32 seq,
               const unsigned char *payload, int len, unsigned char *datagram)
{
    jl_frame frame;

    frame.kind = kind;
    frame.number = link->config.number;
    frame.from = link->config.from;
    frame.to = link->config.to;
    frame.session = link->config.session;
    frame.peer = peer;
    frame.seq = seq;
    frame.ack = link->in_next;
    frame.payload = payload;
    frame.len = len;
    return jl_frame_encode(datagram, JL_FRAME_MAX, &frame);
}

static int hello(jl_link *link, unsigned char *datagram, jl_u32 now)
{
    if (!link->hello_now) {
        if (jli_left(link->sent_at, link->wait_us, now) > 0)
            return 0;
        if (link->wait_us < HELLO_MAX_US / 2)
            link->wait_us *= 2;
        else if (link->wait_us < HELLO_MAX_US)
            link->wait_us = HELLO_MAX_US;
    }
    link->hello_now = 0;
    link->sent_at = now;
    return put(link, JL_FRAME_HELLO, link->peer, 0, NULL, 0, datagram);
}

static int transmit(jl_link *link, unsigned char *datagram, jl_u32 now)
{
    jl_u32 seq = link->out_next;
    int ahead = (int)jli_ahead(seq, link->out_first);
    const unsigned char *piece = jli_piece(link->out, link->out_slot, ahead,
                                           link->window);

    if (seq == link->out_high) {
        link->count.sent++;
        link->out_high = jli_after(seq, 1);
    } else {
        link->count.resent++;
    }
    link->out_next = jli_after(seq, 1);
    link->sent_at = now;
    link->ack_due = link->ack_now = 0;
    if (link->closing && link->out_next == link->out_end)
        return put(link, JL_FRAME_BYE, link->peer, seq, NULL, 0, datagram);
    return put(link, JLI_PIECE_KIND(piece), link->peer, seq,
               JLI_PIECE_PAYLOAD(piece), JLI_PIECE_LEN(piece), datagram);
}

static int acknowledge(jl_link *link, unsigned char *datagram)
{
    jl_u32 ask = (jl_u32)link->ask_now;

    link->ack_due = link->ack_now = link->ask_now = 0;
    link->count.acks++;
    return put(link, JL_FRAME_ACK, link->peer, ask, NULL, 0, datagram);
}

/* Until the other end knows that we have closed, it listens for us. */
static int beats(const jl_link *link)
{
    return link->config.beat_us > 0 &&
           !(link->closing && link->out_first == link->out_end);
}

static int next_frame(jl_link *link, unsigned char *datagram, jl_u32 now)
{
    jl_u32 peer = link->doubt;

    if (link->alive != 0) {
        peer = link->alive;
        link->alive = 0;
        return put(link, JL_FRAME_ALIVE, peer, 0, NULL, 0, datagram);
    }
    if (peer != 0) {
        link->doubt = 0;
        return put(link, JL_FRAME_DOUBT, peer, 0, NULL, 0, datagram);
    }
    if (!link->up)
        return hello(link, datagram, now);
    if (link->out_next != link->out_first &&
        jli_left(link->sent_at, link->wait_us, now) == 0) {
        link->out_next = link->out_first;
        link->heeded = 0;
        if (link->wait_us < BACKOFF_MAX * link->config.rto_us)
            link->wait_us *= 2;
    }
    if (has_piece(link))
        return transmit(link, datagram, now);
    if (link->ack_now || link->ask_now ||
        (link->ack_due > 0 &&
         jli_left(link->due_at, link->config.ack_us, now) == 0) ||
        (beats(link) &&
         jli_left(link->said_at, link->config.beat_us, now) == 0))
        return acknowledge(link, datagram);
    return 0;
}

int jl_link_output(jl_link *link, unsigned char *datagram, int cap,
                   jl_u32 now)
{
    int len;

    if (cap < JL_FRAME_MAX)
        return JL_ENOMEM;
    if (jli_over(link))
        return 0;
    len = next_frame(link, datagram, now);
    if (len > 0)
        link->said_at = now;
    return len;
}

static jl_u32 sooner(jl_u32 a, jl_u32 b)
{
    return a < b ? a : b;
}

long jl_link_timer(const jl_link *link, jl_u32 now)
{
    jl_u32 resend = jli_left(link->sent_at, link->wait_us, now);
    jl_u32 next = NEVER;

    if (jli_over(link))
        return -1;
    if (link->alive != 0 || link->doubt != 0)
        return 0;
    if (!link->up)
        return link->hello_now ? 0 : (long)resend;
    if (has_piece(link) || link->ack_now || link->ask_now)
        return 0;
    if (link->out_next != link->out_first)
        next = resend;
    if (link->ack_due > 0)
        next = sooner(next, jli_left(link->due_at, link->config.ack_us, now));
    if (beats(link))
        next = sooner(next, jli_left(link->said_at, link->config.beat_us,
                                     now));
    if (jli_listens(link))
        next = sooner(next, jli_left(link->listened_at, jli_listen_us(link),
                                     now));
    return next == NEVER ? -1 : (long)next;
}
