/* The parallel IMM on port loop: the serial filter's bits for any number of
 * PEs, with buffered channels and under strict rendezvous. */
#include "par_case.h"

#include "loop/port_loop.h"

struct run {
    jl_loop *loop;
    struct par_shape shape;
    int status[JL_MAX_PES + 1], blamed[JL_MAX_PES + 1];
    struct par_trace trace;
};

static void body(int node, void *context)
{
    struct run *run = context;
    jl_chan *to[JL_MAX_PES + 1] = { NULL }, *from[JL_MAX_PES + 1] = { NULL };
    int i, npe = run->shape.npe;

    for (i = 0; i <= npe && node <= npe; i++)
        if (i != node && (i == npe || node == npe
                          || jl_topo_relays(run->shape.topology, npe, node, i)
                             == 0)) {
            to[i] = jl_loop_tx(run->loop, node, i);
            from[i] = jl_loop_rx(run->loop, i, node);
        }
    if (node <= npe)
        from[node] = jl_loop_rx(run->loop, npe + 1, node);
    if (node > npe)
        (void)jl_chan_recv(jl_loop_rx(run->loop, run->shape.hangs, node),
                           NULL, 0, PAR_ASLEEP_US);
    else if (node == npe)
        run->status[node] = par_host(&run->trace, &run->shape, to[0],
                                     from[0], &run->blamed[node]);
    else
        run->status[node] = par_pe(node, &run->shape, to, from,
                                   &run->blamed[node]);
}

static void start(struct run *run, int slots)
{
    /* the last node does nothing but never send, for a PE to sleep on */
    run->loop = jl_loop_new(run->shape.npe + 2,
                            JL_PAR_MSG(run->shape.M, PAR_N, PAR_Z), slots);
    assert_non_null(run->loop);
    assert_int_equal(jl_loop_run(run->loop, body, run), JL_OK);
    jl_loop_free(run->loop);
}

static void parallel(struct run *run, int slots)
{
    int i;

    start(run, slots);
    for (i = 0; i <= run->shape.npe; i++)
        assert_int_equal(run->status[i], JL_OK);
    assert_int_equal(run->blamed[run->shape.npe], -1);
}

static void compare(struct run *run, int slots)
{
    static struct par_trace serial;
    int i, failures = 0;

    par_serial(&serial, &run->shape);
    parallel(run, slots);
    for (i = 0; i < PAR_STEPS; i++)
        failures += serial.status[i] != JL_OK;
    if (run->shape.M == PAR_M && !run->shape.sizes)
        assert_true(failures > 0);      /* the comparison covers failed steps */
    assert_same_bits(&run->trace, &serial, sizeof serial);
}

/* Channels that are rendezvous, that hold one message, and two. */
static void compare_all(struct run *run)
{
    struct par_shape *s = &run->shape;
    int slots, f;

    for (s->sticky = 0; s->sticky < 2; s->sticky++)
        for (slots = 0; slots <= 2; slots++)
            for (f = 0; f < PAR_FORMS; f++) {
                s->form = par_forms[f];
                compare(run, slots);
            }
}

static void test_par_gives_serial_bits_for_any_pes_and_topology(void **state)
{
    static struct run run = { .shape = { .hangs_at = -1 } };
    struct par_shape *s = &run.shape;

    (void)state;
    s->M = PAR_M;
    for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
         s->topology++)
        for (s->npe = 1; s->npe <= 8; s->npe++)
            compare_all(&run);
}

static void test_par_gives_serial_bits_with_functions(void **state)
{
    static const jl_kf_form *const forms[] = {
        &jl_kf_joseph, &jl_kf_standard, &jl_kf_sqrt, &jl_kf_unscented
    };
    static struct run run = { .shape = { .hangs_at = -1, .nonlinear = 1 } };
    struct par_shape *s = &run.shape;
    int f;

    (void)state;
    s->M = PAR_M;
    for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
         s->topology++)
        for (s->npe = 1; s->npe <= 5; s->npe++)
            for (s->sticky = 0; s->sticky < 2; s->sticky++)
                for (f = 0; f < 4; f++) {
                    s->form = forms[f];
                    compare(&run, s->npe % 3);
                }
}

static void test_par_gives_serial_bits_on_sixteen_pes(void **state)
{
    static struct run run = { .shape = { .hangs_at = -1 } };
    struct par_shape *s = &run.shape;
    int slots;

    (void)state;
    s->form = &jl_kf_joseph;
    for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
         s->topology++)
        for (s->M = 15; s->M <= PAR_MOST; s->M++)
            for (slots = 0; slots <= 2; slots++) {
                s->npe = s->M;
                compare(&run, slots);
            }
}

