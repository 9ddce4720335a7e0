/* PEs that are killed or hang, hosts that are interrupted or killed, at many
 * moments: the right one is named, what was done is kept and marked partial,
 * and nobody and nothing is left.  In a network of the test's own. */
#include "close.h"
#include "scratch.h"
#include "program.h"

#include "own_net.h"

#define DATA TOP_DIR "/sim/data/"
#define LONGEST 40.0            /* seconds; 1 to 5 unless the machine is busy */

static char data[400], model[400], out[400];
static char *serial;            /* the estimates of all rows */

static int setup(void **state)
{
    scratch_setup(state);
    own_net_enter();
    snprintf(data, sizeof data, "%s", endless_record("long.csv"));
    snprintf(model, sizeof model, "%s",
             program_copy("eight_modes.json", DATA "eight_modes.json"));
    snprintf(out, sizeof out, "%s", scratch_path("out.csv"));
    run_jumplink("filter", model, data);
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

/* --- what must be true after a death ------------------------------------- */

/* The file holds the beginning of the serial estimates, and says so. */
static void check_partial(void)
{
    const char *path = scratch_path("out.csv.partial"), *mark;
    char *text = scratch_read(path), *end;
    long rows = 0, of = 0;

    if (text == NULL)           /* it died before the first row */
        return;
    mark = strstr(text, "# partial: ");
    assert_non_null(mark);
    assert_int_equal(sscanf(mark, "# partial: %ld of %ld rows\n", &rows, &of),
                     2);
    assert_int_equal(of, ENDLESS_ROWS);
    assert_memory_equal(text, serial, (size_t)(mark - text));
    for (end = text; end < mark; end++)
        rows -= *end == '\n';
    assert_int_equal(rows, -1);         /* the header */
    free(text);
    assert_int_equal(remove(path), 0);
}

/* It ended with status 1 and complaints that hold `words`; no other PE than
 * `pe` is blamed (-1: nobody is); the result is not there, but perhaps a part
 * of it. */
static void check_death(struct program *p, const char *words, int pe)
{
    int other;

    program_end(p, LONGEST);
    if (p->status != 1 || strstr(p->err, words) == NULL)
        program_fail(p, words);
    for (other = 0; other < 8; other++) {
        char name[8];

        snprintf(name, sizeof name, "PE%d", other);
        if (other != pe && strstr(p->err, name) != NULL)
            program_fail(p, "the right PE");
    }
    program_free(p);
    assert_null(scratch_read(out));
    check_partial();
    assert_int_equal(scratch_count(), 2);       /* data, model */
    check_nobody_left();
}

/* Its process, when it is there; 0 if the run has ended before. */
static pid_t find_pe(int pe)
{
    double deadline = program_now() + 10;
    char option[16];
    pid_t pid = 0;

    snprintf(option, sizeof option, "--pe %d ", pe);
    while (program_find(scratch_dir, option, &pid) == 0)
        if (program_now() > deadline)
            fail();
        else
            program_sleep(0.001);
    return pid;
}

static void start_run(struct program *p, const char *pes, const char *topology)
{
    program_start(p, "filter", model, data, "--pes", pes, "--topology",
                  topology, "--timeout", "1", "-o", out);
}

/* --- PEs ----------------------------------------------------------------- */

static const char *const topologies[] = { "full", "star", "ring", "chain" };

static void test_death_of_a_pe_is_named_at_any_moment(void **state)
{
    int k;

    (void)state;
    needs_own_net();
    for (k = 0; k < 12; k++) {
        struct program p;
        char words[80];
        int pe = (k + k / 4) % 4;

        start_run(&p, "4", topologies[k % 4]);
        (void)find_pe(3);
        program_sleep(0.03 * k);
        kill(find_pe(pe), SIGKILL);
        snprintf(words, sizeof words, "PEs: PE%d was ended by signal 9", pe);
        check_death(&p, words, pe);
    }
}

static void test_death_by_silence_is_named_and_not_the_relay(void **state)
{
    int k;

    (void)state;
    needs_own_net();
    for (k = 0; k < 6; k++) {
        struct program p;
        char words[80];
        int pe = k % 4;

        start_run(&p, "4", topologies[3 - k % 3]);
        (void)find_pe(3);
        program_sleep(0.5 + 0.01 * k);
        kill(find_pe(pe), SIGSTOP);
        snprintf(words, sizeof words, "no word from PE%d: ", pe);
        check_death(&p, words, pe);
    }
}

/* --- the host ------------------------------------------------------------ */

static int own_group(void)
{
    return setpgid(0, 0);
}

/* As from a terminal, to the host and its PEs; or to the host alone. */
static void test_death_interrupted_keeps_what_is_done(void **state)
{
    static const int signals[] = { SIGINT, SIGTERM, SIGHUP };
    static const char *const names[] = { "SIGINT", "SIGTERM", "SIGHUP" };
    int k;

    (void)state;
    needs_own_net();
    for (k = 0; k < 12; k++) {
        const char *const told[] = {
            "filter", model, data, "--pes", "4", "--timeout", "1", "-o", out,
            NULL
        };
        struct program p;

        program_start_file(&p, JUMPLINK, own_group, told);
        (void)find_pe(0);
        program_sleep(0.06 * k);
        kill(k % 2 ? p.pid : -p.pid, signals[k % 3 == 1 && k % 2 == 0 ? 0
                                             : k % 3]);
        check_death(&p, names[k % 3 == 1 && k % 2 == 0 ? 0 : k % 3], -1);
    }
}

static void test_death_of_a_serial_run_keeps_what_is_done(void **state)
{
    struct program p;

    (void)state;
    program_start(&p, "filter", model, data, "--port", "loop", "-o", out);
    program_sleep(0.2);
    kill(p.pid, SIGINT);
    check_death(&p, "SIGINT: the run ends at ", -1);
}

static void test_death_of_the_host_ends_its_pes(void **state)
{
    struct program p;

    (void)state;
    needs_own_net();
    start_run(&p, "4", "full");
    (void)find_pe(3);
    program_sleep(0.3);
    kill(p.pid, SIGKILL);
    program_end(&p, LONGEST);
    program_free(&p);
    check_nobody_left();
}

/* --- by hand ------------------------------------------------------------- */

#define BY_HAND "--pes", "2", "--lcm-url", OWN_NET_URL, "--timeout", "1"

static void start_by_hand(struct program *p)
{
    program_start(&p[0], "pe", "--pe", "0", "--model", model, BY_HAND);
    program_start(&p[1], "pe", "--pe", "1", "--model", model, BY_HAND);
    program_start(&p[2], "host", model, data, BY_HAND, "-o", out);
    program_sleep(1.5);
}

static void check_said(struct program *p, const char *words)
{
    program_end(p, LONGEST);
    if (p->status != 1 || strstr(p->err, words) == NULL)
        program_fail(p, words);
    program_free(p);
}

static void test_death_by_hand_of_the_host_ends_pes(void **state)
{
    struct program p[3];

    (void)state;
    needs_own_net();
    start_by_hand(p);
    kill(p[2].pid, SIGKILL);
    program_end(&p[2], LONGEST);
    program_free(&p[2]);
    check_said(&p[0], "PE0: no word from the host: ");
    check_said(&p[1], "PE1: no word from the host: ");
    check_nobody_left();
}

static void test_death_by_hand_of_a_pe_is_named(void **state)
{
    static const int signals[] = { SIGKILL, SIGSTOP };
    struct program p[3];
    int k, pe;

    (void)state;
    needs_own_net();
    for (k = 0; k < 4; k++) {
        char words[40];

        pe = k % 2;
        start_by_hand(p);
        kill(p[pe].pid, signals[k / 2]);
        snprintf(words, sizeof words, "no word from PE%d: ", pe);
        check_said(&p[1 - pe], words);
        program_end(&p[2], LONGEST);
        assert_int_equal(p[2].status, 1);
        assert_non_null(strstr(p[2].err, words));
        program_free(&p[2]);
        kill(p[pe].pid, SIGKILL);
        program_end(&p[pe], LONGEST);
        program_free(&p[pe]);
        check_partial();
        check_nobody_left();
    }
}

/* --- jumplink sim -------------------------------------------------------- */

/* The table marks the run that was cut short, and there are no plots. */
static void test_death_in_sim_is_marked(void **state)
{
    static const char *const named[] = {
        "table.csv", "table.txt", "track.csv", "eight_modes_fresh.csv.partial"
    };
    const char *folder = scratch_path("sim");
    int files = scratch_count(), k;
    struct program p;

    (void)state;
    needs_own_net();
    program_start(&p, "sim", "--data", DATA "carrier_held_1hz.csv", "--model",
                  model, "--hold", "none", "--timeout", "1", "-o", folder);
    (void)find_pe(3);
    program_sleep(0.2);
    kill(find_pe(2), SIGKILL);
    program_end(&p, LONGEST);
    if (p.status != 1 || strstr(p.err, "PE2 was ended by signal 9") == NULL)
        program_fail(&p, "the death of PE2");
    if (strstr(p.err, ".partial: partial: the first ") != NULL) {
        assert_non_null(strstr(p.out, " (partial)\n"));
        assert_non_null(strstr(p.out, "\nincomplete: "));
        assert_int_equal(scratch_count(), files + 4);
        for (k = 0; k < 4; k++) {
            char path[500];

            snprintf(path, sizeof path, "%s/%s", folder, named[k]);
            free(program_file(path));
        }
    }
    program_free(&p);
    check_nobody_left();
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_death_of_a_pe_is_named_at_any_moment),
        cmocka_unit_test(test_death_by_silence_is_named_and_not_the_relay),
        cmocka_unit_test(test_death_interrupted_keeps_what_is_done),
        cmocka_unit_test(test_death_of_a_serial_run_keeps_what_is_done),
        cmocka_unit_test(test_death_of_the_host_ends_its_pes),
        cmocka_unit_test(test_death_by_hand_of_the_host_ends_pes),
        cmocka_unit_test(test_death_by_hand_of_a_pe_is_named),
        cmocka_unit_test(test_death_in_sim_is_marked),
    };

    return cmocka_run_group_tests(tests, setup, teardown);
}
