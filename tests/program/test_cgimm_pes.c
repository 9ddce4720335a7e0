/* Models of kind cgimm wherever the program runs a filter on PEs: every port,
 * PEs started by hand, measurements off the network, recorded flights.  What
 * is estimated has the bits of `jumplink filter` on one processor. */
#include "live.h"
#include "table.h"

#include <math.h>

#include "jumplink/base.h"

#define DATA TOP_DIR "/sim/data/"
#define RUN "gains"
#define PATIENTLY "--timeout", "20"     /* on a machine that is busy */
#define BY_HAND "--pes", "2", "--lcm-url", LIVE_URL, "--run", RUN, PATIENTLY

/* More modes than some runs have PEs, and fewer than others; two axes. */
static const char five_modes[] =
    "{ \"kind\": \"cgimm\", \"axes\": 2, \"T\": 0.5, \"R\": 2500,\n"
    "  \"Q\": [0.5, 20, 49, 400, 1500],\n"
    "  \"Pi\": [[0.9, 0.04, 0.03, 0.02, 0.01], [0.05, 0.8, 0.05, 0.05, 0.05],\n"
    "         [0.1, 0.1, 0.6, 0.1, 0.1], [0.02, 0.03, 0.05, 0.85, 0.05],\n"
    "         [0.01, 0.01, 0.01, 0.07, 0.9]],\n"
    "  \"mu0\": [0.3, 0.1, 0.2, 0.25, 0.15], \"modes\": [\n"
    "  { \"order\": 2, \"x0\": [1, 2, 0, -3, 4, 0] },\n"
    "  { \"order\": 3, \"x0\": [1, 2, 3, -3, 4, 1] },\n"
    "  { \"order\": 2, \"x0\": [5, 2, 0, -3, 9, 0] },\n"
    "  { \"order\": 3, \"x0\": [1, 2, -8, -3, 4, 1] },\n"
    "  { \"order\": 3, \"x0\": [1, 0, 3, -3, 0, 1] } ] }\n";

/* Two modes, of which the second has noise q, with a start or none. */
#define AT(q, start) \
    "{ \"kind\": \"cgimm\", \"axes\": 2, \"T\": 0.5, \"R\": 400,\n" \
    "  \"Q\": [0.09, " q "], \"Pi\": [[0.95, 0.05], [0.1, 0.9]],\n" \
    "  \"mu0\": [0.5, 0.5], \"modes\": [ {" start " \"order\": 2},\n" \
    "  {" start " \"order\": 2} ] }\n"

static const char at_rest[] = AT("16", "");

static char model[400], data[400], rest[400], folder[400];

static void keep(char *to, const char *path)
{
    snprintf(to, 400, "%s", path);
}

/* Two runs, of which the second begins with nothing, and holes. */
static const char *two_runs(void)
{
    static char text[8000];
    int k, used = sprintf(text, "run,t_s,z0,z1\n");

    for (k = 0; k < 80; k++) {
        used += sprintf(text + used, "%d,%g,", k / 50, 0.5 * k);
        used += k % 9 == 5
            ? sprintf(text + used, ",\n")
            : sprintf(text + used, "%d,%d\n", k * k % 71 * 5 + 30 * k,
                      k * 31 % 97 - k);
    }
    return scratch_write("two_runs.csv", text);
}

static int setup(void **state)
{
    live_setup(state);
    keep(model, scratch_write("five_modes.json", five_modes));
    keep(rest, scratch_write("at_rest.json", at_rest));
    keep(data, two_runs());
    keep(folder, scratch_path("out"));
    return 0;
}

static char *filtered_told(const char *const *told)
{
    char *out;

    run_file_told(JUMPLINK, told);
    check_good(&ran);
    out = ran.out;
    ran.out = NULL;
    return out;
}

/* The estimates, to be freed. */
#define filtered(...) \
    filtered_told((const char *const[]){ "filter", __VA_ARGS__, NULL })

