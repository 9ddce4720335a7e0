/* What chan.c does before and after a port. */
#include "close.h"
#include "jumplink/chan.h"

static int calls, answer;

static int fake_send(jl_chan *chan, const unsigned char *msg, int len,
                     long timeout_us)
{
    (void)chan, (void)msg, (void)len, (void)timeout_us;
    calls++;
    return answer;
}

static int fake_recv(jl_chan *chan, unsigned char *msg, int cap,
                     long timeout_us)
{
    (void)chan, (void)msg, (void)cap, (void)timeout_us;
    calls++;
    return answer;
}

static int fake_wait(jl_chan *const *chans, int n, long timeout_us)
{
    (void)chans, (void)n, (void)timeout_us;
    calls++;
    return answer;
}

static const jl_chan_ops fake = { fake_send, fake_recv, fake_wait };

static jl_chan new_chan(void)
{
    jl_chan chan;

    memset(&chan, 0xff, sizeof chan);
    jl_chan_init(&chan, &fake, 10, 3);
    calls = 0;
    answer = JL_OK;
    return chan;
}

static void test_chan_init(void **state)
{
    jl_chan chan = new_chan();

    (void)state;
    assert_int_equal(chan.max_len, 10);
    assert_int_equal(chan.slots, 3);
    assert_int_equal(chan.messages, 0);
    assert_int_equal(chan.octets, 0);
}

/* What is wrong never reaches the port. */
static void test_chan_checks(void **state)
{
    jl_chan chan = new_chan(), *list = &chan;
    unsigned char msg[20] = { 0 };

    (void)state;
    assert_int_equal(jl_chan_send(&chan, msg, -1, 0), JL_ERANGE);
    assert_int_equal(jl_chan_send(&chan, msg, 1, -2), JL_ERANGE);
    assert_int_equal(jl_chan_send(&chan, msg, 11, 0), JL_ETOOLONG);
    assert_int_equal(jl_chan_send(&chan, msg, INT_MAX, 0), JL_ETOOLONG);
    assert_int_equal(jl_chan_recv(&chan, msg, -1, 0), JL_ERANGE);
    assert_int_equal(jl_chan_recv(&chan, msg, 20, LONG_MIN), JL_ERANGE);
    assert_int_equal(jl_chan_wait(&list, 0, 0), JL_ERANGE);
    assert_int_equal(jl_chan_wait(&list, 1, -2), JL_ERANGE);
    assert_int_equal(calls, 0);
    assert_int_equal(jl_chan_send(&chan, msg, 10, JL_FOREVER), JL_OK);
    assert_int_equal(jl_chan_send(&chan, NULL, 0, 0), JL_OK);
    assert_int_equal(jl_chan_recv(&chan, NULL, 0, JL_FOREVER), 0);
    assert_int_equal(jl_chan_wait(&list, 1, LONG_MAX), 0);
    assert_int_equal(calls, 4);
}

/* Only messages that went through are counted. */
static void test_chan_counts(void **state)
{
    jl_chan chan = new_chan(), *list = &chan;
    unsigned char msg[20] = { 0 };

    (void)state;
    assert_int_equal(jl_chan_send(&chan, msg, 7, 0), JL_OK);
    answer = JL_ETIMEOUT;
    assert_int_equal(jl_chan_send(&chan, msg, 7, 0), JL_ETIMEOUT);
    assert_int_equal(jl_chan_recv(&chan, msg, 20, 0), JL_ETIMEOUT);
    assert_int_equal(chan.messages, 1);
    assert_int_equal(chan.octets, 7);
    answer = 5;
    assert_int_equal(jl_chan_recv(&chan, msg, 20, 0), 5);
    assert_int_equal(jl_chan_wait(&list, 1, 0), 5);
    assert_int_equal(chan.messages, 2);
    assert_int_equal(chan.octets, 12);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chan_init),
        cmocka_unit_test(test_chan_checks),
        cmocka_unit_test(test_chan_counts),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
