/* The host of a run, with a PE0 that says what and when the test wants. */
#include "scratch.h"

#include <signal.h>

#include "interrupt.h"
#include "live_input.h"
#include "par/par_msg.h"
#include "run.h"

#define DATA TOP_DIR "/sim/data/"
#define PES 4

struct said {
    double at_us;
    unsigned char msg[512];
    int len;
};

static struct said said[4];
static int says, next;
static double now_us;
static int raises;              /* SIGINT comes while the host waits */
static int (*alive)(void *context);

static struct model model;
static struct data_file data;
static struct options options;
static struct estimates e;
static long row;

/* --- PE0 ----------------------------------------------------------------- */

static int pe0_send(jl_chan *chan, const unsigned char *msg, int len,
                    long timeout_us)
{
    (void)chan, (void)msg, (void)len, (void)timeout_us;
    return JL_OK;
}

static int pe0_recv(jl_chan *chan, unsigned char *msg, int cap,
                    long timeout_us)
{
    const struct said *s = &said[next];

    (void)chan;
    if (next == 1 && raises)
        raise(SIGINT);
    if (next == says || s->at_us > now_us + (double)timeout_us) {
        now_us += (double)timeout_us;
        return JL_ETIMEOUT;
    }
    if (s->at_us > now_us)
        now_us = s->at_us;
    assert_true(s->len <= cap);
    memcpy(msg, s->msg, (size_t)s->len);
    next++;
    return s->len;
}

static void say(double at_us, int type, int octet, int number, jl_u32 word)
{
    said[says].at_us = at_us;
    said[says].len = jli_msg_plain(said[says].msg, type, octet, number, word);
    says++;
}

static void say_ready(double at_us)
{
    say(at_us, JLI_READY, 0, PES, run_fingerprint(&model, &options));
}

/* --- the host ------------------------------------------------------------ */

static int setup(void **state)
{
    struct data_columns columns = { "east_m,north_m", NULL, NULL };

    (void)state;
    scratch_must(model_read(&model, DATA "two_modes.json") == 0
                 && data_read(&data, DATA "sightseeing_1hz.csv", &columns)
                     == 0, "model and data");
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    model_free(&model);
    data_free(&data);
    return 0;
}

static int start(void **state)
{
    (void)state;
    options_init(&options, "filter");
    options.pes = PES;
    says = next = raises = 0;
    now_us = 0;
    alive = NULL;
    return estimates_open(&e, &data, &model);
}

static int end(void **state)
{
    (void)state;
    estimates_close(&e);
    return 0;
}

static int run_against_pe0(int *failed_pe)
{
    static const jl_chan_ops ops = { pe0_send, pe0_recv, NULL };
    jl_chan to, from;
    struct run_host host = { &to, &from, alive, NULL, -1 };
    int status;

    jl_chan_init(&to, &ops, run_max_len(&model), 2);
    jl_chan_init(&from, &ops, run_max_len(&model), 2);
    status = run_host(&e, &row, &host, &model, &data, &options);
    *failed_pe = host.failed_pe;
    return status;
}

/* --- tests --------------------------------------------------------------- */

/* A deadline that passed elsewhere is not one of the host's own. */
static void test_host_believes_pe0_whatever_happened(void **state)
{
    static const int codes[] = {
        JL_ETIMEOUT, JL_ECLOSED, JL_EPEER, JL_ESILENT, JL_EIO
    };
    int k, pe;

    (void)state;
    for (k = 0; k < 5; k++) {
        says = next = 0;
        now_us = 0;
        say_ready(0);
        say(50e3, JLI_FAULT, 3, -codes[k], 0);
        assert_int_equal(run_against_pe0(&pe), codes[k]);
        assert_int_equal(pe, 3);
        assert_int_equal(row, 0);
        assert_true(now_us < 1e6);
    }
}

