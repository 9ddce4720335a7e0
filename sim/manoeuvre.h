/* Scenario manoeuvre1d: Monte Carlo runs of a target that flies straight, turns
 * off and flies straight again, through the IMM, the constant-gain IMM and an
 * adaptive alpha-beta filter (Liang, Pan, Zhang 2000, section 5).
 *
 * One axis, T = 1 s, R = 1e4 m^2, 450 m/s, acceleration 80 m/s^2 for
 * 10 < t <= 25, else 0.  Modes CV with Q = 100, CA with 4000 (m/s^2)^2, Pi =
 * [.98 .02; .02 .98].  The paper does not say how filters start: here all from
 * the positions measured at -2, -1, 0 s, order 2 through the last two, order 3
 * through all three; the IMM with the covariance of these fits. */
#ifndef SIM_MANOEUVRE_H
#define SIM_MANOEUVRE_H

#include <stdint.h>

enum {
    MAN_STEPS = 40,             /* t = 1 .. 40 s                            */
    MAN_PHASES = 6              /* the last: all of them                    */
};

enum man_filter { MAN_IMM, MAN_CGIMM, MAN_ADAPTIVE, MAN_FILTERS };
enum man_state { MAN_POSITION, MAN_VELOCITY, MAN_ACCELERATION, MAN_STATES };

struct man_phase {
    const char *name;
    int from, to;               /* [s], both included                       */
};

extern const struct man_phase man_phases[MAN_PHASES];

/* Standard deviation of a measured position [m]. */
#define MAN_SIGMA 100.0

/* A step's multiplications and divisions, and additions, as tests/count counts
 * and asserts them: with steady gains, but for the log-likelihood; the IMM in
 * standard form. */
enum {
    MAN_CG_PRODUCTS = 24, MAN_CG_SUMS = 27,
    MAN_IMM_PRODUCTS = 291, MAN_IMM_SUMS = 292
};

/* A figure and its standard error over the runs. */
struct man_figure {
    double value, error;
};

struct manoeuvre {
    long runs;
    uint64_t seed;
    double acceleration[MAN_STEPS];     /* the true one                     */

    /* Errors, estimate less truth, and their squares: sums over runs.  The
     * adaptive filter has no acceleration. */
    double sum[MAN_FILTERS][MAN_STATES][MAN_STEPS];
    double squares[MAN_FILTERS][MAN_STATES][MAN_STEPS];

    /* Of each run's mean error in a phase, and of the sums of squared errors in
     * it: their sums and products, for standard errors. */
    double mean2[MAN_FILTERS][MAN_STATES][MAN_PHASES];
    double square2[MAN_FILTERS][MAN_STATES][MAN_PHASES];
    double square_pair[MAN_STATES][MAN_PHASES];         /* IMM times CG-IMM */
};

/* Returns 0, or 1 after a message: a step failed, or a signal came. */
int manoeuvre_run(struct manoeuvre *m, long runs, uint64_t seed);

/* At step k (from 0). */
double manoeuvre_mean(const struct manoeuvre *m, int filter, int state, int k);
double manoeuvre_rms(const struct manoeuvre *m, int filter, int state, int k);

/* In a phase: mean error, root mean square error, and the ratio of the latter,
 * CG-IMM by IMM. */
struct man_figure manoeuvre_phase_mean(const struct manoeuvre *m, int filter,
                                       int state, int phase);
double manoeuvre_phase_rms(const struct manoeuvre *m, int filter, int state,
                           int phase);
struct man_figure manoeuvre_ratio(const struct manoeuvre *m, int state,
                                  int phase);

/* Print the table, and leave table.txt, table.csv, curves.csv and the plots in
 * the folder.  Returns the exit status. */
int manoeuvre_report(const struct manoeuvre *m, const char *folder);

#endif
