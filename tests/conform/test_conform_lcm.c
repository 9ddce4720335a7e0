/* The channel contract between processes that talk by LCM, in a network of
 * this test's own. */
#include "close.h"
#include "conform.h"
#include "lcm/port_lcm.h"
#include "private_net.h"

#include <errno.h>
#include <lcm/lcm.h>
#include <sched.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define URL "udpm://239.255.76.67:7667?ttl=0"
#define CHILD_SECONDS 30U
#define LINGER_US 1000000L
#define BEAT_US 20000
#define SILENCE_US 800000L

static int net_errno;           /* why there is no network; 0: there is one */
static jl_lcm *lcm;             /* this process's node                      */
static int watched;             /* all beat, and node 0 listens for it     */
static char run_name[16];       /* new for each run                         */

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

static conform_port lcm_port = { 3000, 2, 1, 20, tx, rx, NULL };

static void need_net(void)
{
    if (net_errno != 0) {
        print_message("skipped: no private network: %s\n",
                      strerror(net_errno));
        skip();
    }
}

/* --- processes ----------------------------------------------------------- */

/* A child that ends with this process, and in any case soon. */
static pid_t new_child(void)
{
    pid_t parent = getpid(), child;

    fflush(NULL);
    child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent)
            _exit(99);
        alarm(CHILD_SECONDS);
    }
    return child;
}

static int child_failed(pid_t child)
{
    int status = 0;
    pid_t ended;

    do
        ended = waitpid(child, &status, 0);
    while (ended < 0 && errno == EINTR);
    if (ended == child && WIFEXITED(status))
        return WEXITSTATUS(status) != 0;
    print_error("a child was ended by signal %d\n", WTERMSIG(status));
    return 1;
}

static jl_lcm_config config_of(int node, int nodes)
{
    jl_lcm_config c = { 0 };

    c.url = URL;
    c.run = run_name;
    c.node = node;
    c.nodes = nodes;
    c.number = JL_REAL_OCTETS;
    c.max_len = lcm_port.max_len;
    c.slots = lcm_port.slots;
    c.beat_us = watched ? BEAT_US : 0;
    c.silence_us = watched && node == 0 ? SILENCE_US : 0;
    return c;
}

static void join(int node, int nodes)
{
    jl_lcm_config c = config_of(node, nodes);
    const char *why;

    lcm = jl_lcm_open(&c, &why);
    if (lcm != NULL)
        return;
    fprintf(stderr, "node %d: %s\n", node, why);
    _exit(98);
}

static pid_t start(int node, int nodes, conform_body body)
{
    pid_t child = new_child();

    if (child == 0) {
        join(node, nodes);
        body(node);
        jl_lcm_close(lcm, LINGER_US);
        _exit(conform_failures() != 0);
    }
    return child;
}

static void new_run(void)
{
    static int runs;

    snprintf(run_name, sizeof run_name, "run_%d", runs++);
}

static int run(int n, conform_body body)
{
    pid_t child[CONFORM_PES];
    int i, failed = 0;

    new_run();
    for (i = 0; i < n; i++)
        child[i] = start(i, n, body);
    for (i = 0; i < n; i++)
        failed += child_failed(child[i]);
    return failed;
}

/* --- the contract -------------------------------------------------------- */

static void test_conform_lcm(void **state)
{
    const conform_case *c;
    int failed = 0;

    (void)state;
    need_net();
    for (c = conform_cases; c->name != NULL; c++)
        if (run(c->n, c->body) != 0) {
            print_error("failed: %s\n", c->name);
            failed++;
        }
    assert_int_equal(failed, 0);
}

/* --- what only this port can meet ---------------------------------------- */

/* Octets of no sense, frames of nobody, an own echo: counted, and no harm. */
static void among_strangers(int pe)
{
    unsigned char noise[2000];
    unsigned state = 1;
    char channel[40];
    lcm_t *other;
    int i, k;

    snprintf(channel, sizeof channel, "JL.%s.%d", run_name, 1 - pe);
    other = lcm_create(URL);
    EXPECT(other != NULL, ==, 1);
    /* not before the other one listens */
    EXPECT(jl_chan_send(tx(pe, 1 - pe), NULL, 0, LONG_US), ==, JL_OK);
    EXPECT(jl_chan_recv(rx(1 - pe, pe), NULL, 0, LONG_US), ==, 0);
    for (i = 0; i < 200; i++) {
        unsigned len = conform_random(&state) % sizeof noise;

        for (k = 0; k < (int)len; k++)
            noise[k] = (unsigned char)conform_random(&state);
        if (i % 3 == 0 && len > 6)      /* a sender that exists */
            noise[5] = (unsigned char)pe;
        lcm_publish(other, channel, noise, len);
        if (pe == 0)
            EXPECT(jl_chan_send(tx(0, 1), noise, (int)len, LONG_US), ==,
                   JL_OK);
        else
            EXPECT(jl_chan_recv(rx(0, 1), noise, (int)sizeof noise, LONG_US),
                   ==, (int)len);
    }
    if (pe == 0)
        EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, LONG_US), ==, JL_ECLOSED);
    EXPECT(jl_lcm_count(lcm).refused, >=, 190);
    lcm_destroy(other);
}

