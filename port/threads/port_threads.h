/* Port threads: every PE is a thread, and they really run at the same time.
 *
 * A channel is a ring in memory with one sender and one receiver, without a
 * lock; with slots = 0 it is a strict rendezvous, in which the later of the two
 * copies the message: send returns when the receiver has it, and with timeout 0
 * only a receiver that is already in recv gets it.  What wait sees is a sender
 * blocked in send.
 *
 * A call that must wait looks again and again for 20 us, but only while the PEs
 * that have not ended are no more than the cores this process may use; then it
 * sleeps.  So an idle run costs no processor time.  The deadlines are those of
 * CLOCK_MONOTONIC.
 */
#ifndef PORT_THREADS_H
#define PORT_THREADS_H

#include "jumplink/chan.h"

typedef struct jl_threads jl_threads;

/* Threads for n PEs (the host is one of them, by convention the last), with a
 * channel for messages up to max_len octets from every PE to every other.
 * Returns NULL for n outside [1, 256], a negative max_len or slots, or no
 * memory. */
jl_threads *jl_threads_new(int n, int max_len, int slots);
void jl_threads_free(jl_threads *threads);

/* The end of the channel from PE `from` to PE `to`, for the sender and for the
 * receiver.  Valid until jl_threads_free.  NULL if there is no such channel. */
jl_chan *jl_threads_tx(jl_threads *threads, int from, int to);
jl_chan *jl_threads_rx(jl_threads *threads, int from, int to);

/* Run body(pe, context) on n threads, one for each PE; returns when all have
 * returned.  A PE whose body has returned has closed its channels.  Every run
 * begins with open, empty channels; the counters go on.  Channels are used in
 * the bodies only, each end by its own PE; their counters may be read after
 * the run.
 * Returns JL_OK, or JL_EIO if a thread cannot be made: no body has run. */
int jl_threads_run(jl_threads *threads, void (*body)(int pe, void *context),
                   void *context);

#endif
