/* Losses made by the kernel: a parallel filter over LCM in a network of its own,
 * whose packet filter throws datagrams away. */
#include "close.h"
#include "lcm_crew.h"

#include <stdio.h>
#include <stdlib.h>

#define NFT "PATH=$PATH:/usr/sbin:/sbin nft"

/* Returns 0 if from now on so many of a hundred UDP datagrams are lost. */
static int lose(int percent)
{
    char command[400];

    snprintf(command, sizeof command,
             "exec 2>/dev/null; " NFT " flush ruleset && " NFT " -f - <<'END'\n"
             "table ip jumplink {\n"
             "    counter lost { }\n"
             "    chain in {\n"
             "        type filter hook input priority 0;\n"
             "        ip protocol udp numgen random mod 100 < %d"
             " counter name lost drop\n"
             "    }\n"
             "}\n"
             "END\n", percent);
    return system(command);
}

static long lost(void)
{
    FILE *words = popen(NFT " list counter ip jumplink lost", "r");
    char line[200];
    long packets = -1;

    assert_non_null(words);
    while (fgets(line, sizeof line, words) != NULL)
        sscanf(line, " packets %ld", &packets);
    pclose(words);
    return packets;
}

static void test_fault_network_loses(void **state)
{
    static const int percent[] = { 10, 30 };
    pid_t child[CREW_PES + 1];
    char name[32];
    int i, kind;

    (void)state;
    crew_need_net();
    if (lose(1) != 0) {
        print_message("skipped: nft is not there, or may not be used here\n");
        skip();
    }
    printf("%-8s %10s %10s %8s %12s\n", "drop", "dropped", "pieces",
           "resent", "ms a step");
    for (i = 0; i < 2; i++)
        for (kind = 0; kind < CREW_KINDS; kind++) {
            unsigned long sent = 0, resent = 0;
            int k;

            assert_int_equal(lose(percent[i]), 0);
            snprintf(name, sizeof name, "net%d_%d", percent[i], kind);
            crew_start_filter(child, name, kind, 0, NULL, crew_nodes);
            assert_int_equal(crew_failures(child, CREW_PES + 1), 0);
            assert_same_bits(&crew_nodes[CREW_PES].trace, crew_serial(kind),
                             sizeof crew_nodes->trace);
            for (k = 0; k <= CREW_PES; k++) {
                sent += crew_nodes[k].count.sent;
                resent += crew_nodes[k].count.resent;
            }
            printf("%6d %% %10ld %10lu %8lu %12.2f\n", percent[i], lost(),
                   sent, resent,
                   1e3 * crew_nodes[CREW_PES].seconds / PAR_STEPS);
            assert_true(lost() > (long)sent * percent[i] / 200);
            assert_true(resent > 0);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fault_network_loses),
    };

    crew_prepare();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