static const char *in_folder(const char *name)
{
    static char path[500];

    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

/* --- ports --------------------------------------------------------------- */

static void check_same(const char *serial, const char *of, const char *port,
                       const char *pes, const char *topology)
{
    char *got = filtered(of, data, "--port", port, "--pes", pes, "--topology",
                         topology, "--exchange", "gather", PATIENTLY);

    check_same_text(serial, got);
    free(got);
}

static void test_cgimm_pes_serial_bits(void **state)
{
    static const char *const pes[] = { "1", "2", "3", "5", "8" };
    static const char *const topologies[] = {
        "full", "star", "ring", "chain"
    };
    char *serial = filtered(model, data);
    int p, t;

    (void)state;
    for (t = 0; t < 4; t++)
        for (p = 0; p < 5; p++) {
            check_same(serial, model, "loop", pes[p], topologies[t]);
            check_same(serial, model, "threads", pes[p], topologies[t]);
            if (p == t)
                check_same(serial, model, "lcm", pes[p], topologies[t]);
        }
    check_same(serial, model, "lcm", "8", "ring");
    free(serial);
    check_nobody_left();
}

/* Each run waits for its first measurement: of the second 51 is the first. */
static void test_cgimm_pes_start_at_the_first_measurement(void **state)
{
    char *serial = filtered(rest, data);
    struct table t;

    (void)state;
    check_same(serial, rest, "loop", "2", "full");
    check_same(serial, rest, "threads", "2", "full");
    check_same(serial, rest, "lcm", "3", "full");
    table_take(&t, serial);
    assert_int_equal(t.rows, 80);
    assert_int_equal(t.columns, 2 + 4 + 2 + 1);
    assert_true(isnan(table_at(&t, 50, 2)));
    assert_true(isfinite(table_at(&t, 51, 2)));
    table_free(&t);
    free(serial);
}

/* All modes there, at rest: as if the model said so. */
static void test_cgimm_pes_start_at_rest(void **state)
{
    static const char told[] = AT("16", " \"x0\": [30, 0, 7, 0],");
    static const double first[] = { 1, 30, 0, 7, 0, 0.5, 0.5, 0 };
    struct table got, want;
    char *text;

    (void)state;
    text = filtered(rest, scratch_write("a.csv", "k,z0,z1\n1,30,7\n2,45,9\n"
                                        "3,,\n4,60,-8\n"));
    table_take(&got, text);
    free(text);
    text = filtered(scratch_write("told.json", told),
                    scratch_write("b.csv", "k,z0,z1\n2,45,9\n3,,\n"
                                  "4,60,-8\n"));
    table_take(&want, text);
    free(text);
    assert_int_equal(got.columns, 8);
    assert_same_bits(got.v, first, sizeof first);
    assert_same_bits(got.v + 8, want.v, 3 * sizeof first);
    table_free(&got);
    table_free(&want);
}

static void test_cgimm_pes_failed_step(void **state)
{
    static const char *const ports[] = { "loop", "threads", "lcm" };
    const char *huge = scratch_write("huge.csv", JL_REAL_FLOAT
        ? "k,z0,z1\n1,2,3\n2,1e30,3\n" : "k,z0,z1\n1,2,3\n2,1e200,3\n");
    int i;

    (void)state;
    for (i = 0; i < 3; i++) {
        run_jumplink("filter", model, huge, "--port", ports[i], "--pes", "2",
                     PATIENTLY);
        check_ended(&ran, "huge.csv:3: the step fails");
    }
    check_nobody_left();
}

/* --- by hand ------------------------------------------------------------- */

/* Copies for whoever listens have no covariance. */
struct copies {
    int count;
    char x[8000];               /* x0, a line each */
};

static void on_copy(const lcm_recv_buf_t *buf, const char *channel,
                    const jumplink_estimate *got, void *context)
{
    struct copies *copies = context;

    (void)buf;
    (void)channel;
    assert_int_equal(got->status, 0);
    assert_int_equal(got->n, 6);
    assert_int_equal(got->n_P, 0);
    assert_int_equal(got->M, 5);
    assert_int_equal(got->seq, ++copies->count);
    snprintf(copies->x + strlen(copies->x), 60, "%.17g,%.17g\n", got->x[0],
             got->mu[4]);
}

/* Of every row x0 and mu4, as on_copy has them. */
static void check_copies(const struct copies *copies, const char *serial)
{
    char want[sizeof copies->x] = "";
    struct table t;
    int k;

    table_take(&t, serial);
    assert_int_equal(copies->count, t.rows);
    for (k = 0; k < t.rows; k++)
        snprintf(want + strlen(want), 60, "%.17g,%.17g\n", table_at(&t, k, 2),
                 table_at(&t, k, 2 + 6 + 4));
    check_same_text(want, copies->x);
    table_free(&t);
}

static void test_cgimm_pes_by_hand(void **state)
{
    static struct copies copies;
    jumplink_estimate_subscription_t *sub;
    struct program *host, *pe[2];
    char *serial;
    int i;

    (void)state;
    needs_own_net();
    sub = jumplink_estimate_subscribe(live_lcm, "JL." RUN ".estimate", on_copy,
                                      &copies);
    jumplink_estimate_subscription_set_queue_capacity(sub, 0);
    serial = filtered(model, data);
    for (i = 0; i < 2; i++)
        pe[i] = live_start(JUMPLINK, "pe", "--pe", i == 0 ? "0" : "1",
                           "--model", model, BY_HAND);
    host = live_start(JUMPLINK, "host", model, data, BY_HAND);
    live_end(host);
    check_good(host);
    check_same_text(host->out, serial);
    program_free(host);
    for (i = 0; i < 2; i++) {
        live_end(pe[i]);
        check_good(pe[i]);
        program_free(pe[i]);
    }
    while (lcm_handle_timeout(live_lcm, 200) > 0)
        ;
    check_copies(&copies, serial);
    jumplink_estimate_unsubscribe(live_lcm, sub);
    free(serial);
    check_nobody_left();
}

/* The same but for a gain. */
static void test_cgimm_pes_of_other_gains_are_refused(void **state)
{
    const char *other = scratch_write("other.json", AT("17", ""));
    struct program *host, *pe[2];

    (void)state;
    needs_own_net();
    pe[0] = live_start(JUMPLINK, "pe", "--pe", "0", "--model", rest, BY_HAND);
    pe[1] = live_start(JUMPLINK, "pe", "--pe", "1", "--model", other, BY_HAND);
    host = live_start(JUMPLINK, "host", rest, data, BY_HAND);
    live_end(host);
    live_end(pe[0]);
    live_end(pe[1]);
    check_refused(host, 1, "does not start|different models");
    check_refused(pe[0], 1, "PE0: not like PE1: |different models");
    check_refused(pe[1], 1, "PE1: not like the others: |different models");
    program_free(host);
    program_free(pe[0]);
    program_free(pe[1]);
    check_nobody_left();
}

/* --- off the network ----------------------------------------------------- */

static void send_z(int64_t seq, double time, double z0, double z1)
{
    double z[2] = { z0, z1 };
    jumplink_measurement message = { seq, time, 0, 1, 2, z };

    assert_int_equal(jumplink_measurement_publish(live_lcm, "JL." RUN
                                                  ".measurement", &message), 0);
}

/* 3 and 4 are lost; what filter makes of the record is what was left. */
static void check_live(const char *of, const char *name, const char *port)
{
    struct program *p = live_filter(of, RUN, folder, port);
    char live[60], record[60], *text;
    int k;

    for (k = 1; k <= 12; k++)
        if (k != 3 && k != 4)
            send_z(k, 0.5 * k, k * k % 7 * 10, 50 * k);
    live_end(p);
    check_counts(p, 10, 2, 0, 0);
    program_free(p);
    snprintf(live, sizeof live, "%s_live.csv", name);
    snprintf(record, sizeof record, "%s_record.csv", name);
    text = program_file(in_folder(live));
    assert_null(strstr(text, "P00"));
    run_jumplink("filter", of, in_folder(record));
    check_good(&ran);
    assert_int_equal(table_count(ran.out, '\n'), 13);
    check_same_text(text, ran.out);
    free(text);
}

static void test_cgimm_pes_live(void **state)
{
    (void)state;
    needs_own_net();
    check_live(model, "five_modes", "loop");
    check_live(rest, "at_rest", "threads");
    check_live(model, "five_modes", "lcm");
}

/* --- flights ------------------------------------------------------------- */

static int lines_ending_in_yes(const char *text)
{
    int count = 0;

    while ((text = strstr(text, " yes\n")) != NULL) {
        count++;
        text++;
    }
    return count;
}

static void check_estimates(const char *name, const char *of,
                            const char *flight, const char *hold)
{
    char *text = program_file(in_folder(name));

    run_jumplink("filter", of, flight, "--z", "east_m,north_m", "--hold",
                 hold);
    check_good(&ran);
    check_same_text(text, ran.out);
    free(text);
}

/* Beside a model of kind imm, and with the table's words. */
static void test_cgimm_pes_flight(void **state)
{
    const char *port[] = { "loop", "threads", "lcm" };
    char flight[400], two[400];
    int i;

    (void)state;
    keep(flight, program_head("flight.csv", DATA "carrier_held_1hz.csv", 301));
    keep(two, program_copy("two_modes.json", DATA "two_modes.json"));
    for (i = 0; i < 3; i++) {
        char *text;

        run_jumplink("sim", "--data", flight, "--model", model, "--model",
                     two, "-o", folder, "--port", port[i], "--pes", "2",
                     PATIENTLY);
        check_good(&ran);
        assert_int_equal(lines_ending_in_yes(ran.out), 4);
        assert_non_null(strstr(ran.out, ", joseph, "));
        check_estimates("five_modes_fresh.csv", model, flight, "none");
        check_estimates("five_modes_recognised.csv", model, flight, "detect");
        text = program_file(in_folder("table.csv"));
        assert_non_null(strstr(text, ",1,nan,0\nfive_modes,recognised,"));
        free(text);
        text = program_file(in_folder("modes_five_modes_fresh.gp"));
        assert_non_null(strstr(text, "order 2, alpha "));
        free(text);
    }
    check_nobody_left();
}

static int in_the_source_folder(void)
{
    return chdir(TOP_DIR);
}

/* A flight and a model of its own; the velocity is as it was measured. */
static void test_cgimm_pes_flight_by_kind(void **state)
{
    static const char *const told[] = {
        "sim", "--filter", "cgimm", "--port", "loop", "-o", folder, NULL
    };
    struct program p;
    const char *fresh, *recognised;

    (void)state;
    program_start_file(&p, JUMPLINK, in_the_source_folder, told);
    program_end(&p, PROGRAM_LIMIT);
    check_good(&p);
    assert_int_equal(lines_ending_in_yes(p.out), 2);
    assert_non_null(strstr(p.out, ", constant gains, "));
    fresh = strstr(p.out, "\ntwo_gains    fresh ");
    recognised = strstr(p.out, "\ntwo_gains    recognised ");
    assert_non_null(fresh);
    assert_non_null(recognised);
    assert_close(atof(fresh + 24), 51.36, 0.1);
    assert_close(atof(recognised + 24), 15.75, 0.1);
    program_free(&p);
    run_jumplink("sim", "--filter", "cgimm", "--model", DATA "two_modes.json",
                 "--data", DATA "carrier_held_1hz.csv", "-o", folder);
    check_refused(&ran, 2, "two_modes.json|of kind imm");
}

/* --- refusals ------------------------------------------------------------ */

#define refused(words, ...) do { \
    run_jumplink(__VA_ARGS__); \
    check_refused(&ran, 2, words); \
} while (0)

