/* What the files of port threads share. */
#ifndef THREADS_PARTS_H
#define THREADS_PARTS_H

#include <pthread.h>
#include <stdatomic.h>

#include "port_threads.h"

/* What different PEs write lies in different cache lines. */
#define LINE 64

/* Microseconds of CLOCK_MONOTONIC in 64 bits: no deadline wraps. */
typedef unsigned long long tick;
#define NEVER (~(tick)0)

struct ring;

struct pe {
    _Alignas(LINE) pthread_mutex_t mutex;   /* guards its falling asleep    */
    pthread_cond_t woken;
    pthread_t thread;
    jl_threads *threads;
    int index;
    _Alignas(LINE) atomic_int closed;
};

/* One end of a channel, and all that its PE writes. */
struct end {
    _Alignas(LINE) jl_chan chan;    /* first: ops get a jl_chan and cast it */
    struct ring *ring;
    struct pe *pe;                  /* whose it is                          */
    unsigned place;                 /* of the next message                  */
    unsigned seen;                  /* the other end's count, seen before   */
    _Alignas(LINE) atomic_uint count;   /* messages put in, or taken out    */
    _Alignas(LINE) atomic_int asleep;   /* its PE, until this end is woken  */
};

struct ring {
    struct end tx, rx;
    unsigned char *data;            /* [places, stride]; threads_ring.c     */
    size_t stride;
    unsigned places;

    _Alignas(LINE) atomic_int meeting;      /* a rendezvous: threads_meet.c */
    const unsigned char *msg;       /* the sender's: [len]                  */
    int len;
    unsigned char *buf;             /* the receiver's: [cap]                */
    int cap;
    int given;                      /* what recv is to return               */
};

struct jl_threads {
    int n;
    struct pe *pes;                 /* [n]                                  */
    struct ring *rings;             /* [n,n]; the diagonal is not used      */
    pthread_mutex_t start;          /* held until all threads are there     */
    int cancelled;
    int cores;
    atomic_int unfinished;          /* PEs whose body has not returned      */
    void (*body)(int pe, void *context);
    void *context;
};

static inline struct end *jli_end(jl_chan *chan)
{
    return (struct end *)chan;
}

static inline int jli_closed(struct end *end)
{
    return atomic_load(&end->pe->closed);
}

extern const jl_chan_ops jli_ring_ops, jli_meet_ops;

/* --- waiting (threads_wait.c) -------------------------------------------- */

/* The time a timeout ends. */
tick jli_deadline(long timeout_us);

/* Block until `ready` holds for one of n ends of one PE.
 * Returns the index of the first, or JL_ETIMEOUT. */
int jli_await(jl_chan *const *chans, int n, int (*ready)(struct end *),
              tick deadline);

/* Something changed that this end's PE may wait for.  Costs a load unless it
 * sleeps.  What changed must be atomic and stored before in sequentially
 * consistent order: then either the PE sees it before it sleeps, or we see that
 * it is asleep. */
void jli_wake(struct end *end);

/* jl_chan_ops' wait. */
int jli_wait(jl_chan *const *chans, int n, int (*ready)(struct end *),
             long timeout_us);

#endif