static void test_lcm_strangers(void **state)
{
    (void)state;
    need_net();
    assert_int_equal(run(2, among_strangers), 0);
}

/* A node that dies and comes again is not who it was. */
static void meets_a_restart(int pe)
{
    (void)pe;
    EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, LONG_US), ==, 0);
    EXPECT(jl_chan_send(tx(0, 1), NULL, 0, LONG_US), ==, JL_OK);
    EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, LONG_US), ==, JL_EPEER);
    EXPECT(jl_chan_send(tx(0, 1), NULL, 0, LONG_US), ==, JL_EPEER);
}

static void dies(int pe)
{
    (void)pe;
    EXPECT(jl_chan_send(tx(1, 0), NULL, 0, LONG_US), ==, JL_OK);
    EXPECT(jl_chan_recv(rx(0, 1), NULL, 0, LONG_US), ==, 0);
    _exit(conform_failures() != 0);
}

/* Nobody answers the second life for long. */
static void comes_again(int pe)
{
    (void)pe;
    jl_chan_recv(rx(0, 1), NULL, 0, 300000);
}

static void test_lcm_restart(void **state)
{
    pid_t child;

    (void)state;
    need_net();
    new_run();
    child = start(0, 2, meets_a_restart);
    assert_int_equal(child_failed(start(1, 2, dies)), 0);
    assert_int_equal(child_failed(start(1, 2, comes_again)), 0);
    assert_int_equal(child_failed(child), 0);
}

/* A node that hangs is missed; one that only waits is not. */
static void misses_the_other(int pe)
{
    (void)pe;
    EXPECT(jl_lcm_silence(lcm, 1), ==, -1);
    EXPECT(jl_lcm_silence(lcm, 2), ==, -1);
    EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, LONG_US), ==, 0);
    EXPECT(jl_lcm_silence(lcm, 1), >=, 0);
    EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, LONG_US), ==, 0);
    EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, JL_FOREVER), ==, JL_ESILENT);
    EXPECT(jl_chan_send(tx(0, 1), NULL, 0, LONG_US), ==, JL_ESILENT);
    EXPECT(jl_lcm_silence(lcm, 1), >, 0);
}

static void waits_and_hangs(int pe)
{
    (void)pe;
    EXPECT(jl_chan_send(tx(1, 0), NULL, 0, LONG_US), ==, JL_OK);
    EXPECT(jl_chan_recv(rx(0, 1), NULL, 0, 2 * SILENCE_US), ==, JL_ETIMEOUT);
    EXPECT(jl_chan_send(tx(1, 0), NULL, 0, LONG_US), ==, JL_OK);
    raise(SIGSTOP);
}

static void test_lcm_silence(void **state)
{
    pid_t hung;

    (void)state;
    need_net();
    watched = 1;
    new_run();
    hung = start(1, 2, waits_and_hangs);
    assert_int_equal(child_failed(start(0, 2, misses_the_other)), 0);
    kill(hung, SIGKILL);
    waitpid(hung, NULL, 0);
    watched = 0;
}

/* One that was stopped itself blames nobody. */
static void is_stopped(int pe)
{
    (void)pe;
    EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, LONG_US), ==, 0);
    raise(SIGSTOP);
    EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, 2 * SILENCE_US), ==, JL_ETIMEOUT);
    raise(SIGSTOP);
    EXPECT(jl_chan_send(tx(0, 1), NULL, 0, LONG_US), ==, JL_OK);
    EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, LONG_US), ==, 0);
}

static void waits_for_it(int pe)
{
    (void)pe;
    EXPECT(jl_chan_send(tx(1, 0), NULL, 0, LONG_US), ==, JL_OK);
    EXPECT(jl_chan_recv(rx(0, 1), NULL, 0, LONG_US), ==, 0);
    EXPECT(jl_chan_send(tx(1, 0), NULL, 0, LONG_US), ==, JL_OK);
}

