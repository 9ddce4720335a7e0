/* A bank of modes with measurements, to be filtered on one PE or on several. */
#ifndef PAR_CASE_H
#define PAR_CASE_H

#include "close.h"

#include <stdlib.h>

#include "jumplink.h"
#include "par_cg_case.h"

#define PAR_M 9                         /* modes, usually */
#define PAR_MOST 16                     /* ... and at most */
#define PAR_N 4
#define PAR_Z 2
#define PAR_STEPS 60
#define PAR_X (3 * PAR_CG_AXES)         /* states, at most */

/* What is run, and over which PEs. */
struct par_shape {
    int npe, M;
    int sticky;                 /* a chain that allows the cheap mixing     */
    const jl_kf_form *form;
    int topology, exchange;
    int hangs;                  /* this PE falls asleep ...                 */
    int hangs_at;               /* ... at this measurement; 0: at once; -1:
                                   nobody does                              */
    int gate;                   /* a gate, and bursts of outliers           */
    int nonlinear;              /* two of three modes are                   */
    int sizes;                  /* some modes lack components               */
    int axes;                   /* of a constant-gain IMM; 0: an IMM        */
    const unsigned char *owner; /* NULL: modes are dealt out in turn        */
};

static const jl_kf_form *const par_forms[] = { &jl_kf_joseph, &jl_kf_standard,
                                               &jl_kf_sqrt };
#define PAR_FORMS 3

/* Every PE builds its own. */
struct par_bank {
    jl_mode modes[PAR_MOST];
    jl_real mode_mem[PAR_MOST][JL_MODE_MEM(PAR_N, PAR_Z, PAR_Z)];
    jl_real mem[JL_IMM_STATE(PAR_MOST, PAR_N, PAR_N)];
    jl_real scratch[JL_IMM_SCRATCH(PAR_MOST, PAR_N, PAR_Z)];
    jl_real Pi[PAR_MOST * PAR_MOST];
    jl_motion motions[PAR_MOST];
    jl_nonlinear nonlinear[PAR_MOST];
    const int *map[PAR_MOST];
    jl_imm imm;
    jl_chan *silent;            /* nothing ever comes here                  */
    int hangs_at;               /* or -1                                    */
    struct par_cg_bank cg;
};

/* What a run gives, step by step. */
struct par_trace {
    int status[PAR_STEPS];
    int verdict[PAR_STEPS];
    jl_real x[PAR_STEPS][PAR_X];
    jl_real P[PAR_STEPS][PAR_N * PAR_N];
    jl_real mu[PAR_STEPS][PAR_MOST];
    jl_real loglik[PAR_STEPS];
};

/* M modes; sticky chooses a chain that allows the cheap mixing; form. */
static inline void par_bank_init(struct par_bank *bank, int M, int sticky,
                                 const jl_kf_form *form)
{
    static const jl_real x0[PAR_N] = { 0, 150, 0, 40 };
    jl_real x[PAR_MOST * PAR_N], mu[PAR_MOST], P[PAR_MOST * PAR_N * PAR_N];
    int i, j;

    memset(P, 0, sizeof P);
    for (j = 0; j < M; j++) {
        jl_motion motion = { JL_MOTION_CT, 2, 2, JL_C(0.5), 0, 20, 0 };

        motion.turn_rate = JL_C(0.02) * (jl_real)(j - M / 2);
        motion.accel_std = JL_C(0.3) * (jl_real)(j + 1);
        assert_int_equal(jl_mode_init(&bank->modes[j], PAR_N, PAR_Z, PAR_Z,
                                      bank->mode_mem[j],
                                      JL_MODE_MEM(PAR_N, PAR_Z, PAR_Z)), 0);
        bank->motions[j] = motion;
        assert_int_equal(jl_mode_motion(&bank->modes[j], &motion, 1), 0);
        mu[j] = 1 / (jl_real)M;
        for (i = 0; i < PAR_N; i++) {
            x[j * PAR_N + i] = x0[i];
            P[(j * PAR_N + i) * PAR_N + i] = 900;
        }
        for (i = 0; i < M; i++) {
            jl_real out = sticky ? JL_C(0.1)
                : JL_C(0.02) * (jl_real)(j + 1);    /* leaving mode j */

            bank->Pi[j * M + i] = M == 1 ? 1
                : i == j ? 1 - out : out / (jl_real)(M - 1);
        }
    }
    assert_int_equal(jl_imm_init(&bank->imm, M, bank->modes, form,
                                 JL_MIX_AUTO, bank->mem,
                                 JL_IMM_STATE(PAR_MOST, PAR_N, PAR_N)), 0);
    assert_int_equal(jl_imm_chain(&bank->imm, bank->Pi), 0);
    assert_int_equal(bank->imm.sticky, sticky || M <= 2);
    assert_int_equal(jl_imm_set(&bank->imm, x, P, mu, bank->scratch), 0);
}

