/* The filter on one processor. */
#include "run.h"

#include <math.h>

#include "bank.h"
#include "clock.h"
#include "complain.h"
#include "diagnostics.h"
#include "interrupt.h"
#include "progress.h"

int run_serial(struct estimates *e, const struct model *model,
               const struct data_file *data, const struct options *options)
{
    struct bank bank;
    struct feed feed;
    jl_estimate estimate;
    long row;
    int status = JL_OK;

    if (feed_open(&feed, data, model, options) != 0)
        return 2;
    if (bank_open(&bank, model, options) != 0) {
        complain(model->path, 0, NULL, "no memory for its filter");
        return 1;
    }
    for (row = 0; row < data->rows && status == JL_OK; row++) {
        jl_meas meas;
        double before;

        if (!feed_meas(&feed, row, &meas))
            continue;
        before = clock_us();
        status = bank_step(&bank, &estimate, &meas);
        if (status == JL_OK || status == JL_STARTED) {
            estimates_note(e, row, &estimate,
                           status == JL_OK ? clock_us() - before
                                           : (double)NAN);
            if (e->diagnostics != NULL)
                diagnostics_note(e->diagnostics, row, &bank.imm);
        }
        if (status == JL_STARTED)
            status = JL_OK;
        if (status == JL_OK && options->live == NULL && interrupted() != NULL)
            status = RUN_INTERRUPTED;
        progress(row + 1, data->rows);
    }
    bank_close(&bank);
    return status == JL_OK ? 0 : run_failed(data, row - 1, status, -1);
}
