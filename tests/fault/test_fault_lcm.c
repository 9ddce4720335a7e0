/* Links over LCM through faults: PEs are processes in a network of this test's
 * own, and each puts what it sends into a bad carrier.  Most of the time they
 * wait for repetitions, so several runs go on at once. */
#include "close.h"
#include "conform/conform.h"
#include "conform/par_case.h"
#include "fault.h"
#include "lcm/port_lcm.h"
#include "pair.h"
#include "private_net.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define URL "udpm://239.255.76.67:7667?ttl=0"
#define CHILD_SECONDS 60U
#define LINGER_US 20000000L
#define PAIRS 4                 /* of nodes, at once                        */
#define PAR_PES 3

static int net_errno;           /* why there is no network; 0: there is one */

/* --- nodes and processes ------------------------------------------------- */

/* What a node leaves behind for the test to see. */
struct node {
    jl_link_count count;
    fault f;
    struct par_trace trace;
};

static struct node *nodes;      /* shared by all processes                  */
static jl_lcm *lcm;             /* this process's                           */
static const fault_set *set;    /* the present one                          */

static void put(void *context, int to, const unsigned char *datagram, int len,
                jl_u32 now)
{
    fault_put(context, to, datagram, len, now);
}

static int get(void *context, int *to, unsigned char *datagram, jl_u32 now)
{
    return fault_get(context, to, datagram, now);
}

static long timer(void *context, jl_u32 now)
{
    return fault_timer(context, now);
}

static void join(const char *run, int which, int n, int max_len,
                 struct node *node)
{
    static jl_lcm_carrier carrier;
    jl_lcm_config config = { 0 };
    const char *why;

    fault_init(&node->f, set, (unsigned)(which + 1));
    carrier.context = &node->f;
    carrier.put = put;
    carrier.get = get;
    carrier.timer = timer;
    config.url = URL;
    config.run = run;
    config.node = which;
    config.nodes = n;
    config.number = JL_REAL_OCTETS;
    config.max_len = max_len;
    config.slots = 4;
    config.carrier = &carrier;
    lcm = jl_lcm_open(&config, &why);
    if (lcm != NULL)
        return;
    fprintf(stderr, "node %d: %s\n", which, why);
    _exit(98);
}

static void leave(struct node *node, int failed)
{
    node->count = jl_lcm_count(lcm);
    jl_lcm_close(lcm, LINGER_US);
    _exit(failed);
}

/* A child that ends with this process, and in any case soon. */
static pid_t new_child(void)
{
    pid_t parent = getpid(), child;

    fflush(NULL);
    child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent)
            _exit(99);
        alarm(CHILD_SECONDS);
    }
    return child;
}

/* How many of the children failed. */
static int failures(const pid_t *child, int n)
{
    int i, status, failed = 0;

    for (i = 0; i < n; i++) {
        if (child[i] < 0 || waitpid(child[i], &status, 0) != child[i])
            failed++;
        else if (status != 0) {
            failed++;
            if (WIFSIGNALED(status))
                print_error("%s: a process was ended by signal %d\n",
                            set->name, WTERMSIG(status));
        }
    }
    return failed;
}

static void need_net(void)
{
    if (net_errno != 0) {
        print_message("skipped: no private network: %s\n",
                      strerror(net_errno));
        skip();
    }
}

/* --- a million messages -------------------------------------------------- */

