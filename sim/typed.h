/* Typed copies of a run: what the host feeds and what it gets, as LCM messages
 * that LCM's own tools and programs in any language understand
 * (lcm/measurement.lcm, lcm/estimate.lcm).
 *
 * They are for whoever listens.  The PEs do not need them, nothing repeats a
 * lost one, and a run goes on when they cannot be sent.  Only a run with
 * --lcm-url has them: into a private network nobody can look.
 *
 * A message is never split by us: one above some 1400 octets (an estimate of
 * more than 15 states) is cut up by IP, and on a network that loses packets it
 * arrives less often than a short one.  The run's own frames stay short. */
#ifndef SIM_TYPED_H
#define SIM_TYPED_H

#include <lcm/lcm.h>

#include "data_file.h"
#include "jumplink/par.h"
#include "model_file.h"
#include "options.h"

/* "JL." run "." kind, and its 0. */
#define TYPED_CHANNEL_MAX 40

/* The channel of "measurement" or "estimate"; run NULL: "jumplink". */
void typed_channel(char *channel, const char *run, const char *kind);

struct typed {
    lcm_t *lcm;                 /* NULL: there are no copies                */
    const struct data_file *data;
    int m, n, M;
    int answers_only;           /* the measurements are on the network      */
    char measurement[TYPED_CHANNEL_MAX], estimate[TYPED_CHANNEL_MAX];
    double *real;               /* [m or n + P + M] of the message          */
    unsigned long failed;       /* messages that could not be sent          */
};

/* If it cannot, says so in one line, and there are no copies. */
void typed_open(struct typed *typed, const struct model *model,
                const struct data_file *data, const struct options *options);

/* Says in one line how many could not be sent, if any. */
void typed_close(struct typed *typed);

/* A row of the record; z [m], or NULL: it did not arrive. */
void typed_measurement(struct typed *typed, long row, const jl_real *z);

/* The answer to it. */
void typed_estimate(struct typed *typed, long row, const jl_estimate *answer);

#endif
