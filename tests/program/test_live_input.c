/* jumplink sim --input lcm against a program that sends what it should not:
 * gaps, old and doubled numbers, wrong sizes, numbers that are none, octets
 * that are no message. */
#include "live.h"

#include <math.h>
#include <sched.h>

#include "jumplink/base.h"

#define DATA TOP_DIR "/sim/data/"

static char two[400], folder[400];

/* --- sending ------------------------------------------------------------- */

static const char *channel_of(const char *run, const char *kind)
{
    static char channel[60];

    snprintf(channel, sizeof channel, "JL.%s.%s", run, kind);
    return channel;
}

static void send_z(const char *run, int64_t seq, double time, int record,
                   const double *z, int m)
{
    jumplink_measurement message = { seq, time, record, 1, m, NULL };
    double copy[4];

    memcpy(copy, z, sizeof copy);
    message.z = copy;
    assert_int_equal(jumplink_measurement_publish(live_lcm,
                     channel_of(run, "measurement"), &message), 0);
}

/* 100 m/s east, on a line. */
static void send(const char *run, int64_t seq, double time, int record)
{
    const double z[4] = { 100 * time, 7, 0, 0 };

    send_z(run, seq, time, record, z, 2);
}

static void send_none(const char *run, int64_t seq, double time)
{
    jumplink_measurement message = { seq, time, 0, 0, 0, NULL };

    assert_int_equal(jumplink_measurement_publish(live_lcm,
                     channel_of(run, "measurement"), &message), 0);
}

static void send_octets(const char *run, const void *octets, size_t count)
{
    assert_int_equal(lcm_publish(live_lcm, channel_of(run, "measurement"),
                                 octets, (unsigned)count), 0);
}

/* --- hearing the answers ------------------------------------------------- */

struct answers {
    int count;
    int64_t seq[64];
};

static void on_estimate(const lcm_recv_buf_t *buf, const char *channel,
                        const jumplink_estimate *got, void *context)
{
    struct answers *answers = context;

    (void)buf;
    (void)channel;
    assert_in_range(answers->count, 0, 63);
    assert_int_equal(got->status, 0);
    assert_int_equal(got->n, 4);
    answers->seq[answers->count++] = got->seq;
}

static void check_answers(struct answers *answers, const int64_t *seq,
                          int count)
{
    while (lcm_handle_timeout(live_lcm, 200) > 0)
        ;
    assert_int_equal(answers->count, count);
    assert_memory_equal(answers->seq, seq, (size_t)count * sizeof *seq);
}

/* --- counts -------------------------------------------------------------- */

static void check_file(const char *name, const char *expected)
{
    char path[500], *text;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    text = program_file(path);
    check_same_text(text, expected);
    free(text);
}

/* What jumplink filter makes of the record that was left is what was left. */
static void check_refiltered(void)
{
    char path[500];

    snprintf(path, sizeof path, "%s/two_modes_record.csv", folder);
    run_jumplink("filter", two, path);
    check_good(&ran);
    check_file("two_modes_live.csv", ran.out);
}

static void check_everything_is_counted(const char *port)
{
    static const double nan_z[4] = { 1, NAN }, inf_z[4] = { INFINITY, 1 };
    static const double huge_z[4] = { 1, 1e200 }, three[4] = { 1, 2, 3 };
    static const int64_t answered[] = { 5, 6, 7, 8, 9, 10, 11, 15, 16 };
    struct answers answers = { 0, { 0 } };
    jumplink_estimate_subscription_t *sub = jumplink_estimate_subscribe(
        live_lcm, "JL.counted.estimate", on_estimate, &answers);
    struct program *p = live_filter(two, "counted", folder, port);

    send("counted", -1, 1, 0);          /* refused: 1 */
    send("counted", 5, 5, 0);
    send("counted", 6, 6, 0);
    send("counted", 6, 6, 0);           /* late: 1 */
    send("counted", 4, 4, 0);           /* late: 2 */
    send("counted", 9, 9, 0);           /* lost: 2 */
    send("counted", 8, 8, 0);           /* late: 3 */
    send_z("counted", 10, 10, 0, three, 3);
    send_z("counted", 10, 10, 0, three, 1);
    send_z("counted", 10, 10, 0, nan_z, 2);
    send_z("counted", 10, 10, 0, inf_z, 2);
    send_z("counted", 10, 10, 0, huge_z, 2);
    send("counted", 10, 8.5, 0);
    send("counted", 10, 9, 0);
    send("counted", 10, NAN, 0);
    send("counted", 10, INFINITY, 0);
    send("counted", 10, 1e200, 0);
    send("counted", 10011, 10, 0);
    send("counted", INT64_MAX, 10, 0);
    send("counted", INT64_MIN, 10, 0);  /* refused: 14 */
    send("counted", 10, 10, 0);
    send_none("counted", 11, 11);
    send("counted", 15, 0, 1);          /* lost: 5; a new record */
    send("counted", 16, 1.5, 1);
    live_end(p);
    check_counts(p, 7, 5, 3, 14);
    assert_non_null(strstr(p->out, "predicted through 2\n"));
    assert_non_null(strstr(p->out, "first: a number below 0\n"));
    program_free(p);
    check_file("two_modes_record.csv", "run,t_s,z0,z1\n"
               "0,5,500,7\n" "0,6,600,7\n" "0,7,,\n" "0,8,,\n"
               "0,9,900,7\n" "0,10,1000,7\n" "0,11,,\n"
               "1,0,0,7\n" "1,1.5,150,7\n");
    check_refiltered();
    check_answers(&answers, answered, 9);
    jumplink_estimate_unsubscribe(live_lcm, sub);
}

