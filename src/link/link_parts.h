/* What the files of the link share. */
#ifndef JL_LINK_PARTS_H
#define JL_LINK_PARTS_H

#include <string.h>

#include "base/cc.h"
#include "jumplink/link.h"

/* How far a is ahead of b, modulo 2^32 also where jl_u32 is wider. */
JL_INLINE jl_u32 jli_ahead(jl_u32 a, jl_u32 b)
{
    return (a - b) & (jl_u32)0xFFFFFFFFUL;
}

JL_INLINE jl_u32 jli_after(jl_u32 seq, int n)
{
    return (seq + (jl_u32)n) & (jl_u32)0xFFFFFFFFUL;
}

/* Microseconds left of `wait` since `since`. */
JL_INLINE jl_u32 jli_left(jl_u32 since, jl_u32 wait, jl_u32 now)
{
    jl_u32 passed = jli_ahead(now, since);

    return passed < wait ? wait - passed : 0;
}

/* A link that shall not say anything any more.  One whose other end has
 * closed is still up: it acknowledges, and delivers what it had to send. */
JL_INLINE int jli_over(const jl_link *link)
{
    return link->failed != JL_OK && !link->up;
}

/* Does the other end perhaps lack a piece of a message? */
JL_INLINE int jli_unsaid(const jl_link *link)
{
    jl_u32 bye = link->closing ? 1 : 0;

    return jli_ahead(link->out_end, link->out_first) > bye;
}

/* A link whose other end has to be heard now and then: also one that has closed
 * and has still to acknowledge what it was sent. */
JL_INLINE int jli_listens(const jl_link *link)
{
    return link->config.silence_us > 0 && link->up
        && (link->failed == JL_OK || jli_unsaid(link));
}

/* The longest between two calls of jl_link_judge that counts as listening. */
JL_INLINE jl_u32 jli_listen_us(const jl_link *link)
{
    return link->config.silence_us / 8 + 1;
}

JL_INLINE void jli_heard(jl_link *link, jl_u32 now)
{
    link->heard_at = link->listened_at = now;
    link->unheard_us = 0;
}

/* A piece in a ring, `ahead` behind the oldest.  The ring's index is kept
 * apart from the piece's number, since the window need not divide 2^32. */
JL_INLINE unsigned char *jli_piece(unsigned char *ring, int slot, int ahead,
                                   int window)
{
    return ring + (slot + ahead) % window * JL_LINK_PIECE;
}

JL_INLINE void jli_piece_put(unsigned char *piece, int kind,
                             const unsigned char *payload, int len)
{
    jl_put_u16(piece, (unsigned)len);
    piece[2] = (unsigned char)kind;
    if (len > 0)
        memcpy(piece + 4, payload, (size_t)len);
}

#define JLI_PIECE_LEN(piece) ((int)jl_get_u16(piece))
#define JLI_PIECE_KIND(piece) ((int)(piece)[2])
#define JLI_PIECE_PAYLOAD(piece) ((piece) + 4)

#endif
