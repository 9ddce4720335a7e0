/* From files to a file: read a model and a record, run, write the estimates. */
#ifndef SIM_RUN_FILE_H
#define SIM_RUN_FILE_H

#include "options.h"

/* Returns the program's exit status, after a message unless it is 0. */
int run_file(const char *model_path, const char *data_path,
             const struct options *options);

#endif