static void test_par_leaves_spare_pes_idle(void **state)
{
    static struct run run = { .shape = { .hangs_at = -1 } };
    struct par_shape *s = &run.shape;
    int slots;

    (void)state;
    s->form = &jl_kf_joseph;
    s->npe = JL_MAX_PES;
    for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
         s->topology++)
        for (s->M = 1; s->M <= PAR_M; s->M += 2)
            for (slots = 0; slots < 2; slots++)
                compare(&run, slots);
}

/* --- the gate ------------------------------------------------------------- */

/* The reference shows what is to be compared: rejections, some after some that
 * are missing, and measurements accepted after too many of them. */
static void check_gated(const struct par_shape *shape)
{
    static struct par_trace serial;
    int k, run = 0, rejected = 0, forced = 0;

    par_serial(&serial, shape);
    for (k = 0; k < PAR_STEPS && serial.status[k] == JL_OK; k++)
        if (serial.verdict[k] == JL_REJECTED) {
            run++;
            rejected++;
        } else if (serial.verdict[k] == JL_ACCEPTED) {
            forced += run == JL_GATE_MOST;
            run = 0;
        }
    assert_int_equal(serial.verdict[18], JL_REJECTED);  /* JL_REAL_MAX */
    assert_true(rejected >= 14);
    assert_int_equal(forced, 2);
    assert_int_equal(serial.verdict[33], JL_MISSING);
}

static void test_par_gate_gives_serial_bits(void **state)
{
    static struct run run = { .shape = { .hangs_at = -1, .gate = 1 } };
    struct par_shape *s = &run.shape;

    (void)state;
    s->M = PAR_M;
    for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
         s->topology++)
        for (s->npe = 1; s->npe <= 8; s->npe++) {
            compare_all(&run);
            check_gated(s);
        }
}

static void test_par_gate_with_few_modes(void **state)
{
    static struct run run = { .shape = { .hangs_at = -1, .gate = 1 } };
    struct par_shape *s = &run.shape;

    (void)state;
    for (s->M = 1; s->M <= 5; s->M++)
        for (s->npe = 1; s->npe <= 5; s->npe += 2)
            compare_all(&run);
}

/* A PE alone has nothing to reduce. */
static void test_par_gate_is_not_for_an_all_reduce(void **state)
{
    static struct run run = { .shape = { .hangs_at = -1, .gate = 1 } };
    struct par_shape *s = &run.shape;
    int k;

    (void)state;
    s->form = &jl_kf_joseph;
    s->M = PAR_M;
    s->sticky = 1;
    s->exchange = JL_EXCHANGE_REDUCE;
    for (s->npe = 2; s->npe <= 5; s->npe++) {
        parallel(&run, 1);
        for (k = 0; k < PAR_STEPS; k++)
            assert_int_equal(run.trace.status[k], JL_EGATE);
    }
    s->npe = 1;
    compare(&run, 1);
    assert_int_equal(run.trace.verdict[14], JL_REJECTED);
}

/* --- modes of different states -------------------------------------------- */

static void test_par_sizes_give_serial_bits(void **state)
{
    static struct run run = { .shape = { .hangs_at = -1, .sizes = 1 } };
    struct par_shape *s = &run.shape;
    int f, slots;

    (void)state;
    s->M = PAR_M;
    for (s->npe = 1; s->npe <= 8; s->npe++)
        for (f = 0; f < PAR_FORMS; f++)
            for (s->sticky = 0; s->sticky < 2; s->sticky++)
                for (s->gate = 0; s->gate < 2; s->gate++)
                    for (slots = 0; slots <= 1; slots++) {
                        s->form = par_forms[f];
                        s->topology = s->npe % (JL_TOPO_CHAIN + 1);
                        compare(&run, slots);
                    }
}

/* --- the all-reduce ------------------------------------------------------ */

/* The metric of a reference case: x in sigmas, P by sigmas, mu absolute, the
 * log-likelihood by 1 + |loglik|.  The limits are those of ordinary cases up
 * to the outlier, of 1000 sigma: the modes' log-likelihoods are then differences
 * of numbers of 1e6, and mu has their rounding.  The last steps are not compared: after a
 * measurement of JL_LARGE a spread is the rounding of means, squared, and it
 * decides what still fits. */
static void assert_close_trace(const struct par_trace *a,
                               const struct par_trace *b)
{
    int k, i, j;

    for (k = 0; k < 50; k++) {
        double within = k >= 25 ? 4 * (double)JL_EPSILON * 1e6
            : JL_REAL_FLOAT ? 2e-3 : 1e-11;

        assert_int_equal(a->status[k], b->status[k]);
        for (i = 0; i < PAR_N; i++) {
            double sigma = sqrt((double)b->P[k][i * PAR_N + i]);

            assert_close(a->x[k][i], b->x[k][i], within * sigma);
            for (j = 0; j < PAR_N; j++)
                assert_close(a->P[k][i * PAR_N + j], b->P[k][i * PAR_N + j],
                             within * sigma
                             * sqrt((double)b->P[k][j * PAR_N + j]));
        }
        for (j = 0; j < PAR_MOST; j++)
            assert_close(a->mu[k][j], b->mu[k][j], within);
        assert_close(a->loglik[k], b->loglik[k],
                     within * (1 + fabs((double)b->loglik[k])));
    }
}

