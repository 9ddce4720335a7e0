/* jumplink sim --input lcm: a filter on measurements off the network. */
#ifndef SIM_SIM_LIVE_H
#define SIM_SIM_LIVE_H

#include "options.h"

/* Filter what comes until nothing has come for idle_us, compare with the
 * serial filter over the same record, and leave in the folder options->out
 * MODEL_live.csv, the estimates, and MODEL_record.csv, what was taken.
 * Returns the program's exit status: 1 if nothing came, the run failed, a file
 * could not be made, or the bits differ. */
int sim_live(const char *model_path, struct options *options, long idle_us);

#endif