/* The last word in an exchange or at the start, and who waited for it. */
static void test_host_waits_as_long_as_pe0(void **state)
{
    double timeout, wait;
    int pe;

    (void)state;
    timeout = (double)options.timeout_us * (1 + 2 * PES / 8.0);
    wait = (double)options.start_us * (1 + 3 * PES / 8.0);
    say_ready(wait);
    say(wait + timeout, JLI_FAULT, 2, -JL_ESILENT, 0);
    assert_int_equal(run_against_pe0(&pe), JL_ESILENT);
    assert_int_equal(pe, 2);
}

static void test_host_does_not_wait_for_ever(void **state)
{
    int pe;

    (void)state;
    assert_int_equal(run_against_pe0(&pe), JL_ETIMEOUT);
    assert_int_equal(row, -1);
    say_ready(now_us);
    assert_int_equal(run_against_pe0(&pe), JL_ETIMEOUT);
    assert_int_equal(row, 0);
    assert_int_equal(pe, -1);
}

static int nobody_alive(void *context)
{
    (void)context;
    return 0;
}

/* Long before any deadline, at the start and in a step. */
static void test_host_notices_that_a_pe_is_dead(void **state)
{
    int pe;

    (void)state;
    alive = nobody_alive;
    assert_int_equal(run_against_pe0(&pe), JL_ECLOSED);
    assert_int_equal(row, -1);
    say_ready(now_us);
    assert_int_equal(run_against_pe0(&pe), JL_ECLOSED);
    assert_int_equal(row, 0);
    assert_true(now_us < 1e6);
}

static int stop(void)
{
    return interrupted() != NULL;
}

/* The run of a file is interrupted in the middle of a step, a live one when the
 * answer is there.  The last test: a signal that came is not forgotten. */
static void test_host_interrupted(void **state)
{
    static struct live_input live;
    unsigned char answer[512];
    int pe, len;
    jl_estimate estimate = { .seq = 1 };
    jl_real zero[64] = { 0 };

    (void)state;
    estimate.x = estimate.P = estimate.mu = zero;
    len = jli_msg_estimate(answer, &estimate, model.M, model.n);
    interrupt_catch();
    raises = 1;
    say_ready(0);
    say(5e5, JLI_ESTIMATE, 0, 0, 0);
    said[1].len = len;
    memcpy(said[1].msg, answer, (size_t)len);
    assert_int_equal(run_against_pe0(&pe), RUN_INTERRUPTED);
    assert_int_equal(row, 0);
    assert_int_equal(e.done, 0);

    next = 0;
    now_us = 0;
    live.stop = stop;
    live.data.rows = 1;
    options.live = &live;
    assert_int_equal(run_against_pe0(&pe), JL_OK);
    assert_int_equal(e.done, 1);
}

/* Whoever has another gate is not like the others. */
static void test_host_and_pes_agree_about_gates(void **state)
{
    jl_u32 none = run_fingerprint(&model, &options), some, more;

    (void)state;
    options.gate = 0.99;
    options.gate_most = 5;
    some = run_fingerprint(&model, &options);
    assert_true(some != none);
    options.gate_most = 4;
    more = run_fingerprint(&model, &options);
    assert_true(more != none && more != some);
    options.gate_most = 5;
    options.gate = 0.9901;
    more = run_fingerprint(&model, &options);
    assert_true(more != none && more != some);
    options.gate = 0.99;
    assert_true(run_fingerprint(&model, &options) == some);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(
            test_host_believes_pe0_whatever_happened, start, end),
        cmocka_unit_test_setup_teardown(test_host_waits_as_long_as_pe0, start,
                                        end),
        cmocka_unit_test_setup_teardown(test_host_does_not_wait_for_ever,
                                        start, end),
        cmocka_unit_test_setup_teardown(test_host_notices_that_a_pe_is_dead,
                                        start, end),
        cmocka_unit_test_setup_teardown(test_host_interrupted, start, end),
        cmocka_unit_test_setup_teardown(test_host_and_pes_agree_about_gates,
                                        start, end),
    };

    return cmocka_run_group_tests(tests, setup, teardown);
}