static void check_reduce(const jl_kf_form *form, int sizes)
{
    static struct run run = { .shape = { .hangs_at = -1 } };
    static struct par_trace serial, full;
    struct par_shape *s = &run.shape;
    int slots;

    s->form = form;
    s->sticky = 1;
    s->exchange = JL_EXCHANGE_REDUCE;
    s->sizes = sizes;
    for (s->M = 1; s->M <= PAR_M; s->M += 2)
        for (s->npe = 1; s->npe <= 8; s->npe++) {
            par_serial(&serial, s);
            for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
                 s->topology++)
                for (slots = 0; slots <= 2; slots++) {
                    parallel(&run, slots);
                    assert_close_trace(&run.trace, &serial);
                    if (s->topology == JL_TOPO_FULL && slots == 0)
                        full = run.trace;
                    assert_same_bits(&run.trace, &full, sizeof full);
                }
        }
}

static void test_par_reduce_equals_serial_up_to_rounding(void **state)
{
    (void)state;
    check_reduce(&jl_kf_joseph, 0);
    check_reduce(&jl_kf_sqrt, 0);
}

static void test_par_sizes_reduce_equals_serial_up_to_rounding(void **state)
{
    (void)state;
    check_reduce(&jl_kf_joseph, 1);
    check_reduce(&jl_kf_sqrt, 1);
}

static void test_par_reduce_refuses_a_chain_that_is_not_sticky(void **state)
{
    static struct run run = { .shape = { .hangs_at = -1 } };
    int k;

    (void)state;
    run.shape.form = &jl_kf_joseph;
    run.shape.M = PAR_M;
    run.shape.npe = 3;
    run.shape.exchange = JL_EXCHANGE_REDUCE;
    parallel(&run, 1);
    for (k = 0; k < PAR_STEPS; k++)
        assert_int_equal(run.trace.status[k], JL_ECHAIN);
}

/* --- the constant-gain IMM ------------------------------------------------ */

/* The reference covers lost measurements, steps that fail, two starts. */
static void check_cg(const struct par_shape *shape)
{
    static struct par_trace serial;
    int k, failures = 0;

    par_serial(&serial, shape);
    for (k = 0; k < PAR_STEPS; k++)
        failures += serial.status[k] != JL_OK;
    assert_int_equal(failures, 3);
    assert_int_equal(serial.status[18], JL_ENONFINITE);
    assert_int_equal(serial.status[20], JL_ENONFINITE);
    assert_int_equal(serial.status[43], JL_ERANGE);
    assert_int_equal(serial.verdict[5], JL_MISSING);
    assert_int_equal(serial.verdict[34], JL_MISSING);
    assert_int_equal(serial.verdict[25], JL_ACCEPTED);
}

static void test_par_cg_gives_serial_bits(void **state)
{
    static const int modes[] = { 1, 2, 3, 8 };
    static struct run run = { .shape = { .hangs_at = -1 } };
    struct par_shape *s = &run.shape;
    int k, slots;

    (void)state;
    for (k = 0; k < 4; k++)
        for (s->axes = 1; s->axes <= PAR_CG_AXES; s->axes++) {
            s->M = modes[k];
            check_cg(s);
            for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
                 s->topology++)
                for (s->npe = 1; s->npe <= 8; s->npe++)
                    for (slots = 0; slots <= 2; slots++)
                        compare(&run, slots);
        }
}

static void test_par_cg_heeds_the_owner_table(void **state)
{
    static const unsigned char owners[][8] = {
        { 1, 0, 1, 1, 1, 1, 1, 1 }, { 2, 0, 0, 1, 1, 1, 0, 2 },
        { 2, 1, 0, 0, 0, 0, 0, 0 }
    };
    static const int least[] = { 2, 4, 3 };     /* modes, to need the PEs */
    static struct run run = { .shape = { .hangs_at = -1 } };
    struct par_shape *s = &run.shape;
    int k;

    (void)state;
    s->npe = 4;
    for (k = 0; k < 3; k++)
        for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
             s->topology++)
            for (s->M = least[k]; s->M <= 8; s->M++) {
                s->owner = owners[k];
                s->axes = 1 + s->M % PAR_CG_AXES;
                compare(&run, s->M % 3);
            }
}