static double seconds(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void live_in_pair(int pair, int which, long n)
{
    struct node *node = &nodes[2 * pair + which];
    char run[16];
    int other = 1 - which;

    snprintf(run, sizeof run, "pair%d", pair);
    join(run, which, 2, PAIR_MAX_LEN, node);
    leave(node, pair_body(which, n, jl_lcm_tx(lcm, other),
                          jl_lcm_rx(lcm, other)));
}

static void test_fault_lcm_million(void **state)
{
    long total = 0;
    int s, i;

    (void)state;
    need_net();
    pair_print_head("port lcm, 4 pairs of processes at once");
    for (s = 0; s < PAIR_SETS; s++) {
        struct pair_result result = { 0 };
        long each = pair_messages(s) / (2 * PAIRS);
        pid_t child[2 * PAIRS];

        set = &pair_sets[s];
        result.seconds = -seconds();
        for (i = 0; i < 2 * PAIRS; i++) {
            child[i] = new_child();
            if (child[i] == 0)
                live_in_pair(i / 2, i % 2, each);
        }
        assert_int_equal(failures(child, 2 * PAIRS), 0);
        result.seconds += seconds();
        result.messages = 2 * PAIRS * each;
        for (i = 0; i < 2 * PAIRS; i++)
            pair_add(&result, &nodes[i].count, &nodes[i].f);
        pair_print(set, &result);
        assert_true(pair_faults_were_real(set, &result));
        total += result.messages;
    }
    assert_true(total >= PAIR_ALL);
}

/* --- the contract -------------------------------------------------------- */

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
    static int runs;
    pid_t child[CONFORM_PES];
    char name[17];
    int i;

    snprintf(name, sizeof name, "c%d_%d", (int)(set - pair_sets), runs++);
    for (i = 0; i < n; i++) {
        child[i] = new_child();
        if (child[i] == 0) {
            struct node *node = &nodes[(set - pair_sets) * CONFORM_PES + i];

            join(name, i, n, port->max_len, node);
            body(i);
            leave(node, conform_failures() != 0);
        }
    }
    return failures(child, n);
}

static const conform_port lcm_port = { 2000, 4, 500, 1, tx, rx, run };

static void live_the_suite(void)
{
    const conform_case *c;
    int failed = 0;

    for (c = conform_cases; c->name != NULL; c++)
        if (run(c->n, c->body) != 0) {
            print_error("failed: %s, %s\n", c->name, set->name);
            failed++;
        }
    _exit(failed != 0);
}

static void test_fault_lcm_conforms(void **state)
{
    pid_t child[PAIR_SETS];
    int s;

    (void)state;
    need_net();
    port = &lcm_port;
    for (s = 0; s < PAIR_SETS; s++) {
        set = &pair_sets[s];
        child[s] = new_child();
        if (child[s] == 0)
            live_the_suite();
    }
    assert_int_equal(failures(child, PAIR_SETS), 0);
}

/* --- the parallel filter ------------------------------------------------- */

static void live_in_filter(int s, int which)
{
    jl_chan *to[PAR_PES + 1], *from[PAR_PES + 1];
    struct node *node = &nodes[s * (PAR_PES + 1) + which];
    char name[16];
    int i, status;

    snprintf(name, sizeof name, "par%d", s);
    join(name, which, PAR_PES + 1, JL_PAR_MSG(PAR_M, PAR_N, PAR_Z), node);
    for (i = 0; i <= PAR_PES; i++) {
        to[i] = jl_lcm_tx(lcm, i);
        from[i] = jl_lcm_rx(lcm, i);
    }
    if (which == PAR_PES)
        status = par_host(&node->trace, PAR_M, to[0], from[0]);
    else
        status = par_pe(which, PAR_PES, PAR_M, s % 2, &jl_kf_joseph, to, from);
    if (status != JL_OK)
        fprintf(stderr, "%s: node %d: %s\n", set->name, which,
                jl_status_text(status));
    leave(node, status != JL_OK);
}

static void test_fault_lcm_gives_serial_bits(void **state)
{
    static struct par_trace serial[2];
    pid_t child[PAIR_SETS][PAR_PES + 1];
    int s, i;

    (void)state;
    need_net();
    for (s = 0; s < PAIR_SETS; s++) {
        set = &pair_sets[s];
        for (i = 0; i <= PAR_PES; i++) {
            child[s][i] = new_child();
            if (child[s][i] == 0)
                live_in_filter(s, i);
        }
    }
    for (i = 0; i < 2; i++)
        par_serial(&serial[i], PAR_M, i, &jl_kf_joseph);
    for (s = 0; s < PAIR_SETS; s++) {
        set = &pair_sets[s];
        assert_int_equal(failures(child[s], PAR_PES + 1), 0);
        assert_same_bits(&nodes[s * (PAR_PES + 1) + PAR_PES].trace,
                         &serial[s % 2], sizeof serial[0]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fault_lcm_million),
        cmocka_unit_test(test_fault_lcm_conforms),
        cmocka_unit_test(test_fault_lcm_gives_serial_bits),
    };

    if (private_net_enter() != 0)
        net_errno = errno;
    nodes = mmap(NULL, PAIR_SETS * CONFORM_PES * sizeof *nodes,
                 PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (nodes == MAP_FAILED)
        return 1;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
