/* The channel contract, and what port_threads.h promises beyond it. */
#include "close.h"
#include "conform.h"
#include "threads/port_threads.h"

#include <sched.h>
#include <stdatomic.h>
#include <time.h>

#define MAX_LEN 300

static jl_threads *threads;

static jl_chan *tx(int from, int to)
{
    return jl_threads_tx(threads, from, to);
}

static jl_chan *rx(int from, int to)
{
    return jl_threads_rx(threads, from, to);
}

static conform_port threads_port = { MAX_LEN, 0, 1, 20, tx, rx, NULL };

static void start_body(int pe, void *context)
{
    (*(conform_body *)context)(pe);
}

static int run(int n, conform_body body)
{
    int before = conform_failures(), status;

    threads = jl_threads_new(n, threads_port.max_len, threads_port.slots);
    assert_non_null(threads);
    status = jl_threads_run(threads, start_body, &body);
    jl_threads_free(threads);
    threads = NULL;
    return status != JL_OK || conform_failures() != before;
}

static void all_cases(int slots)
{
    const conform_case *c;
    int failed = 0;

    threads_port.slots = slots;
    for (c = conform_cases; c->name != NULL; c++)
        if (run(c->n, c->body) != 0) {
            print_error("failed: %s, slots %d\n", c->name, slots);
            failed++;
        }
    assert_int_equal(failed, 0);
}

static void test_conform_threads_rendezvous(void **state)
{
    (void)state;
    all_cases(0);
}

static void test_conform_threads_one_slot(void **state)
{
    (void)state;
    all_cases(1);
}

static void test_conform_threads_four_slots(void **state)
{
    (void)state;
    all_cases(4);
}

/* On one core nobody spins: every wait is a sleep. */
static void test_conform_threads_on_one_core(void **state)
{
    cpu_set_t all, one;
    size_t cpu = 0;

    (void)state;
    assert_int_equal(sched_getaffinity(0, sizeof all, &all), 0);
    while (!CPU_ISSET(cpu, &all))
        cpu++;
    CPU_ZERO(&one);
    CPU_SET(cpu, &one);
    assert_int_equal(sched_setaffinity(0, sizeof one, &one), 0);
    for (threads_port.slots = 0; threads_port.slots < 2; threads_port.slots++)
        all_cases(threads_port.slots);
    assert_int_equal(sched_setaffinity(0, sizeof all, &all), 0);
}

/* --- many at once -------------------------------------------------------- */

#define MANY 64

/* A token goes round while nobody else has anything to do. */
static void pass_token(int pe)
{
    unsigned char token[4] = { 0 };
    int lap;

    for (lap = 0; lap < 20; lap++) {
        if (pe > 0 || lap > 0)
            EXPECT(jl_chan_recv(rx((pe + MANY - 1) % MANY, pe), token, 4,
                                LONG_US), ==, 4);
        token[0]++;
        EXPECT(jl_chan_send(tx(pe, (pe + 1) % MANY), token, 4, LONG_US), ==,
               JL_OK);
    }
    if (pe == 0) {
        EXPECT(jl_chan_recv(rx(MANY - 1, pe), token, 4, LONG_US), ==, 4);
        EXPECT(token[0], ==, 20 * MANY % 256);
    }
}

static void test_threads_more_than_cores(void **state)
{
    (void)state;
    for (threads_port.slots = 0; threads_port.slots < 2; threads_port.slots++)
        assert_int_equal(run(MANY, pass_token), 0);
}

/* Hurried calls of all kinds and lengths cross, and take back what they began:
 * what was said to be sent arrives, in order, and nothing else. */
static void haste(int pe)
{
    unsigned char msg[MAX_LEN];
    unsigned state = (unsigned)pe + 1, number = 0;
    int status, len;

    while (number < 20000) {
        unsigned r = conform_random(&state);
        long timeout = r % 3 == 0 ? 0 : (long)(r % 40);

        if (pe == 0) {
            conform_fill(msg, (int)(number % MAX_LEN), number);
            status = jl_chan_send(tx(0, 1), msg, (int)(number % MAX_LEN),
                                  timeout);
            EXPECT(status == JL_OK || status == JL_ETIMEOUT, ==, 1);
            number += status == JL_OK;
        } else {
            int cap = r % 5 == 0 ? (int)(r / 8 % MAX_LEN) : MAX_LEN;
            jl_chan *from = rx(0, 1);

            if (r % 7 == 0) {
                status = jl_chan_wait(&from, 1, timeout);
                EXPECT(status == 0 || status == JL_ETIMEOUT, ==, 1);
            }
            len = jl_chan_recv(from, msg, cap, timeout);
            EXPECT(len >= 0 || len == JL_ETIMEOUT || len == JL_ETOOLONG, ==,
                   1);
            if (len < 0)
                continue;
            EXPECT(len, ==, (int)(number % MAX_LEN));
            EXPECT(conform_same(msg, len, number), ==, 1);
            number++;
        }
    }
    /* The last is not taken back while the other is still at it. */
    if (pe == 0)
        EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, LONG_US), ==, JL_ECLOSED);
}

