/* The parallel IMM on port loop: the serial filter's bits for any number of
 * PEs, with buffered channels and under strict rendezvous. */
#include "par_case.h"

#include "loop/port_loop.h"

struct run {
    jl_loop *loop;
    int npe, M, sticky;
    const jl_kf_form *form;
    int status[JL_MAX_PES + 1];
    struct par_trace trace;
};

static void body(int node, void *context)
{
    struct run *run = context;
    jl_chan *to[JL_MAX_PES + 1] = { NULL }, *from[JL_MAX_PES + 1] = { NULL };
    int i;

    for (i = 0; i <= run->npe; i++)
        if (i != node) {
            to[i] = jl_loop_tx(run->loop, node, i);
            from[i] = jl_loop_rx(run->loop, i, node);
        }
    if (node == run->npe)
        run->status[node] = par_host(&run->trace, run->M, to[0], from[0]);
    else
        run->status[node] = par_pe(node, run->npe, run->M, run->sticky,
                                   run->form, to, from);
}

static void compare(struct run *run, int slots)
{
    static struct par_trace serial;
    int i, failures = 0;

    par_serial(&serial, run->M, run->sticky, run->form);
    run->loop = jl_loop_new(run->npe + 1, JL_PAR_MSG(PAR_M, PAR_N, PAR_Z),
                            slots);
    assert_non_null(run->loop);
    assert_int_equal(jl_loop_run(run->loop, body, run), JL_OK);
    for (i = 0; i <= run->npe; i++)
        assert_int_equal(run->status[i], JL_OK);
    jl_loop_free(run->loop);
    for (i = 0; i < PAR_STEPS; i++)
        failures += serial.status[i] != JL_OK;
    if (run->M == PAR_M)
        assert_true(failures > 0);      /* the comparison covers failed steps */
    assert_same_bits(&run->trace, &serial, sizeof serial);
}

static void test_par_gives_serial_bits_for_any_pes(void **state)
{
    static struct run run;
    int slots, forms;

    (void)state;
    for (run.npe = 1; run.npe <= 8; run.npe++)
        for (run.sticky = 0; run.sticky < 2; run.sticky++)
            for (slots = 0; slots <= 2; slots++)
                for (forms = 0; forms < 2; forms++) {
                    run.M = PAR_M;
                    run.form = forms == 0 ? &jl_kf_joseph : &jl_kf_standard;
                    compare(&run, slots);
                }
}

static void test_par_leaves_spare_pes_idle(void **state)
{
    static struct run run;

    (void)state;
    run.form = &jl_kf_joseph;
    run.npe = JL_MAX_PES;
    for (run.M = 1; run.M <= 5; run.M += 2)
        compare(&run, 1);
}

/* --- what PE0 refuses ---------------------------------------------------- */

#define REFUSALS 9

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
        r->pe_status = par_pe(0, 1, 3, 1, &jl_kf_joseph, to, from);
        return;
    }
    assert_int_equal(jl_host_ready(from[0], 7, buf, sizeof buf, 1000000), 0);
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

/* --- ready barrier ------------------------------------------------------- */

struct barrier {
    jl_loop *loop;
    int status[3];
};

static void barrier_body(int node, void *context)
{
    struct barrier *b = context;
    unsigned char buf[64], hello[8] = { 1, 1, 2, 0, 8, 0, 0, 0 };
    jl_chan *to[3] = { NULL }, *from[3] = { NULL };
    int i;

    for (i = 0; i < 3; i++)
        if (i != node) {
            to[i] = jl_loop_tx(b->loop, node, i);
            from[i] = jl_loop_rx(b->loop, i, node);
        }
    if (node == 0)
        b->status[0] = par_pe(0, 2, 3, 1, &jl_kf_joseph, to, from);
    else if (node == 1)                 /* has fingerprint 8, the others 7 */
        b->status[1] = jl_chan_send(to[0], hello, 8, 0);
    else
        b->status[2] = jl_host_ready(from[0], 7, buf, sizeof buf, 1000000);
}

static void test_par_refuses_to_start_with_different_models(void **state)
{
    struct barrier b = { 0 };

    (void)state;
    b.loop = jl_loop_new(3, JL_PAR_MSG(PAR_M, PAR_N, PAR_Z), 2);
    assert_int_equal(jl_loop_run(b.loop, barrier_body, &b), JL_OK);
    jl_loop_free(b.loop);
    assert_int_equal(b.status[0], JL_EMODEL);
    assert_int_equal(b.status[1], JL_OK);
    assert_int_equal(b.status[2], JL_EMODEL);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_par_gives_serial_bits_for_any_pes),
        cmocka_unit_test(test_par_leaves_spare_pes_idle),
        cmocka_unit_test(test_par_refuses_bad_measurements_with_a_code),
        cmocka_unit_test(test_par_refuses_to_start_with_different_models),
        cmocka_unit_test(test_par_init_refuses_what_does_not_fit),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
