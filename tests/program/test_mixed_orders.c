/* Modes of order 2 beside modes of order 3: as padded by hand, on several PEs,
 * alone, and in a flight's figures. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#include "jumplink/base.h"

#define DATA TOP_DIR "/sim/data/"
#define FLIGHT "--z", "east_m,north_m"

#define HEAD "{ \"kind\": \"imm\", \"axes\": 2, \"order\": 3, \"sigma_z\": 20,\n"
#define CV2 "{\"type\": \"cv\", \"order\": 2, \"accel_std\": 0.5"
#define CA "{\"type\": \"ca\", \"accel_std\": 0.25"
#define CT2 "{\"type\": \"ct\", \"order\": 2, \"turn_rate\": 0.05, " \
    "\"accel_std\": 0.5"

static const char three[] = HEAD "\"sojourn_s\": [30, 30, 30], \"modes\": [\n"
    CV2 "},\n" CA "},\n" CT2 "} ] }\n";

/* What the program writes on standard output, to be freed. */
static char *said(void)
{
    char *out = ran.out;

    check_good(&ran);
    ran.out = NULL;
    return out;
}

#define filtered(...) (run_jumplink("filter", __VA_ARGS__), said())

/* --- against padding ----------------------------------------------------- */

/* A target that turns off at k = 30, at 1 Hz; some rows are empty. */
static const char *measurements(const char *name, int from)
{
    char text[8000];
    size_t at = 0;
    unsigned r = 1;
    int k;

    at += (size_t)snprintf(text, sizeof text, "k,z0,z1\n");
    for (k = 0; k < 80; k++) {
        int turn = k > 30 ? k - 30 : 0, noise[2], i;

        for (i = 0; i < 2; i++) {
            r = r * 1664525u + 1013904223u;
            noise[i] = (int)(r >> 26) - 32;
        }
        if (k < from)
            continue;
        at += (size_t)(k % 9 == 5
            ? snprintf(text + at, sizeof text - at, "%d,,\n", k)
            : snprintf(text + at, sizeof text - at, "%d,%d,%d\n", k,
                       k > 0 ? 100 * k + noise[0] : 0,
                       k > 0 ? 4 * turn * turn + noise[1] : 0));
    }
    return scratch_write(name, text);
}

/* The same by matrices over 1 s: of the CV mode, the acceleration has no past,
 * and a noise of 7 m/s^2. */
static const char padded[] =
    "{ \"kind\": \"imm\", \"n\": 6, \"m\": 2,\n"
    "  \"Pi\": [[0.9, 0.1], [0.2, 0.8]], \"mu0\": [0.5, 0.5],\n"
    "  \"x0\": [0, 0, 0, 0, 0, 0],\n"
    "  \"P0\": [[400,0,0,0,0,0], [0,10000,0,0,0,0], [0,0,49,0,0,0],\n"
    "           [0,0,0,400,0,0], [0,0,0,0,10000,0], [0,0,0,0,0,49]],\n"
    "  \"modes\": [\n"
    "  { \"Phi\": [[1,1,0,0,0,0], [0,1,0,0,0,0], [0,0,0,0,0,0],\n"
    "              [0,0,0,1,1,0], [0,0,0,0,1,0], [0,0,0,0,0,0]],\n"
    "    \"Gamma\": [[0.5,0,0,0], [1,0,0,0], [0,0,1,0],\n"
    "                [0,0.5,0,0], [0,1,0,0], [0,0,0,1]],\n"
    "    \"Q\": [[0.25,0,0,0], [0,0.25,0,0], [0,0,49,0], [0,0,0,49]],\n"
    "    \"H\": [[1,0,0,0,0,0], [0,0,0,1,0,0]],\n"
    "    \"R\": [[400,0], [0,400]] },\n"
    "  { \"Phi\": [[1,1,0.5,0,0,0], [0,1,1,0,0,0], [0,0,1,0,0,0],\n"
    "              [0,0,0,1,1,0.5], [0,0,0,0,1,1], [0,0,0,0,0,1]],\n"
    "    \"Gamma\": [[0.5,0], [1,0], [1,0], [0,0.5], [0,1], [0,1]],\n"
    "    \"Q\": [[0.0625,0], [0,0.0625]],\n"
    "    \"H\": [[1,0,0,0,0,0], [0,0,0,1,0,0]],\n"
    "    \"R\": [[400,0], [0,400]] } ] }\n";

