/* The channel contract, and what port_loop.h promises beyond it, on threads. */
#include "close.h"
#include "conform.h"
#include "loop/port_loop.h"

#define MAX_LEN 300

static jl_loop *loop;

static jl_chan *tx(int from, int to)
{
    return jl_loop_tx(loop, from, to);
}

static jl_chan *rx(int from, int to)
{
    return jl_loop_rx(loop, from, to);
}

static conform_port loop_port = { MAX_LEN, 0, 1, 20, tx, rx, NULL };

static void start_body(int pe, void *context)
{
    (*(conform_body *)context)(pe);
}

static int run(int n, conform_body body)
{
    int before = conform_failures(), status;

    loop = jl_loop_new(n, loop_port.max_len, loop_port.slots);
    assert_non_null(loop);
    status = jl_loop_run(loop, start_body, &body);
    jl_loop_free(loop);
    loop = NULL;
    return status != JL_OK || conform_failures() != before;
}

static void all_cases(int slots)
{
    const conform_case *c;
    int failed = 0;

    loop_port.slots = slots;
    for (c = conform_cases; c->name != NULL; c++)
        if (run(c->n, c->body) != 0) {
            print_error("failed: %s, slots %d\n", c->name, slots);
            failed++;
        }
    assert_int_equal(failed, 0);
}

static void test_conform_loop_rendezvous(void **state)
{
    (void)state;
    all_cases(0);
}

static void test_conform_loop_one_slot(void **state)
{
    (void)state;
    all_cases(1);
}

static void test_conform_loop_four_slots(void **state)
{
    (void)state;
    all_cases(4);
}

/* --- deadlock ------------------------------------------------------------ */

static void ring_of_recv(int pe)
{
    jl_chan *from = rx((pe + 2) % 3, pe);

    EXPECT(jl_chan_recv(from, NULL, 0, JL_FOREVER), ==, JL_EDEADLOCK);
    /* and it can go on from there */
    EXPECT(jl_chan_recv(from, NULL, 0, 10), !=, JL_EDEADLOCK);
}

static void ring_of_send(int pe)
{
    unsigned char msg[1] = { 0 };
    int i;

    for (i = 0; i < loop_port.slots; i++)
        EXPECT(jl_chan_send(tx(pe, (pe + 1) % 3), msg, 1, JL_FOREVER), ==,
               JL_OK);
    EXPECT(jl_chan_send(tx(pe, (pe + 1) % 3), msg, 1, JL_FOREVER), ==,
           JL_EDEADLOCK);
}

static void ring_of_wait(int pe)
{
    jl_chan *from[2];

    from[0] = rx((pe + 1) % 3, pe);
    from[1] = rx((pe + 2) % 3, pe);
    EXPECT(jl_chan_wait(from, 2, JL_FOREVER), ==, JL_EDEADLOCK);
}

static void test_loop_deadlock_is_a_result(void **state)
{
    int slots;

    (void)state;
    for (slots = 0; slots < 3; slots++) {
        loop_port.slots = slots;
        assert_int_equal(run(3, ring_of_recv), 0);
        assert_int_equal(run(3, ring_of_send), 0);
        assert_int_equal(run(3, ring_of_wait), 0);
    }
}

/* One deadline anywhere, and it is no deadlock: time passes. */
static void one_has_a_deadline(int pe)
{
    if (pe == 0) {
        EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, 123456), ==, JL_ETIMEOUT);
        EXPECT(jl_loop_now(loop), ==, 123456);
        EXPECT(jl_chan_send(tx(0, 1), NULL, 0, JL_FOREVER), ==, JL_OK);
    } else {
        EXPECT(jl_chan_recv(rx(0, 1), NULL, 0, JL_FOREVER), ==, 0);
        EXPECT(jl_loop_now(loop), ==, 123456);
    }
}

/* A PE that polls lets the others, and the clock, go on. */
static void one_polls(int pe)
{
    int polls = 0;

    if (pe == 0) {
        while (jl_chan_recv(rx(1, 0), NULL, 0, 0) == JL_ETIMEOUT)
            EXPECT(++polls, <, 10000);
        EXPECT(polls, >=, 100);
        polls = 0;
        while (jl_chan_send(tx(0, 1), NULL, 0, 0) != JL_ECLOSED)
            EXPECT(++polls, <, 10000);
        EXPECT(polls, >=, 100);
    } else if (pe == 2) {
        EXPECT(jl_chan_recv(rx(1, 2), NULL, 0, JL_FOREVER), ==, JL_ECLOSED);
    } else {
        EXPECT(jl_chan_recv(rx(2, 1), NULL, 0, 100), ==, JL_ETIMEOUT);
        EXPECT(jl_chan_send(tx(1, 0), NULL, 0, JL_FOREVER), ==, JL_OK);
        EXPECT(jl_chan_recv(rx(2, 1), NULL, 0, 100), ==, JL_ETIMEOUT);
    }
}

/* Half an hour in an instant, and in the order of the deadlines. */
static void sleepers(int pe)
{
    static const jl_u32 wakes[3] = { 1800000000, 600000000, 1200000000 };
    static int awake;
    jl_chan *from = rx((pe + 1) % 3, pe);

    if (pe == 0)
        awake = 0;
    EXPECT(jl_chan_recv(from, NULL, 0, (long)wakes[pe]), ==, JL_ETIMEOUT);
    EXPECT(jl_loop_now(loop), ==, wakes[pe]);
    EXPECT(awake++, ==, (pe + 2) % 3);
    EXPECT(jl_chan_recv(from, NULL, 0, JL_FOREVER), ==, JL_EDEADLOCK);
}

