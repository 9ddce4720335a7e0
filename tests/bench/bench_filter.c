#include "bench_filter.h"

#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "jumplink.h"
#include "progress.h"

#define AXES 3
#define N (2 * AXES)
#define BLOCK 25                        /* steps of a sample */
#define WARM BLOCK                      /* steps that do not count */

const char *const bench_kind_names[] = { "general", "sticky", "reduce" };

/* A node's own filter, and memory for its part. */
struct bank {
    jl_mode *modes;
    jl_real *mem;               /* all reals: of the modes, the imm, and ... */
    jl_real *scratch, *x, *P, *mu;
    jl_imm imm;
    unsigned char *buf;
    int cap, *status;
    unsigned char owner[JL_MAX_MODES];
};

static void set_chain(struct bank *bank, int M, enum bench_kind kind)
{
    jl_real *Pi = calloc((size_t)(M * M), sizeof *Pi);
    int i, j;

    bench_must(Pi != NULL, "memory");
    for (i = 0; i < M; i++) {
        jl_real out = kind == GENERAL
            ? JL_C(0.02) + JL_C(0.1) * (jl_real)i / (jl_real)M : JL_C(0.1);

        for (j = 0; j < M; j++)
            Pi[i * M + j] = i == j ? 1 - out : out / (jl_real)(M - 1);
    }
    bench_must(jl_imm_chain(&bank->imm, Pi) == JL_OK, "the chain");
    bench_must(bank->imm.sticky == (kind != GENERAL || M <= 2),
               "the kind of chain");
    free(Pi);
}

static struct bank *bank_new(int M, enum bench_kind kind)
{
    struct bank *bank = calloc(1, sizeof *bank);
    const int size = JL_MODE_MEM(N, AXES, AXES);
    jl_real z[AXES] = { 0 }, *p, *state;
    int j;

    bench_must(bank != NULL, "memory");
    bank->cap = JL_PAR_BUF(M, N, AXES);
    bank->modes = calloc((size_t)M, sizeof *bank->modes);
    bank->mem = calloc((size_t)(M * size + JL_IMM_STATE(M, N, AXES)
                                + JL_IMM_SCRATCH(M, N, AXES)
                                + M * N + M * N * N + M), sizeof *p);
    bank->buf = malloc((size_t)bank->cap);
    bank->status = calloc((size_t)M, sizeof *bank->status);
    bench_must(bank->modes != NULL && bank->mem != NULL && bank->buf != NULL
               && bank->status != NULL, "memory");
    p = bank->mem;
    bank->x = p + M * size;
    bank->P = bank->x + M * N;
    bank->mu = bank->P + M * N * N;
    bank->scratch = bank->mu + M;
    state = bank->scratch + JL_IMM_SCRATCH(M, N, AXES);
    for (j = 0; j < M; j++, p += size) {
        jl_motion motion = { JL_MOTION_CV, AXES, 2, 0, 0, 20, 0 };

        motion.accel_std = JL_C(0.2) * (jl_real)(j + 1);
        bench_must(jl_mode_init(&bank->modes[j], N, AXES, AXES, p, size)
                   == JL_OK
                   && jl_mode_motion(&bank->modes[j], &motion, 1) == JL_OK,
                   "a mode");
        jl_motion_start(bank->x + j * N, bank->P + j * N * N, &motion, z, 100,
                        10);
        bank->mu[j] = 1 / (jl_real)M;
    }
    bench_must(jl_imm_init(&bank->imm, M, bank->modes, &jl_kf_joseph,
                           JL_MIX_AUTO, state, JL_IMM_STATE(M, N, AXES)) == JL_OK,
               "the filter");
    set_chain(bank, M, kind);
    bench_must(jl_imm_set(&bank->imm, bank->x, bank->P, bank->mu,
                          bank->scratch) == JL_OK, "the start");
    return bank;
}

static void bank_free(struct bank *bank)
{
    free(bank->modes);
    free(bank->mem);
    free(bank->buf);
    free(bank->status);
    free(bank);
}

/* Measurement k: a weaving path with noise. */
static void set_meas(jl_meas *meas, jl_real *z, int k)
{
    unsigned r = (unsigned)k * 2654435761u;
    int i;

    for (i = 0; i < AXES; i++) {
        r = r * 1664525u + 1013904223u;
        z[i] = (jl_real)(50 * (i + 1) * k) + (jl_real)(k * k % 97)
            + (jl_real)(r >> 16) / 2048 - 16;
    }
    meas->seq = (jl_u32)k + 1;
    meas->first = 0;
    meas->dt = 1;
    meas->z = z;
}

/* --- the ways a step is made --------------------------------------------- */

struct job {
    struct bench_case *c;
    int steps;                  /* a multiple of BLOCK                      */
    double block_us;            /* when the block began                     */
    jl_real x[N];               /* the last estimate                        */
};

/* After step k.  A sample is the mean of a block of steps, since a PE may be a
 * few steps ahead of another, and then a single one seems to take no time. */
static void note(struct job *job, int k)
{
    double now = clock_us();

    if (k >= WARM && k % BLOCK == BLOCK - 1)
        samples_add(&job->c->step, (now - job->block_us) / BLOCK);
    if (k % BLOCK == BLOCK - 1)
        job->block_us = now;
}

