/* Scenarios ar1, spring2 and turn: Monte Carlo runs of a system with one
 * parameter that is not known, through the EKF of state and parameter, the
 * MEKF (c: prev, as in the paper) and the MEKF with spread (jumplink/mekf.h).
 *
 * Each scenario in three situations: the filter is told the truth's noises and
 * how uncertain the parameter is; a hundredth of the parameter's variance (it is
 * too sure); a hundred times the variance of the states' noise w1.  The filters,
 * and the situations, see the same truth and the same measurements. */
#ifndef SIM_RIVALS_H
#define SIM_RIVALS_H

#include <stdint.h>

#include "mekf_filter.h"

enum { RIVAL_EKF, RIVAL_MEKF, RIVAL_SPREAD, RIVALS };
enum { OF_STATE, OF_PARAMETER, QUANTITIES };
enum { AS_MODELLED, TOO_SURE, TOO_NOISY, SITUATIONS };
enum { RIVALS_STEPS = 100 };            /* of the longest                   */

struct rivals_scenario {
    const char *name, *model, *what;
    const char *quantity[QUANTITIES], *unit[QUANTITIES];
    struct mekf_zoo zoo;
    int steps;
    double x0[4], y0;           /* the filters' start                       */
    double var0[5];             /* of it; the true state is drawn from this */
    double y;                   /* the true parameter at the start          */
    double q[3], r[2];          /* variances of noises and measurements     */
    int states, at[2];          /* how many count as `state`, and which     */
};

/* By its name, or NULL. */
const struct rivals_scenario *rivals_scenario(const char *name);

/* A run's error: root mean square over its steps (of several states: of their
 * distance), at its last step, and the mean of estimate less truth (of the
 * first state).  Of the MEKF, the state is xhat. */
struct rivals_error {
    double rms, final, mean;
};

struct rivals_run {
    struct rivals_error of[SITUATIONS][RIVALS][QUANTITIES];
};

struct rivals {
    const struct rivals_scenario *scenario;
    long runs;
    uint64_t seed;
    struct rivals_run *run;     /* [runs]                                   */
    /* Squared errors by step: sums over runs. */
    double squares[SITUATIONS][RIVALS][QUANTITIES][RIVALS_STEPS];
};

/* Simulate.  Returns 0, to be freed; or 1 after a message: no memory, a step
 * failed, or a signal came. */
int rivals_simulate(struct rivals *rivals,
                    const struct rivals_scenario *scenario, long runs,
                    uint64_t seed);
void rivals_free(struct rivals *rivals);

/* A figure and its standard error over the runs. */
struct rivals_figure {
    double value, error;
};

/* Over all runs: the root of the mean of squares of .rms (or of .final), and
 * the mean of .mean. */
struct rivals_figure rivals_rms(const struct rivals *rivals, int situation,
                                int rival, int quantity, int final);
struct rivals_figure rivals_mean(const struct rivals *rivals, int situation,
                                 int rival, int quantity);

/* Root mean square at a step, from 0. */
double rivals_step(const struct rivals *rivals, int situation, int rival,
                   int quantity, int step);

/* The rival's .rms by the EKF's of the same run: their geometric mean, to which
 * a run that goes far astray is only one of them. */
struct rivals_figure rivals_ratio(const struct rivals *rivals, int situation,
                                  int rival, int quantity);

/* Runs in which the rival's rms is below the EKF's. */
long rivals_nearer(const struct rivals *rivals, int situation, int rival,
                   int quantity);

/* Of a ratio: "better" or "worse", if by more than two standard errors it is
 * off 1 by more than 1%; else "no different". */
const char *rivals_verdict(struct rivals_figure ratio);

/* Print the table, and leave table.txt, table.csv, runs.csv, and for each
 * situation curves and plots in the folder.  Returns the exit status. */
int rivals_report(const struct rivals *rivals, const char *folder);

#endif
