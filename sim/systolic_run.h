/* A systolic array (jumplink/systolic.h) of any size at work on a system made
 * for it, beside the filter that it computes. */
#ifndef SIM_SYSTOLIC_RUN_H
#define SIM_SYSTOLIC_RUN_H

#include "jumplink/systolic.h"

struct systolic_run {
    int n, m, r;                /* p1 = n, p2 = m                           */
    int cells;
    long ticks;                 /* of a step in the steady state: the most of
                                   the last few                             */
    long work;                  /* cell-ticks of work in such a step        */
    double apart;               /* farthest estimate from jl_mekf_step's, by
                                   max(1, |it|)                             */
};

enum { SYSTOLIC_STEPS = 12 };

/* Run it on the system of run->n, m, r, of which JL_SYSTOLIC_KNOW_* `known` is
 * constant.  trace may be NULL.  Returns 0, or 1 after a message. */
int systolic_run(struct systolic_run *run,
                 const jl_systolic_schedule *schedule, int known,
                 jl_systolic_trace trace, void *context);

#endif
