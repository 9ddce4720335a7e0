/* `jumplink sim`, the main job: the table, the files, and nobody and nothing
 * left behind. */
#include "close.h"
#include "scratch.h"
#include "program.h"
#include "table.h"

#define DATA TOP_DIR "/sim/data/"
#define ROWS 300
#define PES 4

static char data[400], two[400], eight[400];

static void keep(char *to, const char *path)
{
    snprintf(to, 400, "%s", path);
}

/* Copies in the scratch folder, so that processes can be told by it. */
static int setup(void **state)
{
    scratch_setup(state);
    keep(data, program_head("flight.csv", DATA "carrier_held_1hz.csv",
                            ROWS + 1));
    keep(two, program_copy("two_modes.json", DATA "two_modes.json"));
    keep(eight, program_copy("eight_modes.json", DATA "eight_modes.json"));
    return 0;
}

/* --- the table ----------------------------------------------------------- */

/* The field of a table's line (0: the header) under a heading; good until the
 * next call. */
static const char *cell(const char *csv, int line, const char *heading)
{
    static char text[100];
    const char *head = csv;
    size_t length = strlen(heading);

    for (; line > 0; line--)
        csv = strchr(csv, '\n') + 1;
    while (strncmp(head, heading, length) != 0
           || (head[length] != ',' && head[length] != '\n')) {
        size_t to_next = strcspn(head, ",\n");

        if (head[to_next] != ',') {
            print_error("no column %s\n", heading);
            fail();
        }
        head += to_next + 1;
        csv += strcspn(csv, ",\n") + 1;
    }
    snprintf(text, sizeof text, "%.*s", (int)strcspn(csv, ",\n"), csv);
    return text;
}

/* The other PEs tell PE0 that they are ready, PE0 tells them and the host that
 * all are; the host tells PE0 to stop, PE0 the others; a row goes to the PEs
 * with modes and comes back; but for the first, which starts the filter, every
 * two of them exchange their modes. */
static long messages(long rows, long modes, long pes)
{
    long active = modes < pes ? modes : pes;

    return (pes - 1) + pes + pes + rows * (1 + active)
        + (rows - 1) * active * (active - 1);
}

static void check_table(const char *csv, int line, const char *model,
                        const char *positions, long modes)
{
    assert_string_equal(cell(csv, line, "model"), model);
    assert_string_equal(cell(csv, line, "positions"), positions);
    assert_int_equal(atol(cell(csv, line, "steps")), ROWS - 1);
    assert_int_equal(atol(cell(csv, line, "messages")),
                     messages(ROWS, modes, PES));
    assert_true(atol(cell(csv, line, "octets")) > 1000);
    assert_string_equal(cell(csv, line, "same_bits"), "1");
    assert_true(atof(cell(csv, line, "velocity_rms_mps")) > 1);
    assert_true(atof(cell(csv, line, "velocity_rms_mps")) < 20);
    assert_true(atof(cell(csv, line, "step_median_us")) > 0);
}

static int lines_ending_in_yes(const char *text)
{
    int count = 0;

    while ((text = strstr(text, " yes\n")) != NULL) {
        count++;
        text++;
    }
    return count;
}

/* --- the files ----------------------------------------------------------- */

