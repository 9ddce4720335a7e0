/* Runs over LCM: PEs and host started by hand, PEs that are missing or wrong,
 * and machines that allow no private network.  All of it in a network of the
 * test's own. */
#include "close.h"
#include "scratch.h"
#include "program.h"

#include <fcntl.h>
#include <sched.h>

#include "jumplink/config.h"
#include "own_net.h"

#define DATA TOP_DIR "/sim/data/"
#define LEAVING 15              /* seconds; 1 to 4 unless the machine is busy */
#define FLIGHT "--z", "east_m,north_m"
#define BY_HAND "--pes", "2", "--lcm-url", OWN_NET_URL, PATIENTLY
#define PATIENTLY "--timeout", "20"     /* on a machine that is busy */
#define IN_VAIN "--start", "1.5"        /* where somebody does not come */

static char data[400], two[400], eight[400];
static char *serial;            /* the estimates of data by two */

static void keep(char *to, const char *path)
{
    snprintf(to, 400, "%s", path);
}

static int setup(void **state)
{
    scratch_setup(state);
    own_net_enter();
    keep(data, program_head("flight.csv", DATA "carrier_held_1hz.csv", 201));
    keep(two, program_copy("two_modes.json", DATA "two_modes.json"));
    keep(eight, program_copy("eight_modes.json", DATA "eight_modes.json"));
    run_jumplink("filter", two, data, FLIGHT);
    scratch_must(ran.status == 0, "jumplink filter");
    serial = ran.out;
    ran.out = NULL;
    return 0;
}

static int teardown(void **state)
{
    program_free(&ran);
    free(serial);
    return scratch_teardown(state);
}

/* --- by hand ------------------------------------------------------------- */

/* Three programs: 'h' the host, '0' and '1' the PEs. */
static void start(struct program *p, int which, const char *run)
{
    const char pe[2] = { (char)which, '\0' };

    if (which == 'h')
        program_start(p, "host", two, data, FLIGHT, BY_HAND, "--run", run);
    else
        program_start(p, "pe", "--pe", strcmp(pe, "0") == 0 ? "0" : "1",
                      "--model", two, BY_HAND, "--run", run);
}

static void check_pe_left(struct program *p, char which)
{
    char word[20];

    snprintf(word, sizeof word, "pe %c of 2: ", which);
    check_good(p);
    assert_int_equal(strncmp(p->out, word, strlen(word)), 0);
    assert_non_null(strstr(p->out, " messages, "));
}

static void end_all(struct program *p, const char *order)
{
    int i;

    for (i = 0; i < 3; i++)
        program_end(&p[i], PROGRAM_LIMIT);
    for (i = 0; i < 3; i++) {
        if (order[i] != 'h') {
            check_pe_left(&p[i], order[i]);
        } else {
            check_good(&p[i]);
            check_same_text(p[i].out, serial);
        }
        program_free(&p[i]);
    }
}

static void test_network_by_hand_in_any_order(void **state)
{
    static const char *const orders[] = {
        "h01", "h10", "0h1", "01h", "1h0", "10h",
    };
    size_t i, k;

    (void)state;
    needs_own_net();
    for (i = 0; i < sizeof orders / sizeof *orders; i++) {
        struct program p[3];

        for (k = 0; k < 3; k++) {
            start(&p[k], orders[i][k], "any");
            program_sleep(0.15);
        }
        end_all(p, orders[i]);
    }
    check_nobody_left();
}

static void test_network_two_runs_at_once(void **state)
{
    struct program a[3], b[3];
    int i;

    (void)state;
    needs_own_net();
    for (i = 0; i < 3; i++) {
        start(&a[i], "01h"[i], "one");
        start(&b[i], "h10"[i], "other_1");
    }
    end_all(a, "01h");
    end_all(b, "h10");
    check_nobody_left();
}

/* --timeout is for answers, not for the others to be started. */
static void test_network_waits_for_the_others(void **state)
{
    struct program host, pe;

    (void)state;
    needs_own_net();
    program_start(&host, "host", two, data, FLIGHT, BY_HAND, "--timeout",
                  "0.2");
    program_start(&pe, "pe", "--pe", "0", "--model", two, BY_HAND,
                  "--timeout", "0.2");
    program_end(&host, 2);
    program_end(&pe, 0);
    if (host.status != -1 || host.err[0] != '\0')
        program_fail(&host, "still waiting for PE1");
    if (pe.status != -1 || pe.err[0] != '\0')
        program_fail(&pe, "still waiting for PE1");
    program_free(&host);
    program_free(&pe);
    check_nobody_left();
}

