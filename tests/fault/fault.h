/* A bad carrier: what is put in comes out lost, doubled, in another order, cut,
 * altered or late, each as often as said.  Without I/O and without a clock, so
 * it fits in front of any port; with a seed, so every run can be had again.
 */
#ifndef FAULT_H
#define FAULT_H

#include "jumplink/wire.h"

enum fault_kind {
    FAULT_DROP,                 /* it never comes out                       */
    FAULT_REPEAT,               /* it comes out twice                       */
    FAULT_REORDER,              /* one to three put after it come out first,
                                   or FAULT_WAIT_US pass                    */
    FAULT_CUT,                  /* octets at its end are missing            */
    FAULT_CORRUPT,              /* one to three bits are flipped            */
    FAULT_DELAY,                /* it comes out up to delay_us later        */
    FAULT_KINDS
};

#define FAULT_WAIT_US 300
#define FAULT_PLACES 128        /* datagrams held; more are lost            */

typedef struct fault_set {
    const char *name;
    int percent[FAULT_KINDS];   /* of the datagrams                         */
    jl_u32 delay_us;
} fault_set;

struct fault_place {
    int to, len;                /* len 0: free                              */
    unsigned long number;       /* lower ones come out first                */
    unsigned long behind;       /* out when more than so many were put, ... */
    jl_u32 since, wait;         /* ... or after so much time                */
    unsigned char octets[JL_FRAME_MAX];
};

typedef struct fault {
    fault_set set;
    unsigned random;
    unsigned long put;                  /* datagrams put in ...             */
    unsigned long got;                  /* ... and come out                 */
    unsigned long count[FAULT_KINDS];   /* what befell them                 */
    unsigned long crowded;              /* lost for want of a place         */
    struct fault_place place[FAULT_PLACES];
} fault;

void fault_init(fault *f, const fault_set *set, unsigned seed);

/* A datagram [1 to JL_FRAME_MAX octets] on its way to `to`. */
void fault_put(fault *f, int to, const unsigned char *datagram, int len,
               jl_u32 now);

/* The next to come out now: to datagram [JL_FRAME_MAX], its length; 0: none. */
int fault_get(fault *f, int *to, unsigned char *datagram, jl_u32 now);

/* Microseconds until one comes out by time alone: 0 now, -1 never. */
long fault_timer(const fault *f, jl_u32 now);

#endif