static const char *in(const char *folder, const char *name)
{
    static char path[500];

    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void check_png(const char *path)
{
    unsigned char begins[8] = { 0 };
    FILE *stream = fopen(path, "rb");

    assert_non_null(stream);
    assert_int_equal(fread(begins, 1, 8, stream), 8);
    assert_memory_equal(begins, "\211PNG\r\n\032\n", 8);
    fseek(stream, -8, SEEK_END);
    assert_int_equal(fread(begins, 1, 8, stream), 8);
    assert_memory_equal(begins, "IEND\256B`\202", 8);
    fclose(stream);
}

static void check_svg(const char *path)
{
    char *text = program_file(path);
    size_t n = strlen(text);

    assert_int_equal(strncmp(text, "<?xml", 5), 0);
    assert_non_null(strstr(text, "<svg"));
    while (n > 0 && isspace((unsigned char)text[n - 1]))
        n--;
    assert_true(n > 6 && strncmp(text + n - 6, "</svg>", 6) == 0);
    free(text);
}

static void check_plot(const char *folder, const char *name)
{
    char file[300];

    snprintf(file, sizeof file, "%s.gp", name);
    free(program_file(in(folder, file)));
    snprintf(file, sizeof file, "%s.png", name);
    check_png(in(folder, file));
    snprintf(file, sizeof file, "%s.svg", name);
    check_svg(in(folder, file));
}

static void check_files(const char *folder)
{
    static const char *const plots[] = {
        "track_two_modes", "track_eight_modes", "velocity_error_two_modes",
        "velocity_error_eight_modes", "modes_two_modes_fresh",
        "modes_two_modes_recognised", "modes_eight_modes_fresh",
        "modes_eight_modes_recognised",
    };
    struct table track;
    char *text = program_file(in(folder, "track.csv"));
    size_t i, count = sizeof plots / sizeof *plots;

    for (i = 0; i < count; i++)
        check_plot(folder, plots[i]);
    table_take(&track, text);
    assert_int_equal(track.rows, ROWS);
    table_free(&track);
    free(text);
}

/* The estimates are those of jumplink filter, octet for octet. */
static void check_estimates(const char *folder, const char *name,
                            const char *model, const char *hold)
{
    char *text = program_file(in(folder, name));

    run_jumplink("filter", model, data, "--z", "east_m,north_m", "--hold",
                 hold);
    check_good(&ran);
    check_same_text(text, ran.out);
    free(text);
}

static void check_sim(const char *port, const char *folder)
{
    int before = scratch_count();
    char *csv;

    run_jumplink("sim", "--data", data, "--model", two, "--model", eight,
                 "--out", folder, "--port", port, "--pes", "4",
                 "--timeout", "20");
    check_good(&ran);
    check_nobody_left();
    /* 4 estimates, track.csv, table.csv, table.txt, 8 plots of 3 files */
    assert_int_equal(scratch_count(), before + 31);
    assert_int_equal(lines_ending_in_yes(ran.out), 4);
    assert_null(strstr(ran.out, " NO\n"));
    assert_non_null(strstr(ran.out, folder));
    csv = program_file(in(folder, "table.txt"));
    assert_int_equal(strncmp(ran.out, csv, strlen(csv)), 0);
    free(csv);
    csv = program_file(in(folder, "table.csv"));
    assert_int_equal(table_count(csv, '\n'), 5);
    check_table(csv, 1, "two_modes", "fresh", 2);
    check_table(csv, 2, "two_modes", "recognised", 2);
    check_table(csv, 3, "eight_modes", "fresh", 8);
    check_table(csv, 4, "eight_modes", "recognised", 8);
    free(csv);
    check_files(folder);
    check_estimates(folder, "two_modes_fresh.csv", two, "none");
    check_estimates(folder, "two_modes_recognised.csv", two, "detect");
    check_estimates(folder, "eight_modes_fresh.csv", eight, "none");
    check_estimates(folder, "eight_modes_recognised.csv", eight, "detect");
}

static void test_sim_over_lcm(void **state)
{
    (void)state;
    check_sim("lcm", scratch_path("lcm"));
}

static void test_sim_over_loop(void **state)
{
    (void)state;
    check_sim("loop", scratch_path("some/folder/loop"));
}

static void test_sim_over_threads(void **state)
{
    (void)state;
    check_sim("threads", scratch_path("threads"));
}

/* --- the whole flight ---------------------------------------------------- */

static void test_sim_recognised_positions_pay(void **state)
{
    char folder[400], *csv;

    (void)state;
    keep(folder, scratch_path("flight"));
    run_jumplink("sim", "--data", DATA "carrier_held_1hz.csv", "--model", two,
                 "--out", folder, "--port", "loop");
    check_good(&ran);
    csv = program_file(in(folder, "table.csv"));
    assert_close(atof(cell(csv, 1, "velocity_rms_mps")), 50.8, 0.1);
    assert_close(atof(cell(csv, 2, "velocity_rms_mps")), 9.22, 0.05);
    assert_int_equal(atol(cell(csv, 1, "steps")), 2498);
    free(csv);
}

static void test_sim_one_way_only(void **state)
{
    char folder[400], *csv;

    (void)state;
    keep(folder, scratch_path("one"));
    run_jumplink("sim", "--data", data, "--model", two, "-o", folder, "--port",
                 "loop", "--hold", "detect", "--filter", "kf", "--mode", "1",
                 "--pes", "1");
    check_good(&ran);
    csv = program_file(in(folder, "table.csv"));
    assert_int_equal(table_count(csv, '\n'), 2);
    assert_string_equal(cell(csv, 1, "positions"), "recognised");
    assert_int_equal(atol(cell(csv, 1, "messages")), messages(ROWS, 1, 1));
    free(csv);
}

/* --- refusals ------------------------------------------------------------ */

#define sim_refused(status, words, ...) do { \
    run_jumplink("sim", __VA_ARGS__); \
    check_refused(&ran, status, words); \
} while (0)

