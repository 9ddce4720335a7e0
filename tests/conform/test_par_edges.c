/* Pieces of the parallel filter that a run shows only at its edges. */
#include "close.h"

#include "par/par_parts.h"
#include "par_cg_case.h"

/* --- deadlines ----------------------------------------------------------- */

static long given_us;

static int note_recv(jl_chan *chan, unsigned char *msg, int cap,
                     long timeout_us)
{
    (void)chan, (void)msg, (void)cap;
    given_us = timeout_us;
    return JL_ETIMEOUT;
}

static long deadline(long timeout_us, int level)
{
    static const jl_chan_ops ops = { NULL, note_recv, NULL };
    static unsigned char buf[64];
    jl_chan chan, *from[1];
    jl_par par;

    memset(&par, 0, sizeof par);
    jl_chan_init(&chan, &ops, 32, 1);
    from[0] = &chan;
    par.config.npe = 2;
    par.config.from = from;
    par.buf = buf;
    par.cap = sizeof buf;
    assert_int_equal(jli_par_recv(&par, 0, timeout_us, level), JL_ETIMEOUT);
    return given_us;
}

static void test_par_deadlines_grow_and_stay_numbers(void **state)
{
    int level, most = 3 * JL_MAX_PES;
    long before;

    (void)state;
    assert_int_equal(deadline(0, most), 0);
    assert_int_equal(deadline(8000, 0), 8000);
    assert_int_equal(deadline(8000, 3), 11000);
    for (level = 0; level <= most; level++) {
        assert_int_equal(deadline(JL_FOREVER, level), JL_FOREVER);
        assert_true(deadline(LONG_MAX, level) == LONG_MAX);
    }
    before = 0;
    for (level = 0; level <= most; level++) {
        assert_true(deadline(LONG_MAX / 4, level) >= before);
        before = deadline(LONG_MAX / 4, level);
    }
    assert_true(before > LONG_MAX / 8 * 7);
}

/* --- octets -------------------------------------------------------------- */

/* What jumplink/par.h says of a mode's message. */
static void test_par_cg_messages_are_as_short_as_said(void **state)
{
    static struct par_cg_bank bank;
    static const unsigned char owner[2] = { 0, 1 };
    unsigned char buf[JL_PAR_CG_BUF(2, 3)], msg[JL_PAR_CG_MSG(2, 3)];
    jl_real mu[2] = { 0 }, x[9] = { 0 }, z[3];
    jl_estimate estimate = { 0 };
    jl_par_config config = { 0 };
    jl_chan chan = { 0 }, *chans[2];
    jl_hop hop = { 0 };
    int axes, pe, order, status[2];
    jl_par par;

    (void)state;
    chan.max_len = JL_PAR_CG_MSG(2, 3);
    chans[0] = chans[1] = &chan;
    config.npe = 2;
    config.owner = owner;
    config.to = config.from = chans;
    estimate.x = x;
    estimate.mu = mu;
    hop.count = 1;
    for (axes = 1; axes <= 3; axes++)
        for (pe = 0; pe < 2; pe++) {
            par_cg_init(&bank, 2, axes);
            config.pe = pe;
            hop.first = hop.from = (unsigned char)pe;
            order = par_cg_order(pe, 2, axes);
            assert_int_equal(jl_par_init_cg(&par, &bank.cg, &config, buf,
                                            sizeof buf, status, z), JL_OK);
            status[pe] = 0;
            assert_int_equal(jli_msg_modes(msg, &par, &hop),
                             8 + 2 + JL_REAL_OCTETS * (1 + axes * order));
            assert_int_equal(jli_msg_modes_read(&par, &hop, msg,
                                                8 + 2 + JL_REAL_OCTETS
                                                * (1 + axes * order)), JL_OK);
            assert_int_equal(jli_msg_modes_read(&par, &hop, msg,
                                                8 + 2 + JL_REAL_OCTETS
                                                * (2 + axes * order)),
                             JL_ELENGTH);
            assert_int_equal(jli_msg_estimate(msg, &estimate, 2,
                                              axes * bank.cg.order),
                             8 + JL_REAL_OCTETS
                             * (1 + axes * bank.cg.order + 2));
        }
}