/* A mode of a target that hardly moves: it has no velocities. */
static inline void par_still(jl_mode *mode, jl_real *mem)
{
    static const jl_real F[] = { 1, 0, 0, 1 }, Q[] = { 400, 0, 0, 400 };
    jl_real scratch[JL_MODE_SCRATCH(PAR_Z, PAR_Z, PAR_Z)];

    assert_int_equal(jl_mode_init(mode, PAR_Z, PAR_Z, PAR_Z, mem,
                                  JL_MODE_MEM(PAR_Z, PAR_Z, PAR_Z)), 0);
    assert_int_equal(jl_mode_set(mode, F, F, Q, NULL, F, Q, scratch), 0);
}

/* Every third mode is like that; one that starts to move does so with 100 m/s
 * or so.  To be called before there is a gate. */
static inline void par_bank_sizes(struct par_bank *bank)
{
    static const int positions[] = { 0, 2 };
    static const jl_real mean[PAR_N] = { 0, 100, 0, 50 };
    static const jl_real var[PAR_N] = { 0, 2500, 0, 900 };
    jl_real x[PAR_MOST * PAR_N], P[PAR_MOST * PAR_N * PAR_N], mu[PAR_MOST];
    jl_imm *imm = &bank->imm;
    int j, M = imm->M;

    memcpy(x, imm->x, (size_t)(M * PAR_N) * sizeof *x);
    memcpy(mu, imm->mu, (size_t)M * sizeof *mu);
    for (j = 0; j < M; j++) {
        jl_imm_cov(imm, j, P + j * PAR_N * PAR_N);
        bank->map[j] = NULL;
        if (j % 3 != 1)
            continue;
        bank->map[j] = positions;
        par_still(&bank->modes[j], bank->mode_mem[j]);
    }
    assert_int_equal(jl_imm_init_sizes(imm, M, PAR_N, bank->modes, bank->map,
                                       mean, var, imm->form, JL_MIX_AUTO,
                                       bank->mem,
                                       JL_IMM_STATE(PAR_MOST, PAR_N, PAR_Z)),
                     0);
    assert_int_equal(jl_imm_chain(imm, bank->Pi), 0);
    assert_int_equal(jl_imm_set(imm, x, P, mu, bank->scratch), 0);
}

/* A gate; where that is allowed, nobody enters the last mode. */
static inline void par_bank_gate(struct par_bank *bank, int sticky)
{
    int M = bank->imm.M, i;

    for (i = 0; !sticky && M > 2 && i < M; i++) {
        jl_real *row = bank->Pi + i * M;

        row[i < M - 1 ? i : 0] += row[M - 1];
        row[M - 1] = 0;
    }
    assert_int_equal(jl_imm_chain(&bank->imm, bank->Pi), 0);
    assert_int_equal(jl_imm_gate(&bank->imm, JL_C(13.82), JL_GATE_MOST), 0);
}

/* --- nonlinear modes ------------------------------------------------------ */

