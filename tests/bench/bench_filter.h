/* Steps of an IMM to be timed: a bank of CV models in 3 axes (n = 6, m = 3)
 * that differ in how hard they manoeuvre, Joseph form. */
#ifndef BENCH_FILTER_H
#define BENCH_FILTER_H

#include "bench.h"
#include "jumplink/config.h"

/* Which chain, and what PEs exchange. */
enum bench_kind {
    GENERAL,                    /* any Pi: mixing takes M^2 sums            */
    STICKY,                     /* Pi = diag + 1 v': M                      */
    STICKY_REDUCE,              /* ... and PEs exchange only a pool each    */
    BENCH_KINDS
};

extern const char *const bench_kind_names[];

struct bench_case {
    enum bench_kind kind;
    int M;                      /* modes; 0: no case                        */
    int pes;                    /* 0: the serial filter                     */
    enum bench_port port;
    int served;                 /* 1: a host sends each measurement to PE0
                                   and waits for the estimate; 0: it is on
                                   every PE already (jl_par_step)           */
    struct samples step;        /* us                                       */
};

/* Time `steps` steps more, after a few that do not count. */
void bench_steps(struct bench_case *c, int steps);

/* Rounds of all cases in turn, so that what slows the machine down for a while
 * slows them all. */
void bench_rounds(struct bench_case *cases, int count, int rounds,
                  const char *name);

#endif