static void serial(struct job *job)
{
    struct bank *bank = bank_new(job->c->M, job->c->kind);
    jl_real z[AXES];
    jl_meas meas;
    int k;

    for (k = 0; k < WARM + job->steps; k++) {
        set_meas(&meas, z, k);
        bench_must(jl_imm_step(&bank->imm, z, bank->scratch) == JL_OK,
                   "a serial step");
        note(job, k);
    }
    memcpy(job->x, bank->imm.xhat, sizeof job->x);
    bank_free(bank);
}

static void all_steps(struct job *job, jl_par *par, struct bank *bank)
{
    jl_real z[AXES];
    jl_meas meas;
    int k;

    for (k = 0; k < WARM + job->steps; k++) {
        set_meas(&meas, z, k);
        bench_must(jl_par_step(par, &meas, bank->scratch) == JL_OK,
                   "a parallel step");
        if (par->config.pe == 0)
            note(job, k);
    }
    if (par->config.pe == 0)
        memcpy(job->x, bank->imm.xhat, sizeof job->x);
}

static void pe(int node, jl_chan **to, jl_chan **from, struct job *job)
{
    struct bench_case *c = job->c;
    struct bank *bank = bank_new(c->M, c->kind);
    jl_par_config config = { 0 };
    jl_real z[AXES];
    jl_par par;

    jl_par_deal(bank->owner, c->M, c->pes);
    config.pe = node;
    config.npe = c->pes;
    config.owner = bank->owner;
    config.exchange = c->kind == STICKY_REDUCE ? JL_EXCHANGE_REDUCE
                                               : JL_EXCHANGE_GATHER;
    config.to = to;
    config.from = from;
    config.to_host = c->served ? to[c->pes] : NULL;
    config.from_host = c->served ? from[c->pes] : NULL;
    config.start_us = config.timeout_us = BENCH_WAIT_US;
    bench_must(jl_par_init(&par, &bank->imm, &config, bank->buf, bank->cap,
                           bank->status, z) == JL_OK, "jl_par_init");
    if (c->served)
        bench_must(jl_par_serve(&par, bank->scratch) == JL_OK,
                   "jl_par_serve");
    else
        all_steps(job, &par, bank);
    bank_free(bank);
}

static void host(jl_chan *to, jl_chan *from, struct job *job)
{
    struct bank *bank = bank_new(job->c->M, job->c->kind);  /* for its memory */
    int M = job->c->M, k;
    jl_estimate estimate = { 0 };
    jl_real z[AXES];
    jl_meas meas;

    estimate.x = bank->x;
    estimate.P = bank->P;
    estimate.mu = bank->mu;
    bench_must(jl_host_ready(from, 0, &k, bank->buf, bank->cap, BENCH_WAIT_US)
               == JL_OK, "the PEs are not ready");
    for (k = 0; k < WARM + job->steps; k++) {
        set_meas(&meas, z, k);
        bench_must(jl_host_send(to, &meas, AXES, bank->buf, bank->cap,
                                BENCH_WAIT_US) == JL_OK
                   && jl_host_recv(from, &estimate, M, N, bank->buf,
                                   bank->cap, BENCH_WAIT_US) == JL_OK
                   && estimate.status == JL_OK, "a step of the host");
        note(job, k);
    }
    memcpy(job->x, estimate.x, sizeof job->x);
    bench_must(jl_host_stop(to, bank->buf, bank->cap, BENCH_WAIT_US)
               == JL_OK, "the end of the run");
    bank_free(bank);
}

static void body(int node, jl_chan **to, jl_chan **from, void *context)
{
    struct job *job = context;

    if (node == job->c->pes)
        host(to[0], from[0], job);
    else
        pe(node, to, from, job);
}

void bench_steps(struct bench_case *c, int steps)
{
    struct job job = { 0 };

    job.c = c;
    job.steps = steps;
    if (c->pes == 0) {
        serial(&job);
        return;
    }
    bench_run(c->port, c->pes + c->served, c->served ? c->pes : 0,
              JL_PAR_MSG(c->M, N, AXES), body, &job);
    if (c->kind != STICKY_REDUCE) {
        struct bench_case alone = { c->kind, c->M, 0, ON_LOOP, 0, { 0 } };
        struct job same = { &alone, steps, 0, { 0 } };

        serial(&same);
        free(alone.step.us);
        bench_must(memcmp(job.x, same.x, sizeof same.x) == 0,
                   "not the serial filter's bits");
    }
}

/* About as long for each size. */
static int steps_of(int M)
{
    return M <= 16 ? 300 : M <= 64 ? 150 : 50;
}

void bench_rounds(struct bench_case *cases, int count, int rounds,
                  const char *name)
{
    int round, i;

    progress_begin(name);
    for (round = 0; round < rounds; round++)
        for (i = 0; i < count; i++) {
            if (cases[i].M > 0)
                bench_steps(&cases[i], steps_of(cases[i].M));
            progress(round * count + i + 1, rounds * count);
        }
    progress_begin(NULL);
}
