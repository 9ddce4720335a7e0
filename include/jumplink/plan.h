/* Plans: which PEs are joined, and in which order they talk.
 *
 * Topologies of npe PEs, 0 to npe-1; every link carries messages both ways:
 *     full    every PE is joined to every other
 *     star    PE0 to every other
 *     ring    PE i to PE i+1, and the last to PE0
 *     chain   PE i to PE i+1
 * PEs that are not joined reach each other through relays: at most one up to 4
 * PEs, but for the chain.
 *
 * In an exchange every PE gives a block of its own to all others.  It is one
 * static list of hops in one total order; each PE executes, in that order, the
 * hops it has a part in.  So it cannot deadlock, even if every message is a
 * rendezvous: of all hops not yet done, nothing stands before the first.
 *     full    a tournament: in each round PEs meet in pairs, and swap
 *     star    all blocks to PE0; then to each PE the others' blocks
 *     ring    in round d neighbours swap what comes from d PEs away: both ways
 *             round, and half way round only upwards
 *     chain   two sweeps, from either end to the other, gather on their way
 */
#ifndef JL_PLAN_H
#define JL_PLAN_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    JL_TOPO_FULL = 0, JL_TOPO_STAR = 1, JL_TOPO_RING = 2, JL_TOPO_CHAIN = 3
};

/* One message of an exchange. */
typedef struct jl_hop {
    unsigned char from, to;     /* two PEs that are joined                  */
    unsigned char first, count; /* ... carries the blocks of PEs first,
                                   first+1, .. modulo npe, count of them    */
    unsigned char level;        /* so many hops, at most, one after another,
                                   must be done before it, by whomever      */
} jl_hop;

/* Room for the hops that one PE has a part in, and for all. */
#define JL_HOPS_OF_PE(npe) (2 * (npe))
#define JL_HOPS_OF_ALL(npe) ((npe) * (npe))

/* Relays on the shortest way from PE a to PE b; 0: they are joined.
 * a, b from 0 to npe-1, different; cost O(1). */
int jl_topo_relays(int topology, int npe, int a, int b);

/* The PE before `pe` on the way from PE0: what PE0 says to all is passed on
 * along the tree that these make.  0 < pe < npe. */
int jl_topo_parent(int topology, int npe, int pe);

/* List the exchange's hops in their order: those in which PE `pe` has a part,
 * or, with pe = -1, all.  hops [cap].
 * Returns how many there are, JL_EDIM (topology; npe outside 1..JL_MAX_PES;
 * pe), or JL_ENOMEM (cap; JL_HOPS_OF_... always suffices). */
int jl_hops_exchange(jl_hop *hops, int cap, int topology, int npe, int pe);

#ifdef __cplusplus
}
#endif
#endif
