/* What a datagram does to a link. */
#include "link/link_parts.h"

static int refuse(unsigned long *count, int status)
{
    ++*count;
    return status;
}

/* Of those that ask for the same piece, before it is acknowledged or its time
 * is out.  A carrier that mixes up what it carries makes for many, and each
 * brings a whole window onto it. */
#define ASKS_HEEDED 8

/* frame->ack is the next piece that the other end waits for. */
static void take_ack(jl_link *link, const jl_frame *frame, jl_u32 now)
{
    jl_u32 n = jli_ahead(frame->ack, link->out_first);

    if (n > jli_ahead(link->out_high, link->out_first))
        return;                 /* old, or of what was never sent */
    if (n > 0) {
        if (n > jli_ahead(link->out_next, link->out_first))
            link->out_next = frame->ack;
        link->out_first = frame->ack;
        link->out_slot = (int)((jl_u32)link->out_slot + n) % link->window;
        link->wait_us = link->config.rto_us;
        link->sent_at = now;
        link->heeded = 0;
    }
    if (frame->kind == JL_FRAME_ACK && frame->seq == 1
        && link->heeded < ASKS_HEEDED) {
        link->heeded++;
        link->out_next = link->out_first;       /* asked: do not wait */
    }
}

/* Every piece of a message but the last is full, so that a message cannot
 * take more pieces than it needs, and the ring always holds a whole one. */
static int fits(const jl_link *link, const jl_frame *frame)
{
    int left = link->config.max_len - link->in_len;

    if (frame->kind == JL_FRAME_DATA)
        return frame->len == JL_FRAME_PAYLOAD && frame->len < left;
    return frame->len <= left;
}

/* A piece ahead of a missing one, which is asked for at once; again only when
 * the sender has started again, for its pieces do not go up, and it is missing
 * again.  Not for want of room: then recv asks. */
static void ask_for_missing(jl_link *link, jl_u32 seq)
{
    jl_u32 beyond = jli_ahead(seq, link->in_early);

    if (link->room_lacked)
        return;
    if (!link->in_gap || beyond == 0 || beyond > (jl_u32)0x7FFFFFFFUL)
        link->in_gap = link->ask_now = 1;
    link->in_early = seq;
}

static int take_piece(jl_link *link, const jl_frame *frame, jl_u32 now)
{
    jl_u32 ahead = jli_ahead(frame->seq, link->in_next);
    int bye = frame->kind == JL_FRAME_BYE;

    if (ahead > (jl_u32)0x7FFFFFFFUL) {
        link->ack_now = 1;      /* our acknowledgement was lost */
        return refuse(&link->count.doubled, JL_EORDER);
    }
    if (link->failed != JL_OK)
        return refuse(&link->count.refused, JL_EMSG);
    if (link->in_held == link->window && !bye) {
        link->room_lacked = 1;
        return refuse(&link->count.early, JL_EAGAIN);
    }
    if (ahead > 0) {
        ask_for_missing(link, frame->seq);
        return refuse(&link->count.early, JL_EORDER);
    }
    if (!bye && !fits(link, frame))
        return refuse(&link->count.refused, JL_ELENGTH);

    if (bye) {
        link->failed = JL_ECLOSED;
    } else {
        jli_piece_put(jli_piece(link->in, link->in_slot, link->in_held++,
                                link->window),
                      frame->kind, frame->payload, frame->len);
        link->in_len = frame->kind == JL_FRAME_LAST ? 0
                                                    : link->in_len + frame->len;
    }
    link->count.received++;
    link->in_next = jli_after(link->in_next, 1);
    link->room_lacked = link->in_gap = 0;
    if (link->ack_due++ == 0)
        link->due_at = now;
    if (bye || 2 * link->ack_due >= link->window)
        link->ack_now = 1;
    return JL_OK;
}

/* A frame of a session that is not the other end's.  Sessions never return,
 * and no session before the present one can have been asked by us while we
 * were up: so an answer, even a recorded one, comes from a later session. */
static int meet_stranger(jl_link *link, const jl_frame *frame, int knows_us)
{
    link->count.stale++;
    if (frame->kind == JL_FRAME_ALIVE && knows_us) {
        link->up = 0;
        if (link->failed == JL_OK || jli_unsaid(link))
            link->failed = JL_EPEER;
    } else if (frame->kind == JL_FRAME_HELLO || knows_us) {
        link->doubt = frame->session;
    }
    return JL_EPEER;
}

int jl_link_input(jl_link *link, const unsigned char *datagram, int len,
                  jl_u32 now)
{
    jl_frame frame;
    int status = jl_frame_decode(&frame, datagram, len, link->config.number);
    int knows_us;

    if (status != JL_OK)
        return refuse(&link->count.refused, status);
    if (frame.from != link->config.to || frame.to != link->config.from)
        return refuse(&link->count.refused, JL_EMSG);
    if (jli_over(link))
        return refuse(&link->count.stale, JL_EPEER);

    knows_us = frame.peer == link->config.session;
    if (frame.kind == JL_FRAME_DOUBT && knows_us) {
        link->alive = frame.session;
        return JL_OK;
    }
    if (!link->up && frame.kind == JL_FRAME_HELLO && !knows_us) {
        link->peer = frame.session;     /* perhaps; the answer will show */
        link->hello_now = 1;
        return JL_OK;
    }
    if (!link->up && knows_us && frame.kind != JL_FRAME_ALIVE) {
        link->peer = frame.session;
        link->up = 1;
        link->wait_us = link->config.rto_us;
    }
    if (!link->up)
        return refuse(&link->count.stale, JL_EPEER);
    if (frame.session != link->peer)
        return meet_stranger(link, &frame, knows_us);
    if (frame.kind == JL_FRAME_HELLO) {
        jli_heard(link, now);
        link->ack_now = 1;      /* it is not up yet: any frame brings it up */
        return JL_OK;
    }
    if (!knows_us)
        link->ack_now = 1;      /* it is up with an earlier session of ours */
    if (!knows_us || frame.kind == JL_FRAME_ALIVE)
        return refuse(&link->count.stale, JL_EPEER);
    jli_heard(link, now);
    take_ack(link, &frame, now);
    return frame.kind == JL_FRAME_ACK ? JL_OK : take_piece(link, &frame, now);
}
