/* LCM's own tools as clients: lcm-logger records a run, lcm-logplayer feeds
 * one, whole and with packets taken out. */
#include "live.h"
#include "table.h"

#include <math.h>

#include "jumplink/base.h"

#define DATA TOP_DIR "/sim/data/"
#define ROWS 200
#define RUN "flight"
#define LOSE_EVERY 7            /* ROWS is no multiple of it */
#define READY "TEST_READY"
#define DONE "TEST_DONE"
#define TRIES 10                /* for LCM to lose nothing */

static char data[400], two[400], whole[400];
static char *estimates;         /* of data by two, on one processor */

static void keep(char *to, const char *path)
{
    snprintf(to, 400, "%s", path);
}

/* --- recording ----------------------------------------------------------- */

/* Events of a channel in a log, if all of it can be read. */
static int log_count(const char *path, const char *channel)
{
    lcm_eventlog_t *log = lcm_eventlog_create(path, "r");
    lcm_eventlog_event_t *event;
    int count = 0;

    while (log != NULL && (event = lcm_eventlog_read_next_event(log)) != NULL) {
        count += strcmp(event->channel, channel) == 0;
        lcm_eventlog_free_event(event);
    }
    if (log != NULL)
        lcm_eventlog_destroy(log);
    return count;
}

/* The logger hears, or has heard all before, once it has written this. */
static void log_await(const char *path, const char *channel)
{
    double deadline = program_now() + PROGRAM_LIMIT;

    while (log_count(path, channel) == 0) {
        assert_true(program_now() < deadline);
        lcm_publish(live_lcm, channel, "x", 1);
        program_sleep(0.02);
    }
}

static void run_by_hand(void)
{
#define TOLD "--pes", "2", "--lcm-url", LIVE_URL, "--run", RUN, "--timeout", \
    "20"
    struct program *pe0 = live_start(JUMPLINK, "pe", "--pe", "0", "--model",
                                     two, TOLD);
    struct program *pe1 = live_start(JUMPLINK, "pe", "--pe", "1", "--model",
                                     two, TOLD);
    struct program *host = live_start(JUMPLINK, "host", two, data, "--z",
                                      "east_m,north_m", "--hold", "detect",
                                      TOLD);

    live_end(host);
    live_end(pe0);
    live_end(pe1);
    check_good(host);
    check_good(pe0);
    check_good(pe1);
    check_same_text(host->out, estimates);
    program_free(host);
    program_free(pe0);
    program_free(pe1);
#undef TOLD
}

/* PEs that the program starts have names of their own for their frames. */
static void run_filter(void)
{
    struct program *p = live_start(JUMPLINK, "filter", two, data, "--z",
                                   "east_m,north_m", "--hold", "detect",
                                   "--pes", "2", "--lcm-url", LIVE_URL,
                                   "--run", RUN, "--timeout", "20");

    live_end(p);
    check_good(p);
    check_same_text(p->out, estimates);
    program_free(p);
}

/* lcm-logger, too, loses messages on a busy machine (its queue holds 30). */
static void record(const char *path, void (*run)(void))
{
    int i;

    for (i = 0; i < TRIES; i++) {
        struct program *logger = live_start("lcm-logger", "--quiet", "--force",
                                            "--flush-interval=5",
                                            "--lcm-url=" LIVE_URL LIVE_BUFFER,
                                            path);

        log_await(path, READY);
        run();
        log_await(path, DONE);
        kill(logger->pid, SIGTERM);
        live_end(logger);
        program_free(logger);
        if (log_count(path, "JL." RUN ".measurement") == ROWS
            && log_count(path, "JL." RUN ".estimate") == ROWS)
            return;
        print_message("the logger missed something: once more\n");
    }
    fail();
}

/* --- what a log holds ---------------------------------------------------- */

