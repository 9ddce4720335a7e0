/* What stands on channels, over LCM through faults: the contract, and the
 * parallel filter.  What has to wait for repetitions runs at once. */
#include "close.h"
#include "conform/conform.h"
#include "lcm_crew.h"
#include "pair.h"

#include <stdio.h>
#include <unistd.h>

#define CASES_MAX 24
#define RTO_US 2000             /* less than usual: there is much to repeat */

/* --- the contract -------------------------------------------------------- */

static jl_lcm *lcm;             /* this process's node                      */
static const fault_set *set;    /* the present one                          */
static const conform_case *now_testing;

static jl_chan *tx(int from, int to)
{
    (void)from;
    return jl_lcm_tx(lcm, to);
}

static jl_chan *rx(int from, int to)
{
    (void)to;
    return jl_lcm_rx(lcm, from);
}

static int run(int n, conform_body body)
{
    int which = (int)(now_testing - conform_cases), i;
    pid_t child[CONFORM_PES];
    char name[32];

    snprintf(name, sizeof name, "case%d_%d", which, (int)(set - pair_sets));
    for (i = 0; i < n; i++) {
        child[i] = crew_fork();
        if (child[i] == 0) {
            struct crew_node *node = &crew_nodes[which * CONFORM_PES + i];

            lcm = crew_join(name, i, n, port->max_len, RTO_US, set, node);
            body(i);
            crew_leave(lcm, node, conform_failures() != 0, CREW_LINGER_US);
        }
    }
    return crew_failures(child, n);
}

static const conform_port lcm_port = { 2000, 4, 500, 1, tx, rx, run };

/* One case under all fault sets. */
static void live_a_case(void)
{
    int s, failed = 0;

    for (s = 0; s < PAIR_SETS; s++) {
        set = &pair_sets[s];
        if (run(now_testing->n, now_testing->body) != 0) {
            print_error("failed: %s, %s\n", now_testing->name, set->name);
            failed++;
        }
    }
    _exit(failed != 0);
}

static void test_fault_lcm_conforms(void **state)
{
    pid_t child[CASES_MAX];
    int n = 0;

    (void)state;
    crew_need_net();
    port = &lcm_port;
    for (; conform_cases[n].name != NULL; n++) {
        assert_true(n < CASES_MAX);
        now_testing = &conform_cases[n];
        child[n] = crew_fork();
        if (child[n] == 0)
            live_a_case();
    }
    assert_int_equal(crew_failures(child, n), 0);
}

/* --- the parallel filter ------------------------------------------------- */

static void test_fault_lcm_gives_serial_bits(void **state)
{
    pid_t child[PAIR_SETS][CREW_PES + 1];
    struct crew_node *nodes = crew_nodes;
    char name[32];
    int s;

    (void)state;
    crew_need_net();
    for (s = 0; s < PAIR_SETS; s++, nodes += CREW_PES + 1) {
        snprintf(name, sizeof name, "par%d", s);
        crew_start_filter(child[s], name, s % CREW_KINDS, RTO_US,
                          &pair_sets[s], nodes);
    }
    nodes = crew_nodes;
    for (s = 0; s < PAIR_SETS; s++, nodes += CREW_PES + 1) {
        assert_int_equal(crew_failures(child[s], CREW_PES + 1), 0);
        assert_same_bits(&nodes[CREW_PES].trace, crew_serial(s % CREW_KINDS),
                         sizeof nodes->trace);
        printf("%-12s %8.2f ms a step of %d PEs, %d filters at once\n",
               pair_sets[s].name, 1e3 * nodes[CREW_PES].seconds / PAR_STEPS,
               CREW_PES, PAIR_SETS);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fault_lcm_conforms),
        cmocka_unit_test(test_fault_lcm_gives_serial_bits),
    };

    crew_prepare();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