static void test_lcm_stopped_is_not_silence(void **state)
{
    pid_t stopped, other;
    int i, status = 0;

    (void)state;
    need_net();
    watched = 1;
    new_run();
    stopped = start(0, 2, is_stopped);
    other = start(1, 2, waits_for_it);
    for (i = 0; i < 2; i++) {
        assert_int_equal(waitpid(stopped, &status, WUNTRACED), stopped);
        assert_true(WIFSTOPPED(status));
        usleep(2 * SILENCE_US);
        kill(stopped, SIGCONT);
    }
    assert_int_equal(child_failed(stopped), 0);
    assert_int_equal(child_failed(other), 0);
    watched = 0;
}

/* All leave at once when nothing was lost: nobody lingers. */
static void leave(int pe)
{
    (void)pe;
}

static void test_lcm_close_is_quick(void **state)
{
    struct timespec a, b;
    double seconds;

    (void)state;
    need_net();
    clock_gettime(CLOCK_MONOTONIC, &a);
    assert_int_equal(run(3, leave), 0);
    clock_gettime(CLOCK_MONOTONIC, &b);
    seconds = (double)(b.tv_sec - a.tv_sec)
        + 1e-9 * (double)(b.tv_nsec - a.tv_nsec);
    assert_true(seconds < 0.8 * 1e-6 * (double)LINGER_US);
}

/* A peer that never came: close gives up after linger_us. */
static void test_lcm_alone(void **state)
{
    pid_t child;

    (void)state;
    need_net();
    new_run();
    child = new_child();
    if (child == 0) {
        jl_chan *from;

        join(0, 2);
        from = rx(1, 0);
        if (jl_chan_recv(from, NULL, 0, 1000) != JL_ETIMEOUT
            || jl_chan_wait(&from, 1, 1000) != JL_ETIMEOUT
            || jl_chan_send(tx(0, 1), NULL, 0, 0) != JL_OK)
            _exit(1);
        jl_lcm_close(lcm, 50000);
        _exit(0);
    }
    assert_int_equal(child_failed(child), 0);
}

static void test_lcm_refuses(void **state)
{
    const char *why = NULL;
    jl_lcm_config c;
    int i;

    (void)state;
    strcpy(run_name, "x");
    for (i = 0; i < 16; i++) {
        c = config_of(0, 2);
        switch (i) {
        case 0: c.url = NULL; break;
        case 1: c.url = "tcpq://localhost"; break;
        case 2: c.url = "udpm://not an address"; break;
        case 3: c.run = ""; break;
        case 4: c.run = "seventeen_letters"; break;
        case 5: c.run = "a.b"; break;
        case 6: c.node = 2; break;
        case 7: c.node = -1; break;
        case 8: c.nodes = 257; break;
        case 9: c.number = 5; break;
        case 10: c.max_len = -1; break;
        case 11: c.slots = 0; break;
        case 12: c.max_len = INT_MAX; break;
        case 13: c.rto_us = JL_LINK_MAX_US + 1; break;
        case 14: c.beat_us = JL_LINK_MAX_US + 1; break;
        case 15: c.silence_us = JL_LINK_MAX_US + 1; break;
        }
        why = NULL;
        assert_null(jl_lcm_open(&c, &why));
        assert_non_null(why);
    }
    jl_lcm_close(NULL, 0);
}

static void test_lcm_no_route(void **state)
{
    pid_t child;

    (void)state;
    need_net();
    child = new_child();
    if (child == 0) {
        jl_lcm_config c = config_of(0, 2);
        const char *why = "";

        strcpy(run_name, "x");
        _exit(unshare(CLONE_NEWNET) != 0 || jl_lcm_open(&c, &why) != NULL
              || strstr(why, "route") == NULL);
    }
    assert_int_equal(child_failed(child), 0);
}

static void test_private_net_shared_url(void **state)
{
    char a[64], b[64];

    (void)state;
    private_net_shared_url(a, sizeof a, 1);
    private_net_shared_url(b, sizeof b, 2);
    assert_memory_equal(a, "udpm://239.255.", 15);
    assert_non_null(strstr(a, "?ttl=0"));
    assert_string_not_equal(a, b);
    private_net_shared_url(b, sizeof b, 1);
    assert_string_equal(a, b);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_conform_lcm),
        cmocka_unit_test(test_lcm_strangers),
        cmocka_unit_test(test_lcm_restart),
        cmocka_unit_test(test_lcm_silence),
        cmocka_unit_test(test_lcm_stopped_is_not_silence),
        cmocka_unit_test(test_lcm_close_is_quick),
        cmocka_unit_test(test_lcm_alone),
        cmocka_unit_test(test_lcm_refuses),
        cmocka_unit_test(test_lcm_no_route),
        cmocka_unit_test(test_private_net_shared_url),
    };

    if (private_net_enter() != 0)
        net_errno = errno;
    lcm_port.run = run;
    port = &lcm_port;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
