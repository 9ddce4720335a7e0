/* Links over port loop through faults. */
#include "close.h"
#include "linked_suite.h"
#include "loop/port_loop.h"

static void *make(int n, int max_len, int slots)
{
    return jl_loop_new(n, max_len, slots);
}

static void end(void *carrier)
{
    jl_loop_free(carrier);
}

static jl_chan *tx(void *carrier, int from, int to)
{
    return jl_loop_tx(carrier, from, to);
}

static jl_chan *rx(void *carrier, int from, int to)
{
    return jl_loop_rx(carrier, from, to);
}

static int run(void *carrier, void (*body)(int pe, void *context),
               void *context)
{
    return jl_loop_run(carrier, body, context);
}

static jl_u32 now(void *carrier)
{
    return jl_loop_now(carrier);
}

static const linked_port loop_port = {
    "port loop, seconds of its virtual clock", 1000, make, end, tx, rx, run, now
};

static void test_fault_loop_million(void **state)
{
    (void)state;
    linked_suite_million(&loop_port);
}

static void test_fault_loop_conforms(void **state)
{
    (void)state;
    linked_suite_conforms(&loop_port);
}

static void test_fault_loop_gives_serial_bits(void **state)
{
    (void)state;
    linked_suite_gives_serial_bits(&loop_port);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fault_loop_million),
        cmocka_unit_test(test_fault_loop_conforms),
        cmocka_unit_test(test_fault_loop_gives_serial_bits),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