static void test_live_counts_everything_over_lcm(void **state)
{
    (void)state;
    needs_own_net();
    check_everything_is_counted("lcm");
}

static void test_live_counts_everything_over_loop(void **state)
{
    (void)state;
    needs_own_net();
    check_everything_is_counted("loop");
}

/* An outlier in the midst. */
static void test_live_gate(void **state)
{
    static const double off[4] = { 1e5, -1e5, 0, 0 };
    struct program *p;
    int k;

    (void)state;
    needs_own_net();
    p = live_start(JUMPLINK, "sim", "--input", "lcm", "--model", two,
                   "--lcm-url", LIVE_URL, "--run", "gate", "--pes", "2",
                   "--port", "loop", "--idle", "2", "-o", folder, "--gate",
                   "0.9999");
    live_await_words(p, "listening to ");
    for (k = 1; k <= 8; k++)
        if (k == 5)
            send_z("gate", k, k, 0, off, 2);
        else
            send("gate", k, k, 0);
    live_end(p);
    check_counts(p, 8, 0, 0, 0);
    assert_int_equal(live_count_of(p, "rejected"), 1);
    program_free(p);
}

/* A record starts at a measurement: what did not arrive before it is a row
 * without estimate and without answer. */
static void test_live_starts_at_the_first_that_arrived(void **state)
{
    static const int64_t answered[] = { 3, 4 };
    struct answers answers = { 0, { 0 } };
    jumplink_estimate_subscription_t *sub;
    struct program *p;

    (void)state;
    needs_own_net();
    sub = jumplink_estimate_subscribe(live_lcm, "JL.late.estimate",
                                      on_estimate, &answers);
    p = live_filter(two, "late", folder, "loop");
    send_none("late", 1, 1);
    send_none("late", 2, 2);
    send("late", 3, 3, 0);
    send("late", 4, 4, 0);
    live_end(p);
    check_counts(p, 4, 0, 0, 0);
    program_free(p);
    check_file("two_modes_record.csv",
               "t_s,z0,z1\n1,,\n2,,\n3,300,7\n4,400,7\n");
    check_refiltered();
    check_answers(&answers, answered, 2);
    jumplink_estimate_unsubscribe(live_lcm, sub);
}

/* The longest gap that is filled. */
static void test_live_fills_a_long_gap(void **state)
{
    struct program *p;

    (void)state;
    needs_own_net();
    p = live_filter(two, "gap", folder, "loop");
    send("gap", 0, 0, 0);
    send("gap", 10001, 100.01, 0);
    send_none("gap", 10002, 1e300);     /* and a time that is no step away */
    live_end(p);
    check_counts(p, 2, 10000, 0, 1);
    assert_non_null(strstr(p->out, "predicted through 10000\n"));
    program_free(p);
    check_refiltered();
}

/* Two runs on one address hear each their own. */
static void test_live_runs_do_not_mix(void **state)
{
    struct program *p;

    (void)state;
    needs_own_net();
    p = live_filter(two, "one", folder, "lcm");
    send("one", 1, 1, 0);
    send("other", 2, 2, 0);
    send("on", 2, 2, 0);
    send("onex", 2, 2, 0);
    send("one", 2, 2, 0);
    live_end(p);
    check_counts(p, 2, 0, 0, 0);
    program_free(p);
    check_file("two_modes_record.csv", "t_s,z0,z1\n1,100,7\n2,200,7\n");
}

/* --- hostile octets ------------------------------------------------------ */