static void test_par_cg_blames_the_dead(void **state)
{
    static struct run run;
    struct par_shape *s = &run.shape;
    int pe;

    (void)state;
    s->M = 4;
    s->npe = 4;
    s->axes = 1;
    s->hangs_at = 7;
    for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
         s->topology++)
        for (s->hangs = 0; s->hangs < s->npe; s->hangs++) {
            start(&run, s->hangs % 3);
            for (pe = 0; pe <= s->npe; pe++)
                if (pe != s->hangs) {
                    assert_true(run.status[pe] != JL_OK);
                    if (pe < s->npe || s->hangs > 0)
                        assert_int_equal(run.blamed[pe], s->hangs);
                }
        }
}

#define CG_PES 3
#define CG_ROWS 20

/* Every PE steps by itself, with measurements that it has already; with one of
 * them something is wrong. */
struct alone {
    jl_loop *loop;
    void (*live)(struct alone *a, int pe, jl_par *par);
    int M, bad_pe;
    int status[CG_PES][CG_ROWS];
    struct par_cg_bank bank[CG_PES];
};

#define BAD_ROW(k) ((k) % 6 == 3)

/* It has got bad measurements. */
static void step_alone(struct alone *a, int pe, jl_par *par)
{
    struct par_cg_bank *bank = &a->bank[pe], before;
    jl_real z[1];
    jl_meas meas;
    int k, bad;

    for (k = 1; k < CG_ROWS; k++) {
        before = *bank;
        par_cg_meas(&meas, z, k, 1);
        bad = BAD_ROW(k) || meas.z == NULL;
        meas.z = z;
        if (bad && pe == a->bad_pe)
            z[0] = k % 2 ? JL_REAL_MAX : jl_log(0);
        a->status[pe][k] = jl_par_step(par, &meas, bank->scratch);
        if (a->status[pe][k] != JL_OK) {
            const jl_cgimm *cg = &bank->cg;

            assert_same_bits(cg->mu, before.mem + (cg->mu - bank->mem),
                             (size_t)a->M * sizeof *z);
            assert_same_bits(cg->x, before.mem + (cg->x - bank->mem),
                             (size_t)(3 * a->M) * sizeof *z);
            assert_same_bits(cg->w, before.mem + (cg->w - bank->mem),
                             (size_t)(3 * a->M) * sizeof *z);
        }
        if (k % 2)
            jl_par_ahead(par, bank->scratch);
    }
}

static void alone_body(int pe, void *context)
{
    struct alone *a = context;
    jl_chan *to[CG_PES] = { NULL }, *from[CG_PES] = { NULL };
    unsigned char owner[PAR_CG_M], buf[JL_PAR_CG_BUF(PAR_CG_M, 1)];
    int status[PAR_CG_M], i;
    jl_par_config config = { 0 };
    jl_real z[1];
    jl_par par;

    for (i = 0; i < CG_PES; i++)
        if (i != pe) {
            to[i] = jl_loop_tx(a->loop, pe, i);
            from[i] = jl_loop_rx(a->loop, i, pe);
        }
    jl_par_deal(owner, a->M, CG_PES);
    config.pe = pe;
    config.npe = CG_PES;
    config.owner = owner;
    config.to = to;
    config.from = from;
    config.timeout_us = 1000000;
    par_cg_init(&a->bank[pe], a->M, 1);
    assert_int_equal(jl_par_init_cg(&par, &a->bank[pe].cg, &config, buf,
                                    sizeof buf, status, z), JL_OK);
    a->live(a, pe, &par);
}

/* All PEs tell the same, and go on as if the step had not been. */
static void test_par_cg_fails_for_all_or_none(void **state)
{
    static struct alone a;
    static struct par_cg_bank serial;
    jl_real z[1];
    jl_meas meas;
    int k, pe;

    (void)state;
    a.live = step_alone;
    for (a.M = CG_PES; a.M <= PAR_CG_M; a.M += a.M < 8 ? 1 : PAR_CG_M - 8)
        for (a.bad_pe = 0; a.bad_pe < CG_PES; a.bad_pe++) {
            a.loop = jl_loop_new(CG_PES, JL_PAR_CG_MSG(PAR_CG_M, 1), 1);
            assert_int_equal(jl_loop_run(a.loop, alone_body, &a), JL_OK);
            jl_loop_free(a.loop);
            par_cg_init(&serial, a.M, 1);
            for (k = 1; k < CG_ROWS; k++) {
                par_cg_meas(&meas, z, k, 1);
                if (BAD_ROW(k) || meas.z == NULL || k == 18)
                    meas.z = NULL;
                else
                    assert_int_equal(jl_cgimm_step(&serial.cg, z), JL_OK);
                for (pe = 0; pe < CG_PES; pe++)
                    assert_int_equal(a.status[pe][k],
                                     meas.z == NULL ? JL_ENONFINITE : JL_OK);
            }
            for (pe = 0; pe < CG_PES; pe++) {
                const jl_cgimm *cg = &a.bank[pe].cg;

                assert_same_bits(cg->x, serial.cg.x,
                                 (size_t)(3 * a.M) * sizeof *z);
                assert_same_bits(cg->mu, serial.cg.mu,
                                 (size_t)a.M * sizeof *z);
                assert_same_bits(cg->w, serial.cg.w,
                                 (size_t)(3 * a.M) * sizeof *z);
                assert_same_bits(cg->xhat, serial.cg.xhat, 3 * sizeof *z);
            }
        }
}