static const char mixed[] = HEAD "\"a0_std\": 7,\n"
    "\"Pi\": [[0.9, 0.1], [0.2, 0.8]], \"modes\": [" CV2 "},\n" CA "} ] }\n";

/* Row i of a and row j of b: k, x in sigmas, P by sigmas, mu, loglik. */
static void check_row(const struct table *a, int i, const struct table *b,
                      int j, double within)
{
    double sigma[6];
    int row, column, at = 7;

    for (row = 0; row < 6; at += 6 - row, row++)
        sigma[row] = sqrt(table_at(b, j, at));
    assert_close(table_at(a, i, 0), table_at(b, j, 0), 0);
    for (row = 0; row < 6; row++)
        assert_close(table_at(a, i, 1 + row), table_at(b, j, 1 + row),
                     within * sigma[row]);
    for (at = 7, row = 0; row < 6; row++)
        for (column = row; column < 6; column++, at++)
            assert_close(table_at(a, i, at), table_at(b, j, at),
                         within * sigma[row] * sigma[column]);
    for (; at < a->columns; at++)
        assert_close(table_at(a, i, at), table_at(b, j, at),
                     within * (1 + fabs(table_at(b, j, at))));
}

static void check_padding(const char *form)
{
    double within = JL_REAL_FLOAT ? 2e-3 : 1e-11;
    struct table a, b;
    char *sized, *full;
    int k;

    sized = filtered(scratch_write("mixed.json", mixed),
                     measurements("all.csv", 0), "--time", "k", "--form",
                     form);
    full = filtered(scratch_write("padded.json", padded),
                    measurements("rest.csv", 1), "--form", form);
    table_take(&a, sized);
    table_take(&b, full);
    assert_string_equal(a.header, b.header);
    assert_int_equal(a.rows, 80);
    assert_int_equal(b.rows, 79);
    for (k = 1; k < 80; k++)            /* row 0 is the start */
        check_row(&a, k, &b, k - 1, within);
    table_free(&a);
    table_free(&b);
    free(sized);
    free(full);
}

static void test_orders_equal_padding(void **state)
{
    (void)state;
    check_padding("joseph");
    check_padding("standard");
    check_padding("sqrt");
}

/* --- starts ---------------------------------------------------------------- */

/* A start of a mode is of what it has, one at the top of everything. */
static void test_orders_and_starts(void **state)
{
    static const char top[] = HEAD "\"sojourn_s\": [30, 30],\n"
        "\"x0\": [10, 150, 3, 20, 40, 4], \"P0\": [[9,1,0,0,0,0],"
        "[1,9,0,0,2,0], [0,0,9,0,0,0], [0,0,0,9,0,0], [0,2,0,0,9,0],"
        "[0,0,0,0,0,9]],\n\"modes\": [" CV2 "},\n" CA "} ] }\n";
    static const char each[] = HEAD "\"sojourn_s\": [30, 30],\n"
        "\"modes\": [" CV2 ", \"x0\": [10, 150, 20, 40], \"P0\": "
        "[[9,1,0,0], [1,9,0,2], [0,0,9,0], [0,2,0,9]]},\n"
        CA ", \"x0\": [10, 150, 3, 20, 40, 4], \"P0\": [[9,1,0,0,0,0],"
        "[1,9,0,0,2,0], [0,0,9,0,0,0], [0,0,0,9,0,0], [0,2,0,0,9,0],"
        "[0,0,0,0,0,9]]} ] }\n";
    const char *data = measurements("starts.csv", 0);
    char *a, *b;

    (void)state;
    a = filtered(scratch_write("top.json", top), data, "--time", "k");
    b = filtered(scratch_write("each.json", each), data, "--time", "k");
    check_same_text(a, b);
    free(a);
    free(b);
    a = filtered(scratch_write("top.json", top), data, "--time", "k",
                 "--filter", "kf", "--mode", "0");
    b = filtered(scratch_write("each.json", each), data, "--time", "k",
                 "--filter", "kf", "--mode", "0");
    check_same_text(a, b);
    assert_non_null(strstr(a, "\n0,"));
    free(a);
    free(b);
}