/* Every cut of a message, every octet of it damaged, sizes that lie. */
static void test_live_survives_any_octets(void **state)
{
    double z[2] = { 1, 2 };
    jumplink_measurement message = { 0, 0, 0, 1, 2, NULL };
    unsigned char octets[4096];
    struct program *p;
    int i, length;

    (void)state;
    needs_own_net();
    memset(octets, 0, sizeof octets);
    message.z = z;
    length = jumplink_measurement_encode(octets, 0, sizeof octets, &message);
    assert_true(length > 0);
    p = live_filter(two, "any", folder, "lcm");
    send("any", 1, 1, 0);
    for (i = 0; i < length; i++)
        send_octets("any", octets, (size_t)i);
    send_octets("any", octets, sizeof octets);
    for (i = 0; i < 8; i++) {           /* the type's own number */
        octets[i] ^= 0xff;
        send_octets("any", octets, (size_t)length);
        octets[i] ^= 0xff;
    }
    for (i = 1; i <= 4; i++) {          /* how many components */
        octets[length - 16 - i] ^= 0xff;
        send_octets("any", octets, (size_t)length);
        octets[length - 16 - i] ^= 0xff;
    }
    send_octets("any", octets, (size_t)length);     /* whole, but late */
    send("any", 2, 2, 0);
    live_end(p);
    check_counts(p, 2, 0, 1, length + 1 + 8 + 4);
    program_free(p);
}

/* --- ends ---------------------------------------------------------------- */

static void test_live_nothing_comes(void **state)
{
    (void)state;
    needs_own_net();
    run_jumplink("sim", "--input", "lcm", "--model", two, "--lcm-url",
                 LIVE_URL, "--pes", "2", "--start", "1.5", "-o", folder);
    if (ran.status != 1 || strstr(ran.err, "JL.jumplink.measurement: no "
                                  "measurement on " LIVE_URL) == NULL)
        program_fail(&ran, "a word that nothing came");
    check_nobody_left();
}

static void test_live_nothing_of_use_comes(void **state)
{
    static const double three[4] = { 1, 2, 3 };
    struct program *p;

    (void)state;
    needs_own_net();
    p = live_start(JUMPLINK, "sim", "--input", "lcm", "--model", two,
                   "--lcm-url", LIVE_URL, "--run", "three", "--port", "loop",
                   "--start", "2", "-o", folder);
    live_await_words(p, "listening to JL.three.measurement");
    send_z("three", 1, 1, 0, three, 3);
    send_z("three", 2, 2, 0, three, 3);
    live_end(p);
    if (p->status != 1 || strstr(p->err, "2 refused") == NULL
        || strstr(p->err, "number 1 has 3 measurements, but ") == NULL)
        program_fail(p, "a word on what was refused");
    program_free(p);
}

/* While the host waits for a sensor, it still notices that a PE has gone. */
static void test_live_killed_pe_while_waiting(void **state)
{
    struct program *p;
    pid_t pe = 0;

    (void)state;
    needs_own_net();
    p = live_filter(two, "killed", folder, "lcm");
    send("killed", 1, 1, 0);
    while (program_find("--pe 1", two, &pe) != 1) {
        assert_true(program_now() - p->began < PROGRAM_LIMIT);
        program_sleep(0.01);
    }
    kill(pe, SIGKILL);
    live_end(p);
    if (p->status != 1 || strstr(p->err, "PE1 was ended by signal 9") == NULL)
        program_fail(p, "PE1 to be named");
    program_free(p);
    check_nobody_left();
}

static int lose_the_network(void)
{
    return unshare(CLONE_NEWNET);
}

/* The way to end a run, from a terminal that signals the PEs as well: all that
 * came is answered, compared and kept. */
static void end_by(int signal)
{
    struct answers answers = { 0, { 0 } };
    jumplink_estimate_subscription_t *sub = jumplink_estimate_subscribe(
        live_lcm, "JL.ended.estimate", on_estimate, &answers);
    double deadline = program_now() + PROGRAM_LIMIT;
    struct program *p = live_start("setsid", JUMPLINK, "sim", "--input", "lcm",
                                   "--model", two, "--lcm-url", LIVE_URL,
                                   "--run", "ended", "--pes", "2",
                                   "--timeout", "20", "--idle", "60", "-o",
                                   folder);
    int k;

    live_await_words(p, "listening to ");
    for (k = 1; k <= 3; k++)
        send("ended", k, k, 0);
    while (answers.count < 3 && program_now() < deadline)
        (void)lcm_handle_timeout(live_lcm, 100);
    assert_int_equal(kill(-p->pid, signal), 0);
    live_end(p);
    check_counts(p, 3, 0, 0, 0);
    program_free(p);
    check_refiltered();
    jumplink_estimate_unsubscribe(live_lcm, sub);
}