static void check_measurement(const lcm_eventlog_event_t *event, int row,
                              const struct table *sent)
{
    jumplink_measurement got;
    int i;

    assert_int_equal(jumplink_measurement_decode(event->data, 0,
                                                 event->datalen, &got),
                     event->datalen);
    assert_int_equal(got.seq, row + 1);
    assert_true(got.time == table_at(sent, row, 0));
    assert_int_equal(got.record, 0);
    assert_int_equal(got.m, 2);
    assert_int_equal(got.arrived, row == 0
        || table_at(sent, row, 1) != table_at(sent, row - 1, 1)
        || table_at(sent, row, 2) != table_at(sent, row - 1, 2));
    for (i = 0; i < 2; i++)
        assert_true(got.arrived ? got.z[i] == (double)(jl_real)table_at(sent,
                    row, 1 + i) : isnan(got.z[i]));
    jumplink_measurement_decode_cleanup(&got);
}

static void check_numbers(const struct table *given, int row, int *column,
                          const double *got, int count)
{
    int i;

    for (i = 0; i < count; i++)
        assert_true(got[i] == table_at(given, row, (*column)++));
}

static void check_estimate(const lcm_eventlog_event_t *event, int row,
                           const struct table *given)
{
    jumplink_estimate got;
    int column = 0;

    assert_int_equal(jumplink_estimate_decode(event->data, 0, event->datalen,
                                              &got), event->datalen);
    assert_int_equal(got.seq, row + 1);
    assert_int_equal(got.status, 0);
    assert_int_equal(got.n, 4);
    assert_int_equal(got.n_P, 10);
    assert_int_equal(got.M, 2);
    check_numbers(given, row, &column, &got.time, 1);
    check_numbers(given, row, &column, got.x, got.n);
    check_numbers(given, row, &column, got.P, got.n_P);
    check_numbers(given, row, &column, got.mu, got.M);
    check_numbers(given, row, &column, &got.loglik, 1);
    assert_int_equal(column, given->columns);
    jumplink_estimate_decode_cleanup(&got);
}

static void check_log(const char *path)
{
    lcm_eventlog_t *log = lcm_eventlog_create(path, "r");
    lcm_eventlog_event_t *event;
    struct table sent, given;
    char *text = program_file(data);
    int measurements = 0, answers = 0, frames = 0;

    table_take(&sent, text);
    table_take(&given, estimates);
    free(text);
    assert_non_null(log);
    while ((event = lcm_eventlog_read_next_event(log)) != NULL) {
        if (strcmp(event->channel, "JL." RUN ".measurement") == 0)
            check_measurement(event, measurements++, &sent);
        else if (strcmp(event->channel, "JL." RUN ".estimate") == 0)
            check_estimate(event, answers++, &given);
        else if (strcmp(event->channel, READY) != 0
                 && strcmp(event->channel, DONE) != 0)
            frames++;
        assert_true(answers <= measurements);
        lcm_eventlog_free_event(event);
    }
    lcm_eventlog_destroy(log);
    assert_int_equal(measurements, ROWS);
    assert_int_equal(answers, ROWS);
    assert_true(frames > 2 * ROWS);     /* the PEs' own talk is there, too */
    table_free(&sent);
    table_free(&given);
}

static void test_tools_record_a_run_by_hand(void **state)
{
    (void)state;
    needs_own_net();
    record(whole, run_by_hand);
    check_log(whole);
}

static void test_tools_record_a_filter(void **state)
{
    const char *path = scratch_path("filter.log");

    (void)state;
    needs_own_net();
    record(path, run_filter);
    check_log(path);
}

/* --- playing ------------------------------------------------------------- */

/* Play a log into a filter that listens; *out, to be freed: its estimates. */
static struct program *play(const char *path, const char *port,
                            const char *channels, char **out)
{
    char folder[400], file[420];
    struct program *live, *player;

    keep(folder, scratch_path("live"));
    snprintf(file, sizeof file, "%s/two_modes_live.csv", folder);
    live = live_filter(two, RUN, folder, port);
    player = live_start("lcm-logplayer", "--speed=4", "--regexp", channels,
                        "--lcm-url=" LIVE_URL, path);
    live_end(player);
    assert_int_equal(player->status, 0);
    program_free(player);
    live_end(live);
    check_good(live);
    *out = program_file(file);
    return live;
}

/* The player and the network may lose some as well: then once more. */
static void check_plays(const char *path, const char *port,
                        const char *channels, int missing,
                        const char *expected)
{
    struct program *p;
    char *out;
    int i;

    for (i = 1; ; i++) {
        p = play(path, port, channels, &out);
        if (live_count_of(p, "lost") <= missing || i == TRIES)
            break;
        print_message("LCM lost something: once more\n");
        program_free(p);
        free(out);
    }
    check_counts(p, ROWS - missing, missing, 0, 0);
    check_same_estimates(out, expected);
    program_free(p);
    free(out);
}

