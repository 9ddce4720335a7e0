/* The folded MEKF on port lcm, each PE a process: the serial bits and the same
 * octets. */
#include "fold_case.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "lcm/port_lcm.h"
#include "private_net.h"

#define URL "udpm://239.255.76.67:7667?ttl=0"

static int is_private;

/* 0 if all was well. */
static int live(const struct fold_shape *shape, int pe)
{
    static struct fold_pe t;
    jl_lcm_config config = { 0 };
    jl_chan *to[JL_MAX_PES], *from[JL_MAX_PES];
    const char *why;
    jl_lcm *lcm;
    int i, bad;

    config.url = URL;
    config.run = "fold";
    config.node = pe;
    config.nodes = shape->npe;
    config.number = JL_REAL_OCTETS;
    config.max_len = FOLD_MAX_MSG;
    config.slots = 2;
    lcm = jl_lcm_open(&config, &why);
    if (lcm == NULL)
        return 1;
    for (i = 0; i < shape->npe; i++) {
        to[i] = jl_lcm_tx(lcm, i);
        from[i] = jl_lcm_rx(lcm, i);
    }
    bad = fold_pe(&t, pe, shape, to, from);
    jl_lcm_close(lcm, 10000000);
    return bad;
}

static void be_pe(const struct fold_shape *shape, int pe, pid_t parent)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    alarm(30);
    if (getppid() != parent)
        _exit(1);
    _exit(live(shape, pe) != 0);
}

/* PE0 is this process. */
static void compare(const struct fold_shape *shape)
{
    pid_t pid[JL_MAX_PES], parent = getpid();
    int pe, bad, status;

    for (pe = 1; pe < shape->npe; pe++) {
        pid[pe] = fork();
        assert_true(pid[pe] >= 0);
        if (pid[pe] == 0)
            be_pe(shape, pe, parent);
    }
    bad = live(shape, 0);
    for (pe = 1; pe < shape->npe; pe++) {
        if (bad > 0)
            kill(pid[pe], SIGKILL);
        waitpid(pid[pe], &status, 0);
        bad += status != 0;
    }
    assert_int_equal(bad, 0);
}

static void compare_all(int fail, int models)
{
    struct fold_shape s = { .fail = fail, .fail_pe = -1, .leaves = -1 };

    if (!is_private)
        skip();
    for (s.npe = 2; s.npe <= 8; s.npe++)
        for (s.model = s.npe % 3; s.model < FOLD_MODELS; s.model += models) {
            s.c = (jl_mekf_c)((s.npe + s.model) % 3);
            s.spread = s.npe / 3 % 2;
            compare(&s);
        }
}

static void test_fold_gives_serial_bits_over_lcm(void **state)
{
    (void)state;
    compare_all(FAIL_NEVER, 2);
}

static void test_fold_fails_for_all_or_none_over_lcm(void **state)
{
    (void)state;
    compare_all(FAIL_F, FOLD_MODELS);
    compare_all(FAIL_SINGULAR, FOLD_MODELS);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fold_gives_serial_bits_over_lcm),
        cmocka_unit_test(test_fold_fails_for_all_or_none_over_lcm),
    };

    is_private = private_net_enter() == 0;
    if (!is_private)
        print_message("skipped: no private network is allowed here\n");
    return cmocka_run_group_tests(tests, NULL, NULL);
}