static void test_live_ended_from_a_terminal(void **state)
{
    (void)state;
    needs_own_net();
    end_by(SIGINT);
    end_by(SIGHUP);
}

static void test_live_interrupted_before_anything_came(void **state)
{
    struct program *p;

    (void)state;
    needs_own_net();
    p = live_filter(two, "silent", folder, "loop");
    assert_int_equal(kill(p->pid, SIGTERM), 0);
    live_end(p);
    if (p->status != 1 || strstr(p->err, "SIGTERM: no measurement on "
                                 LIVE_URL " so far\n") == NULL)
        program_fail(p, "the signal to be named");
    program_free(p);
}

static void test_live_without_a_network(void **state)
{
    static const char *const told[] = {
        "sim", "--input", "lcm", "--model", two, "--lcm-url", LIVE_URL, "-o",
        folder, NULL
    };
    struct program p;

    (void)state;
    needs_own_net();
    program_start_file(&p, JUMPLINK, lose_the_network, told);
    program_end(&p, PROGRAM_LIMIT);
    check_refused(&p, 1, LIVE_URL "|LCM cannot be used");
    program_free(&p);
}

#define refused(words, ...) do { \
    run_jumplink("sim", __VA_ARGS__); \
    check_refused(&ran, 2, words); \
} while (0)

static void test_live_wrong_use(void **state)
{
    (void)state;
    refused("--input tcp", "--input", "tcp");
    refused("needs one --model, and --lcm-url", "--input", "lcm", "--model",
            two);
    refused("needs one --model, and --lcm-url", "--input", "lcm",
            "--lcm-url", LIVE_URL);
    refused("needs one --model, and --lcm-url", "--input", "lcm",
            "--lcm-url", LIVE_URL, "--model", two, "--model", two);
    refused("--data", "--input", "lcm", "--lcm-url", LIVE_URL, "--model", two,
            "--data", "x.csv");
    refused("--z", "--input", "lcm", "--lcm-url", LIVE_URL, "--model", two,
            "--z", "a,b");
    refused("--time", "--input", "lcm", "--lcm-url", LIVE_URL, "--model", two,
            "--time", "t");
    refused("--idle goes with --input lcm", "--idle", "1");
    refused("--idle -1", "--input", "lcm", "--idle", "-1");
    refused("--run names", "--run", "x");
    refused("none.json|No such file", "--input", "lcm", "--lcm-url", LIVE_URL,
            "--model", scratch_path("none.json"), "-o", folder);
}

/* --- copies of any size -------------------------------------------------- */

enum { MANY = 64 };

static void put_matrix(FILE *out, const char *name, int rows, double diagonal)
{
    int i, j;

    fprintf(out, "\"%s\": [", name);
    for (i = 0; i < rows; i++)
        for (j = 0; j < MANY; j++)
            fprintf(out, "%s%g%s", j == 0 ? (i == 0 ? "[" : ",[") : ",",
                    i == j ? diagonal : 0.0, j == MANY - 1 ? "]" : "");
    fputs("]", out);
}

/* As many states as there may be: an estimate of 17 kB, a dozen datagrams. */
static const char *write_many(void)
{
    const char *path = scratch_path("many.json");
    FILE *out = fopen(path, "w");
    int i, j;

    scratch_must(out != NULL, path);
    fprintf(out, "{\"kind\": \"imm\", \"n\": %d, \"m\": 1,\n\"Pi\": "
            "[[0.9,0.1],[0.1,0.9]], \"mu0\": [0.5,0.5], \"modes\": [", MANY);
    for (j = 0; j < 2; j++) {
        fprintf(out, "%s{", j == 0 ? "" : ",\n");
        put_matrix(out, "Phi", MANY, 0.5 + j / 4.0);
        fputs(",\n", out);
        put_matrix(out, "Gamma", MANY, 1);
        fputs(",\n", out);
        put_matrix(out, "Q", MANY, 1);
        fputs(",\n", out);
        put_matrix(out, "H", 1, 1);
        fputs(",\n\"R\": [[1]],\n", out);
        put_matrix(out, "P0", MANY, 3);
        fputs(",\n\"x0\": [1", out);
        for (i = 1; i < MANY; i++)
            fputs(",1", out);
        fputs("]}", out);
    }
    fputs("]}\n", out);
    scratch_must(fclose(out) == 0, path);
    return path;
}

