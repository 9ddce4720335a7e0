/* A link as its user sees it: messages in, messages out. */
#include "link/link_parts.h"

static int config_is_good(const jl_link_config *c)
{
    return (c->number == 4 || c->number == 8) &&
           c->from >= 0 && c->from <= 255 && c->to >= 0 && c->to <= 255 &&
           c->from != c->to && c->session != 0 &&
           c->session <= (jl_u32)0xFFFFFFFFUL && c->max_len >= 0 &&
           c->slots >= 1 &&
           c->slots <= INT_MAX / 2 / JL_LINK_PIECE / JL_LINK_PIECES(c->max_len)
           && c->rto_us >= 1 && c->rto_us <= (jl_u32)JL_LINK_MAX_US &&
           c->ack_us <= (jl_u32)JL_LINK_MAX_US &&
           c->beat_us <= (jl_u32)JL_LINK_MAX_US &&
           c->silence_us <= (jl_u32)JL_LINK_MAX_US;
}

int jl_link_init(jl_link *link, const jl_link_config *config,
                 unsigned char *mem, int cap, jl_u32 now)
{
    if (!config_is_good(config))
        return JL_EDIM;
    if (cap < JL_LINK_MEM(config->max_len, config->slots))
        return JL_ENOMEM;
    memset(link, 0, sizeof *link);
    link->config = *config;
    link->window = config->slots * JL_LINK_PIECES(config->max_len);
    link->out = mem;
    link->in = mem + link->window * JL_LINK_PIECE;
    link->sent_at = now;
    link->wait_us = config->rto_us;
    link->hello_now = 1;
    return JL_OK;
}

void jl_link_count_add(jl_link_count *sum, const jl_link_count *count)
{
    sum->sent += count->sent;
    sum->resent += count->resent;
    sum->acks += count->acks;
    sum->received += count->received;
    sum->doubled += count->doubled;
    sum->early += count->early;
    sum->refused += count->refused;
    sum->stale += count->stale;
}

int jl_link_send(jl_link *link, const unsigned char *msg, int len)
{
    int held = (int)jli_ahead(link->out_end, link->out_first);

    if (link->failed != JL_OK)
        return link->failed;
    if (link->closing)
        return JL_ECLOSED;
    if (len < 0 || len > link->config.max_len)
        return JL_ETOOLONG;
    if (held + JL_LINK_PIECES(len) > link->window)
        return JL_EAGAIN;
    for (; len > JL_FRAME_PAYLOAD; len -= JL_FRAME_PAYLOAD) {
        jli_piece_put(jli_piece(link->out, link->out_slot, held++,
                                link->window),
                      JL_FRAME_DATA, msg, JL_FRAME_PAYLOAD);
        msg += JL_FRAME_PAYLOAD;
    }
    jli_piece_put(jli_piece(link->out, link->out_slot, held++, link->window),
                  JL_FRAME_LAST, msg, len);
    link->out_end = jli_after(link->out_first, held);
    return JL_OK;
}

void jl_link_close(jl_link *link)
{
    if (link->closing)
        return;
    link->closing = 1;
    /* BYE has a number, but no place in the ring. */
    link->out_end = jli_after(link->out_end, 1);
}

int jl_link_peek(const jl_link *link)
{
    int i, len = 0;

    for (i = 0; i < link->in_held; i++) {
        const unsigned char *piece = jli_piece(link->in, link->in_slot, i,
                                               link->window);
        len += JLI_PIECE_LEN(piece);
        if (JLI_PIECE_KIND(piece) == JL_FRAME_LAST)
            return len;
    }
    return link->failed != JL_OK ? link->failed : JL_EAGAIN;
}

int jl_link_recv(jl_link *link, unsigned char *msg, int cap)
{
    int len = jl_link_peek(link), kind;

    if (len < 0)
        return len;
    if (len > cap)
        return JL_ETOOLONG;
    do {
        const unsigned char *piece = jli_piece(link->in, link->in_slot, 0,
                                               link->window);
        int n = JLI_PIECE_LEN(piece);

        kind = JLI_PIECE_KIND(piece);
        if (n > 0) {
            memcpy(msg, JLI_PIECE_PAYLOAD(piece), (size_t)n);
            msg += n;
        }
        link->in_slot = (link->in_slot + 1) % link->window;
        link->in_held--;
    } while (kind != JL_FRAME_LAST);
    /* At half a ring, not at once: the sender will send all it has.  But if the
     * rest of a message is what had no room, there is no more to fetch. */
    if (link->room_lacked && (link->in_held <= link->window / 2 ||
                              jl_link_peek(link) < 0)) {
        link->room_lacked = 0;
        link->ask_now = 1;
    }
    return len;
}

int jl_link_idle(const jl_link *link)
{
    jl_u32 left = jli_ahead(link->out_end, link->out_first);

    if (jli_over(link))
        return 1;
    /* When both have closed, one must leave first: to it the other's BYE may
     * remain without an answer, so having sent it must do. */
    if (link->closing && link->failed == JL_ECLOSED && left == 1 &&
        link->out_high == link->out_end)
        left = 0;
    return left == 0 && link->ack_due == 0 && !link->ack_now;
}
