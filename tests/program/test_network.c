/* Runs over LCM: PEs and host started by hand, PEs that are missing, wrong or
 * killed, and machines that allow no private network.  All of it in a network
 * of the test's own. */
#include "close.h"
#include "scratch.h"
#include "program.h"

#include <fcntl.h>
#include <sched.h>

#include "private_net.h"

#define DATA TOP_DIR "/sim/data/"
#define URL "udpm://239.255.76.67:7667?ttl=0"
#define LEAVING 15              /* seconds; 1 to 4 unless the machine is busy */
#define FLIGHT "--z", "east_m,north_m"
#define BY_HAND "--pes", "2", "--lcm-url", URL, PATIENTLY
#define PATIENTLY "--timeout", "20"     /* on a machine that is busy */

static char data[400], two[400], eight[400], endless[400];
static char *serial;            /* the estimates of data by two */
static int private_net;

static void keep(char *to, const char *path)
{
    snprintf(to, 400, "%s", path);
}

/* A record that takes long enough to be killed in. */
static void write_endless(void)
{
    FILE *stream;
    int k;

    keep(endless, scratch_path("endless.csv"));
    stream = fopen(endless, "w");
    scratch_must(stream != NULL, endless);
    fputs("t_s,z0,z1\n", stream);
    for (k = 0; k < 50000; k++)
        fprintf(stream, "%d,%d,%d\n", k, 10 * k, k % 7);
    scratch_must(fclose(stream) == 0, endless);
}

static int setup(void **state)
{
    scratch_setup(state);
    private_net = private_net_enter() == 0;
    if (!private_net)
        print_message("no private network is allowed here: %s\n",
                      strerror(errno));
    keep(data, program_head("flight.csv", DATA "carrier_held_1hz.csv", 201));
    keep(two, program_copy("two_modes.json", DATA "two_modes.json"));
    keep(eight, program_copy("eight_modes.json", DATA "eight_modes.json"));
    write_endless();
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

#define needs_private_net() do { \
    if (!private_net) \
        skip(); \
} while (0)

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
    needs_private_net();
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
    needs_private_net();
    for (i = 0; i < 3; i++) {
        start(&a[i], "01h"[i], "one");
        start(&b[i], "h10"[i], "other_1");
    }
    end_all(a, "01h");
    end_all(b, "h10");
    check_nobody_left();
}

/* --- wrong PEs ----------------------------------------------------------- */

/* A host and two PEs of which the second has other arguments: all refuse. */
static void check_mismatch(const char *what, const char *model,
                           const char *form)
{
    struct program p[3];
    int i;

    start(&p[0], 'h', "bad");
    start(&p[1], '0', "bad");
    program_start(&p[2], "pe", "--pe", "1", "--model", model, BY_HAND, "--run",
                  "bad", "--form", form);
    for (i = 0; i < 3; i++)
        program_end(&p[i], PROGRAM_LIMIT);
    check_refused(&p[0], 1, what);
    check_refused(&p[1], 1, what);
    check_refused(&p[2], 1, "PE1");
    for (i = 0; i < 3; i++)
        program_free(&p[i]);
}

static void test_network_different_models_are_refused(void **state)
{
    (void)state;
    needs_private_net();
    check_mismatch("different model", eight, "joseph");
    check_mismatch("different", two, "standard");
    check_nobody_left();
}

/* The host has another model than both PEs. */
static void test_network_host_with_another_model(void **state)
{
    struct program p[3];
    int i;

    (void)state;
    needs_private_net();
    start(&p[0], '0', "host");
    start(&p[1], '1', "host");
    program_start(&p[2], "host", eight, data, FLIGHT, BY_HAND, "--run",
                  "host");
    for (i = 0; i < 3; i++)
        program_end(&p[i], PROGRAM_LIMIT);
    check_refused(&p[2], 1, "different model");
    for (i = 0; i < 3; i++)
        program_free(&p[i]);
    check_nobody_left();
}

/* PE1 is not there: the host, and PE0, end by themselves. */
static void test_network_missing_pe(void **state)
{
    struct program host, pe;

    (void)state;
    needs_private_net();
    program_start(&host, "host", two, data, FLIGHT, BY_HAND, "--timeout",
                  "0.5");
    program_start(&pe, "pe", "--pe", "0", "--model", two, BY_HAND,
                  "--timeout", "0.5");
    program_end(&host, PROGRAM_LIMIT);
    program_end(&pe, PROGRAM_LIMIT);
    check_refused(&host, 1, "does not start");
    check_refused(&pe, 1, "PE0");
    program_free(&host);
    program_free(&pe);
    check_nobody_left();
}

/* --- a PE that dies ------------------------------------------------------ */

/* Kill PE `which` of a filter in mid-run. */
static void check_killed(const char *which, int number)
{
    struct program p;
    char pe[20], out[400], name[8];
    pid_t pid = 0;
    int before = scratch_count();
    double killed;

    snprintf(pe, sizeof pe, " pe --pe %s ", which);
    snprintf(name, sizeof name, "PE%s", which);
    keep(out, scratch_path("killed.csv"));
    program_start(&p, "filter", eight, endless, "--port", "lcm", "--out", out);
    while (program_find(pe, scratch_dir, &pid) == 0
           && program_now() < p.began + 10)
        program_sleep(0.01);
    program_sleep(0.5);
    assert_true(pid > 0);
    kill(pid, number);
    killed = program_now();
    program_end(&p, PROGRAM_LIMIT);
    assert_int_equal(p.status, 1);
    assert_true(program_now() - killed < LEAVING);
    assert_string_equal(p.out, "");
    if (number == SIGKILL && strstr(p.err, name) == NULL)
        program_fail(&p, name);
    assert_int_equal(scratch_count(), before);
    program_free(&p);
    check_nobody_left();
}

static void test_network_killed_pe(void **state)
{
    (void)state;
    check_killed("0", SIGKILL);
    check_killed("1", SIGKILL);
    check_killed("3", SIGKILL);
}

/* One that only stops answering is not waited for longer than the timeout,
 * and is gone afterwards. */
static void test_network_stopped_pe(void **state)
{
    (void)state;
    check_killed("2", SIGSTOP);
}

/* The PEs do not outlive a program that is killed. */
static void test_network_killed_filter(void **state)
{
    struct program p;
    int before = scratch_count();

    (void)state;
    program_start(&p, "filter", eight, endless, "--port", "lcm", "--out",
                  scratch_path("killed.csv"));
    while (program_find(" pe --pe 3 ", scratch_dir, NULL) == 0
           && program_now() < p.began + 10)
        program_sleep(0.01);
    program_sleep(0.2);
    kill(p.pid, SIGKILL);
    program_end(&p, PROGRAM_LIMIT);
    assert_int_equal(p.status, 128 + SIGKILL);
    check_nobody_left();
    assert_int_equal(scratch_count(), before);
    program_free(&p);
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_network_by_hand_in_any_order),
        cmocka_unit_test(test_network_two_runs_at_once),
        cmocka_unit_test(test_network_different_models_are_refused),
        cmocka_unit_test(test_network_host_with_another_model),
        cmocka_unit_test(test_network_missing_pe),
        cmocka_unit_test(test_network_killed_pe),
        cmocka_unit_test(test_network_stopped_pe),
        cmocka_unit_test(test_network_killed_filter),
        cmocka_unit_test(test_network_falls_back_to_the_machines_own),
        cmocka_unit_test(test_network_without_multicast),
        cmocka_unit_test(test_network_wrong_use),
    };

    return cmocka_run_group_tests(tests, setup, teardown);
}
