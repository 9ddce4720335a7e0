/* Port skel: where a new port begins (port/README.md).
 *
 * Nodes joined by a carrier of datagrams, which may lose, double, reorder or
 * damage them: a radio, a bus, a UART with a framing such as COBS.  All that a
 * carrier is to this port are three functions; the rest, from messages longer
 * than a datagram to a board that restarts, is done by one jl_link a peer.
 * Nothing is allocated, and there are no threads: the links of a node go on
 * while it is in a call, or in jl_skel_poll.
 *
 * A node that computes for longer than rto_us between calls is sent some
 * datagrams again, which costs time only; for longer than the others'
 * silence_us, and it is taken for dead (JL_ESILENT).
 */
#ifndef PORT_SKEL_H
#define PORT_SKEL_H

#include "jumplink/chan.h"
#include "jumplink/link.h"

/* The carrier.  An error is for good; a lost datagram is none. */
typedef struct jl_skel_carrier {
    /* Send a datagram [len] to a node, without waiting for it.  One that finds
     * no room is lost.  Returns JL_OK or JL_EIO. */
    int (*put)(void *context, int to, const unsigned char *datagram, int len);
    /* The next datagram that came for this node, into datagram [cap]; waits
     * for one up to wait_us, -1: without end.  May come back earlier.
     * Returns its length, 0: none came, or JL_EIO. */
    int (*get)(void *context, unsigned char *datagram, int cap, long wait_us);
    /* Microseconds modulo 2^32 of a clock that does not go back. */
    jl_u32 (*now)(void *context);
    void *context;
} jl_skel_carrier;

/* The carrier of this machine, to be filled in (end of port_skel.c): as it is,
 * every call of it fails. */
extern const jl_skel_carrier jl_skel_machine;

#define JL_SKEL_NODES 17        /* 16 PEs and a host */

typedef struct jl_skel_config {
    jl_skel_carrier carrier;
    int node, nodes;            /* which of how many, the host included     */
    jl_u32 session;             /* not 0, and new for every start: from a
                                   counter in flash, or from noise          */
    int number;                 /* octets of a real: JL_REAL_OCTETS         */
    int max_len;                /* octets of the longest message            */
    int slots;                  /* longest messages held, >= 1; 2 is usual  */
    jl_u32 rto_us;              /* a few times the carrier's round trip     */
    jl_u32 ack_us;              /* a quarter of it                          */
    jl_u32 beat_us;             /* longest a node says nothing; 0: any      */
    jl_u32 silence_us;          /* longest a peer may say nothing, many of
                                   its beat_us; 0: any                      */
} jl_skel_config;

/* Octets of memory for a node: a link holds twice the slots, since what was
 * received and is not acknowledged yet still fills its sender's. */
#define JL_SKEL_MEM(nodes, max_len, slots) \
    (((nodes) - 1) * JL_LINK_MEM(max_len, 2 * (slots)))

typedef struct jl_skel jl_skel;

typedef struct jl_skel_end {
    jl_chan chan;               /* first: ops get a jl_chan and cast it     */
    jl_skel *skel;
    jl_link *link;
} jl_skel_end;

typedef struct jl_skel_peer {
    jl_link link;
    jl_skel_end tx, rx;
} jl_skel_peer;

struct jl_skel {
    jl_skel_config config;
    int failed;                 /* JL_OK, or the carrier's error            */
    unsigned long strays;       /* datagrams that belong to no link         */
    jl_skel_peer peers[JL_SKEL_NODES];  /* our own is not used              */
};

/* Join over mem [cap octets], cap >= JL_SKEL_MEM; both outlive the channels.
 * The peers may come later; messages sent before wait for them.
 * Returns JL_OK, JL_EDIM (a field of config out of range), JL_ENOMEM. */
int jl_skel_init(jl_skel *skel, const jl_skel_config *config,
                 unsigned char *mem, int cap);

/* Channels to and from another node.  NULL if there is no such node, or it is
 * this one. */
jl_chan *jl_skel_tx(jl_skel *skel, int node);
jl_chan *jl_skel_rx(jl_skel *skel, int node);

/* Keep the links going in between, without waiting: for a node that computes
 * for long.  Returns JL_OK or JL_EIO. */
int jl_skel_poll(jl_skel *skel);

/* Close: wait up to linger_us until all that was sent is acknowledged, or its
 * receiver has closed; then stay three rto_us to answer peers that did not hear
 * our last word.
 * Returns JL_OK, JL_ETIMEOUT (a peer has not had all, or has left and its last
 * word was lost), JL_EIO. */
int jl_skel_close(jl_skel *skel, long linger_us);

#endif
