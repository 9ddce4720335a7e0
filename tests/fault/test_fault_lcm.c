/* A million messages over LCM through faults.  Most of the time the nodes wait
 * for repetitions, so several pairs are at work at once. */
#include "close.h"
#include "lcm_crew.h"
#include "pair.h"

#include <stdio.h>

#define PAIRS 8
#define LINGER_US 20000000L     /* at 30% of everything 4 s are not enough,
                                   once in ten runs, for the last piece     */

static void live_in_pair(int pair, int which, const fault_set *set, long n)
{
    struct crew_node *node = &crew_nodes[2 * pair + which];
    int other = 1 - which;
    char run[32];
    jl_lcm *lcm;
    int failed;

    snprintf(run, sizeof run, "pair%d", pair);
    lcm = crew_join(run, which, 2, PAIR_MAX_LEN, 0, set, node);
    failed = pair_body(which, n, jl_lcm_tx(lcm, other),
                       jl_lcm_rx(lcm, other));
    if (failed)
        pair_explain(which, jl_lcm_link(lcm, other), &node->fault,
                     (jl_u32)(unsigned long long)(1e6 * crew_clock()));
    crew_leave(lcm, node, failed, LINGER_US);
}

static long run(const fault_set *set, long messages)
{
    struct pair_result result = { 0 };
    long each = (messages + 2 * PAIRS - 1) / (2 * PAIRS);
    pid_t child[2 * PAIRS];
    int i;

    result.seconds = -crew_clock();
    for (i = 0; i < 2 * PAIRS; i++) {
        child[i] = crew_fork();
        if (child[i] == 0)
            live_in_pair(i / 2, i % 2, set, each);
    }
    assert_int_equal(crew_failures(child, 2 * PAIRS), 0);
    result.seconds += crew_clock();
    result.messages = 2 * PAIRS * each;
    for (i = 0; i < 2 * PAIRS; i++)
        pair_add(&result, &crew_nodes[i].count, &crew_nodes[i].fault);
    pair_print(set, &result);
    assert_true(pair_faults_were_real(set, &result));
    return result.messages;
}

static void test_fault_lcm_million(void **state)
{
    long total = 0;
    int s;

    (void)state;
    crew_need_net();
    pair_print_head("port lcm, 8 pairs of processes at once");
    for (s = 0; s < PAIR_SETS; s++)
        total += run(&pair_sets[s], pair_messages(s));
    assert_true(total >= PAIR_ALL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fault_lcm_million),
    };

    crew_prepare();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
