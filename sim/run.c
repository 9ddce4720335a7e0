/* A run of any kind. */
#include "run.h"

#include <stdlib.h>
#include <string.h>

/* Mode j's start of its k components is the model's. */
static void pick_start(struct model *model, int j, int k)
{
    int n = model->n, a, b;
    const int *map = k < n ? model->map[j] : NULL;

    for (a = 0; a < k; a++) {
        int row = j * n + (map != NULL ? map[a] : a);

        model->x0[a] = model->x0[row];
        for (b = 0; b < k; b++)
            model->P0[a * k + b]
                = model->P0[row * n + (map != NULL ? map[b] : b)];
    }
}

/* What a filter without covariances cannot do. */
static int check_cgimm(const struct model *model, const struct options *o)
{
    const char *option = o->filter == FILTER_IMM ? "--filter imm"
        : o->filter == FILTER_KF ? "--filter kf"
        : o->form_given ? "--form"
        : o->gate > 0 ? "--gate"
        : o->diagnostics ? "--diagnostics" : NULL;

    if (option != NULL)
        return misuse(o->command, "%s needs covariances, and %s is of kind "
                      "cgimm", option, model->path);
    if (o->exchange == JL_EXCHANGE_REDUCE)
        return misuse(o->command, "--exchange reduce is for kind imm, and %s "
                      "is of kind cgimm, whose PEs need every mode's estimate",
                      model->path);
    return 0;
}

/* What the filters of kind mekf, on one processor, cannot do. */
static int pick_mekf(struct model *model, const struct options *o)
{
    const char *option = o->filter == FILTER_IMM ? "--filter imm"
        : o->filter == FILTER_CGIMM ? "--filter cgimm"
        : o->filter == FILTER_KF ? "--filter kf"
        : o->form_given ? "--form"
        : o->gate > 0 ? "--gate"
        : o->diagnostics ? "--diagnostics"
        : o->mode >= 0 ? "--mode" : NULL;

    if (option != NULL)
        return misuse(o->command, "%s is not for kind mekf, and %s is of it",
                      option, model->path);
    if (o->port != PORT_NONE)
        return misuse(o->command, "%s is of kind mekf, which runs on one "
                      "processor: jumplink filter without --pes and --port",
                      model->path);
    if (o->spread && o->filter == FILTER_EKF)
        return misuse(o->command, "--spread is not for --filter ekf");
    model->mekf->plain = o->filter == FILTER_EKF;
    model->mekf->spread = o->spread;
    return 0;
}

int run_pick_mode(struct model *model, const struct options *options)
{
    int j = options->mode, k;

    if (model->mekf != NULL)
        return pick_mekf(model, options);
    if (options->filter == FILTER_MEKF || options->filter == FILTER_EKF
        || options->spread)
        return misuse(options->command, "%s needs a model of kind mekf, and "
                      "%s is none", options->spread ? "--spread"
                      : options->filter == FILTER_EKF ? "--filter ekf"
                      : "--filter mekf", model->path);
    if (model->gains == NULL && options->filter == FILTER_CGIMM)
        return misuse(options->command, "--filter cgimm needs gains, and %s "
                      "is of kind imm", model->path);
    if (model->gains != NULL && check_cgimm(model, options) != 0)
        return 2;
    if (options->filter != FILTER_KF)
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
    k = model->modes[j].n;
    model->modes[0] = model->modes[j];
    if (model->motions != NULL)
        model->motions[0] = model->motions[j];
    if (model->sojourn_s != NULL)
        model->sojourn_s[0] = model->sojourn_s[j];
    if (model->Pi != NULL)
        model->Pi[0] = 1;
    model->mu0[0] = 1;
    if (model->x0 != NULL)
        pick_start(model, j, k);
    free(model->map);
    model->map = NULL;
    model->n = k;
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