/* --- wrong PEs ----------------------------------------------------------- */

static void end_three(struct program *p)
{
    int i;

    for (i = 0; i < 3; i++)
        program_end(&p[i], PROGRAM_LIMIT);
}

static void free_three(struct program *p)
{
    int i;

    for (i = 0; i < 3; i++)
        program_free(&p[i]);
    check_nobody_left();
}

#define DIFFERENT "different models, filters, forms, gates or topologies"

/* A host and two PEs of which the second has other arguments: all refuse. */
static void check_mismatch_told(const char *const *told)
{
    struct program p[3];

    start(&p[0], 'h', "bad");
    start(&p[1], '0', "bad");
    program_start_file(&p[2], JUMPLINK, NULL, told);
    end_three(p);
    check_refused(&p[0], 1, "does not start|" DIFFERENT);
    check_refused(&p[1], 1, "PE0: not like PE1: |" DIFFERENT);
    check_refused(&p[2], 1, "PE1: not like the others: |" DIFFERENT);
    free_three(p);
}

#define check_mismatch(...) \
    check_mismatch_told((const char *const[]){ \
        "pe", "--pe", "1", BY_HAND, "--run", "bad", __VA_ARGS__, NULL })

static void test_network_different_pes_are_refused(void **state)
{
    (void)state;
    needs_own_net();
    check_mismatch("--model", eight);
    check_mismatch("--model", two, "--form", "standard");
    check_mismatch("--model", two, "--filter", "kf", "--mode", "1");
    check_mismatch("--model", two, "--gate", "0.99999");
}

/* A gate is given to each of them. */
static void test_network_by_hand_with_a_gate(void **state)
{
    struct program host, pe[2];
    char *want;
    int i;

    (void)state;
    needs_own_net();
    run_jumplink("filter", two, data, FLIGHT, "--gate", "0.99", "--gate-most",
                 "2");
    assert_int_equal(ran.status, 0);
    assert_non_null(strstr(ran.err, ": the gate rejected "));
    want = ran.out;
    ran.out = NULL;
    for (i = 0; i < 2; i++)
        program_start(&pe[i], "pe", "--pe", i == 0 ? "0" : "1", "--model", two,
                      BY_HAND, "--gate", "0.99", "--gate-most", "2");
    program_start(&host, "host", two, data, FLIGHT, BY_HAND, "--gate", "0.99",
                  "--gate-most", "2");
    program_end(&host, PROGRAM_LIMIT);
    for (i = 0; i < 2; i++) {
        program_end(&pe[i], PROGRAM_LIMIT);
        check_pe_left(&pe[i], (char)('0' + i));
        program_free(&pe[i]);
    }
    assert_int_equal(host.status, 0);
    check_same_text(host.out, want);
    check_same_text(host.err, ran.err);
    assert_true(strcmp(want, serial) != 0);
    program_free(&host);
    free(want);
    check_nobody_left();
}

/* The host has another model than both PEs. */
static void test_network_host_with_another_model(void **state)
{
    struct program p[3];

    (void)state;
    needs_own_net();
    start(&p[0], '0', "host");
    start(&p[1], '1', "host");
    program_start(&p[2], "host", eight, data, FLIGHT, BY_HAND, "--run",
                  "host");
    end_three(p);
    check_refused(&p[2], 1, "does not start|" DIFFERENT);
    free_three(p);
}

/* The program for the other type of number. */
static const char *other_jumplink(void)
{
    static char path[400];

    if (JL_REAL_FLOAT)
        snprintf(path, sizeof path, "%.*s",
                 (int)(strlen(JUMPLINK) - strlen("_f32")), JUMPLINK);
    else
        snprintf(path, sizeof path, "%s_f32", JUMPLINK);
    return path;
}

/* Says why it fails, and then that datagrams of another kind came. */
static void check_hint(const struct program *p, const char *why)
{
    const char *hint = strstr(p->err, "\njumplink: LCM: ");

    if (p->status != 1 || p->out[0] != '\0' || p->seconds > LEAVING
        || strncmp(p->err, "jumplink: ", 10) != 0 || hint == NULL
        || strchr(p->err, '\n') != hint
        || strchr(hint + 1, '\n') != p->err + strlen(p->err) - 1
        || strstr(p->err, why) == NULL || strstr(p->err, why) > hint
        || strstr(hint, "datagrams were refused") == NULL
        || strstr(hint, "another type of number") == NULL)
        program_fail(p, why);
}

