/* What all kinds of runs share, and the serial one. */
#include "run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bank.h"
#include "clock.h"
#include "complain.h"
#include "jumplink/par.h"
#include "progress.h"

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

int run_max_len(const struct model *model)
{
    return JL_PAR_MSG(model->M, model->n, model->m);
}

jl_u32 run_fingerprint(const struct model *model,
                       const struct options *options)
{
    unsigned char more[4];

    more[0] = (unsigned char)options->pes;
    more[1] = options->form == &jl_kf_joseph;
    more[2] = (unsigned char)(options->kf ? options->mode + 2 : 0);
    more[3] = JL_REAL_OCTETS;
    return jl_crc32(model->fingerprint, more, sizeof more);
}

int run_is_channels(int status)
{
    return status <= JL_ETIMEOUT;
}

int run_failed(const struct data_file *data, long row, int status)
{
    if (row < 0)
        complain("PEs", 0, NULL, "the run does not start: %s",
                 jl_status_text(status));
    else if (run_is_channels(status))
        complain("PEs", 0, NULL, "the run ends at %s:%ld: %s", data->path,
                 data->line[row], jl_status_text(status));
    else
        complain(data->path, data->line[row], NULL, "the step fails: %s",
                 jl_status_text(status));
    return 1;
}

static void note(struct estimates *e, long row, const jl_real *x,
                 const jl_real *P, const jl_real *mu, jl_real loglik,
                 double us)
{
    int n = e->n, M = e->M;

    memcpy(e->x + row * n, x, (size_t)n * sizeof *x);
    memcpy(e->P + row * n * n, P, (size_t)(n * n) * sizeof *P);
    memcpy(e->mu + row * M, mu, (size_t)M * sizeof *mu);
    e->loglik[row] = loglik;
    e->us[row] = us;
}

/* --- serial -------------------------------------------------------------- */

int run_serial(struct estimates *e, const struct model *model,
               const struct data_file *data, const struct options *options)
{
    struct bank bank;
    struct feed feed;
    jl_imm *imm = &bank.imm;
    long row;
    int status = JL_OK;

    if (feed_open(&feed, data, model, options) != 0)
        return 2;
    if (bank_open(&bank, model, options->form) != 0) {
        complain(model->path, 0, NULL, "no memory for its filter");
        return 1;
    }
    for (row = 0; row < data->rows && status == JL_OK; row++) {
        jl_meas meas;
        double before;

        if (!feed_meas(&feed, row, &meas))
            continue;
        before = clock_us();
        status = bank_prepare(&bank, imm, &meas);
        if (status == JL_OK)
            status = jl_imm_step(imm, meas.z, bank.scratch);
        if (status == JL_OK || status == JL_STARTED)
            note(e, row, imm->xhat, imm->Phat, imm->mu, imm->loglik,
                 status == JL_OK ? clock_us() - before : (double)NAN);
        if (status == JL_STARTED)
            status = JL_OK;
        progress(row + 1, data->rows);
    }
    bank_close(&bank);
    return status == JL_OK ? 0 : run_failed(data, row - 1, status);
}

/* --- a PE ---------------------------------------------------------------- */

/* "PE0: no word from PE2: nothing happened before the deadline" */
static void pe_failed(int pe, const jl_par *par, int status)
{
    char name[16], other[16] = "the host";

    snprintf(name, sizeof name, "PE%d", pe);
    if (par->failed == JL_OK) {
        complain(name, 0, NULL, "%s", jl_status_text(status));
        return;
    }
    if (par->failed_pe < par->config.npe)
        snprintf(other, sizeof other, "PE%d", par->failed_pe);
    complain(name, 0, NULL, "%s %s: %s", par->failed == JL_EMODEL
             ? "not like" : "no word from", other, jl_status_text(status));
}

int run_pe(int pe, const struct model *model, const struct options *options,
           jl_chan **to, jl_chan **from)
{
    int M = model->M, cap = JL_PAR_BUF(M, model->n, model->m), status;
    unsigned char *owner = calloc((size_t)M, 1);
    unsigned char *buf = malloc((size_t)cap);
    int *mode_status = calloc((size_t)M, sizeof *mode_status);
    jl_real *z = calloc((size_t)model->m, sizeof *z);
    jl_par_config config;
    struct bank bank;
    jl_par par;

    if (owner == NULL || buf == NULL || mode_status == NULL || z == NULL
        || bank_open(&bank, model, options->form) != 0) {
        status = JL_ENOMEM;
    } else {
        jl_par_deal(owner, M, options->pes);
        memset(&config, 0, sizeof config);
        config.pe = pe;
        config.npe = options->pes;
        config.owner = owner;
        config.to = to;
        config.from = from;
        config.to_host = to[options->pes];
        config.from_host = from[options->pes];
        config.prepare = bank_prepare;
        config.context = &bank;
        config.fingerprint = run_fingerprint(model, options);
        config.start_us = options->start_us;
        config.timeout_us = options->timeout_us;
        status = jl_par_init(&par, &bank.imm, &config, buf, cap, mode_status,
                             z);
        if (status == JL_OK)
            status = jl_par_serve(&par, bank.scratch);
        if (status != JL_OK)
            pe_failed(pe, &par, status);
        bank_close(&bank);
    }
    free(owner);
    free(buf);
    free(mode_status);
    free(z);
    return status;
}

