/* Runs over LCM among strangers: foreign messages, hostile datagrams, and the
 * record of an earlier run.  They change nothing, are refused and counted. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "stranger.h"

#include "own_net.h"

#define DATA TOP_DIR "/sim/data/"
#define RUN "--pes", "3", "--lcm-url", STRANGER_URL, "--timeout", "20"
#define FLIGHT "--z", "east_m,north_m"

static char data[400], model[400], tape[400];
static char *serial;            /* the estimates of data by model */

static int setup(void **state)
{
    scratch_setup(state);
    own_net_enter();
    strcpy(data, program_copy("flight.csv", DATA "sightseeing_1hz.csv"));
    strcpy(model, program_copy("eight_modes.json", DATA "eight_modes.json"));
    strcpy(tape, scratch_path("tape"));
    run_jumplink("filter", model, data, FLIGHT);
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

/* --- checks -------------------------------------------------------------- */

/* The serial filter's octets, and one line that says how many datagrams were
 * refused: at least so many. */
static void check_undisturbed(const struct program *p, unsigned long least)
{
    unsigned long refused = 0;
    const char *end = strchr(p->err, '\n');

    check_same_text(p->out, serial);
    if (p->status != 0 || end == NULL || end[1] != '\0'
        || sscanf(p->err, "jumplink: LCM: %lu datagrams that do not belong to "
                  "this run were refused", &refused) != 1
        || refused < least)
        program_fail(p, "success, and a line about what was refused");
}

static void check_pe(const struct program *p, int pe, unsigned long least)
{
    unsigned long refused = 0;
    int which = -1;

    check_good(p);
    if (sscanf(p->out, "pe %d of 3: %*u messages, %*u octets, %*u sent again, "
               "%lu refused", &which, &refused) != 2
        || which != pe || refused < least)
        program_fail(p, "a line with what was refused");
}

/* --- runs by hand -------------------------------------------------------- */

static void start_by_hand(struct program *p, const char *run)
{
    static const char *const pe[3] = { "0", "1", "2" };
    int i;

    for (i = 0; i < 3; i++)
        program_start(&p[i], "pe", "--pe", pe[i], "--model", model, RUN,
                      "--run", run);
    program_start(&p[3], "host", model, data, FLIGHT, RUN, "--run", run);
}

static void end_by_hand(struct program *p)
{
    int i;

    for (i = 3; i >= 0; i--)
        program_end(&p[i], PROGRAM_LIMIT);
}

static void free_by_hand(struct program *p)
{
    int i;

    for (i = 0; i < 4; i++)
        program_free(&p[i]);
    check_nobody_left();
}

static void test_strays_from_before_the_start(void **state)
{
    struct program p[4];
    pid_t stranger;
    int i;

    (void)state;
    needs_own_net();
    stranger = stranger_start("strays", 4);
    start_by_hand(p, "strays");
    end_by_hand(p);
    stranger_end(stranger);
    check_undisturbed(&p[3], 10);
    for (i = 0; i < 3; i++)
        check_pe(&p[i], i, 10);
    free_by_hand(p);
}

static void test_strays_replayed_run(void **state)
{
    struct program p[4];
    pid_t stranger;
    int i;

    (void)state;
    needs_own_net();
    stranger = stranger_record(tape);
    start_by_hand(p, "again");
    end_by_hand(p);
    stranger_end(stranger);
    check_good(&p[3]);
    check_same_text(p[3].out, serial);
    for (i = 0; i < 3; i++)
        check_pe(&p[i], i, 0);
    free_by_hand(p);

    stranger = stranger_replay(tape);
    start_by_hand(p, "again");
    end_by_hand(p);
    stranger_end(stranger);
    check_undisturbed(&p[3], 1);
    for (i = 0; i < 3; i++)
        check_pe(&p[i], i, 1);
    free_by_hand(p);
}

/* --- a run of its own ---------------------------------------------------- */

/* The name of a filter's run is made of its process number.  Only PEs are
 * troubled: the host says what they have counted. */
static void test_strays_in_a_filter(void **state)
{
    struct program p;
    pid_t stranger;
    char run[20];

    (void)state;
    needs_own_net();
    program_start(&p, "filter", model, data, FLIGHT, RUN);
    snprintf(run, sizeof run, "r%d_1", (int)p.pid);
    stranger = stranger_start(run, 3);
    program_end(&p, PROGRAM_LIMIT);
    stranger_end(stranger);
    check_undisturbed(&p, 1);
    program_free(&p);
    check_nobody_left();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_strays_from_before_the_start),
        cmocka_unit_test(test_strays_replayed_run),
        cmocka_unit_test(test_strays_in_a_filter),
    };

    return cmocka_run_group_tests(tests, setup, teardown);
}