/* The faster, the more the velocity turns; context is the mode's motion.
 * Where the measurements that are absurd have led is no sine, but a code. */
static inline int par_f(jl_real *y, const jl_real *x, void *context)
{
    const jl_motion *motion = context;
    jl_real s, c, angle = x[1] * x[3] * JL_C(1e-6) + motion->turn_rate;
    int status = jl_sincos(&s, &c, angle);

    if (status != JL_OK)
        return status;
    y[1] = c * x[1] - s * x[3];
    y[3] = s * x[1] + c * x[3];
    y[0] = x[0] + (x[1] + y[1]) / 2;
    y[2] = x[2] + (x[3] + y[3]) / 2;
    return JL_OK;
}

static inline int par_h(jl_real *z, const jl_real *x, void *context)
{
    jl_real s, c;
    int status = jl_sincos(&s, &c, x[0] / 1000);

    (void)context;
    z[0] = x[0] + 30 * s;
    z[1] = x[2] + 30 * c;
    return status;
}

static inline void par_residual(jl_real *d, const jl_real *a,
                                const jl_real *b, void *context)
{
    (void)context;
    d[0] = a[0] - b[0];
    d[1] = a[1] - b[1];
}

static inline void par_bank_bend(struct par_bank *bank)
{
    int j;

    for (j = 0; j < bank->imm.M; j++) {
        jl_nonlinear *how = &bank->nonlinear[j];

        memset(how, 0, sizeof *how);
        how->h = par_h;
        how->context = &bank->motions[j];
        if (j % 3 == 1) {
            how->f = par_f;
            how->residual = par_residual;
            how->kappa = 1;
        }
        if (j % 3 > 0)
            assert_int_equal(jl_mode_nonlinear(&bank->modes[j], how), 0);
    }
}

/* --- running it ----------------------------------------------------------- */

/* A model that changes now and then, in a prepare that spoils the scratch. */
static inline int par_prepare(void *context, jl_imm *imm, const jl_meas *meas)
{
    struct par_bank *bank = context;
    int j, status = JL_OK;

    if ((int)meas->seq == bank->hangs_at)
        (void)jl_chan_recv(bank->silent, NULL, 0, PAR_ASLEEP_US);
    memset(bank->scratch, 0xff, sizeof bank->scratch);
    if (meas->seq % 10 != 0)
        return JL_OK;
    for (j = 0; j < imm->M && status == JL_OK; j++)
        if (bank->modes[j].n == PAR_N)
            status = jl_mode_motion(&bank->modes[j], &bank->motions[j],
                                    meas->seq % 20 == 0 ? JL_C(1.25) : 1);
    return status == JL_OK ? jl_imm_chain(imm, bank->Pi) : status;
}

/* Measurement k: a weaving path with noise; some are missing, one is an
 * outlier, and some so large that the predictions after them must fail. */
static inline void par_meas(jl_meas *meas, jl_real *z, int k)
{
    unsigned r = (unsigned)k * 2654435761u;
    int i;

    for (i = 0; i < PAR_Z; i++) {
        r = r * 1664525u + 1013904223u;
        z[i] = (jl_real)((i == 0 ? 150 : 40) * (k + 1))
            + (jl_real)(r >> 16) / 2048 - 16
            + (jl_real)((k * k) % 97);
    }
    if (k == 25)
        z[0] += 20000;
    if (k >= 50 && k < 54)
        z[0] = z[1] = JL_LARGE;
    meas->seq = (jl_u32)k + 1;
    meas->first = 0;
    meas->dt = 1;
    meas->z = k % 7 == 5 ? NULL : z;
}

/* What a gate is for: outliers in a row that it rejects, a number that cannot
 * be used, a displacement that it gives in to; and at last numbers so large
 * that, once it has given in, predictions fail. */