/* Its own mode has come to infinity. */
static void step_spoilt(struct alone *a, int pe, jl_par *par)
{
    struct par_cg_bank *bank = &a->bank[pe], before;
    jl_real z[1];
    jl_meas meas;
    int k;

    if (pe == a->bad_pe)
        bank->cg.x[3 * pe + 1] = -jl_log(0);
    for (k = 1; k < 4; k++) {
        before = *bank;
        par_cg_meas(&meas, z, k, 1);
        a->status[pe][k] = jl_par_step(par, &meas, bank->scratch);
        assert_same_bits(bank->cg.x, before.mem + (before.cg.x - bank->mem),
                         (size_t)(3 * a->M) * sizeof *z);
        assert_same_bits(bank->cg.mu, before.mem + (before.cg.mu - bank->mem),
                         (size_t)a->M * sizeof *z);
    }
}

static void test_par_cg_infinity_spreads_to_nobody(void **state)
{
    static struct alone a;
    int k, pe;

    (void)state;
    a.live = step_spoilt;
    a.M = CG_PES;
    for (a.bad_pe = 0; a.bad_pe < CG_PES; a.bad_pe++) {
        a.loop = jl_loop_new(CG_PES, JL_PAR_CG_MSG(PAR_CG_M, 1), 1);
        assert_int_equal(jl_loop_run(a.loop, alone_body, &a), JL_OK);
        jl_loop_free(a.loop);
        for (k = 1; k < 4; k++)
            for (pe = 0; pe < CG_PES; pe++)
                assert_int_equal(a.status[pe][k], JL_ENONFINITE);
    }
}

/* --- death ---------------------------------------------------------------- */

/* Whoever hangs, at the start or in a step: all others blame that PE, however
 * many relays are between, and the host hears that the run is over. */
static void test_par_blames_the_dead_and_not_the_relay(void **state)
{
    static struct run run;
    struct par_shape *s = &run.shape;
    int slots, pe;

    (void)state;
    s->form = &jl_kf_joseph;
    s->M = PAR_M;
    for (s->topology = JL_TOPO_FULL; s->topology <= JL_TOPO_CHAIN;
         s->topology++)
        for (s->npe = 2; s->npe <= 6; s->npe++)
            for (s->hangs = 0; s->hangs < s->npe; s->hangs++)
                for (s->hangs_at = 0; s->hangs_at < 8; s->hangs_at += 7)
                    for (slots = 0; slots <= 2; slots++) {
                        start(&run, slots);
                        for (pe = 0; pe <= s->npe; pe++)
                            if (pe != s->hangs) {
                                assert_true(run.status[pe] != JL_OK);
                                if (pe < s->npe || s->hangs > 0)
                                    assert_int_equal(run.blamed[pe],
                                                     s->hangs);
                            }
                    }
}

/* --- what PE0 refuses ---------------------------------------------------- */

#define REFUSALS 9

static const struct par_shape one_pe = {
    .npe = 1, .M = 3, .sticky = 1, .form = &jl_kf_joseph, .hangs_at = -1
};

struct refusal {
    jl_loop *loop;
    int pe_status, answer[REFUSALS], good;
};

/* A measurement as octets, sent as it is; the status of the answer. */
static int offer(struct refusal *r, const unsigned char *msg, int len)
{
    unsigned char buf[JL_PAR_MSG(PAR_M, PAR_N, PAR_Z)];
    jl_real x[PAR_N], P[PAR_N * PAR_N], mu[PAR_M];
    jl_estimate estimate = { 0 };

    estimate.x = x;
    estimate.P = P;
    estimate.mu = mu;
    assert_int_equal(jl_chan_send(jl_loop_tx(r->loop, 1, 0), msg, len, 0), 0);
    assert_int_equal(jl_host_recv(jl_loop_rx(r->loop, 0, 1), &estimate, 3,
                                  PAR_N, buf, sizeof buf, 1000000), 0);
    if (len >= 8)                       /* an answer bears its question's seq */
        assert_int_equal(estimate.seq, jl_get_u32(msg + 4));
    return estimate.status;
}

