/* From rows of a record to measurements: which arrived, which begins a record,
 * how much time has passed. */
#ifndef SIM_FEED_H
#define SIM_FEED_H

#include "data_file.h"
#include "jumplink/par.h"
#include "model_file.h"
#include "options.h"

struct feed {
    const struct data_file *data;
    int needs_first;            /* a record starts only at an arrived z     */
    enum hold hold;
    int waiting;                /* the record has not begun yet             */
    double time;                /* of the last row fed                      */
};

/* Check that model and data fit.  Returns 0, or -1 after a message. */
int feed_open(struct feed *feed, const struct data_file *data,
              const struct model *model, const struct options *options);

/* 1 if the measurement of the row arrived. */
int feed_arrived(const struct feed *feed, long row);

/* The measurement of the row; rows in order from 0.  Returns 1, or 0 when the
 * record has not begun: nothing has arrived yet. */
int feed_meas(struct feed *feed, long row, jl_meas *meas);

#endif