/* Binds *par of *bank, which is PE 1 of 2 and owns mode 1. */
static void bind(jl_par *par, struct par_cg_bank *bank)
{
    static unsigned char owner[3] = { 0, 1, 0 }, buf[JL_PAR_CG_BUF(3, 3)];
    static int status[3];
    static jl_real z[3];
    static jl_chan chan, *chans[2] = { &chan, &chan };
    jl_par_config config = { 0 };

    chan.max_len = JL_PAR_CG_MSG(3, 3);
    config.npe = 2;
    config.pe = 1;
    config.owner = owner;
    config.to = config.from = chans;
    par_cg_init(bank, 3, 3);
    assert_int_equal(bank->gains[1].order, 3);
    memset(status, 0, sizeof status);
    assert_int_equal(jl_par_init_cg(par, &bank->cg, &config, buf, sizeof buf,
                                    status, z), JL_OK);
}

static const jl_hop of_mode_1 = { .from = 1, .first = 1, .count = 1 };

/* Of a mode that has not failed: no number that is none, no square below 0. */
static void test_par_cg_takes_no_unsound_mode(void **state)
{
    static struct par_cg_bank bank;
    unsigned char msg[JL_PAR_CG_MSG(3, 3)];
    const jl_real bad[] = { -1, jl_log(0), -jl_log(0), jl_log(0) * 0 };
    jl_real good = 1;
    int len, at, k;
    jl_par par;

    (void)state;
    bind(&par, &bank);
    len = jli_msg_modes(msg, &par, &of_mode_1);
    for (at = 10; at < len; at += JL_REAL_OCTETS)
        for (k = 0; k < 4; k++) {
            int sound = at == 10 ? k == 2 : k == 0;

            jl_put_reals(msg + at, &bad[k], 1);
            assert_int_equal(jli_msg_modes_read(&par, &of_mode_1, msg, len),
                             sound ? JL_OK : JL_EMSG);
            jl_put_u16(msg + 8, (unsigned)-JL_ENONFINITE);
            assert_int_equal(jli_msg_modes_read(&par, &of_mode_1, msg, len),
                             JL_OK);
            jl_put_u16(msg + 8, 0);
            jl_put_reals(msg + at, &good, 1);
        }
    assert_int_equal(at, len);
}

/* A mode of an IMM of 3 states has as many reals as one of order 3 in 3 axes,
 * an estimate as many as one of 9 states without covariance. */
static void test_par_kinds_take_only_their_own(void **state)
{
    static struct par_cg_bank bank;
    unsigned char msg[JL_PAR_CG_MSG(3, 3)];
    jl_real x[9] = { 0 }, P[9] = { 0 }, mu[2] = { 0 };
    jl_estimate imm = { 0 }, cg = { 0 };
    int len;
    jl_par par;

    (void)state;
    bind(&par, &bank);
    len = jli_msg_modes(msg, &par, &of_mode_1);
    assert_int_equal(len, 8 + JL_PAR_MODE(3));
    assert_int_equal(jli_msg_modes_read(&par, &of_mode_1, msg, len), JL_OK);
    msg[0] = JLI_MODES;
    assert_int_equal(jli_msg_modes_read(&par, &of_mode_1, msg, len), JL_EMSG);

    imm.x = cg.x = x;
    imm.mu = cg.mu = mu;
    imm.P = P;
    len = jli_msg_estimate(msg, &imm, 2, 3);
    assert_int_equal(jli_msg_estimate_read(&imm, 2, 3, msg, len), JL_OK);
    assert_int_equal(jli_msg_estimate_read(&cg, 2, 9, msg, len), JL_EMSG);
    assert_int_equal(jli_msg_estimate(msg, &cg, 2, 9), len);
    assert_int_equal(jli_msg_estimate_read(&cg, 2, 9, msg, len), JL_OK);
    assert_int_equal(jli_msg_estimate_read(&imm, 2, 3, msg, len), JL_EMSG);
}

/* The largest filter there may be, orders mixed: one message that carries all
 * modes fits, and brings the bits of all that a mode has, but no more. */
