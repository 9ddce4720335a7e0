/* What the program writes: files that are whole or not there, and plots. */
#include "close.h"
#include "scratch.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

#include "complain.h"
#include "out_file.h"
#include "plot.h"
#include "progress.h"

/* --- files ------------------------------------------------------------- */

static void check_content(const char *path, const char *text)
{
    char *there = scratch_read(path);

    assert_non_null(there);
    assert_string_equal(there, text);
    free(there);
}

static void test_out_is_whole_or_not_there(void **state)
{
    const char *path = scratch_path("new.csv");
    struct out_file out;
    int before = scratch_count();
    struct stat there;
    mode_t mask = umask(027);

    (void)state;
    assert_int_equal(out_open(&out, path), 0);
    fprintf(out.stream, "one\n");
    assert_int_equal(access(path, F_OK), -1);
    assert_int_equal(out_close(&out, 1), 0);
    umask(mask);
    check_content(path, "one\n");
    assert_int_equal(stat(path, &there), 0);
    assert_int_equal(there.st_mode & 0777, 0640);

    assert_int_equal(out_open(&out, path), 0);
    fprintf(out.stream, "half");
    assert_int_equal(out_close(&out, 0), 0);
    check_content(path, "one\n");

    assert_int_equal(out_open(&out, path), 0);
    fprintf(out.stream, "two\n");
    check_content(path, "one\n");
    assert_int_equal(out_close(&out, 1), 0);
    check_content(path, "two\n");
    assert_int_equal(scratch_count(), before + 1);
    unlink(path);
}

/* A link stays a link, and a device a device. */
static void test_out_behind_links_and_devices(void **state)
{
    const char *link = scratch_path("link.csv"), *path = scratch_path("t.csv");
    struct out_file out;
    struct stat there;
    char octet;
    int pipe, i;

    (void)state;
    scratch_write("t.csv", "old");
    assert_int_equal(symlink("t.csv", link), 0);
    assert_int_equal(out_open(&out, link), 0);
    fprintf(out.stream, "new");
    assert_int_equal(out_close(&out, 1), 0);
    check_content(path, "new");
    assert_int_equal(lstat(link, &there), 0);
    assert_true(S_ISLNK(there.st_mode));
    unlink(link);
    unlink(path);

    assert_int_equal(mkfifo(scratch_path("pipe"), 0600), 0);
    pipe = open(scratch_path("pipe"), O_RDWR);
    assert_int_equal(out_open(&out, scratch_path("pipe")), 0);
    fprintf(out.stream, "x");
    assert_int_equal(out_close(&out, 1), 0);
    assert_int_equal(stat(scratch_path("pipe"), &there), 0);
    assert_true(S_ISFIFO(there.st_mode));
    assert_int_equal(read(pipe, &octet, 1), 1);
    assert_int_equal(octet, 'x');
    close(pipe);

    /* only now, since a mistake here would replace the device */
    for (i = 0; i < 2; i++) {           /* found at the end; and before */
        int n = i == 0 ? 1 : 100000;

        assert_int_equal(out_open(&out, "/dev/full"), 0);
        while (n-- > 0)
            fprintf(out.stream, "x");
        capture_begin();
        assert_int_equal(out_close(&out, 1), -1);
        check_line(capture_end(), "/dev/full: ", "cannot write", "No space");
    }
    unlink(scratch_path("pipe"));
}

static void test_out_disk_full(void **state)
{
    const char *path = scratch_path("full.csv");
    struct rlimit no_limit, limit;
    struct out_file out;
    int n;

    (void)state;
    scratch_write("full.csv", "old");
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &no_limit), 0);
    limit = no_limit;
    limit.rlim_cur = 10000;
    for (n = 10001; n < 100000; n += 80000) {
        int i;

        assert_int_equal(out_open(&out, path), 0);
        assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
        for (i = 0; i < n; i++)
            fprintf(out.stream, "x");
        capture_begin();
        assert_int_equal(out_close(&out, 1), -1);
        setrlimit(RLIMIT_FSIZE, &no_limit);
        check_line(capture_end(), "full.csv: ", "cannot write", "too large");
    }
    check_content(path, "old");
    unlink(path);
    assert_int_equal(scratch_count(), 0);
}

static void bad_out(const char *path, const char *what)
{
    struct out_file out;

    capture_begin();
    assert_int_equal(out_open(&out, path), -1);
    check_line(capture_end(), path, "cannot create: ", what);
    assert_null(out.stream);
}

