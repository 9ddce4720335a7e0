/* The constant-gain IMM over a record: a row is a step of the model's T. */
#include "run.h"

#include <stdlib.h>

#include "clock.h"
#include "complain.h"
#include "interrupt.h"
#include "jumplink/cgimm.h"
#include "progress.h"

static int run_rows(struct estimates *e, jl_cgimm *cg, jl_real *x,
                    struct feed *feed, const struct model *model,
                    const struct options *options)
{
    const struct data_file *data = feed->data;
    int status = JL_OK;
    long row;

    for (row = 0; row < data->rows && status == JL_OK; row++) {
        jl_meas meas;
        double before;

        if (!feed_meas(feed, row, &meas))
            continue;
        before = clock_us();
        if (meas.first)
            status = jl_cgimm_set(cg, model->x0, model->mu0);
        if (status == JL_OK)
            status = jl_cgimm_step(cg, meas.z);
        if (status == JL_OK) {
            double after = clock_us();

            jl_cgimm_estimate(cg, x);
            estimates_note(e, row, x, NULL, cg->mu, jl_cgimm_loglik(cg),
                           after - before);
            if (options->live == NULL && interrupted() != NULL)
                status = RUN_INTERRUPTED;
        }
        progress(row + 1, data->rows);
    }
    return status == JL_OK ? 0 : run_failed(data, row - 1, status, -1);
}

int run_cgimm(struct estimates *e, const struct model *model,
              const struct data_file *data, const struct options *options)
{
    int cap = JL_CGIMM_STATE(model->M, model->m), status = JL_ENOMEM;
    jl_real *mem = calloc((size_t)(cap + model->n), sizeof *mem);
    struct feed feed;
    jl_cgimm cg;

    if (mem != NULL)
        status = jl_cgimm_init(&cg, model->M, model->gains, model->m,
                               model->T, model->R, model->Pi, mem, cap);
    if (status != JL_OK)
        complain(model->path, 0, NULL, "%s", jl_status_text(status));
    status = status != JL_OK ? 1
        : feed_open(&feed, data, model, options) != 0 ? 2
        : run_rows(e, &cg, mem + cap, &feed, model, options);
    free(mem);
    return status;
}