static void test_network_pe_with_another_type_of_number(void **state)
{
    struct program p[3];

    (void)state;
    needs_own_net();
    program_start(&p[0], "host", two, data, FLIGHT, BY_HAND, "--start", "3");
    program_start(&p[1], "pe", "--pe", "0", "--model", two, BY_HAND, "--start",
                  "3");
    program_start_file(&p[2], other_jumplink(), NULL, (const char *const[]){
                       "pe", "--pe", "1", "--model", two, BY_HAND, "--start",
                       "3", NULL });
    end_three(p);
    check_hint(&p[0], "the run does not start: no word from PE1: ");
    check_hint(&p[1], "PE0: no word from PE1");
    check_hint(&p[2], "PE1: no word from PE0");
    free_three(p);
}

/* A PE is not there: host and the other PE, which both name it, end. */
static void check_missing(const char *there, const char *words,
                          const char *host_words)
{
    struct program host, pe;

    program_start(&host, "host", two, data, FLIGHT, BY_HAND, IN_VAIN);
    program_start(&pe, "pe", "--pe", there, "--model", two, BY_HAND, IN_VAIN);
    program_end(&host, PROGRAM_LIMIT);
    program_end(&pe, PROGRAM_LIMIT);
    check_refused(&host, 1, host_words);
    check_refused(&pe, 1, words);
    assert_true(host.seconds < LEAVING);
    assert_true(pe.seconds < LEAVING);
    program_free(&host);
    program_free(&pe);
    check_nobody_left();
}

static void test_network_missing_pe(void **state)
{
    (void)state;
    needs_own_net();
    check_missing("0", "PE0: no word from PE1",
                  "does not start: no word from PE1: ");
    check_missing("1", "PE1: no word from PE0",
                  "does not start: no word from PE0: ");
}

static void test_network_host_alone(void **state)
{
    (void)state;
    needs_own_net();
    run_jumplink("host", two, data, FLIGHT, BY_HAND, IN_VAIN);
    check_refused(&ran, 1, "does not start");
    assert_true(ran.seconds < LEAVING);
}

/* --- without private networks -------------------------------------------- */

static int put(const char *path, const char *text)
{
    int fd = open(path, O_WRONLY);
    ssize_t n = (ssize_t)strlen(text);
    int bad = fd < 0 || write(fd, text, (size_t)n) != n;

    if (fd >= 0)
        close(fd);
    return bad;
}

/* A user namespace of one's own, in which the limits below are one's own. */
static int own_limits(int flags)
{
    char map[60];
    long uid = (long)geteuid(), gid = (long)getegid();

    if (unshare(CLONE_NEWUSER | flags) != 0
        || put("/proc/self/setgroups", "deny"))
        return -1;
    snprintf(map, sizeof map, "%ld %ld 1", uid, uid);
    if (put("/proc/self/uid_map", map))
        return -1;
    snprintf(map, sizeof map, "%ld %ld 1", gid, gid);
    return put("/proc/self/gid_map", map);
}

static int forbid_namespaces(void)
{
    return put("/proc/sys/user/max_net_namespaces", "0")
        || put("/proc/sys/user/max_user_namespaces", "0");
}

static int multicast_only(void)
{
    return own_limits(0) != 0 || private_net_enter() != 0
        || forbid_namespaces();
}

static int no_multicast(void)
{
    return own_limits(CLONE_NEWNET) != 0 || forbid_namespaces();
}

static int ignore_children(void)
{
    return signal(SIGCHLD, SIG_IGN) == SIG_ERR;
}

static void run_where(int (*where)(void))
{
    const char *const told[] = { "filter", two, data, FLIGHT, "--port", "lcm",
                                 "--pes", "3", PATIENTLY, NULL };

    program_free(&ran);
    program_start_file(&ran, JUMPLINK, where, told);
    program_end(&ran, PROGRAM_LIMIT);
    if (ran.status == 77)
        print_message("the limits of namespaces cannot be set here\n");
}