static inline void par_spoil(jl_real *z, int k)
{
    if (k >= 14 && k < 17)
        z[0] += 3000;
    if (k == 18)
        z[1] = -JL_REAL_MAX;
    if (k >= 30 && k < 40)
        z[0] += 8000;
    if (k >= 50)
        z[0] = z[1] = JL_LARGE;
}

static inline void par_note(struct par_trace *trace, int k, int status,
                            int verdict, const jl_real *x, const jl_real *P,
                            const jl_real *mu, jl_real loglik, int M, int n)
{
    trace->status[k] = status;
    if (status != JL_OK)
        return;
    trace->verdict[k] = verdict;
    memcpy(trace->x[k], x, (size_t)n * sizeof *x);
    if (P != NULL)
        memcpy(trace->P[k], P, sizeof trace->P[k]);
    memcpy(trace->mu[k], mu, (size_t)M * sizeof *mu);
    trace->loglik[k] = loglik;
}

static inline void par_serial_cg(struct par_trace *trace,
                                 const struct par_shape *shape)
{
    struct par_cg_bank bank;
    jl_real z[PAR_CG_AXES], x[PAR_X];
    jl_meas meas;
    int k, status, verdict;

    par_cg_init(&bank, shape->M, shape->axes);
    for (k = 0; k < PAR_STEPS; k++) {
        par_cg_meas(&meas, z, k, shape->axes);
        status = par_cg_step(&bank, &meas, &verdict);
        jl_cgimm_estimate(&bank.cg, x);
        par_note(trace, k, status, verdict, x, NULL, bank.cg.mu,
                 jl_cgimm_loglik(&bank.cg), shape->M, shape->axes * bank.cg.order);
    }
}

/* The reference: jl_imm_step, or jl_cgimm_step, on one processor. */
static inline void par_serial(struct par_trace *trace,
                              const struct par_shape *shape)
{
    static struct par_bank bank;
    jl_real z[PAR_Z];
    jl_meas meas;
    int k, status;

    memset(trace, 0, sizeof *trace);
    if (shape->axes > 0) {
        par_serial_cg(trace, shape);
        return;
    }
    par_bank_init(&bank, shape->M, shape->sticky, shape->form);
    if (shape->nonlinear)
        par_bank_bend(&bank);
    bank.hangs_at = -1;
    if (shape->sizes)
        par_bank_sizes(&bank);
    if (shape->gate)
        par_bank_gate(&bank, shape->sticky);
    for (k = 0; k < PAR_STEPS; k++) {
        par_meas(&meas, z, k);
        if (shape->gate)
            par_spoil(z, k);
        status = par_prepare(&bank, &bank.imm, &meas);
        if (status == JL_OK)
            status = jl_imm_step(&bank.imm, meas.z, bank.scratch);
        par_note(trace, k, status, bank.imm.verdict, bank.imm.xhat,
                 bank.imm.Phat, bank.imm.mu, bank.imm.loglik, shape->M,
                 PAR_N);
    }
}

/* Bind a PE's part to the shape's filter and serve. */
static inline int par_serve(jl_par *par, const struct par_shape *shape,
                            struct par_bank *bank, jl_par_config *config)
{
    unsigned char buf[JL_PAR_BUF(PAR_MOST, PAR_N, PAR_Z)];
    int mode_status[PAR_MOST], status;
    jl_real z[PAR_CG_AXES];

    if (shape->axes > 0) {
        par_cg_init(&bank->cg, shape->M, shape->axes);
        bank->cg.silent = bank->silent;
        bank->cg.hangs_at = bank->hangs_at;
        config->prepare_cg = par_cg_prepare;
        config->context = &bank->cg;
        status = jl_par_init_cg(par, &bank->cg.cg, config, buf, sizeof buf,
                                mode_status, z);
        return status == JL_OK ? jl_par_serve(par, bank->cg.scratch) : status;
    }
    par_bank_init(bank, shape->M, shape->sticky, shape->form);
    if (shape->sizes)
        par_bank_sizes(bank);
    if (shape->gate)
        par_bank_gate(bank, shape->sticky);
    if (shape->nonlinear)
        par_bank_bend(bank);
    config->prepare = par_prepare;
    config->context = bank;
    status = jl_par_init(par, &bank->imm, config, buf, sizeof buf,
                         mode_status, z);
    return status == JL_OK ? jl_par_serve(par, bank->scratch) : status;
}