static int offer_meas(struct refusal *r, jl_u32 seq, jl_real dt, jl_real z0,
                      int m)
{
    jl_real z[3] = { 0 };
    unsigned char msg[64] = { 2, 0 };   /* the layout of par_msg.h */

    z[0] = z0;
    jl_put_u16(msg + 2, (unsigned)m);
    jl_put_u32(msg + 4, seq);
    jl_put_reals(msg + 8, &dt, 1);
    jl_put_reals(msg + 8 + JL_REAL_OCTETS, z, m);
    return offer(r, msg, 8 + (1 + m) * JL_REAL_OCTETS);
}

static void refusal_body(int node, void *context)
{
    struct refusal *r = context;
    jl_chan *to[2] = { NULL }, *from[2] = { NULL };
    unsigned char buf[64], garbage[5] = { 9, 9, 9, 9, 9 };
    jl_real zero = 0, one = 1;
    int n = 0;

    to[1 - node] = jl_loop_tx(r->loop, node, 1 - node);
    from[1 - node] = jl_loop_rx(r->loop, 1 - node, node);
    if (node == 0) {
        r->pe_status = par_pe(0, &one_pe, to, from, NULL);
        return;
    }
    assert_int_equal(jl_host_ready(from[0], 7, &n, buf, sizeof buf, 1000000),
                     0);
    n = 0;
    r->answer[n++] = offer_meas(r, 1, 1, zero / zero, 2);
    r->good = offer_meas(r, 1, 1, 3, 2) == JL_OK;
    r->answer[n++] = offer(r, garbage, 5);
    r->answer[n++] = offer(r, garbage, 0);
    r->answer[n++] = offer_meas(r, 2, 1, 3, 3);
    r->answer[n++] = offer_meas(r, 1, 1, 3, 2);
    r->answer[n++] = offer_meas(r, 2, -1, 3, 2);
    r->answer[n++] = offer_meas(r, 3, 1, zero / zero, 2);
    r->answer[n++] = offer_meas(r, 4, one / zero, 3, 2);
    r->answer[n++] = offer_meas(r, 5, 1, one / zero, 2);
    r->good += offer_meas(r, 6, 1, 3, 2) == JL_OK;
    assert_int_equal(jl_host_stop(to[0], buf, sizeof buf, 0), 0);
}

static void test_par_refuses_bad_measurements_with_a_code(void **state)
{
    static const int want[REFUSALS] = {
        JL_ENONFINITE, JL_ELENGTH, JL_ELENGTH, JL_EMSG, JL_EMSG, JL_ETIME,
        JL_ENONFINITE, JL_ENONFINITE, JL_ENONFINITE
    };
    struct refusal r = { 0 };
    int i;

    (void)state;
    r.loop = jl_loop_new(2, JL_PAR_MSG(PAR_M, PAR_N, PAR_Z), 2);
    assert_int_equal(jl_loop_run(r.loop, refusal_body, &r), JL_OK);
    jl_loop_free(r.loop);
    assert_int_equal(r.pe_status, JL_OK);
    assert_int_equal(r.good, 2);
    for (i = 0; i < REFUSALS; i++)
        assert_int_equal(r.answer[i], want[i]);
}

/* --- a PE1 that says what does not belong here --------------------------- */

static const struct par_shape two_pes = {
    .npe = 2, .M = 3, .sticky = 1, .form = &jl_kf_joseph, .hangs_at = -1
};

#define X_TOP (9 + 2 * JL_REAL_OCTETS)         /* of x[0] in MODES */
#define MODES_LEN (8 + 2 + (1 + PAR_N + JL_PACKED(PAR_N)) * JL_REAL_OCTETS)

/* One octet of its READY or its MODES is another, or octets are missing. */
struct odd {
    int in_modes, at, value, missing;
    int status;                 /* what PE0 and the host get                */
};

struct barrier {
    jl_loop *loop;
    const struct odd *odd;
    int status, blamed, host_status, host_blamed;
};

static void odd_pe1(const struct odd *odd, jl_chan *to, jl_chan *from)
{
    unsigned char in[JL_PAR_MSG(PAR_M, PAR_N, PAR_Z)];
    unsigned char ready[8] = { 1, 1, 2, 0, 7, 0, 0, 0 };
    unsigned char modes[MODES_LEN] = { 3, 1, 1, 0, 1, 0, 0, 0 };

    modes[X_TOP - 1] = JL_REAL_FLOAT ? 0x80 : 0xf0;     /* next to nothing */
    if (odd->at >= 0)
        (odd->in_modes ? modes : ready)[odd->at] = (unsigned char)odd->value;
    (void)jl_chan_send(to, ready, 8 - !odd->in_modes * odd->missing, 0);
    if (!odd->in_modes)
        return;                 /* it cannot be told: the host still can */
    (void)jl_chan_recv(from, in, sizeof in, 1000000);   /* READY */
    if (jl_chan_recv(from, in, sizeof in, 1000000) > 0) /* MEAS */
        (void)jl_chan_send(to, modes, MODES_LEN - odd->missing, 0);
}

