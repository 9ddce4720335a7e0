/* A run of any kind. */
#include "run.h"

#include <string.h>

int run_pick_mode(struct model *model, const struct options *options)
{
    int j = options->mode, n = model->n;

    if (!options->kf)
        return options->mode < 0 ? 0
            : misuse(options->command, "--mode goes with --filter kf");
    if (j < 0 && model->M > 1)
        return misuse(options->command, "--filter kf takes one mode, and %s "
                      "has %d: choose one with --mode", model->path, model->M);
    if (j < 0)
        j = 0;
    if (j >= model->M)
        return misuse(options->command, "--mode %d: %s has modes 0 to %d", j,
                      model->path, model->M - 1);
    model->modes[0] = model->modes[j];
    if (model->motions != NULL)
        model->motions[0] = model->motions[j];
    if (model->sojourn_s != NULL)
        model->sojourn_s[0] = model->sojourn_s[j];
    if (model->Pi != NULL)
        model->Pi[0] = 1;
    model->mu0[0] = 1;
    if (model->x0 != NULL) {
        memmove(model->x0, model->x0 + j * n, (size_t)n * sizeof(jl_real));
        memmove(model->P0, model->P0 + j * n * n,
                (size_t)(n * n) * sizeof(jl_real));
    }
    model->M = 1;
    return 0;
}

int run(struct estimates *e, struct traffic *traffic,
        const struct model *model, const struct data_file *data,
        const struct options *options)
{
    struct feed feed;

    memset(traffic, 0, sizeof *traffic);
    if (feed_open(&feed, data, model, options) != 0)
        return 2;                       /* before anybody is started */
    switch (options->port) {
    case PORT_LOOP:
    case PORT_THREADS:
        return run_inside(e, traffic, model, data, options);
    case PORT_LCM:
        return run_lcm(e, traffic, model, data, options);
    case PORT_BY_HAND:
        return run_by_hand(e, traffic, model, data, options);
    default:
        return run_serial(e, model, data, options);
    }
}