/* The measurements, the old estimates, and the frames of the old run. */
static void test_tools_play_a_whole_log(void **state)
{
    (void)state;
    needs_own_net();
    check_plays(whole, "lcm", ".*", 0, estimates);
}

static void test_tools_play_the_measurements(void **state)
{
    (void)state;
    needs_own_net();
    check_plays(whole, "loop", "JL\\." RUN "\\.measurement", 0, estimates);
}

/* A log without every seventh measurement. */
static void write_holes(const char *path)
{
    lcm_eventlog_t *from = lcm_eventlog_create(whole, "r");
    lcm_eventlog_t *to = lcm_eventlog_create(path, "w");
    lcm_eventlog_event_t *event;
    int count = 0;

    scratch_must(from != NULL && to != NULL, path);
    while ((event = lcm_eventlog_read_next_event(from)) != NULL) {
        if (strcmp(event->channel, "JL." RUN ".measurement") != 0
            || ++count % LOSE_EVERY != 0)
            assert_int_equal(lcm_eventlog_write_event(to, event), 0);
        lcm_eventlog_free_event(event);
    }
    lcm_eventlog_destroy(from);
    lcm_eventlog_destroy(to);
}

/* The record as the filter should see it: every seventh row without one. */
static const char *write_blanks(void)
{
    const char *path = scratch_path("blanks.csv");
    FILE *stream = fopen(path, "w");
    char *text = program_file(data);
    struct table t;
    int i;

    scratch_must(stream != NULL, path);
    table_take(&t, text);
    free(text);
    fputs("t_s,z0,z1\n", stream);
    for (i = 0; i < ROWS; i++) {
        double s = table_at(&t, i, 0);
        int held = i > 0 && !(table_at(&t, i, 1) != table_at(&t, i - 1, 1)
                              || table_at(&t, i, 2) != table_at(&t, i - 1, 2));

        if ((i + 1) % LOSE_EVERY == 0) {
            s = table_at(&t, i - 1, 0);
            s += (table_at(&t, i + 1, 0) - s) / 2;
            held = 1;
        }
        if (held)
            fprintf(stream, "%.17g,,\n", s);
        else
            fprintf(stream, "%.17g,%.17g,%.17g\n", s, table_at(&t, i, 1),
                    table_at(&t, i, 2));
    }
    table_free(&t);
    scratch_must(fclose(stream) == 0, path);
    return path;
}

static void test_tools_play_a_log_with_holes(void **state)
{
    char holes[400];

    (void)state;
    needs_own_net();
    keep(holes, scratch_path("holes.log"));
    write_holes(holes);
    run_jumplink("filter", two, write_blanks());
    check_good(&ran);
    check_plays(holes, "lcm", ".*", ROWS / LOSE_EVERY, ran.out);
}

/* ------------------------------------------------------------------------- */

static int setup(void **state)
{
    live_setup(state);
    keep(data, program_head("flight.csv", DATA "carrier_held_1hz.csv",
                            ROWS + 1));
    keep(two, program_copy("two_modes.json", DATA "two_modes.json"));
    keep(whole, scratch_path("whole.log"));
    run_jumplink("filter", two, data, "--z", "east_m,north_m", "--hold",
                 "detect");
    scratch_must(ran.status == 0, "jumplink filter");
    estimates = ran.out;
    ran.out = NULL;
    return 0;
}

static int teardown(void **state)
{
    free(estimates);
    return live_teardown(state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_tools_record_a_run_by_hand,
                                  live_kill_all),
        cmocka_unit_test_teardown(test_tools_record_a_filter, live_kill_all),
        cmocka_unit_test_teardown(test_tools_play_a_whole_log, live_kill_all),
        cmocka_unit_test_teardown(test_tools_play_the_measurements,
                                  live_kill_all),
        cmocka_unit_test_teardown(test_tools_play_a_log_with_holes,
                                  live_kill_all),
    };

    return cmocka_run_group_tests(tests, setup, teardown);
}