static void test_cgimm_pes_no_all_reduce(void **state)
{
    static const char words[] = "--exchange reduce is for kind imm|"
        "five_modes.json is of kind cgimm";

    (void)state;
    refused(words, "filter", model, data, "--port", "loop", "--exchange",
            "reduce");
    refused(words, "pe", "--pe", "0", "--model", model, BY_HAND, "--exchange",
            "reduce");
    refused(words, "host", model, data, BY_HAND, "--exchange", "reduce");
    refused(words, "sim", "--data", DATA "carrier_held_1hz.csv", "--model",
            model, "-o", folder, "--exchange", "reduce");
    refused(words, "sim", "--input", "lcm", "--model", model, BY_HAND, "-o",
            folder, "--exchange", "reduce");
}

/* The default's name, too. */
static void test_cgimm_pes_no_form(void **state)
{
    static const char words[] = "--form needs covariances|five_modes.json";

    (void)state;
    refused(words, "filter", model, data, "--form", "joseph");
    refused(words, "filter", model, data, "--port", "loop", "--form",
            "joseph");
    refused(words, "pe", "--pe", "0", "--model", model, BY_HAND, "--form",
            "joseph");
    refused(words, "host", model, data, BY_HAND, "--form", "joseph");
    refused("--diagnostics", "filter", model, data, "--port", "loop",
            "--diagnostics");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cgimm_pes_serial_bits),
        cmocka_unit_test(test_cgimm_pes_start_at_the_first_measurement),
        cmocka_unit_test(test_cgimm_pes_start_at_rest),
        cmocka_unit_test(test_cgimm_pes_failed_step),
        cmocka_unit_test_teardown(test_cgimm_pes_by_hand, live_kill_all),
        cmocka_unit_test_teardown(test_cgimm_pes_of_other_gains_are_refused,
                                  live_kill_all),
        cmocka_unit_test_teardown(test_cgimm_pes_live, live_kill_all),
        cmocka_unit_test(test_cgimm_pes_flight),
        cmocka_unit_test(test_cgimm_pes_flight_by_kind),
        cmocka_unit_test(test_cgimm_pes_no_all_reduce),
        cmocka_unit_test(test_cgimm_pes_no_form),
    };

    return cmocka_run_group_tests(tests, setup, live_teardown);
}
