/* Several machines, as network namespaces: each process of a run in one of its
 * own, joined by veth pairs to a bridge in that of the test.  No namespace has
 * a name, so the kernel removes them with the last process in them, however
 * that ends. */
#include "program.h"

#include <sched.h>

#include <lcm/lcm.h>

#include "own_net.h"

#define DATA TOP_DIR "/sim/data/"
#define URL "udpm://239.255.76.67:7667?ttl=1"
#define FLIGHT "--z", "east_m,north_m"
#define RUN "--pes", "2", "--lcm-url", URL, "--timeout", "20"
#define SHORT_RUN "--pes", "2", "--lcm-url", URL, "--timeout", "1"
#define ROWS 300

static char data[400], two[400], endless[400];
static char *serial;            /* the estimates of data by two */
static int possible;
static int machines;            /* so far: their addresses and links */
static struct program p[3];     /* PE 0, PE 1, the host */

static void keep(char *to, const char *path)
{
    snprintf(to, 400, "%s", path);
}

/* --- the network --------------------------------------------------------- */

/* Both ends of a new machine's way to the test and back. */
static int says[2], hears[2];

static int shell(const char *format, ...)
    __attribute__((format(printf, 1, 2)));

static int shell(const char *format, ...)
{
    char command[400];
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(command, sizeof command, format, arguments);
    va_end(arguments);
    return system(command) == 0 ? 0 : -1;
}

/* In the child: leave the test's network, wait for a link, set it up. */
static int become_machine(void)
{
    char word = 'x';

    if (unshare(CLONE_NEWNET) != 0 || write(says[1], &word, 1) != 1
        || read(hears[0], &word, 1) != 1)
        return -1;
    return shell("ip link set lo up && ip addr add 10.77.0.%d/24 dev eth0 && "
                 "ip link set eth0 up && ip route add 224.0.0.0/4 dev eth0",
                 machines);
}

/* Start jumplink on a machine of its own. */
static void machine_start(struct program *at, const char *const *told)
{
    char word = 'x';

    machines++;
    scratch_must(pipe2(says, O_CLOEXEC) == 0 && pipe2(hears, O_CLOEXEC) == 0,
                 "pipe");
    program_start_file(at, JUMPLINK, become_machine, told);
    scratch_must(read(says[0], &word, 1) == 1, "a new network namespace");
    scratch_must(shell("ip link add v%d type veth peer name eth0 netns %d && "
                       "ip link set v%d master br0 up", machines, (int)at->pid,
                       machines) == 0, "a veth pair");
    scratch_must(write(hears[1], &word, 1) == 1, "pipe");
    close(says[0]);
    close(says[1]);
    close(hears[0]);
    close(hears[1]);
}

#define machine(at, ...) \
    machine_start((at), (const char *const[]){ __VA_ARGS__, NULL })

/* Packets that came over the links so far. */
static long carried(void)
{
    FILE *stream = fopen("/proc/self/net/dev", "r");
    char name[32], line[400];
    long octets, packets, found = -1;

    scratch_must(stream != NULL, "/proc/self/net/dev");
    while (fgets(line, sizeof line, stream) != NULL)
        if (sscanf(line, " %30[^:]: %ld %ld", name, &octets, &packets) == 3
            && strcmp(name, "br0") == 0)
            found = packets;
    fclose(stream);
    assert_true(found >= 0);
    return found;
}

/* --- tests --------------------------------------------------------------- */

#define needs_machines() do { \
    if (!possible) \
        skip(); \
} while (0)

static void on_estimate(const lcm_recv_buf_t *buf, const char *channel,
                        void *context)
{
    int *count = context;

    (void)buf;
    (void)channel;
    ++*count;
}