static void test_threads_haste(void **state)
{
    (void)state;
    for (threads_port.slots = 0; threads_port.slots < 3; threads_port.slots++)
        assert_int_equal(run(2, haste), 0);
}

/* A message of a sender that does not wait, for a receiver with too short a
 * buffer: both are told, and neither waits for ever. */
static void too_long_for_one_who_waits(int pe)
{
    unsigned char msg[3] = { 1, 2, 3 };
    int status = JL_ETIMEOUT, tries;

    if (pe == 0) {
        for (tries = 0; status == JL_ETIMEOUT && tries < 1000000000; tries++)
            status = jl_chan_send(tx(0, 1), msg, 3, 0);
        EXPECT(status, ==, JL_OK);
    } else {
        EXPECT(jl_chan_recv(rx(0, 1), msg, 2, LONG_US), ==, JL_ETOOLONG);
        EXPECT(jl_chan_recv(rx(0, 1), msg, 3, LONG_US), ==, 3);
    }
}

static void test_threads_too_long_for_one_who_waits(void **state)
{
    (void)state;
    for (threads_port.slots = 0; threads_port.slots < 2; threads_port.slots++)
        assert_int_equal(run(2, too_long_for_one_who_waits), 0);
}

/* A sender gives up, again and again, just while a receiver with too short a
 * buffer looks at the message: it has not been taken. */
static void too_long_for_one_who_gives_up(int pe)
{
    unsigned char msg[3] = { 1, 2, 3 };
    int status = JL_ETIMEOUT, tries;

    if (pe == 0) {
        for (tries = 0; status == JL_ETIMEOUT; tries++)
            status = jl_chan_send(tx(0, 1), msg, 3, tries % 4);
        EXPECT(status, ==, JL_ECLOSED);
    } else {
        for (tries = 0; tries < 300000; tries++) {
            status = jl_chan_recv(rx(0, 1), msg, 2, 0);
            EXPECT(status == JL_ETOOLONG || status == JL_ETIMEOUT, ==, 1);
        }
    }
}

static void test_threads_too_long_for_one_who_gives_up(void **state)
{
    (void)state;
    threads_port.slots = 0;
    assert_int_equal(run(2, too_long_for_one_who_gives_up), 0);
}

/* --- closing ------------------------------------------------------------- */

/* Send while there is room; what the first that is not taken returns. */
static int send_until(int from, int to, long timeout_us)
{
    int taken = 0, status;

    while ((status = jl_chan_send(tx(from, to), NULL, 0, timeout_us))
           == JL_OK)
        taken++;
    return taken <= threads_port.slots ? status : JL_OK;
}

/* The other end closes while we are blocked in send: not taken. */
static void closed_while_sending(int pe)
{
    jl_chan *from = rx(0, 1);

    if (pe == 1) {
        EXPECT(jl_chan_wait(&from, 1, LONG_US), ==, 0);
        EXPECT(jl_chan_recv(rx(2, 1), NULL, 0, SHORT_US), ==, JL_ETIMEOUT);
    } else if (pe == 2) {
        EXPECT(jl_chan_recv(rx(1, 2), NULL, 0, JL_FOREVER), ==, JL_ECLOSED);
    } else {
        EXPECT(send_until(0, 1, JL_FOREVER), ==, JL_ECLOSED);
    }
}

static void closed_while_waiting(int pe)
{
    jl_chan *from[2];

    if (pe == 1) {
        EXPECT(jl_chan_recv(rx(2, 1), NULL, 0, SHORT_US), ==, JL_ETIMEOUT);
    } else if (pe == 0) {
        from[0] = rx(2, 0);
        from[1] = rx(1, 0);
        EXPECT(jl_chan_wait(from, 2, JL_FOREVER), ==, 1);
    } else {
        EXPECT(jl_chan_recv(rx(0, 2), NULL, 0, JL_FOREVER), ==, JL_ECLOSED);
    }
}

static void test_threads_closed_while_blocked(void **state)
{
    (void)state;
    for (threads_port.slots = 0; threads_port.slots < 3;
         threads_port.slots++) {
        assert_int_equal(run(3, closed_while_sending), 0);
        assert_int_equal(run(3, closed_while_waiting), 0);
    }
}

/* --- the processor ------------------------------------------------------- */

#define IDLE_US 300000L

static double cpu_us(void)
{
    struct timespec t;

    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e6 + (double)t.tv_nsec * 1e-3;
}

