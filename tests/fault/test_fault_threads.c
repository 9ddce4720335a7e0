/* Links over port threads through faults. */
#include "close.h"
#include <time.h>

#include "linked_suite.h"
#include "threads/port_threads.h"

static void *make(int n, int max_len, int slots)
{
    return jl_threads_new(n, max_len, slots);
}

static void end(void *carrier)
{
    jl_threads_free(carrier);
}

static jl_chan *tx(void *carrier, int from, int to)
{
    return jl_threads_tx(carrier, from, to);
}

static jl_chan *rx(void *carrier, int from, int to)
{
    return jl_threads_rx(carrier, from, to);
}

static int run(void *carrier, void (*body)(int pe, void *context),
               void *context)
{
    return jl_threads_run(carrier, body, context);
}

static jl_u32 now(void *carrier)
{
    struct timespec t;

    (void)carrier;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (jl_u32)((unsigned long long)t.tv_sec * 1000000ULL
                    + (unsigned long long)t.tv_nsec / 1000ULL);
}

static const linked_port threads_port = {
    "port threads", 500, make, end, tx, rx, run, now
};

static void test_fault_threads_million(void **state)
{
    (void)state;
    linked_suite_million(&threads_port);
}

static void test_fault_threads_conforms(void **state)
{
    (void)state;
    linked_suite_conforms(&threads_port);
}

static void test_fault_threads_gives_serial_bits(void **state)
{
    (void)state;
    linked_suite_gives_serial_bits(&threads_port);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fault_threads_million),
        cmocka_unit_test(test_fault_threads_conforms),
        cmocka_unit_test(test_fault_threads_gives_serial_bits),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