/* --- one mode of them -------------------------------------------------------- */

/* Is what it is in a model of its own. */
static void test_orders_alone(void **state)
{
    static const char alone[] = "{ \"kind\": \"imm\", \"axes\": 2, \"order\": "
        "2, \"sigma_z\": 20, \"sojourn_s\": [30], \"modes\": [" CV2 "} ] }\n";
    const char *data = measurements("alone.csv", 0);
    const char *model = scratch_write("three.json", three);
    char *one = filtered(scratch_write("alone.json", alone), data, "--time",
                         "k");
    char *of_three = filtered(model, data, "--time", "k", "--filter", "kf",
                              "--mode", "0");

    (void)state;
    check_same_text(one, of_three);
    assert_non_null(strstr(one, "x0,x1,x2,x3,P00"));
    run_jumplink("filter", model, data, "--time", "k", "--filter", "kf",
                 "--mode", "0", "--port", "loop", "--pes", "2");
    check_same_text(one, ran.out);
    free(one);
    free(of_three);
}

/* --- on PEs ------------------------------------------------------------------ */

static void check_same_on(const char *port, const char *pes,
                          const char *serial, const char *model,
                          const char *data)
{
    char *parallel = filtered(model, data, FLIGHT, "--port", port, "--pes",
                              pes, "--timeout", "20");

    check_same_text(serial, parallel);
    free(parallel);
}

static void test_orders_on_pes(void **state)
{
    const char *model = scratch_write("three.json", three);
    const char *data = program_head("glide.csv", DATA "glider_irregular.csv",
                                    301);
    char *serial = filtered(model, data, FLIGHT);

    (void)state;
    check_same_on("loop", "2", serial, model, data);
    check_same_on("loop", "3", serial, model, data);
    check_same_on("threads", "3", serial, model, data);
    check_same_on("lcm", "2", serial, model, data);
    free(serial);
}

/* --- a flight ------------------------------------------------------------------ */

/* North is where the model has it, whatever the first mode has. */
static void test_orders_in_a_flight(void **state)
{
    const char *model = scratch_write("three.json", three);
    char folder[400], *table;
    const char *cell;
    int i;

    (void)state;
    snprintf(folder, sizeof folder, "%s", scratch_path("flight"));
    run_jumplink("sim", "--data", DATA "carrier_held_1hz.csv", "--model",
                 model, "--out", folder, "--port", "loop", "--hold", "detect");
    check_good(&ran);
    strncat(folder, "/table.csv", sizeof folder - strlen(folder) - 1);
    table = program_file(folder);
    assert_non_null(cell = strstr(table, "velocity_rms_mps"));
    for (i = 0; cell > table; cell--)
        i += *cell == ',';
    assert_non_null(cell = strchr(table, '\n'));
    for (; i > 0; i--)
        cell = strchr(cell + 1, ',');
    assert_true(atof(cell + 1) > 1 && atof(cell + 1) < 30);
    free(table);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_orders_equal_padding),
        cmocka_unit_test(test_orders_and_starts),
        cmocka_unit_test(test_orders_alone),
        cmocka_unit_test(test_orders_on_pes),
        cmocka_unit_test(test_orders_in_a_flight),
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