static int meet_odd_pe1(jl_chan *to, jl_chan *from, int *blamed)
{
    unsigned char buf[JL_PAR_MSG(PAR_M, PAR_N, PAR_Z)];
    jl_real x[PAR_N], P[PAR_N * PAR_N], mu[PAR_M], z[PAR_Z];
    jl_estimate estimate = { 0 };
    jl_meas meas;
    int status = jl_host_ready(from, 7, blamed, buf, sizeof buf, 1000000);

    estimate.x = x;
    estimate.P = P;
    estimate.mu = mu;
    par_meas(&meas, z, 0);
    if (status == JL_OK)
        status = jl_host_send(to, &meas, PAR_Z, buf, sizeof buf, 0);
    if (status == JL_OK) {
        status = jl_host_recv(from, &estimate, 3, PAR_N, buf, sizeof buf,
                              60000000);
        *blamed = estimate.failed_pe;
    }
    return status;
}

static void barrier_body(int node, void *context)
{
    struct barrier *b = context;
    jl_chan *to[3] = { NULL }, *from[3] = { NULL };
    int i;

    for (i = 0; i < 3; i++)
        if (i != node) {
            to[i] = jl_loop_tx(b->loop, node, i);
            from[i] = jl_loop_rx(b->loop, i, node);
        }
    if (node == 0)
        b->status = par_pe(0, &two_pes, to, from, &b->blamed);
    else if (node == 1)
        odd_pe1(b->odd, to[0], from[0]);
    else
        b->host_status = meet_odd_pe1(to[0], from[0], &b->host_blamed);
}

static void test_par_believes_no_odd_pe(void **state)
{
    static const struct odd odds[] = {
        { 0, 0, 9, 0, JL_EMSG },        /* type */
        { 0, 1, 0, 0, JL_EMSG },        /* about PE0 */
        { 0, 1, 2, 0, JL_EMSG },        /* about a PE that is not there */
        { 0, 2, 3, 0, JL_EMODEL },      /* of three PEs */
        { 0, 4, 8, 0, JL_EMODEL },      /* fingerprint */
        { 0, -1, 0, 1, JL_EMSG },
        { 1, 0, 9, 0, JL_EMSG },        /* type */
        { 1, 0, 7, 0, JL_EMSG },        /* of a constant-gain IMM */
        { 1, 1, 0, 0, JL_EMSG },        /* from PE0 */
        { 1, 2, 2, 0, JL_EMSG },        /* two modes */
        { 1, 4, 2, 0, JL_EMSG },        /* of another measurement */
        { 1, 7, 1, 0, JL_EMSG },
        { 1, X_TOP, 0x7f, 0, JL_EMSG }, /* infinity */
        { 1, -1, 0, 1, JL_ELENGTH }
    };
    static const struct odd good = { 1, -1, 0, 0, JL_OK };
    size_t k;

    (void)state;
    for (k = 0; k <= sizeof odds / sizeof *odds; k++) {
        struct barrier b = { 0 };

        b.odd = k == 0 ? &good : &odds[k - 1];
        b.loop = jl_loop_new(3, JL_PAR_MSG(PAR_M, PAR_N, PAR_Z), 2);
        assert_int_equal(jl_loop_run(b.loop, barrier_body, &b), JL_OK);
        jl_loop_free(b.loop);
        assert_int_equal(b.host_status, b.odd->status);
        assert_int_equal(b.host_blamed, k == 0 ? -1 : 1);
        if (k == 0)
            continue;
        assert_int_equal(b.status, b.odd->status);
        assert_int_equal(b.blamed, 1);
    }
}

/* --- init ---------------------------------------------------------------- */