static void test_par_cg_largest_messages_fit(void **state)
{
    enum { M = JL_MAX_MODES, AXES = JL_MAX_STATES, X = M * AXES * 3 };
    static jl_cg_gains gains[M];
    static jl_real mem[2][JL_CGIMM_STATE(M, AXES)], Pi[M * M], z[AXES];
    static unsigned char buf[JL_PAR_CG_BUF(M, AXES)], owner[M];
    static unsigned char msg[JL_PAR_CG_MSG(M, AXES)];
    static int status[M];
    jl_par_config config = { 0 };
    jl_hop hop = { .count = 1 };
    int i, j, len, want = 8;
    jl_estimate estimate = { 0 };
    jl_cgimm cg[2];
    jl_par par[2];

    (void)state;
    config.npe = 1;
    config.owner = owner;
    for (j = 0; j < M; j++) {
        assert_int_equal(jl_cg_design(&gains[j], j % 3 == 1 ? 2 : 3, 1, 100,
                                      1e4), JL_OK);
        want += 2 + (1 + AXES * gains[j].order) * JL_REAL_OCTETS;
        Pi[j * M + j] = 1;
    }
    for (i = 0; i < 2; i++) {
        assert_int_equal(jl_cgimm_init(&cg[i], M, gains, AXES, 1, 1e4, Pi,
                                       mem[i], JL_CGIMM_STATE(M, AXES)),
                         JL_OK);
        assert_int_equal(jl_par_init_cg(&par[i], &cg[i], &config, buf,
                                        sizeof buf, status, z), JL_OK);
    }
    for (i = 0; i < X; i++)
        cg[0].mixed[i] = (jl_real)(i + 1);
    for (j = 0; j < M; j++)
        cg[0].l[j] = (jl_real)j;
    len = jli_msg_modes(msg, &par[0], &hop);
    assert_int_equal(len, want);
    assert_in_range(len, 1, JL_PAR_CG_MSG(M, AXES));
    assert_int_equal(jli_msg_modes_read(&par[1], &hop, msg, len), JL_OK);
    for (i = 0; i < X; i++)
        assert_close(cg[1].mixed[i],
                     i % 3 < gains[i / (3 * AXES)].order ? i + 1 : 0, 0);
    assert_same_bits(cg[1].l, cg[0].l, M * sizeof *z);
    estimate.x = cg[0].mixed;
    estimate.mu = cg[0].mu;
    assert_in_range(jli_msg_estimate(msg, &estimate, M, AXES * 3), 1,
                    JL_PAR_CG_MSG(M, AXES));
}

/* --- pools --------------------------------------------------------------- */

#define MODES 3

/* After an outlier that a mode which cannot be entered would explain, the
 * others' shares keep their digits. */
static void test_pool_heeds_only_modes_that_are_possible(void **state)
{
    static const unsigned char owner[MODES] = { 0, 0, 0 };
    static jl_real mem[JL_IMM_STATE(MODES, 1, 1)];
    jl_real pool[2], work[2];
    jl_imm imm;
    jl_par par;

    (void)state;
    memset(&imm, 0, sizeof imm);
    memset(&par, 0, sizeof par);
    imm.M = MODES;
    imm.n = 1;
    imm.form = &jl_kf_joseph;
    imm.d = work;
    imm.xw = mem;
    imm.Pw = mem + MODES;
    imm.l = mem + 2 * MODES;
    imm.e = mem + 3 * MODES;
    imm.c = mem + 4 * MODES;
    imm.logc = mem + 5 * MODES;
    imm.l[0] = imm.l[1] = -1 / JL_EPSILON / JL_EPSILON;
    imm.l[2] = 0;
    imm.c[0] = JL_C(0.25);
    imm.c[1] = JL_C(0.75);
    imm.logc[2] = jl_log(0);            /* and c[2] = 0 */
    imm.xw[1] = 1;
    imm.xw[2] = 1000;
    imm.Pw[0] = imm.Pw[1] = imm.Pw[2] = 2;
    par.config.owner = owner;
    par.imm = &imm;
    par.pool = pool;
    jli_pool_own(&par);
    assert_close(pool[0], 0.75, 4 * (double)JL_EPSILON);
    assert_close(pool[1], 2 + 0.25 * 0.75, 8 * (double)JL_EPSILON);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_par_deadlines_grow_and_stay_numbers),
        cmocka_unit_test(test_par_cg_messages_are_as_short_as_said),
        cmocka_unit_test(test_par_cg_takes_no_unsound_mode),
        cmocka_unit_test(test_par_kinds_take_only_their_own),
        cmocka_unit_test(test_par_cg_largest_messages_fit),
        cmocka_unit_test(test_pool_heeds_only_modes_that_are_possible),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
