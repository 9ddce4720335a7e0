/* Port loop: every PE is a thread, and a baton goes round, so that exactly one
 * runs at a time and the order of events is the same on every run.
 *
 * A PE keeps the baton until it blocks in a channel call; then it goes to the
 * next PE, in index order and from the last to PE 0, that can go on.  When
 * nobody can, the clock jumps to the earliest deadline; when there is none,
 * all blocked calls return JL_EDEADLOCK.  So a timeout takes no time, and a
 * deadlock is a result and not a hang.  A call with timeout 0 that finds
 * nothing takes 1 us and passes the baton once, so polling hangs nobody.
 *
 * A channel is a ring in memory.  With slots = 0 it is a strict rendezvous:
 * send returns when the receiver has copied the message, and with timeout 0 it
 * does so only if the receiver is already in recv; what recv and wait see is a
 * sender blocked in send.
 */
#ifndef PORT_LOOP_H
#define PORT_LOOP_H

#include "jumplink/chan.h"

typedef struct jl_loop jl_loop;

/* A loop of n PEs (the host is one of them, by convention the last), with a
 * channel for messages up to max_len octets from every PE to every other.
 * Returns NULL for n < 1, a negative max_len or slots, or no memory. */
jl_loop *jl_loop_new(int n, int max_len, int slots);
void jl_loop_free(jl_loop *loop);

/* The end of the channel from PE `from` to PE `to`, for the sender and for the
 * receiver.  Valid until jl_loop_free.  NULL if there is no such channel. */
jl_chan *jl_loop_tx(jl_loop *loop, int from, int to);
jl_chan *jl_loop_rx(jl_loop *loop, int from, int to);

/* Run body(pe, context) on n threads, one for each PE, PE 0 first; returns when
 * all have returned.  A PE whose body has returned has closed its channels.
 * Every run begins with open, empty channels; the clock and the counters go on.
 * Channels are used in the bodies only.
 * Returns JL_OK, or JL_EIO if a thread cannot be made: no body has run. */
int jl_loop_run(jl_loop *loop, void (*body)(int pe, void *context),
                void *context);

/* The loop's clock [us] modulo 2^32, from 0. */
jl_u32 jl_loop_now(const jl_loop *loop);

#endif