/* And the test, on the switch, hears the typed copies. */
static void test_machines_give_the_serial_bits(void **state)
{
    lcm_t *lcm;
    long before;
    int i, heard = 0;

    (void)state;
    needs_machines();
    lcm = lcm_create(URL "&recv_buf_size=4194304");
    assert_non_null(lcm);
    lcm_subscription_set_queue_capacity(lcm_subscribe(lcm,
        "JL.jumplink.estimate", on_estimate, &heard), 0);
    before = carried();
    machine(&p[0], "pe", "--pe", "0", "--model", two, RUN);
    machine(&p[1], "pe", "--pe", "1", "--model", two, RUN);
    machine(&p[2], "host", two, data, FLIGHT, RUN);
    for (i = 0; i < 3; i++)
        program_end(&p[i], PROGRAM_LIMIT);
    for (i = 0; i < 3; i++)
        check_good(&p[i]);
    check_same_text(p[2].out, serial);
    /* z to PE 0 and on to PE 1, their exchange, the estimate, two copies */
    assert_true(carried() - before >= 7 * ROWS);
    while (lcm_handle_timeout(lcm, 200) > 0)
        ;
    assert_int_equal(heard, ROWS);
    lcm_destroy(lcm);
    for (i = 0; i < 3; i++)
        program_free(&p[i]);
    check_nobody_left();
}

/* The cable of PE 1 is pulled. */
static void test_machines_one_is_cut_off(void **state)
{
    long before;
    int i, cable;

    (void)state;
    needs_machines();
    before = carried();
    machine(&p[0], "pe", "--pe", "0", "--model", two, SHORT_RUN);
    machine(&p[1], "pe", "--pe", "1", "--model", two, SHORT_RUN);
    cable = machines;
    machine(&p[2], "host", two, endless, SHORT_RUN);
    while (carried() - before < 1000)
        program_sleep(0.005);
    scratch_must(shell("ip link set v%d down", cable) == 0, "ip link");
    program_end(&p[2], PROGRAM_LIMIT);
    program_end(&p[0], PROGRAM_LIMIT);
    program_end(&p[1], PROGRAM_LIMIT);
    check_ended(&p[2], "no word from PE1: ");
    check_refused(&p[0], 1, "PE0: no word from PE1: ");
    check_refused(&p[1], 1, "PE1: no word from PE0: ");
    for (i = 0; i < 3; i++)
        program_free(&p[i]);
    check_nobody_left();
}

/* ------------------------------------------------------------------------- */

/* The test's own network becomes the switch, and a machine on it. */
static int make_switch(void)
{
    return private_net_enter() == 0
        && shell("{ ip link add br0 type bridge mcast_snooping 0 && "
                 "ip addr add 10.77.0.254/24 dev br0 && "
                 "ip link set br0 up && ip route flush 224.0.0.0/4 && "
                 "ip route add 224.0.0.0/4 dev br0 && "
                 "ip link add v0 type veth peer name w0; } 2>/dev/null") == 0;
}

static int kill_all(void **state)
{
    int i;

    (void)state;
    for (i = 0; i < 3; i++)
        program_kill(&p[i]);
    return 0;
}

static int setup(void **state)
{
    scratch_setup(state);
    keep(data, program_head("flight.csv", DATA "sightseeing_1hz.csv",
                            ROWS + 1));
    keep(two, program_copy("two_modes.json", DATA "two_modes.json"));
    keep(endless, endless_record("endless.csv"));
    run_jumplink("filter", two, data, FLIGHT);
    scratch_must(ran.status == 0, "jumplink filter");
    serial = ran.out;
    ran.out = NULL;
    possible = make_switch();
    if (!possible)
        print_message("no bridge between network namespaces is allowed here "
                      "(it takes root, and ip of iproute2): skipped\n");
    return 0;
}

static int teardown(void **state)
{
    program_free(&ran);
    free(serial);
    return scratch_teardown(state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_machines_give_the_serial_bits,
                                  kill_all),
        cmocka_unit_test_teardown(test_machines_one_is_cut_off, kill_all),
    };

    return cmocka_run_group_tests(tests, setup, teardown);
}
