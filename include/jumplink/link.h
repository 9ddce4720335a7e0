/* Links: two channels, one each way, between two PEs over a carrier that
 * loses, doubles, reorders or damages datagrams.
 *
 * A link is an object without I/O and without a clock: datagrams that came in
 * are given to it, datagrams to go out are taken from it, and the time is an
 * argument.  So a port for a new carrier is a loop around jl_link_input and
 * jl_link_output, and a test can run a day of losses in a second.
 *
 * Protocol (frames: wire.h, src/wire/WIRE.md).  A message is cut into pieces
 * that fit a frame; pieces are numbered from 0; up to `window` are under way;
 * the receiver takes them in order only and acknowledges by the number of the
 * next piece it waits for, on data that goes back anyway or, after ack_us or
 * half a window, in a frame of its own.  A piece ahead of a missing one is
 * dropped, and the receiver asks at once to be sent the missing one and what
 * follows.  What is not acknowledged in time (rto_us, doubled up to 16 times)
 * is sent again: first one piece alone, and when that is acknowledged, the
 * rest.  A receiver without room drops what comes, unacknowledged, and asks
 * when there is room again.  If an asking is lost, the sender's repetitions
 * find out.
 *
 * Sessions.  Each end has a session number, new for every start of the
 * program.  HELLO frames tell it to the other end, and the link is up only
 * when a frame has shown that the other end knows ours: a recorded frame, or
 * one of a life of the other end that was over before ours began, never can.
 * When an end that is up hears of another session of the other end, it asks
 * that session (DOUBT).  Only a living other end answers (ALIVE); then it has
 * restarted, and the link fails with JL_EPEER: what was under way cannot be
 * known to have arrived.
 *
 * Silence.  An end that is up says something at least every beat_us until the
 * other end knows that it has closed.  One that has listened for silence_us and
 * heard nothing from the other end's session takes it for dead: JL_ESILENT.
 *
 * Times are unsigned microseconds modulo 2^32 of any clock that does not go
 * back; only differences count, so the wrap after 71 minutes is harmless.
 */
#ifndef JL_LINK_H
#define JL_LINK_H

#include "base.h"
#include "wire.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct jl_link_config {
    int number;                 /* octets of a real in the messages: 8 or 4 */
    int from, to;               /* this end and the other: 0 to 255         */
    jl_u32 session;             /* this end's, not 0, new for every start   */
    int max_len;                /* octets of the longest message, >= 0      */
    int slots;                  /* longest messages held each way, >= 1     */
    jl_u32 rto_us;              /* first retransmission time, say 5000      */
    jl_u32 ack_us;              /* longest wait with an acknowledgement; well
                                   below rto_us, or much is sent twice      */
    jl_u32 beat_us;             /* longest this end says nothing; 0: any    */
    jl_u32 silence_us;          /* longest the other end may say nothing,
                                   many of its beat_us; 0: any              */
} jl_link_config;

/* What happened on a link, counted since init. */
typedef struct jl_link_count {
    unsigned long sent;         /* data frames, first transmissions         */
    unsigned long resent;       /* data frames sent again                   */
    unsigned long acks;         /* frames that only acknowledge             */
    unsigned long received;     /* data frames taken                        */
    unsigned long doubled;      /* data frames that we had already          */
    unsigned long early;        /* data frames ahead of a lost one, or when
                                   there was no room: dropped               */
    unsigned long refused;      /* not frames, damaged, of another type, not
                                   between these two ends, too long for us  */
    unsigned long stale;        /* frames of or for another session         */
} jl_link_count;

/* *sum += *count, for a node of several links. */
void jl_link_count_add(jl_link_count *sum, const jl_link_count *count);

/* Longest of the times in a jl_link_config: 67 s. */
#define JL_LINK_MAX_US 67108864L

/* Pieces a message of len octets is cut into. */
#define JL_LINK_PIECES(len) \
    ((len) <= 0 ? 1 : ((len) - 1) / JL_FRAME_PAYLOAD + 1)

/* Octets that a piece takes in memory: its length, its kind, itself. */
#define JL_LINK_PIECE (4 + JL_FRAME_PAYLOAD)

/* Octets of memory for a link: `slots` longest messages each way. */
#define JL_LINK_MEM(max_len, slots) \
    (2 * (slots) * JL_LINK_PIECES(max_len) * JL_LINK_PIECE)

