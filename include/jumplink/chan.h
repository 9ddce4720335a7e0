/* Channels: how processing elements (PEs) talk.
 *
 * A channel carries messages one way, from one PE to one other.  A message is
 * 0 to max_len octets and arrives whole: neither cut nor joined, neither lost
 * nor doubled, and in the order in which it was sent.
 *
 * The contract, which every port keeps and tests/conform checks:
 *
 *  1 send returns JL_OK once the channel has taken the message: the caller may
 *    reuse its buffer.  The channel holds at least `slots` messages of max_len
 *    that nobody has received yet; with slots = 0 it is a rendezvous, and send
 *    returns only when the receiver has the message.
 *  2 recv returns the length of the oldest message and copies it to the
 *    caller's buffer.  If the buffer is too short it returns JL_ETOOLONG, and
 *    the message stays where it is.
 *  3 Both block until they can do so or the deadline passes: JL_ETIMEOUT.
 *    After a timeout the message has not been taken (send) or is still to come
 *    (recv), and the call may be repeated.  A timeout of 0 does not block.
 *  4 While a call blocks, the port keeps the other channels of the same PE
 *    going (acknowledgements, repetitions).
 *  5 wait blocks until one of several channels of one PE, all of one port,
 *    has a message that recv would return at once, and gives the index of the
 *    first such in the list.  (With slots = 0 a sender whose deadline passes
 *    takes its message back, also after wait has seen it.)
 *  6 When the other end has closed, what it sent before can still be received;
 *    then recv returns JL_ECLOSED.  A send to it returns JL_ECLOSED.
 *  7 One thread at a time uses the channels of a PE.
 *
 * Nothing here allocates; who makes a channel is the port (port/<name>).
 */
#ifndef JL_CHAN_H
#define JL_CHAN_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* As a timeout: no deadline.  Other timeouts are 0 or more microseconds. */
#define JL_FOREVER (-1L)

typedef struct jl_chan jl_chan;

typedef struct jl_chan_ops {
    int (*send)(jl_chan *chan, const unsigned char *msg, int len,
                long timeout_us);
    int (*recv)(jl_chan *chan, unsigned char *msg, int cap, long timeout_us);
    int (*wait)(jl_chan *const *chans, int n, long timeout_us);
} jl_chan_ops;

/* The first member of a port's own channel. */
struct jl_chan {
    const jl_chan_ops *ops;
    int max_len;                /* octets of the longest message            */
    int slots;                  /* messages held unreceived; 0: rendezvous  */
    unsigned long messages;     /* sent or received through this end        */
    unsigned long octets;
};

/* Set up the common part of a channel: for ports. */
void jl_chan_init(jl_chan *chan, const jl_chan_ops *ops, int max_len,
                  int slots);

/* Send a message [len octets]; msg may be NULL if len is 0.
 * Returns JL_OK, JL_ETOOLONG (len > max_len), JL_ETIMEOUT, JL_ECLOSED,
 * JL_ERANGE (a negative len or timeout), or what else the port meets:
 * JL_EDEADLOCK, JL_EPEER, JL_ESILENT, JL_EIO. */
int jl_chan_send(jl_chan *chan, const unsigned char *msg, int len,
                 long timeout_us);

/* Receive a message into msg [cap octets]; msg may be NULL if cap is 0.
 * Returns its length >= 0, or JL_ETOOLONG (the message stays), JL_ETIMEOUT,
 * JL_ECLOSED, JL_ERANGE, JL_EDEADLOCK, JL_EPEER, JL_ESILENT, JL_EIO. */
int jl_chan_recv(jl_chan *chan, unsigned char *msg, int cap, long timeout_us);

/* Wait for a message on one of n >= 1 channels to receive from.
 * Returns the index of the first that has one (or whose recv would return an
 * error at once), or JL_ETIMEOUT, JL_ERANGE, JL_EDEADLOCK, JL_EIO. */
int jl_chan_wait(jl_chan *const *chans, int n, long timeout_us);

#ifdef __cplusplus
}
#endif
#endif
