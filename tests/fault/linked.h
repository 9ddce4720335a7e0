/* Channels over links over a bad carrier: datagrams are messages of another
 * port's channels, and faults befall them on the way there.  So every port is a
 * carrier that jl_link can be tried on.
 */
#ifndef LINKED_H
#define LINKED_H

#include "fault.h"
#include "jumplink/chan.h"
#include "jumplink/link.h"

/* Datagrams a carrier's channels should hold: what a window of pieces, doubled,
 * needs.  More are lost. */
#define LINKED_PLACES 64

typedef struct linked_config {
    int node, nodes;            /* which of how many                        */
    int max_len, slots;         /* of the channels                          */
    jl_u32 rto_us;
    const fault_set *set;       /* what befalls the datagrams we send       */
    jl_chan *const *to;         /* [nodes] the carrier's channels, for      */
    jl_chan *const *from;       /* messages of JL_FRAME_MAX                 */
    jl_u32 (*now)(void *context);       /* its clock [us]                   */
    void *context;
} linked_config;

typedef struct linked linked;

/* In the node's own thread; to, from and set are not kept.  NULL: no memory, or a size out of range. */
linked *linked_open(const linked_config *config);

/* Close all channels: wait up to linger_us until all that was sent is there or
 * its receiver has gone, repeat the last word for a while, and free
 * everything. */
void linked_close(linked *l, long linger_us);

/* Channels to and from another node; they keep all of chan.h. */
jl_chan *linked_tx(linked *l, int node);
jl_chan *linked_rx(linked *l, int node);

/* The link to another node, to look at. */
const jl_link *linked_link(const linked *l, int node);

/* What happened so far: sums over the links, and the faults. */
jl_link_count linked_count(const linked *l);
const fault *linked_fault(const linked *l);

#endif