static void test_out_places_that_are_wrong(void **state)
{
    struct out_file out;
    const char *path = scratch_path("gone");

    (void)state;
    bad_out(scratch_dir, "Is a directory");
    bad_out(scratch_path("nowhere/x.csv"), "No such file or directory");
    scratch_write("file", "");
    bad_out(scratch_path("file/x.csv"), "Not a directory");

    unlink(scratch_path("file"));

    /* the target turns into a folder meanwhile: nothing may be left behind */
    assert_int_equal(out_open(&out, path), 0);
    assert_int_equal(mkdir(path, 0700), 0);
    capture_begin();
    assert_int_equal(out_close(&out, 1), -1);
    check_line(capture_end(), path, "cannot rename", "");
    assert_int_equal(rmdir(path), 0);
    assert_int_equal(scratch_count(), 0);
}

/* Standard output is written to, and stays open. */
static void test_out_standard_output(void **state)
{
    int fd = open(scratch_path("stdout"), O_RDWR | O_CREAT, 0600), old;
    struct out_file out;

    (void)state;
    fflush(stdout);
    old = dup(STDOUT_FILENO);
    assert_true(fd >= 0 && old >= 0 && dup2(fd, STDOUT_FILENO) >= 0);
    assert_int_equal(out_open(&out, NULL), 0);
    fprintf(out.stream, "a");
    assert_int_equal(out_close(&out, 1), 0);
    assert_int_equal(out_open(&out, "-"), 0);
    fprintf(out.stream, "b");
    assert_int_equal(out_close(&out, 1), 0);
    assert_true(dup2(old, STDOUT_FILENO) >= 0);
    close(old);
    close(fd);
    check_content(scratch_path("stdout"), "ab");
    unlink(scratch_path("stdout"));
}

/* --- plots ------------------------------------------------------------- */

static const char run_csv[] =
    "t_s,east_m,north_m,x0,x2,err,held,mu0,mu1\n"
    "0,0,0,0,0,1.5,0,0.5,0.5\n"
    "1,,,90,10,0,1,0.25,0.75\n"
    "2,200,20,nan,20,0.5,0,1,0\n";

/* All three plots; returns the sum of what they return. */
static int draw(const char *folder)
{
    static const struct plot_series track[] = {
        { "run.csv", "east_m", "north_m", "pilot's own", PLOT_DOTS },
        { "run.csv", "x0", "x2", "estimate", PLOT_LINE },
        { "run.csv", "x2", "x0", NULL, PLOT_TRUTH }
    };
    static const struct plot_series errors[] = {
        { "run.csv", "t_s", "held", "held", PLOT_SHADE },
        { "run.csv", "t_s", "err", "error", PLOT_LINE }
    };
    static const char *const names[] = { "a_b", "it's" };

    return plot_track(folder, "track", "a_b: it's", track, 3)
        + plot_errors(folder, "errors", NULL, "error in m/s", errors, 2)
        + plot_modes(folder, "modes", "modes", "run.csv", "t_s", names, 2)
        + plot_modes(folder, "unnamed", "modes", "run.csv", "t_s", NULL, 2);
}

static void test_plot_draws_png_and_svg(void **state)
{
    static const char *const names[] = {
        "track", "errors", "modes", "unnamed"
    };
    size_t i;

    (void)state;
    if (system("gnuplot --version >/dev/null 2>&1") != 0)
        skip();
    scratch_write("run.csv", run_csv);
    assert_int_equal(draw(scratch_dir), 0);
    for (i = 0; i < sizeof names / sizeof names[0]; i++) {
        char file[100], *text;

        snprintf(file, sizeof file, "%s.svg", names[i]);
        text = scratch_read(scratch_path(file));
        assert_non_null(text);
        assert_non_null(strstr(text, "</svg>"));
        free(text);
        unlink(scratch_path(file));
        snprintf(file, sizeof file, "%s.png", names[i]);
        text = scratch_read(scratch_path(file));
        assert_non_null(text);
        assert_memory_equal(text, "\x89PNG", 4);
        free(text);
        unlink(scratch_path(file));
        snprintf(file, sizeof file, "%s.gp", names[i]);
        unlink(scratch_path(file));
    }
    unlink(scratch_path("run.csv"));
}