static void test_loop_clock(void **state)
{
    (void)state;
    for (loop_port.slots = 0; loop_port.slots < 2; loop_port.slots++) {
        assert_int_equal(run(2, one_has_a_deadline), 0);
        assert_int_equal(run(3, one_polls), 0);
        assert_int_equal(run(3, sleepers), 0);
    }
}

/* The other end closes while we are blocked in send: not taken. */
static void closed_while_sending(int pe)
{
    int i;

    if (pe == 1) {
        EXPECT(jl_chan_recv(rx(2, 1), NULL, 0, 100), ==, JL_ETIMEOUT);
    } else if (pe == 2) {
        EXPECT(jl_chan_recv(rx(1, 2), NULL, 0, JL_FOREVER), ==, JL_ECLOSED);
    } else {
        for (i = 0; i < loop_port.slots; i++)
            EXPECT(jl_chan_send(tx(0, 1), NULL, 0, 0), ==, JL_OK);
        EXPECT(jl_chan_send(tx(0, 1), NULL, 0, JL_FOREVER), ==, JL_ECLOSED);
    }
}

static void test_loop_closed_while_sending(void **state)
{
    (void)state;
    for (loop_port.slots = 0; loop_port.slots < 3; loop_port.slots++)
        assert_int_equal(run(3, closed_while_sending), 0);
}

/* --- the same on every run ----------------------------------------------- */

#define EVENTS 4096
#define N 5

static int events[2][EVENTS], count[2], which;

static void note(int pe, int what, int status)
{
    if (count[which] < EVENTS)
        events[which][count[which]++] = status * 1000 + pe * 10 + what;
}

static void random_work(int pe)
{
    unsigned char msg[MAX_LEN];
    unsigned state = (unsigned)pe + 1;
    int i;

    memset(msg, 0, sizeof msg);
    for (i = 0; i < 100; i++) {
        int what = (int)(conform_random(&state) % 3);
        int other = (pe + 1 + (int)(conform_random(&state) % (N - 1))) % N;
        long timeout = (long)(conform_random(&state) % 50);

        if (what == 0)
            note(pe, 0, jl_chan_send(tx(pe, other), msg, i, timeout));
        else if (what == 1)
            note(pe, 1, jl_chan_recv(rx(other, pe), msg, MAX_LEN, timeout));
        else {
            jl_chan *from = rx(other, pe);

            note(pe, 2, jl_chan_wait(&from, 1, timeout));
        }
    }
}

static void test_loop_order_is_the_same(void **state)
{
    (void)state;
    for (loop_port.slots = 0; loop_port.slots < 3; loop_port.slots++) {
        for (which = 0; which < 2; which++) {
            count[which] = 0;
            assert_int_equal(run(N, random_work), 0);
        }
        assert_int_equal(count[0], 100 * N);
        assert_int_equal(count[1], 100 * N);
        assert_memory_equal(events[0], events[1], sizeof events[0]);
    }
}

/* --- the object ---------------------------------------------------------- */

static void leave_something(int pe)
{
    if (pe == 0)
        EXPECT(jl_chan_send(tx(0, 1), NULL, 0, 0), ==, JL_OK);
}

static void find_nothing(int pe)
{
    if (pe == 1)
        EXPECT(jl_chan_recv(rx(0, 1), NULL, 0, 10), ==, JL_ECLOSED);
}

static void test_loop_run_again(void **state)
{
    conform_body body;

    (void)state;
    loop = jl_loop_new(2, 0, 1);
    assert_non_null(loop);
    body = leave_something;
    assert_int_equal(jl_loop_run(loop, start_body, &body), JL_OK);
    body = find_nothing;
    assert_int_equal(jl_loop_run(loop, start_body, &body), JL_OK);
    jl_loop_free(loop);
    assert_int_equal(conform_failures(), 0);
}

static void test_loop_bounds(void **state)
{
    (void)state;
    assert_null(jl_loop_new(0, 1, 1));
    assert_null(jl_loop_new(2, -1, 1));
    assert_null(jl_loop_new(2, 1, -1));
    loop = jl_loop_new(2, 1, 1);
    assert_non_null(loop);
    assert_null(tx(0, 0));
    assert_null(tx(0, 2));
    assert_null(rx(-1, 0));
    assert_non_null(tx(0, 1));
    assert_ptr_not_equal(tx(0, 1), rx(0, 1));
    jl_loop_free(loop);
    jl_loop_free(NULL);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_conform_loop_rendezvous),
        cmocka_unit_test(test_conform_loop_one_slot),
        cmocka_unit_test(test_conform_loop_four_slots),
        cmocka_unit_test(test_loop_deadlock_is_a_result),
        cmocka_unit_test(test_loop_clock),
        cmocka_unit_test(test_loop_closed_while_sending),
        cmocka_unit_test(test_loop_order_is_the_same),
        cmocka_unit_test(test_loop_run_again),
        cmocka_unit_test(test_loop_bounds),
    };

    loop_port.run = run;
    port = &loop_port;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
