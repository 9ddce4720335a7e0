/* The wire: integers and reals as octets, and frames for carriers that may
 * lose, cut, damage or mix up what they carry.  src/wire/WIRE.md names every
 * octet.  All numbers are little-endian; no struct is ever copied to a wire.
 */
#ifndef JL_WIRE_H
#define JL_WIRE_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- octets ------------------------------------------------------------ */

void jl_put_u16(unsigned char *p, unsigned v);          /* 2 octets         */
void jl_put_u32(unsigned char *p, jl_u32 v);            /* 4 octets         */
void jl_put_real(unsigned char *p, jl_real v);          /* JL_REAL_OCTETS   */
unsigned jl_get_u16(const unsigned char *p);
jl_u32 jl_get_u32(const unsigned char *p);
jl_real jl_get_real(const unsigned char *p);            /* any bits pass    */

#if JL_REAL_FLOAT
#define JL_REAL_OCTETS 4        /* IEEE 754 binary32 */
#else
#define JL_REAL_OCTETS 8        /* IEEE 754 binary64 */
#endif

/* n reals in a row; return the first octet behind them. */
unsigned char *jl_put_reals(unsigned char *p, const jl_real *v, int n);
const unsigned char *jl_get_reals(const unsigned char *p, jl_real *v, int n);

/* CRC-32 (reflected polynomial EDB88320, start and final inversion, as in
 * IEEE 802.3: "123456789" gives CBF43926) of len octets.  crc is 0 for the
 * first piece, the last result for each further piece. */
jl_u32 jl_crc32(jl_u32 crc, const unsigned char *p, int len);

/* --- frames ------------------------------------------------------------ */

#define JL_FRAME_VERSION 1
#define JL_FRAME_HEADER 32
#define JL_FRAME_FROM 5         /* the octet that names the sender */
#define JL_FRAME_TRAILER 4      /* CRC-32 of all before it */
#define JL_FRAME_PAYLOAD (JL_FRAME_MAX - JL_FRAME_HEADER - JL_FRAME_TRAILER)

enum {                          /* kinds of frames */
    JL_FRAME_HELLO = 1,         /* I am here; this is my session            */
    JL_FRAME_DATA = 2,          /* a piece of a message, more follow        */
    JL_FRAME_LAST = 3,          /* the last (or only) piece of a message    */
    JL_FRAME_ACK = 4,           /* nothing but the acknowledgement          */
    JL_FRAME_BYE = 5,           /* I close: no more data after this         */
    JL_FRAME_DOUBT = 6,         /* I know another session of yours: are you
                                   there?                                   */
    JL_FRAME_ALIVE = 7          /* I am: the answer                         */
};

typedef struct jl_frame {
    int kind;                   /* JL_FRAME_...                             */
    int number;                 /* octets of a real: 8 or 4                 */
    int from, to;               /* who sends it to whom: 0 to 255           */
    jl_u32 session;             /* the sender's session                     */
    jl_u32 peer;                /* the receiver's session, as the sender
                                   knows it; 0: not yet                     */
    jl_u32 seq;                 /* number of this piece; ACK: 1 to be sent
                                   what was lost or dropped, from ack on    */
    jl_u32 ack;                 /* the next piece the sender waits for      */
    const unsigned char *payload;
    int len;                    /* octets of payload, 0 to JL_FRAME_PAYLOAD */
} jl_frame;

/* Write a frame to buf [cap].
 * Returns its length, or JL_EDIM (a field out of range, a session of 0, a
 * payload where none is allowed), JL_ENOMEM (cap).
 * Aliasing: the payload may already lie at buf + JL_FRAME_HEADER. */
int jl_frame_encode(unsigned char *buf, int cap, const jl_frame *frame);

/* Read the frame that fills buf [len] exactly; frame->payload points into buf.
 * `number` is the type of number that this program speaks: 8 or 4.
 * Returns JL_OK, or the first thing that is wrong, with *frame untouched:
 *     JL_ELENGTH   too short or too long for a frame, or for its length field
 *     JL_EMAGIC    does not begin like a frame
 *     JL_EVERSION  another version
 *     JL_ECRC      damaged
 *     JL_ENUMBER   another type of number
 *     JL_EMSG      right checksum, but an unknown kind, a session of 0, a
 *                  reserved octet that is not 0, or a payload where none is
 *                  allowed */
int jl_frame_decode(jl_frame *frame, const unsigned char *buf, int len,
                    int number);

#ifdef __cplusplus
}
#endif
#endif
