/* The host's part of a run, for any port; and why a run failed, in words. */
#include "run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "complain.h"
#include "interrupt.h"
#include "jumplink/par.h"
#include "live_input.h"
#include "progress.h"
#include "typed.h"

int run_is_channels(int status)
{
    return status <= JL_ETIMEOUT && status != JL_ECHAIN
        && status != JL_EGATE;
}

int run_failed(const struct data_file *data, long row, int status,
               int failed_pe)
{
    char where[400] = "the run does not start", who[40] = "";

    if (row >= 0)
        snprintf(where, sizeof where, "the run ends at %s:%ld", data->path,
                 data->line[row]);
    if (failed_pe >= 0)
        snprintf(who, sizeof who, "%s PE%d: ", status == JL_EMODEL
                 ? "not like" : "no word from", failed_pe);
    else if (row < 0 && run_is_channels(status) && status != JL_EMODEL)
        strcpy(who, "no word from PE0: ");
    if (status == RUN_INTERRUPTED)
        complain(interrupted(), 0, NULL, "%s", where);
    else if (row < 0 || run_is_channels(status))
        complain("PEs", 0, NULL, "%s: %s%s", where, who,
                 jl_status_text(status));
    else
        complain(data->path, data->line[row], NULL, "the step fails: %s",
                 jl_status_text(status));
    return 1;
}

/* Between looks at whether everybody is alive. */
#define SLICE_US 100000L

/* How late PE0 may tell of a PE that does not come: it, or one that tells it,
 * waits for as many eighths more as messages must come before (par.h), at most
 * 2 a PE in an exchange, and 3 at the start. */
static long latest_us(long us, int messages)
{
    return us + us / 8 * messages + 1000000;
}

/* Receive an answer, in slices; `estimate` NULL: the ready word.  A live run
 * is interrupted between two answers only: that is how it ends. */
static int receive(struct run_host *host, jl_estimate *estimate,
                   const struct model *model, const struct options *options,
                   unsigned char *buf, int cap)
{
    long left = estimate == NULL
        ? latest_us(options->start_us, 3 * options->pes)
        : latest_us(run_message_us(options), 2 * options->pes), slice;
    int status;

    do {
        slice = left < SLICE_US ? left : SLICE_US;
        left -= slice;
        status = estimate == NULL
            ? jl_host_ready(host->from, run_fingerprint(model, options),
                            &host->failed_pe, buf, cap, slice)
            : jl_host_recv(host->from, estimate, model->M, model->n, buf, cap,
                           slice);
        if (estimate != NULL)
            host->failed_pe = estimate->failed_pe;
        if (status != JL_ETIMEOUT || host->failed_pe >= 0)
            return status;              /* a timeout may be another's */
        if (interrupted() != NULL
            && (estimate == NULL || options->live == NULL))
            return RUN_INTERRUPTED;
        if (host->alive != NULL && !host->alive(host->context))
            return JL_ECLOSED;
    } while (left > 0);
    return status;
}

static int host_row(struct estimates *e, long row,
                    struct run_host *host, const jl_meas *meas,
                    jl_estimate *estimate, const struct model *model,
                    const struct options *options, unsigned char *buf,
                    int cap)
{
    double before = clock_us();
    int is_start = meas->first && model->x0 == NULL;
    int status = jl_host_send(host->to, meas, model->m, buf, cap,
                              options->timeout_us);

    if (status == JL_OK)
        status = receive(host, estimate, model, options, buf, cap);
    if (status == JL_OK && estimate->seq != meas->seq)
        status = JL_EMSG;
    if (status == JL_OK)
        status = estimate->status;
    if (status == JL_OK)
        estimates_note(e, row, estimate,
                       is_start ? (double)NAN : clock_us() - before);
    return status;
}

/* The longest look at the network for a measurement, and then the links. */
#define LOOK_US 20000L

/* Nothing is on its way while the host waits for a measurement, so what comes
 * is the end of the run; and the links go on only in a call. */
static int keep_going(struct run_host *host, const struct model *model,
                      jl_estimate *estimate, unsigned char *buf, int cap)
{
    int status = jl_host_recv(host->from, estimate, model->M, model->n, buf,
                              cap, 0);

    host->failed_pe = estimate->failed_pe;
    if (status == JL_OK)
        return JL_EMSG;
    if (status != JL_ETIMEOUT || host->failed_pe >= 0)
        return status;
    return host->alive != NULL && !host->alive(host->context) ? JL_ECLOSED
                                                              : JL_OK;
}

/* JL_OK: the record has the row; LIVE_END: it is over; or why it cannot. */
static int next_row(struct estimates *e, long row, struct run_host *host,
                    const struct model *model, const struct data_file *data,
                    struct live_input *live, jl_estimate *estimate,
                    unsigned char *buf, int cap)
{
    int status;

    if (live == NULL)
        return row < data->rows ? JL_OK : LIVE_END;
    while ((status = live_row(live, row, LOOK_US)) == JL_ETIMEOUT) {
        status = keep_going(host, model, estimate, buf, cap);
        if (status != JL_OK)
            return status;
    }
    if (status == JL_OK && estimates_grow(e, row + 1) != 0)
        status = JL_ENOMEM;
    return status;
}

static int host_rows(struct estimates *e, long *row,
                     struct run_host *host, const struct model *model,
                     const struct data_file *data,
                     const struct options *options, jl_estimate *estimate,
                     unsigned char *buf, int cap, struct typed *typed)
{
    struct feed feed;
    jl_meas meas;
    int fed, status;

    if (feed_open(&feed, data, model, options) != 0)
        return JL_EDIM;
    for (*row = 0; ; ++*row) {
        status = next_row(e, *row, host, model, data, options->live, estimate,
                          buf, cap);
        if (status != JL_OK)
            break;
        fed = feed_meas(&feed, *row, &meas);
        typed_measurement(typed, *row, fed ? meas.z : NULL);
        if (fed)
            status = host_row(e, *row, host, &meas, estimate, model, options,
                              buf, cap);
        if (fed && (status == JL_OK || !run_is_channels(status)))
            typed_estimate(typed, *row, estimate);
        if (status == JL_OK && options->live == NULL && interrupted() != NULL)
            status = RUN_INTERRUPTED;
        if (status != JL_OK)
            return status;
        progress(*row + 1, data->rows);
    }
    --*row;                             /* the last that was there */
    return status == LIVE_END ? JL_OK : status;
}

int run_host(struct estimates *e, long *row, struct run_host *host,
             const struct model *model, const struct data_file *data,
             const struct options *options)
{
    int n = model->n, cap = run_max_len(model), status;
    unsigned char *buf = malloc((size_t)cap);
    jl_real *mem = calloc((size_t)(n + n * n + model->M), sizeof *mem);
    jl_estimate estimate;
    struct typed typed;

    *row = -1;
    host->failed_pe = -1;
    if (buf == NULL || mem == NULL) {
        free(buf);
        free(mem);
        return JL_ENOMEM;
    }
    memset(&estimate, 0, sizeof estimate);
    estimate.x = mem;
    estimate.mu = mem + n;
    estimate.P = model->gains != NULL ? NULL : estimate.mu + model->M;
    status = receive(host, NULL, model, options, buf, cap);
    if (status == JL_OK) {
        typed_open(&typed, model, data, options);
        status = host_rows(e, row, host, model, data, options, &estimate, buf,
                           cap, &typed);
        typed_close(&typed);
    }
    if (status == JL_OK || !run_is_channels(status))
        (void)jl_host_stop(host->to, buf, cap, options->timeout_us);
    free(buf);
    free(mem);
    return status;
}