static void on_many(const lcm_recv_buf_t *buf, const char *channel,
                    const jumplink_estimate *got, void *context)
{
    char **at = context;
    int i;

    (void)buf;
    (void)channel;
    assert_int_equal(got->n, MANY);
    assert_int_equal(got->n_P, MANY * (MANY + 1) / 2);
    assert_int_equal(got->M, 2);
    *at = strchr(*at, '\n') + 1;        /* a row of the file: t, x, P, .. */
    *at = strchr(*at, ',');
    for (i = 0; i < got->n; i++)
        assert_true(strtod(*at + 1, at) == got->x[i]);
    for (i = 0; i < got->n_P; i++)
        assert_true(strtod(*at + 1, at) == got->P[i]);
}

static void test_live_copies_of_many_states(void **state)
{
    const char *csv, *model;
    char *at = NULL;
    jumplink_estimate_subscription_t *sub;
    int count = 0;

    (void)state;
    needs_own_net();
    model = write_many();
    csv = scratch_write("many.csv", "k,z0\n1,1\n2,3\n3,2\n4,2.5\n5,1\n");
    sub = jumplink_estimate_subscribe(live_lcm, "JL.jumplink.estimate",
                                      on_many, &at);
    run_jumplink("filter", model, csv, "--pes", "2", "--timeout", "20",
                 "--lcm-url", LIVE_URL);
    check_good(&ran);
    at = ran.out;
    while (lcm_handle_timeout(live_lcm, 300) > 0)
        count++;
    assert_int_equal(count, 5);
    jumplink_estimate_unsubscribe(live_lcm, sub);
}

static void on_any(const lcm_recv_buf_t *buf, const char *channel,
                   const jumplink_estimate *got, void *context)
{
    struct answers *answers = context;

    (void)buf;
    (void)channel;
    assert_int_equal(got->n, got->status == 0 ? 4 : 0);
    assert_int_equal(got->n_P, got->status == 0 ? 10 : 0);
    assert_int_equal(got->M, got->status == 0 ? 2 : 0);
    answers->seq[answers->count++] = got->status;
}

/* The last copy says why there are no more. */
static void test_live_copies_of_a_failed_step(void **state)
{
    static const int64_t statuses[] = { JL_OK, JL_OK, JL_ENONFINITE };
    struct answers answers = { 0, { 0 } };
    jumplink_estimate_subscription_t *sub;
    const char *csv;
    char text[80];

    (void)state;
    needs_own_net();
    snprintf(text, sizeof text, "t_s,z0,z1\n0,0,0\n1,1,1\n2,%s,1\n3,1,1\n",
             JL_REAL_FLOAT ? "1e30" : "1e300");     /* above JL_LARGE */
    csv = scratch_write("failing.csv", text);
    sub = jumplink_estimate_subscribe(live_lcm, "JL.failing.estimate", on_any,
                                      &answers);
    run_jumplink("filter", two, csv, "--pes", "2", "--timeout", "20",
                 "--lcm-url", LIVE_URL, "--run", "failing");
    check_ended(&ran, "failing.csv:4: the step fails");
    check_answers(&answers, statuses, 3);
    jumplink_estimate_unsubscribe(live_lcm, sub);
}

/* ------------------------------------------------------------------------- */

static int setup(void **state)
{
    live_setup(state);
    snprintf(two, sizeof two, "%s", program_copy("two_modes.json",
                                                 DATA "two_modes.json"));
    snprintf(folder, sizeof folder, "%s", scratch_path("live"));
    return 0;
}

#define live_test(f) cmocka_unit_test_teardown(f, live_kill_all)

int main(void)
{
    const struct CMUnitTest tests[] = {
        live_test(test_live_counts_everything_over_lcm),
        live_test(test_live_counts_everything_over_loop),
        live_test(test_live_gate),
        live_test(test_live_starts_at_the_first_that_arrived),
        live_test(test_live_fills_a_long_gap),
        live_test(test_live_runs_do_not_mix),
        live_test(test_live_survives_any_octets),
        live_test(test_live_nothing_comes),
        live_test(test_live_nothing_of_use_comes),
        live_test(test_live_killed_pe_while_waiting),
        live_test(test_live_ended_from_a_terminal),
        live_test(test_live_interrupted_before_anything_came),
        live_test(test_live_without_a_network),
        live_test(test_live_wrong_use),
        live_test(test_live_copies_of_many_states),
        live_test(test_live_copies_of_a_failed_step),
    };

    return cmocka_run_group_tests(tests, setup, live_teardown);
}
