/* Pieces of the parallel filter that a run shows only at its edges. */
#include "close.h"

#include "par/par_parts.h"

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
        cmocka_unit_test(test_pool_heeds_only_modes_that_are_possible),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