/* A PE's part; the channels are [npe + 1], the host is the node npe; of
 * a PE that hangs, nothing must come on the channel from itself.  Returns what
 * jl_par_serve returns, and in *blamed, unless that is NULL, whom it blames. */
static inline int par_pe(int pe, const struct par_shape *shape, jl_chan **to,
                         jl_chan **from, int *blamed)
{
    struct par_bank *bank = malloc(sizeof *bank);
    unsigned char dealt[PAR_MOST];
    jl_par_config config = { 0 };
    int status;
    jl_par par;

    bank->silent = from[pe];
    bank->hangs_at = shape->hangs == pe ? shape->hangs_at : -1;
    if (bank->hangs_at == 0)
        (void)jl_chan_recv(bank->silent, NULL, 0, PAR_ASLEEP_US);
    jl_par_deal(dealt, shape->M, shape->npe);
    config.pe = pe;
    config.npe = shape->npe;
    config.owner = shape->owner != NULL ? shape->owner : dealt;
    config.topology = shape->topology;
    config.exchange = shape->exchange;
    config.to = to;
    config.from = from;
    config.to_host = to[shape->npe];
    config.from_host = from[shape->npe];
    config.fingerprint = 7;
    config.timeout_us = 5000000;
    config.start_us = 5000000;
    status = par_serve(&par, shape, bank, &config);
    if (blamed != NULL)
        *blamed = par.failed_pe;
    free(bank);
    return status;
}

/* The host's part: feed all measurements, note all answers, stop.  *blamed as
 * above, -1 for nobody. */
static inline int par_host(struct par_trace *trace,
                           const struct par_shape *shape, jl_chan *to,
                           jl_chan *from, int *blamed)
{
    unsigned char buf[JL_PAR_MSG(PAR_MOST, PAR_N, PAR_Z)];
    jl_real x[PAR_X], P[PAR_N * PAR_N], mu[PAR_MOST], z[PAR_CG_AXES];
    int n = PAR_N, m = PAR_Z, axes = shape->axes, k, status;
    jl_estimate estimate = { 0 };
    jl_meas meas;

    memset(trace, 0, sizeof *trace);
    if (axes > 0) {
        m = axes;
        n = axes * 2;
        for (k = 0; k < shape->M; k++)
            if (par_cg_order(k, shape->M, axes) == 3)
                n = axes * 3;
    }
    estimate.x = x;
    estimate.P = axes > 0 ? NULL : P;
    estimate.mu = mu;
    status = jl_host_ready(from, 7, &estimate.failed_pe, buf, sizeof buf,
                           60000000);
    for (k = 0; k < PAR_STEPS && status == JL_OK; k++) {
        if (axes > 0)
            par_cg_meas(&meas, z, k, axes);
        else
            par_meas(&meas, z, k);
        if (shape->gate)
            par_spoil(z, k);
        status = jl_host_send(to, &meas, m, buf, sizeof buf, 5000000);
        if (status == JL_OK)
            status = jl_host_recv(from, &estimate, shape->M, n, buf,
                                  sizeof buf, 60000000);
        if (status == JL_OK && estimate.seq != meas.seq)
            status = JL_EMSG;
        if (status == JL_OK)
            par_note(trace, k, estimate.status, estimate.verdict, x,
                     estimate.P, mu, estimate.loglik, shape->M, n);
    }
    if (blamed != NULL)
        *blamed = estimate.failed_pe;
    return status == JL_OK ? jl_host_stop(to, buf, sizeof buf, 5000000)
                           : status;
}

#endif
