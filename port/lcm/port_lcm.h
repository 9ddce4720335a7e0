/* Port lcm: PEs are processes that talk by LCM messages (UDP multicast).
 *
 * Every node listens on one LCM channel, "JL.<run>.<node>"; what is sent to it
 * are frames of jl_link, one link a peer, since LCM loses messages.  Messages
 * on the network stay under 1400 octets; the receive buffer is 4 MB and the
 * subscription's queue has no limit of its own.
 *
 * A node goes on only while it is in a call: one that computes for longer than
 * rto_us between calls is sent some messages again, which costs time only; one
 * that does so for longer than the silence_us of others is taken for dead.
 * LCM has a thread of its own: fork before jl_lcm_open, not after.
 */
#ifndef PORT_LCM_H
#define PORT_LCM_H

#include "jumplink/chan.h"
#include "jumplink/link.h"

typedef struct jl_lcm jl_lcm;

/* First retransmission time [us]; an acknowledgement waits five eighths of it
 * for data to go with.  The shorter, the sooner a lost datagram is made good:
 * with 30% lost almost all of a step is this wait.  But a wait that is shorter
 * than a tick of the kernel (4 ms) makes every sleep dearer: a step over a clean
 * network took 8% longer with 5000. */
#define JL_LCM_RTO 8000

/* What stands between a node and LCM, for tests of bad networks: every datagram
 * is put there, and LCM gets what comes out.  The time is a link's. */
typedef struct jl_lcm_carrier {
    void *context;
    void (*put)(void *context, int to, const unsigned char *datagram, int len,
                jl_u32 now);
    /* The next to go out now, its length (0: none), and to whom. */
    int (*get)(void *context, int *to, unsigned char *datagram, jl_u32 now);
    /* Microseconds until get has one; -1: never by time alone. */
    long (*timer)(void *context, jl_u32 now);
} jl_lcm_carrier;

typedef struct jl_lcm_config {
    const char *url;            /* "udpm://239.255.76.67:7667?ttl=0"        */
    const char *run;            /* name of the run: [A-Za-z0-9_], 1 to 16   */
    int node, nodes;            /* which of how many, the host included     */
    int number;                 /* octets of a real: JL_REAL_OCTETS         */
    int max_len;                /* octets of the longest message            */
    int slots;                  /* longest messages held, >= 1; 2 is usual  */
    jl_u32 rto_us;              /* first retransmission time; 0: JL_LCM_RTO */
    jl_u32 beat_us;             /* longest without a word to a peer; 0: any */
    jl_u32 silence_us;          /* longest without one from it; 0: any      */
    const jl_lcm_carrier *carrier;      /* NULL: none; outlives the node    */
} jl_lcm_config;

/* Join the run; the peers may come later, and messages sent before wait for
 * them.  config is not kept.  Takes 10 s to fail behind a firewall that drops
 * multicast, and keeps LCM's own words off stderr.
 * Returns NULL and points *why to a static text when it fails ("no multicast
 * route ...", "bad LCM address ...", ...); else *why is NULL. */
jl_lcm *jl_lcm_open(const jl_lcm_config *config, const char **why);

/* Close: wait up to linger_us until all that was sent is acknowledged, or its
 * receiver has closed too; then, if a peer has not acknowledged our last word,
 * repeat it for 48 rto_us, unless all have closed and nothing was ever lost. */
void jl_lcm_close(jl_lcm *lcm, long linger_us);

/* Channels to and from another node; valid until jl_lcm_close.  NULL if there
 * is no such node, or it is this one. */
jl_chan *jl_lcm_tx(jl_lcm *lcm, int node);
jl_chan *jl_lcm_rx(jl_lcm *lcm, int node);

/* Microseconds since a node was last heard, as far as the last channel call
 * saw; -1 if it is not there (yet) or has closed.  Channels to and from one that
 * has been silent for silence_us fail with JL_ESILENT, once what came before is
 * fetched. */
long jl_lcm_silence(const jl_lcm *lcm, int node);

/* The link to another node, to look at what it does; valid until jl_lcm_close.
 * Its time is that of CLOCK_MONOTONIC [us].  NULL as for a channel. */
const jl_link *jl_lcm_link(const jl_lcm *lcm, int node);

/* Sum of the counters of all links; `refused` also counts what came from no
 * node of this run. */
jl_link_count jl_lcm_count(const jl_lcm *lcm);

#endif