static void test_sim_refuses(void **state)
{
    char out[400];
    int before = scratch_count();

    (void)state;
    keep(out, scratch_path("refused"));
    sim_refused(2, "none.csv|No such file", "--data",
                scratch_path("none.csv"), "--model", two, "--out", out);
    sim_refused(2, "none.json|No such file", "--data", data, "--model",
                scratch_path("none.json"), "--out", out);
    sim_refused(2, "axes", "--data", data, "--out", out, "--model",
                TOP_DIR "/tests/golden/imm/cvca3/model.json");
    sim_refused(2, "z.csv:1: east_m", "--out", out, "--model", two, "--data",
                TOP_DIR "/tests/golden/imm/cvca3/z.csv");
    sim_refused(2, "unexpected 'more'", "more");
    sim_refused(2, "--port", "--port", "mpi");
    sim_refused(2, "--run", "--run", "x");
    sim_refused(2, "--lcm-url", "--port", "loop", "--lcm-url", "udpm://x");
    sim_refused(2, "--mode", "--data", data, "--model", two, "--filter", "kf");
    sim_refused(2, "--model", "--model", "1", "--model", "2", "--model", "3",
                "--model", "4", "--model", "5", "--model", "6", "--model",
                "7", "--model", "8", "--model", "9");
    assert_int_equal(scratch_count(), before);
}

/* The folder's name is a file's: known before any work. */
static void test_sim_out_is_a_file(void **state)
{
    const char *file = scratch_write("file", "kept");
    int before = scratch_count();
    char *text;

    (void)state;
    sim_refused(1, "/file|Not a directory", "--data", data, "--model", two,
                "--port", "loop", "--out", file);
    text = program_file(file);
    assert_string_equal(text, "kept");
    free(text);
    assert_int_equal(scratch_count(), before);
}

/* Files are named after the models: two of one name would share them. */
static void test_sim_two_models_of_one_name(void **state)
{
    char twin[400], out[400];

    (void)state;
    keep(out, scratch_path("same"));
    scratch_must(mkdir(scratch_path("other"), 0777) == 0, "mkdir");
    keep(twin, program_copy("other/two_modes.json", eight));
    sim_refused(2, "--model|other/two_modes.json", "--data", data, "--model",
                two, "--model", twin, "--port", "loop", "--out", out);
    sim_refused(2, "--model|two_modes.json", "--data", data, "--model", two,
                "--model", eight, "--model", two, "--port", "loop", "--out",
                out);
    assert_int_not_equal(access(out, F_OK), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sim_over_lcm),
        cmocka_unit_test(test_sim_over_loop),
        cmocka_unit_test(test_sim_over_threads),
        cmocka_unit_test(test_sim_recognised_positions_pay),
        cmocka_unit_test(test_sim_one_way_only),
        cmocka_unit_test(test_sim_refuses),
        cmocka_unit_test(test_sim_out_is_a_file),
        cmocka_unit_test(test_sim_two_models_of_one_name),
    };

    return cmocka_run_group_tests(tests, setup, scratch_teardown);
}
