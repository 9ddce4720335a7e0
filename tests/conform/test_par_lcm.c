/* The parallel IMM on port lcm, each PE a process: the serial filter's bits for
 * any number of PEs. */
#include "par_case.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "lcm/port_lcm.h"
#include "private_net.h"

#define URL "udpm://239.255.76.67:7667?ttl=0"

static int is_private;

static jl_lcm *join(const struct par_shape *shape, int node, jl_chan **to,
                    jl_chan **from)
{
    jl_lcm_config config = { 0 };
    const char *why;
    jl_lcm *lcm;
    int i;

    config.url = URL;
    config.run = "par";
    config.node = node;
    config.nodes = shape->npe + 1;
    config.number = JL_REAL_OCTETS;
    config.max_len = JL_PAR_MSG(PAR_M, PAR_N, PAR_Z);
    config.slots = 2;
    lcm = jl_lcm_open(&config, &why);
    for (i = 0; lcm != NULL && i <= shape->npe; i++) {
        to[i] = jl_lcm_tx(lcm, i);
        from[i] = jl_lcm_rx(lcm, i);
    }
    return lcm;
}

/* The child's life: a PE; its exit status is 0 if all went well. */
static void be_pe(const struct par_shape *shape, int pe, pid_t parent)
{
    jl_chan *to[JL_MAX_PES + 1], *from[JL_MAX_PES + 1];
    int status = JL_EIO;
    jl_lcm *lcm;

    prctl(PR_SET_PDEATHSIG, SIGKILL);
    alarm(30);
    if (getppid() != parent)
        _exit(1);
    lcm = join(shape, pe, to, from);
    if (lcm != NULL)
        status = par_pe(pe, shape, to, from, NULL);
    jl_lcm_close(lcm, 10000000);
    _exit(status == JL_OK ? 0 : 1);
}

static void compare(const struct par_shape *shape)
{
    static struct par_trace serial, trace;
    jl_chan *to[JL_MAX_PES + 1], *from[JL_MAX_PES + 1];
    pid_t pid[JL_MAX_PES], parent = getpid();
    int pe, host = JL_EIO, bad = 0, status;
    jl_lcm *lcm;

    par_serial(&serial, shape);
    for (pe = 0; pe < shape->npe; pe++) {
        pid[pe] = fork();
        if (pid[pe] == 0)
            be_pe(shape, pe, parent);
    }
    lcm = join(shape, shape->npe, to, from);
    if (lcm != NULL)
        host = par_host(&trace, shape, to[0], from[0], NULL);
    jl_lcm_close(lcm, 10000000);
    for (pe = 0; pe < shape->npe; pe++) {
        if (host != JL_OK && pid[pe] > 0)
            kill(pid[pe], SIGKILL);
        waitpid(pid[pe], &status, 0);
        bad += status != 0;
    }
    assert_int_equal(host, JL_OK);
    assert_int_equal(bad, 0);
    assert_same_bits(&trace, &serial, sizeof serial);
}

static void compare_all(int gate)
{
    struct par_shape s = { .M = PAR_M, .form = &jl_kf_joseph,
                           .hangs_at = -1, .gate = gate };

    if (!is_private)
        skip();
    for (s.topology = JL_TOPO_FULL; s.topology <= JL_TOPO_CHAIN;
         s.topology++)
        for (s.npe = 1; s.npe <= 8; s.npe++) {
            s.sticky = s.npe % 2;
            s.form = par_forms[s.npe / 2 % PAR_FORMS];
            compare(&s);
        }
}

static void test_par_gives_serial_bits_over_lcm_and_topologies(void **state)
{
    (void)state;
    compare_all(0);
}

static void test_par_gate_gives_serial_bits_over_lcm(void **state)
{
    (void)state;
    compare_all(1);
}

static void test_par_cg_gives_serial_bits_over_lcm(void **state)
{
    static const int modes[] = { 2, 8, 1, 3 };
    struct par_shape s = { .hangs_at = -1 };

    (void)state;
    if (!is_private)
        skip();
    for (s.topology = JL_TOPO_FULL; s.topology <= JL_TOPO_CHAIN;
         s.topology++)
        for (s.npe = 1; s.npe <= 8; s.npe++) {
            s.M = modes[(s.npe + s.topology) % 4];
            s.axes = 1 + (s.npe + 2 * s.topology) % PAR_CG_AXES;
            compare(&s);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_par_gives_serial_bits_over_lcm_and_topologies),
        cmocka_unit_test(test_par_gate_gives_serial_bits_over_lcm),
        cmocka_unit_test(test_par_cg_gives_serial_bits_over_lcm),
    };

    is_private = private_net_enter() == 0;
    if (!is_private)
        print_message("skipped: no private network is allowed here\n");
    return cmocka_run_group_tests(tests, NULL, NULL);
}