/* --- the host ------------------------------------------------------------ */

/* Between looks at whether everybody is alive. */
#define SLICE_US 100000L

/* Receive within the deadline, in slices.  `estimate` NULL: the ready word. */
static int receive(const struct run_host *host, jl_estimate *estimate,
                   jl_u32 fingerprint, const struct model *model,
                   unsigned char *buf, int cap, long timeout_us)
{
    long slice, left = timeout_us;
    int status;

    do {
        slice = left < SLICE_US ? left : SLICE_US;
        left -= slice;
        status = estimate == NULL
            ? jl_host_ready(host->from, fingerprint, buf, cap, slice)
            : jl_host_recv(host->from, estimate, model->M, model->n, buf, cap,
                           slice);
        if (status == JL_ETIMEOUT && host->alive != NULL
            && !host->alive(host->context))
            return JL_ECLOSED;
    } while (status == JL_ETIMEOUT && left > 0);
    return status;
}

static int host_row(struct estimates *e, long row,
                    const struct run_host *host, const jl_meas *meas,
                    jl_estimate *estimate, const struct model *model,
                    unsigned char *buf, int cap, long timeout_us)
{
    double before = clock_us();
    int is_start = meas->first && model->x0 == NULL;
    int status = jl_host_send(host->to, meas, model->m, buf, cap, timeout_us);

    if (status == JL_OK)
        status = receive(host, estimate, 0, model, buf, cap, timeout_us);
    if (status == JL_OK && estimate->seq != meas->seq)
        status = JL_EMSG;
    if (status == JL_OK)
        status = estimate->status;
    if (status == JL_OK)
        note(e, row, estimate->x, estimate->P, estimate->mu, estimate->loglik,
             is_start ? (double)NAN : clock_us() - before);
    return status;
}

/* The answer to a measurement may come as late as a PE's own deadline. */
static long answer_us(const struct options *options)
{
    return options->timeout_us + 1000000;
}

static int host_rows(struct estimates *e, long *row,
                     const struct run_host *host, const struct model *model,
                     const struct data_file *data,
                     const struct options *options, jl_estimate *estimate,
                     unsigned char *buf, int cap)
{
    struct feed feed;
    jl_meas meas;
    int status = JL_OK;

    if (feed_open(&feed, data, model, options) != 0)
        return JL_EDIM;
    for (*row = 0; *row < data->rows; ++*row) {
        if (feed_meas(&feed, *row, &meas))
            status = host_row(e, *row, host, &meas, estimate, model, buf, cap,
                              answer_us(options));
        if (status != JL_OK)
            return status;
        progress(*row + 1, data->rows);
    }
    return JL_OK;
}

int run_host(struct estimates *e, long *row, const struct run_host *host,
             const struct model *model, const struct data_file *data,
             const struct options *options)
{
    int n = model->n, cap = run_max_len(model), status;
    unsigned char *buf = malloc((size_t)cap);
    jl_real *mem = calloc((size_t)(n + n * n + model->M), sizeof *mem);
    jl_estimate estimate;

    *row = -1;
    if (buf == NULL || mem == NULL) {
        free(buf);
        free(mem);
        return JL_ENOMEM;
    }
    memset(&estimate, 0, sizeof estimate);
    estimate.x = mem;
    estimate.P = mem + n;
    estimate.mu = estimate.P + n * n;
    status = receive(host, NULL, run_fingerprint(model, options), model, buf,
                     cap, options->start_us + 1000000);
    if (status == JL_OK)
        status = host_rows(e, row, host, model, data, options, &estimate, buf,
                           cap);
    if (status == JL_OK || !run_is_channels(status))
        (void)jl_host_stop(host->to, buf, cap, options->timeout_us);
    free(buf);
    free(mem);
    return status;
}

/* --- any ----------------------------------------------------------------- */

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
        return run_loop(e, traffic, model, data, options);
    case PORT_LCM:
        return run_lcm(e, traffic, model, data, options);
    case PORT_BY_HAND:
        return run_by_hand(e, traffic, model, data, options);
    default:
        return run_serial(e, model, data, options);
    }
}