typedef struct jl_link {
    jl_link_config config;
    int window;                 /* pieces held each way                     */
    jl_u32 peer;                /* the other end's session; 0: unknown      */
    int up;                     /* both ends know each other                */
    int failed;                 /* JL_OK, JL_EPEER, JL_ESILENT;
                                   JL_ECLOSED: BYE came                     */
    int closing;                /* we closed: the last piece is BYE         */
    unsigned char *out;         /* ring of pieces not acknowledged          */
    int out_slot;               /* where in the ring the oldest lies        */
    jl_u32 out_first;           /* oldest piece not acknowledged            */
    jl_u32 out_next;            /* next piece to transmit                   */
    jl_u32 out_high;            /* behind the last piece ever transmitted   */
    jl_u32 out_end;             /* behind the last piece handed to us       */
    jl_u32 sent_at;             /* when a piece or HELLO last went out      */
    jl_u32 wait_us;             /* how long from then until sent again      */
    int heeded;                 /* times the other end asked for out_first  */
    unsigned char *in;          /* ring of pieces not fetched by recv       */
    int in_slot;                /* where in the ring the oldest lies        */
    int in_held;                /* pieces in the ring                       */
    int in_len;                 /* octets of the message still arriving     */
    jl_u32 in_next;             /* next piece to arrive                     */
    int ack_due;                /* pieces taken and not acknowledged        */
    jl_u32 due_at;              /* since when                               */
    int ack_now;                /* acknowledge without waiting              */
    int room_lacked;            /* a piece was dropped for want of room     */
    int ask_now;                /* ask for the pieces from in_next on       */
    int in_gap;                 /* have asked; the piece has not come since */
    jl_u32 in_early;            /* highest piece seen since then            */
    int hello_now;              /* send HELLO without waiting               */
    jl_u32 doubt;               /* session to send DOUBT to; 0: none        */
    jl_u32 alive;               /* session to send ALIVE to; 0: none        */
    jl_u32 said_at;             /* when we last said anything               */
    jl_u32 heard_at;            /* when the other end was last heard        */
    jl_u32 listened_at;         /* until when listening has been counted    */
    jl_u32 unheard_us;          /* listened so long since heard_at          */
    jl_link_count count;
} jl_link;

/* Make a link over mem [cap octets], cap >= JL_LINK_MEM(max_len, slots).
 * Returns JL_OK, JL_EDIM (a field of config out of range, from = to, memory
 * beyond an int), JL_ENOMEM;
 * *link is untouched on error. */
int jl_link_init(jl_link *link, const jl_link_config *config,
                 unsigned char *mem, int cap, jl_u32 now);

/* Take a message to be sent [len], also before the link is up.
 * Returns JL_OK, JL_EAGAIN (no room before more is acknowledged),
 * JL_ETOOLONG, JL_ECLOSED (either end has closed), JL_EPEER, JL_ESILENT. */
int jl_link_send(jl_link *link, const unsigned char *msg, int len);

/* Fetch the oldest whole message into msg [cap].
 * Returns its length, JL_EAGAIN (none yet), JL_ETOOLONG (it stays),
 * and when all is fetched JL_ECLOSED (the other end closed), JL_EPEER,
 * JL_ESILENT. */
int jl_link_recv(jl_link *link, unsigned char *msg, int cap);

/* Length of the message that recv would return, or recv's error. */
int jl_link_peek(const jl_link *link);

/* A datagram [len] came from the carrier, at the time now.  Anything may be
 * in it.  Returns JL_OK if it was of use, or the reason why it was counted
 * and dropped: a code of jl_frame_decode, JL_ELENGTH (more than max_len),
 * JL_EMSG (not between these ends, or after BYE), JL_EPEER (another session,
 * or the link has failed), JL_EORDER (had already, or ahead of a lost one),
 * JL_EAGAIN (no room: it will be sent again). */
int jl_link_input(jl_link *link, const unsigned char *datagram, int len,
                  jl_u32 now);

/* The next datagram to give to the carrier now: written to datagram [cap],
 * cap >= JL_FRAME_MAX.  Call until it returns 0.
 * Returns its length; 0: nothing to send now; JL_ENOMEM. */
int jl_link_output(jl_link *link, unsigned char *datagram, int cap,
                   jl_u32 now);

/* Judge the other end's silence.  Call it only when all that waits at the
 * carrier has been given to jl_link_input; best, after every time that was done
 * and before jl_link_timer is asked.
 * Between two calls at most silence_us / 8 counts as listening: an end that was
 * stopped, or computed, does not take for silence what it did not hear, even
 * where the carrier needs a moment to hand over what came meanwhile.
 * Returns JL_OK, or JL_ESILENT if the link has failed so, now or before. */
int jl_link_judge(jl_link *link, jl_u32 now);

/* Microseconds since the other end was last heard, listening or not (after
 * 67 s: JL_LINK_MAX_US); -1 if the link is not up, unless it has failed for
 * silence, or the other end closed. */
long jl_link_silence(const jl_link *link, jl_u32 now);

/* Microseconds until jl_link_output or jl_link_judge may have something by time
 * alone: 0 for now; -1 for not before something comes in or is sent. */
long jl_link_timer(const jl_link *link, jl_u32 now);

/* Close this end: no more send; what was sent is still delivered, and what the
 * other end sends still comes in. */
void jl_link_close(jl_link *link);

/* 1 if nothing is under way: all sent pieces are acknowledged, and so are all
 * received ones, and a close was told to the other end; or the link failed.
 * The last acknowledgement may be lost: who leaves should go on for a few
 * rto_us to answer repetitions. */
int jl_link_idle(const jl_link *link);

#ifdef __cplusplus
}
#endif
#endif