static void test_par_init_refuses_what_does_not_fit(void **state)
{
    static struct par_bank bank;
    unsigned char owner[PAR_M], buf[JL_PAR_BUF(PAR_M, PAR_N, PAR_Z)];
    int mode_status[PAR_M];
    jl_real z[PAR_Z];
    jl_chan small = { 0 }, *chans[2];
    jl_par_config config = { 0 };
    jl_par par, before;

    (void)state;
    par_bank_init(&bank, 4, 1, &jl_kf_joseph);
    small.max_len = 16;
    chans[0] = chans[1] = &small;
    memset(&par, 0x5a, sizeof par);
    before = par;
    config.npe = 2;
    config.owner = owner;
    config.to = config.from = chans;
    jl_par_deal(owner, 4, 2);
    assert_int_equal(jl_par_init(&par, &bank.imm, &config, buf, sizeof buf,
                                 mode_status, z), JL_ETOOLONG);
    small.max_len = 1 << 20;
    assert_int_equal(jl_par_init(&par, &bank.imm, &config, buf, 100,
                                 mode_status, z), JL_ENOMEM);
    config.pe = 2;
    assert_int_equal(jl_par_init(&par, &bank.imm, &config, buf, sizeof buf,
                                 mode_status, z), JL_EDIM);
    config.pe = 0;
    owner[3] = 2;                       /* a PE that is not there */
    assert_int_equal(jl_par_init(&par, &bank.imm, &config, buf, sizeof buf,
                                 mode_status, z), JL_EDIM);
    memset(owner, 1, sizeof owner);     /* PE0 owns nothing */
    assert_int_equal(jl_par_init(&par, &bank.imm, &config, buf, sizeof buf,
                                 mode_status, z), JL_EDIM);
    config.npe = JL_MAX_PES + 1;
    assert_int_equal(jl_par_init(&par, &bank.imm, &config, buf, sizeof buf,
                                 mode_status, z), JL_EDIM);
    assert_same_bits(&par, &before, sizeof par);
}

static void test_par_cg_init_refuses_what_does_not_fit(void **state)
{
    static struct par_cg_bank bank;
    unsigned char owner[2] = { 0, 1 }, buf[JL_PAR_CG_BUF(2, 3)];
    int mode_status[2];
    jl_real z[3];
    jl_chan small = { 0 }, *chans[2];
    jl_par_config config = { 0 };
    jl_par par, before;

    (void)state;
    par_cg_init(&bank, 2, 3);
    small.max_len = JL_PAR_CG_MSG(2, 3) - 1;
    chans[0] = chans[1] = &small;
    memset(&par, 0x5a, sizeof par);
    before = par;
    config.npe = 2;
    config.owner = owner;
    config.to = config.from = chans;
    config.exchange = JL_EXCHANGE_REDUCE;
    assert_int_equal(jl_par_init_cg(&par, &bank.cg, &config, buf, sizeof buf,
                                    mode_status, z), JL_ECHAIN);
    config.exchange = JL_EXCHANGE_GATHER;
    assert_int_equal(jl_par_init_cg(&par, &bank.cg, &config, buf, sizeof buf,
                                    mode_status, z), JL_ETOOLONG);
    small.max_len++;
    assert_int_equal(jl_par_init_cg(&par, &bank.cg, &config, buf,
                                    sizeof buf - 1, mode_status, z),
                     JL_ENOMEM);
    owner[1] = 2;
    assert_int_equal(jl_par_init_cg(&par, &bank.cg, &config, buf, sizeof buf,
                                    mode_status, z), JL_EDIM);
    assert_same_bits(&par, &before, sizeof par);
    owner[1] = 1;
    assert_int_equal(jl_par_init_cg(&par, &bank.cg, &config, buf, sizeof buf,
                                    mode_status, z), JL_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_par_gives_serial_bits_for_any_pes_and_topology),
        cmocka_unit_test(test_par_gives_serial_bits_with_functions),
        cmocka_unit_test(test_par_gives_serial_bits_on_sixteen_pes),
        cmocka_unit_test(test_par_leaves_spare_pes_idle),
        cmocka_unit_test(test_par_gate_gives_serial_bits),
        cmocka_unit_test(test_par_gate_with_few_modes),
        cmocka_unit_test(test_par_gate_is_not_for_an_all_reduce),
        cmocka_unit_test(test_par_sizes_give_serial_bits),
        cmocka_unit_test(test_par_reduce_equals_serial_up_to_rounding),
        cmocka_unit_test(test_par_sizes_reduce_equals_serial_up_to_rounding),
        cmocka_unit_test(test_par_reduce_refuses_a_chain_that_is_not_sticky),
        cmocka_unit_test(test_par_cg_gives_serial_bits),
        cmocka_unit_test(test_par_cg_heeds_the_owner_table),
        cmocka_unit_test(test_par_cg_blames_the_dead),
        cmocka_unit_test(test_par_cg_fails_for_all_or_none),
        cmocka_unit_test(test_par_cg_infinity_spreads_to_nobody),
        cmocka_unit_test(test_par_blames_the_dead_and_not_the_relay),
        cmocka_unit_test(test_par_refuses_bad_measurements_with_a_code),
        cmocka_unit_test(test_par_believes_no_odd_pe),
        cmocka_unit_test(test_par_init_refuses_what_does_not_fit),
        cmocka_unit_test(test_par_cg_init_refuses_what_does_not_fit),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