/* As some daemons start programs. */
static void test_network_from_one_who_ignores_children(void **state)
{
    (void)state;
    needs_own_net();
    run_where(ignore_children);
    check_good(&ran);
    check_same_text(ran.out, serial);
    check_nobody_left();
}

static void test_network_falls_back_to_the_machines_own(void **state)
{
    const char *end;

    (void)state;
    run_where(multicast_only);
    if (ran.status == 77)
        skip();
    end = strchr(ran.err, '\n');
    if (ran.status != 0 || end == NULL || end[1] != '\0'
        || strstr(ran.err, "private") == NULL
        || strstr(ran.err, "ttl=0") == NULL
        || strncmp(ran.err, "jumplink: ", 10) != 0)
        program_fail(&ran, "success, and one line about the network");
    check_same_text(ran.out, serial);
    check_nobody_left();
}

static void test_network_without_multicast(void **state)
{
    (void)state;
    run_where(no_multicast);
    if (ran.status == 77)
        skip();
    assert_int_equal(ran.status, 1);
    assert_string_equal(ran.out, "");
    if (strstr(ran.err, "no multicast route") == NULL
        || strstr(ran.err, "ip route add 224.0.0.0/4 dev lo") == NULL)
        program_fail(&ran, "a word about multicast and what helps");
    assert_true(ran.seconds < 15);
    check_nobody_left();
}

/* --- wrong use ----------------------------------------------------------- */

#define refused(words, ...) do { \
    run_jumplink(__VA_ARGS__); \
    check_refused(&ran, 2, words); \
} while (0)

static void test_network_wrong_use(void **state)
{
    (void)state;
    refused("MODEL.json and DATA.csv", "host", two);
    refused("--pes and --lcm-url", "host", two, data);
    refused("--port", "host", two, data, BY_HAND, "--port", "loop");
    refused("--run 'a b'", "host", two, data, BY_HAND, "--run", "a b");
    refused("--run", "pe", "--pe", "0", "--model", two, BY_HAND, "--run",
            "seventeen_letters");
    refused("--start 0", "host", two, data, BY_HAND, "--start", "0");
    refused("--lcm-url foo", "host", two, data, "--pes", "2", "--lcm-url",
            "foo");
    refused("--mode", "host", two, data, BY_HAND, "--mode", "1");
    refused("unexpected 'x'", "pe", "x");
    refused("--model", "pe", "--pe", "0", BY_HAND);
    refused("--lcm-url", "pe", "--pe", "0", "--pes", "2", "--model", two);
    refused("--pe 2", "pe", "--pe", "2", BY_HAND, "--model", two);
    refused("--pe -1", "pe", "--pe", "-1", BY_HAND, "--model", two);
    refused("--pe x", "pe", "--pe", "x", BY_HAND, "--model", two);
    refused("--hold", "pe", "--pe", "0", BY_HAND, "--model", two, "--hold",
            "none");
    refused("none.json", "pe", "--pe", "0", BY_HAND, "--model", "none.json");
    refused("--mode", "pe", "--pe", "0", BY_HAND, "--model", two, "--filter",
            "kf");
}

/* A host says so before it waits for anybody. */
static void test_network_host_with_a_misfit(void **state)
{
    (void)state;
    refused("z.csv:1: |2 measurements", "host",
            TOP_DIR "/tests/golden/imm/cvca3/model.json",
            TOP_DIR "/tests/golden/imm/bank12/z.csv", BY_HAND);
    assert_true(ran.seconds < LEAVING);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_network_by_hand_in_any_order),
        cmocka_unit_test(test_network_two_runs_at_once),
        cmocka_unit_test(test_network_waits_for_the_others),
        cmocka_unit_test(test_network_different_pes_are_refused),
        cmocka_unit_test(test_network_by_hand_with_a_gate),
        cmocka_unit_test(test_network_host_with_another_model),
        cmocka_unit_test(test_network_pe_with_another_type_of_number),
        cmocka_unit_test(test_network_missing_pe),
        cmocka_unit_test(test_network_host_alone),
        cmocka_unit_test(test_network_from_one_who_ignores_children),
        cmocka_unit_test(test_network_falls_back_to_the_machines_own),
        cmocka_unit_test(test_network_without_multicast),
        cmocka_unit_test(test_network_wrong_use),
        cmocka_unit_test(test_network_host_with_a_misfit),
    };

    return cmocka_run_group_tests(tests, setup, teardown);
}
