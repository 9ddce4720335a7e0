/* Programs on an LCM network of the test's own: start and end them, talk with
 * them in typed messages.  What a failed test leaves running is killed, by pid,
 * before the next begins. */
#ifndef TESTS_LIVE_H
#define TESTS_LIVE_H

#include "program.h"

#include <lcm/lcm.h>

#include "jumplink_estimate.h"
#include "jumplink_measurement.h"
#include "own_net.h"

#define LIVE_URL OWN_NET_URL
#define LIVE_BUFFER "&recv_buf_size=4194304"
#define LIVE_RUNNING 8

static lcm_t *live_lcm;
static struct program live_running[LIVE_RUNNING];

/* --- the group's setup, and each test's teardown ------------------------- */

static inline int live_setup(void **state)
{
    scratch_setup(state);
    own_net_enter();
    if (!own_net)
        return 0;
    live_lcm = lcm_create(LIVE_URL LIVE_BUFFER);
    scratch_must(live_lcm != NULL, "lcm_create");
    return 0;
}

static inline int live_teardown(void **state)
{
    if (live_lcm != NULL)
        lcm_destroy(live_lcm);
    program_free(&ran);
    return scratch_teardown(state);
}

/* Start an installed program, or JUMPLINK, found as a shell finds it. */
static inline struct program *live_start_told(const char *const *told)
{
    struct program *p = live_running;

    while (p->pid > 0)
        p++;
    scratch_must(p < live_running + LIVE_RUNNING, "too many programs");
    program_start_file(p, "/usr/bin/env", NULL, told);
    return p;
}

#define live_start(...) \
    live_start_told((const char *const[]){ __VA_ARGS__, NULL })

/* Wait for its end; what it said is good until program_free. */
static inline void live_end(struct program *p)
{
    program_end(p, PROGRAM_LIMIT);
}

static inline int live_kill_all(void **state)
{
    struct program *p;

    (void)state;
    for (p = live_running; p < live_running + LIVE_RUNNING; p++)
        program_kill(p);
    return 0;
}

/* --- a program under way ------------------------------------------------- */

/* Wait until it has said the words on standard output. */
static inline void live_await_words(struct program *p, const char *words)
{
    double deadline = program_now() + PROGRAM_LIMIT;
    char text[4096];
    ssize_t n;

    do {
        n = pread(p->out_fd, text, sizeof text - 1, 0);
        text[n > 0 ? n : 0] = '\0';
        if (strstr(text, words) != NULL)
            return;
        program_sleep(0.005);
    } while (program_now() < deadline);
    print_error("'%s' was not said, but '%s'\n", words, text);
    fail();
}

/* jumplink sim --input lcm that listens to the run; its files go to `out`. */
static inline struct program *live_filter(const char *model, const char *run,
                                          const char *out, const char *port)
{
    struct program *p = live_start(JUMPLINK, "sim", "--input", "lcm",
                                   "--model", model, "--lcm-url", LIVE_URL,
                                   "--run", run, "--pes", "2", "--port", port,
                                   "--timeout", "20", "--idle", "2", "-o",
                                   out);

    live_await_words(p, "listening to ");
    return p;
}

/* The number after a word at the beginning of a line of its report. */
static inline long live_count_of(const struct program *p, const char *word)
{
    const char *at = p->out;
    size_t length = strlen(word);

    while (at != NULL && strncmp(at, word, length) != 0) {
        at = strchr(at, '\n');
        at = at == NULL ? NULL : at + 1;
    }
    if (at == NULL)
        program_fail(p, word);
    return at == NULL ? -1 : strtol(at + length, NULL, 10);
}

static inline void check_counts(const struct program *p, long received,
                                long lost, long late, long refused)
{
    check_good(p);
    assert_int_equal(live_count_of(p, "received"), received);
    assert_int_equal(live_count_of(p, "lost"), lost);
    assert_int_equal(live_count_of(p, "late"), late);
    assert_int_equal(live_count_of(p, "refused"), refused);
    assert_non_null(strstr(p->out, "same bits as serial: yes\n"));
}

/* --- files --------------------------------------------------------------- */

/* Two files of estimates: the same octets, but the time as a number. */
static inline void check_same_estimates(const char *a, const char *b)
{
    int line;

    for (line = 1; *a != '\0' && *b != '\0'; line++) {
        char *after_a, *after_b;
        double s = strtod(a, &after_a), t = strtod(b, &after_b);
        size_t length = strcspn(after_a, "\n") + 1;

        if (s < t || s > t || strncmp(after_a, after_b, length) != 0) {
            print_error("line %d: '%.60s' and '%.60s'\n", line, a, b);
            fail();
        }
        a = after_a + length;
        b = after_b + length;
    }
    assert_string_equal(a, b);
}

#endif