static void test_plot_without_gnuplot(void **state)
{
    static const struct plot_series series = {
        "run.csv", "x0", "x2", "estimate", PLOT_LINE
    };
    char *path = strdup(getenv("PATH")), *script;

    (void)state;
    assert_int_equal(setenv("PATH", scratch_dir, 1), 0);
    capture_begin();
    assert_int_equal(plot_track(scratch_dir, "p", "it's", &series, 1), 1);
    check_line(capture_end(), "p.gp: ", "gnuplot", "not installed");
    assert_int_equal(setenv("PATH", path, 1), 0);
    free(path);
    script = scratch_read(scratch_path("p.gp"));
    assert_non_null(script);
    assert_non_null(strstr(script, "set title 'it''s'"));
    assert_non_null(strstr(script, "column('x0') / 1000"));
    free(script);
    unlink(scratch_path("p.gp"));
}

static void test_plot_that_fails(void **state)
{
    static const struct plot_series series = {
        "nowhere.csv", "x0", "x2", "estimate", PLOT_LINE
    };

    (void)state;
    capture_begin();
    assert_int_equal(plot_track(scratch_path("nowhere"), "p", NULL, &series,
                                1), -1);
    check_line(capture_end(), "nowhere/p.gp: ", "cannot create", "No such");
    if (system("gnuplot --version >/dev/null 2>&1") != 0)
        skip();
    capture_begin();
    assert_int_equal(plot_track(scratch_dir, "p", NULL, &series, 1), -1);
    check_line(capture_end(), "p.gp: ", "gnuplot failed", "gnuplot p.gp");
    assert_int_equal(access(scratch_path("p.png"), F_OK), -1);
    assert_int_equal(access(scratch_path("p.svg"), F_OK), -1);
    unlink(scratch_path("p.gp"));
}

/* --- progress ------------------------------------------------------------ */

/* A line of a terminal, which comes in pieces, as the kernel hands it on; 0 if
 * it does not end within 5 s of silence. */
static int said_on(int master, char *line, size_t size)
{
    struct pollfd readable = { master, POLLIN, 0 };
    size_t n = 0;

    while (memchr(line, '\n', n) == NULL) {
        ssize_t more = poll(&readable, 1, 5000) == 1
            ? read(master, line + n, size - 1 - n) : 0;

        if (more <= 0)
            return 0;
        n += (size_t)more;
        line[n] = 0;
    }
    return 1;
}

/* What a terminal shows of work, a complaint in its midst, and its end. */
static void test_progress_on_a_terminal(void **state)
{
    int master = posix_openpt(O_RDWR | O_NOCTTY), terminal = -1, saved;
    char said[400] = "";
    int got;

    (void)state;
    if (master >= 0 && grantpt(master) == 0 && unlockpt(master) == 0)
        terminal = open(ptsname(master), O_RDWR | O_NOCTTY);
    if (terminal < 0) {
        print_message("skipped: no pseudo-terminal: %s\n", strerror(errno));
        skip();
    }
    saved = dup(STDERR_FILENO);
    fflush(stderr);
    dup2(terminal, STDERR_FILENO);
    progress_begin("a flight");
    progress(3, 10);
    complain("x.csv", 4, NULL, "no");
    progress_begin(NULL);
    progress(4, 10);                    /* nothing is under way */
    fflush(stderr);
    dup2(saved, STDERR_FILENO);
    got = said_on(master, said, sizeof said);
    close(terminal);
    close(master);
    close(saved);
    assert_true(got);
    assert_string_equal(said, "\r\033[Ka flight: 3 of 10"
                        "\r\033[Kjumplink: x.csv:4: no\r\n");
}

/* Nothing of it in a file or pipe. */
static void test_progress_elsewhere(void **state)
{
    (void)state;
    capture_begin();
    progress_begin("a flight");
    progress(3, 10);
    progress_begin(NULL);
    assert_string_equal(capture_end(), "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_out_is_whole_or_not_there),
        cmocka_unit_test(test_out_behind_links_and_devices),
        cmocka_unit_test(test_out_disk_full),
        cmocka_unit_test(test_out_places_that_are_wrong),
        cmocka_unit_test(test_out_standard_output),
        cmocka_unit_test(test_plot_draws_png_and_svg),
        cmocka_unit_test(test_plot_without_gnuplot),
        cmocka_unit_test(test_plot_that_fails),
        cmocka_unit_test(test_progress_on_a_terminal),
        cmocka_unit_test(test_progress_elsewhere)
    };

    return cmocka_run_group_tests(tests, scratch_setup, scratch_teardown);
}
