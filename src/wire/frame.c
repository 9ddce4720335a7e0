/* Frames to octets and back.  WIRE.md names every octet. */
#include <string.h>

#include "jumplink/wire.h"

enum {                          /* where a field begins */
    AT_MAGIC = 0,
    AT_VERSION = 2,
    AT_KIND = 3,
    AT_NUMBER = 4,
    AT_FROM = JL_FRAME_FROM,
    AT_TO = 6,
    AT_ZERO = 7,
    AT_SESSION = 8,
    AT_PEER = 12,
    AT_SEQ = 16,
    AT_ACK = 20,
    AT_LEN = 24,
    AT_ZEROS = 26
};

static int is_octet(int v)
{
    return v >= 0 && v <= 255;
}

/* What both directions demand of a frame beyond the form of its octets. */
static int has_sense(int kind, jl_u32 session, int len)
{
    return kind >= JL_FRAME_HELLO && kind <= JL_FRAME_ALIVE && session != 0 &&
           (len == 0 || kind == JL_FRAME_DATA || kind == JL_FRAME_LAST);
}

int jl_frame_encode(unsigned char *buf, int cap, const jl_frame *frame)
{
    int end;

    if (frame->len < 0 || frame->len > JL_FRAME_PAYLOAD ||
        (frame->number != 4 && frame->number != 8) ||
        !is_octet(frame->from) || !is_octet(frame->to) ||
        !has_sense(frame->kind, frame->session, frame->len))
        return JL_EDIM;
    end = JL_FRAME_HEADER + frame->len;
    if (cap < end + JL_FRAME_TRAILER)
        return JL_ENOMEM;
    if (frame->len > 0)         /* first: the header may lie on its place */
        memmove(buf + JL_FRAME_HEADER, frame->payload, (size_t)frame->len);
    memset(buf, 0, JL_FRAME_HEADER);
    buf[AT_MAGIC] = 0x4A;       /* "JL" whatever the character set */
    buf[AT_MAGIC + 1] = 0x4C;
    buf[AT_VERSION] = JL_FRAME_VERSION;
    buf[AT_KIND] = (unsigned char)frame->kind;
    buf[AT_NUMBER] = (unsigned char)frame->number;
    buf[AT_FROM] = (unsigned char)frame->from;
    buf[AT_TO] = (unsigned char)frame->to;
    jl_put_u32(buf + AT_SESSION, frame->session);
    jl_put_u32(buf + AT_PEER, frame->peer);
    jl_put_u32(buf + AT_SEQ, frame->seq);
    jl_put_u32(buf + AT_ACK, frame->ack);
    jl_put_u16(buf + AT_LEN, (unsigned)frame->len);
    jl_put_u32(buf + end, jl_crc32(0, buf, end));
    return end + JL_FRAME_TRAILER;
}

static int zeros(const unsigned char *p, int n)
{
    while (n > 0 && p[n - 1] == 0)
        n--;
    return n == 0;
}

int jl_frame_decode(jl_frame *frame, const unsigned char *buf, int len,
                    int number)
{
    int end, payload;

    if (len < JL_FRAME_HEADER + JL_FRAME_TRAILER || len > JL_FRAME_MAX)
        return JL_ELENGTH;
    end = len - JL_FRAME_TRAILER;
    payload = end - JL_FRAME_HEADER;
    if (buf[AT_MAGIC] != 0x4A || buf[AT_MAGIC + 1] != 0x4C)
        return JL_EMAGIC;
    if (buf[AT_VERSION] != JL_FRAME_VERSION)
        return JL_EVERSION;
    if (jl_get_u16(buf + AT_LEN) != (unsigned)payload)
        return JL_ELENGTH;
    if (jl_get_u32(buf + end) != jl_crc32(0, buf, end))
        return JL_ECRC;
    if (buf[AT_NUMBER] != number)
        return JL_ENUMBER;
    if (!has_sense(buf[AT_KIND], jl_get_u32(buf + AT_SESSION), payload) ||
        buf[AT_ZERO] != 0 || !zeros(buf + AT_ZEROS, JL_FRAME_HEADER - AT_ZEROS))
        return JL_EMSG;
    frame->kind = buf[AT_KIND];
    frame->number = number;
    frame->from = buf[AT_FROM];
    frame->to = buf[AT_TO];
    frame->session = jl_get_u32(buf + AT_SESSION);
    frame->peer = jl_get_u32(buf + AT_PEER);
    frame->seq = jl_get_u32(buf + AT_SEQ);
    frame->ack = jl_get_u32(buf + AT_ACK);
    frame->payload = buf + JL_FRAME_HEADER;
    frame->len = payload;
    return JL_OK;
}
