/* Measurements off the network: typed messages (lcm/measurement.lcm) from any
 * LCM program become the rows of a record, one by one.
 *
 * LCM loses messages, so the numbers decide.  A gap is filled with rows that
 * did not arrive, at times evenly between its neighbours: the filter predicts
 * through them.  Between two records nothing is filled.  A number that is not
 * above the last one is late or doubled, and ignored.  A message that cannot
 * be a measurement of this model is refused, and leaves a gap.
 *
 * One source a channel: a second one's numbers would pass for gaps or late
 * ones.  Its times are trusted: one so far ahead that the model cannot step
 * there ends the run as a failed step does. */
#ifndef SIM_LIVE_INPUT_H
#define SIM_LIVE_INPUT_H

#include <lcm/lcm.h>

#include "data_file.h"
#include "model_file.h"
#include "options.h"
#include "typed.h"

/* More than this lost at once: rather a stray than the next one. */
#define LIVE_GAP_MAX 10000

struct live_count {
    unsigned long received;     /* measurements taken                       */
    unsigned long lost;         /* numbers left out between them            */
    unsigned long filled;       /* ... for which there is a row             */
    unsigned long late;         /* older than one taken, or doubled         */
    unsigned long refused;
};

struct live_input {
    struct data_file data;      /* what was taken; `line` is the number     */
    struct live_count count;
    char refusal[160];          /* why the first was refused                */
    int (*stop)(void);          /* 1: end now; or NULL                      */
    const struct model *model;
    lcm_t *lcm;
    long start_us, idle_us;     /* longest wait for the first, for the next */
    int64_t last;               /* number of the last one taken             */
    double since_us;            /* when the wait for ... began              */
    long awaited;               /* ... this row                             */
    long room;                  /* rows that the record has memory for      */
    int no_memory;
};

/* Listen on the channel of options->run.  Returns 0, or -1 after a message. */
int live_open(struct live_input *live, const struct model *model,
              const struct options *options, long idle_us);
void live_close(struct live_input *live);

/* Listen no more.  A record with no number has no column `run` either. */
void live_finish(struct live_input *live);

/* Wait for a row, at most timeout_us.  Returns JL_OK: it is there;
 * JL_ETIMEOUT: not yet, call again; LIVE_END: there will be none, too long
 * nothing came; JL_EIO, JL_ENOMEM. */
#define LIVE_END 1
int live_row(struct live_input *live, long row, long timeout_us);

#endif