static void idle_in_recv(int pe)
{
    EXPECT(jl_chan_recv(rx(1 - pe, pe), NULL, 0, pe == 0 ? IDLE_US
                        : JL_FOREVER), ==, pe == 0 ? JL_ETIMEOUT
           : JL_ECLOSED);
}

static void idle_in_wait(int pe)
{
    jl_chan *from = rx(1 - pe, pe);

    EXPECT(jl_chan_wait(&from, 1, pe == 0 ? IDLE_US : JL_FOREVER), ==,
           pe == 0 ? JL_ETIMEOUT : 0);
}

static void idle_in_send(int pe)
{
    EXPECT(send_until(pe, 1 - pe, pe == 0 ? IDLE_US : JL_FOREVER), ==,
           pe == 0 ? JL_ETIMEOUT : JL_ECLOSED);
}

/* Two PEs that spun would use 600 ms, and one that did 300. */
static void test_threads_idle_costs_nothing(void **state)
{
    static const conform_body bodies[] = { idle_in_recv, idle_in_wait,
                                           idle_in_send };
    double before;
    int i;

    (void)state;
    for (threads_port.slots = 0; threads_port.slots < 2; threads_port.slots++)
        for (i = 0; i < 3; i++) {
            before = cpu_us();
            assert_int_equal(run(2, bodies[i]), 0);
            assert_true(cpu_us() - before < IDLE_US / 3);
        }
}

/* --- the object ---------------------------------------------------------- */

/* Sent, seen, and never received. */
static void leave_something(int pe)
{
    jl_chan *from = rx(0, 1);

    if (pe == 1)
        EXPECT(jl_chan_wait(&from, 1, LONG_US), ==, 0);
    else
        EXPECT(jl_chan_send(tx(0, 1), NULL, 0, 0), ==, JL_OK);
}

static void find_nothing(int pe)
{
    if (pe == 1)
        EXPECT(jl_chan_recv(rx(0, 1), NULL, 0, LONG_US), ==, JL_ECLOSED);
}

static void talk(int pe)
{
    if (pe == 0)
        EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, LONG_US), ==, 0);
    else
        EXPECT(jl_chan_send(tx(1, 0), NULL, 0, LONG_US), ==, JL_OK);
}

static void test_threads_run_again(void **state)
{
    int before = conform_failures();
    conform_body body;

    (void)state;
    threads = jl_threads_new(2, 0, 1);
    assert_non_null(threads);
    body = leave_something;
    assert_int_equal(jl_threads_run(threads, start_body, &body), JL_OK);
    assert_int_equal(tx(0, 1)->messages, 1);
    body = find_nothing;
    assert_int_equal(jl_threads_run(threads, start_body, &body), JL_OK);
    assert_int_equal(tx(0, 1)->messages, 1);
    assert_int_equal(rx(0, 1)->messages, 0);
    body = talk;
    assert_int_equal(jl_threads_run(threads, start_body, &body), JL_OK);
    assert_int_equal(rx(1, 0)->messages, 1);
    jl_threads_free(threads);
    assert_int_equal(conform_failures(), before);
}

static void test_threads_bounds(void **state)
{
    (void)state;
    assert_null(jl_threads_new(0, 1, 1));
    assert_null(jl_threads_new(257, 1, 1));
    assert_null(jl_threads_new(2, -1, 1));
    assert_null(jl_threads_new(2, 1, -1));
    threads = jl_threads_new(256, 0, 0);
    assert_non_null(threads);
    jl_threads_free(threads);
    threads = jl_threads_new(2, 1, 1);
    assert_non_null(threads);
    assert_null(tx(0, 0));
    assert_null(tx(0, 2));
    assert_null(rx(-1, 0));
    assert_non_null(tx(0, 1));
    assert_ptr_not_equal(tx(0, 1), rx(0, 1));
    jl_threads_free(threads);
    jl_threads_free(NULL);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_conform_threads_rendezvous),
        cmocka_unit_test(test_conform_threads_one_slot),
        cmocka_unit_test(test_conform_threads_four_slots),
        cmocka_unit_test(test_conform_threads_on_one_core),
        cmocka_unit_test(test_threads_more_than_cores),
        cmocka_unit_test(test_threads_haste),
        cmocka_unit_test(test_threads_too_long_for_one_who_waits),
        cmocka_unit_test(test_threads_too_long_for_one_who_gives_up),
        cmocka_unit_test(test_threads_closed_while_blocked),
        cmocka_unit_test(test_threads_idle_costs_nothing),
        cmocka_unit_test(test_threads_run_again),
        cmocka_unit_test(test_threads_bounds),
    };

    threads_port.run = run;
    port = &threads_port;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
