/* `jumplink systolic`: the counts of the specification, files that agree with
 * them, and what it refuses. */
#include "close.h"
#include "scratch.h"
#include "program.h"

static long number_after(const char *text, const char *start)
{
    const char *at = strstr(text, start);

    if (at == NULL) {
        print_error("no line %s\n", start);
        fail();
        return 0;
    }
    return strtol(at + strlen(start), NULL, 10);
}

/* Cells, and ticks of a step: as known ahead plus 1, naive, best, and best with
 * constant c and Gamma. */
static void test_systolic_counts(void **state)
{
    static const struct {
        const char *size;
        int cells, paper, naive, best, constant;
    } want[] = {
        { "1,1,1", 11, 8, 12, 8, 8 }, { "3,2,2", 47, 19, 32, 20, 18 },
        { "4,2,2", 62, 22, 38, 24, 21 }, { "2,4,1", 37, 20, 30, 23, 22 },
        { "4,4,4", 119, 32, 54, 35, 31 }, { "8,4,4", 223, 44, 78, 50, 43 }
    };
    const char *folder = scratch_path("counts");
    char path[200], *csv;
    size_t i;

    (void)state;
    run_jumplink("systolic", "-o", folder);
    check_good(&ran);
    assert_non_null(strstr(ran.out, "DOES NOT HOLD: counted, 1 to 1 ticks"));
    assert_non_null(strstr(ran.out, "holds: 57% to 73%"));
    snprintf(path, sizeof path, "%s/counts.csv", folder);
    csv = program_file(path);
    for (i = 0; i < sizeof want / sizeof *want; i++) {
        char line[60];

        snprintf(line, sizeof line, "%s,%d,paper,", want[i].size,
                 want[i].cells);
        assert_int_equal(number_after(csv, line), want[i].paper + 1);
        snprintf(line, sizeof line, "%s,%d,naive,", want[i].size,
                 want[i].cells);
        assert_int_equal(number_after(csv, line), want[i].naive);
        snprintf(line, sizeof line, "%s,%d,best,", want[i].size,
                 want[i].cells);
        assert_int_equal(number_after(csv, line), want[i].best);
        snprintf(line, sizeof line, "%s,%d,c_and_gamma_known,", want[i].size,
                 want[i].cells);
        assert_int_equal(number_after(csv, line), want[i].constant);
    }
    free(csv);
}

/* Work and ticks of the steps drawn are those counted; a cell does one thing a
 * tick; no row of the array works before the one above it could feed it. */
static void test_systolic_activity(void **state)
{
    const char *folder = scratch_path("activity");
    char path[200], *csv, *line, *rest;
    long work = 0, ticks, before = -1, tick_before = 0, first = 0, last = 0;

    (void)state;
    run_jumplink("systolic", "--n", "4", "--m", "2", "--r", "2", "--schedule",
                 "naive", "-o", folder);
    check_good(&ran);
    snprintf(path, sizeof path, "%s/counts.csv", folder);
    csv = program_file(path);
    ticks = number_after(csv, "4,2,2,62,naive,");
    first = number_after(csv, "4,2,2,62,naive,38,");
    free(csv);
    assert_int_equal(ticks, 38);
    snprintf(path, sizeof path, "%s/activity.csv", folder);
    csv = program_file(path);
    rest = csv;
    line = strsep(&rest, "\n");
    assert_string_equal(line, "tick,step,cell,part,row,column,mode");
    while ((line = strsep(&rest, "\n")) != NULL && *line != '\0') {
        long tick, step, cell;
        char mode[20];

        assert_int_equal(sscanf(line, "%ld,%ld,%ld,%*[a-z],%*d,%*d,%19s",
                                &tick, &step, &cell, mode), 4);
        assert_true(tick > tick_before || (tick == tick_before
                                           && cell > before));
        assert_in_range(cell, 0, 61);
        assert_in_range(step, 3, 5);
        before = cell;
        tick_before = tick;
        work += strcmp(mode, "QR") == 0 || strcmp(mode, "Faddeev") == 0
            || strcmp(mode, "multiply") == 0;
        last = tick;
    }
    assert_int_equal(work, 3 * first);
    assert_true(last > 4 * ticks);
    free(csv);
    snprintf(path, sizeof path, "%s/activity.png", folder);
    csv = program_file(path);
    assert_memory_equal(csv, "\x89PNG", 4);
    free(csv);
}

static void test_systolic_refuses(void **state)
{
    static const char *const sizes[] = { "3,2", "0,1,1", "3,2,2,", "3,2,17",
                                         "a,b,c" };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        run_jumplink("systolic", "--size", sizes[i]);
        check_refused(&ran, 2, "--size|three numbers");
    }
    run_jumplink("systolic", "--n", "3", "--m", "2");
    check_refused(&ran, 2, "--n, --m and --r go together");
    run_jumplink("systolic", "--n", "3", "--m", "0", "--r", "2");
    check_refused(&ran, 2, "--m 0: 1 to 16");
    run_jumplink("systolic", "--schedule", "worst");
    check_refused(&ran, 2, "--schedule worst");
    run_jumplink("systolic", "model.json");
    check_refused(&ran, 2, "model.json");
    run_jumplink("systolic", "--sise", "3,2,2");
    check_refused(&ran, 2, "unknown option --sise");
    run_jumplink("systolic", "--size");
    check_refused(&ran, 2, "--size needs a value");
    run_jumplink("systolic", "-o", "/dev/null/x");
    check_refused(&ran, 1, "/dev/null");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_systolic_counts),
        cmocka_unit_test(test_systolic_activity),
        cmocka_unit_test(test_systolic_refuses),
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
