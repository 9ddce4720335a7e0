#include "lcm_crew.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "private_net.h"

#define CHILD_SECONDS 100U
#define SLOTS 4

struct crew_node *crew_nodes;
static int net_errno;           /* why there is no network; 0: there is one */

void crew_prepare(void)
{
    if (private_net_enter() != 0)
        net_errno = errno;
    crew_nodes = mmap(NULL, CREW_NODES * sizeof *crew_nodes,
                      PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1,
                      0);
    if (crew_nodes == MAP_FAILED) {
        perror("mmap");
        _exit(1);
    }
}

void crew_need_net(void)
{
    if (net_errno != 0) {
        print_message("skipped: no private network: %s\n",
                      strerror(net_errno));
        skip();
    }
}

double crew_clock(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* --- processes ----------------------------------------------------------- */

pid_t crew_fork(void)
{
    pid_t parent = getpid(), child;

    fflush(NULL);
    child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent)
            _exit(99);
        alarm(CHILD_SECONDS);
    }
    return child;
}

int crew_failures(const pid_t *child, int n)
{
    int i, status, failed = 0;

    for (i = 0; i < n; i++) {
        if (child[i] < 0 || waitpid(child[i], &status, 0) != child[i]) {
            failed++;
            print_error("process %d was not there\n", i);
        } else if (status != 0) {
            failed++;
            if (WIFSIGNALED(status))
                print_error("process %d (%ld) was ended by signal %d\n", i,
                            (long)child[i], WTERMSIG(status));
        }
    }
    return failed;
}

/* --- a node -------------------------------------------------------------- */

static void put(void *context, int to, const unsigned char *datagram, int len,
                jl_u32 now)
{
    fault_put(context, to, datagram, len, now);
}

static int get(void *context, int *to, unsigned char *datagram, jl_u32 now)
{
    return fault_get(context, to, datagram, now);
}

static long timer(void *context, jl_u32 now)
{
    return fault_timer(context, now);
}

jl_lcm *crew_join(const char *run, int which, int n, int max_len,
                  jl_u32 rto_us, const fault_set *set, struct crew_node *node)
{
    static jl_lcm_carrier carrier;
    jl_lcm_config config = { 0 };
    char url[64];
    const char *why;
    jl_lcm *lcm;

    if (set != NULL) {
        fault_init(&node->fault, set, (unsigned)(which + 1));
        carrier.context = &node->fault;
        carrier.put = put;
        carrier.get = get;
        carrier.timer = timer;
        config.carrier = &carrier;
    }
    /* An address of each run's own: or every node gets, and throws away, what
     * all the others send. */
    snprintf(url, sizeof url, "udpm://239.255.76.67:%u?ttl=0", CREW_PORT
             + (unsigned)jl_crc32(0, (const unsigned char *)run,
                                  (int)strlen(run)) % CREW_PORTS);
    config.url = url;
    config.run = run;
    config.node = which;
    config.nodes = n;
    config.number = JL_REAL_OCTETS;
    config.max_len = max_len;
    config.slots = SLOTS;
    config.rto_us = rto_us;
    lcm = jl_lcm_open(&config, &why);
    if (lcm == NULL) {
        fprintf(stderr, "node %d: %s\n", which, why);
        _exit(98);
    }
    return lcm;
}

void crew_leave(jl_lcm *lcm, struct crew_node *node, int failed,
                long linger_us)
{
    node->count = jl_lcm_count(lcm);
    jl_lcm_close(lcm, linger_us);
    _exit(failed);
}

/* --- the parallel filter ------------------------------------------------- */

static struct par_shape shape_of(int kind)
{
    struct par_shape shape = { .npe = CREW_PES, .M = PAR_M,
                               .form = &jl_kf_joseph, .hangs_at = -1 };

    shape.sticky = kind == CREW_STICKY;
    if (kind == CREW_CG) {
        shape.M = 8;
        shape.axes = PAR_CG_AXES;
    }
    return shape;
}

static void live_in_filter(const char *run, int which, int kind,
                           jl_u32 rto_us, const fault_set *set, struct crew_node *node)
{
    struct par_shape shape = shape_of(kind);
    jl_chan *to[CREW_PES + 1], *from[CREW_PES + 1];
    jl_lcm *lcm = crew_join(run, which, CREW_PES + 1,
                            JL_PAR_MSG(PAR_M, PAR_N, PAR_Z), rto_us, set,
                            node);
    int i, status;

    for (i = 0; i <= CREW_PES; i++) {
        to[i] = jl_lcm_tx(lcm, i);
        from[i] = jl_lcm_rx(lcm, i);
    }
    node->seconds = -crew_clock();
    if (which == CREW_PES)
        status = par_host(&node->trace, &shape, to[0], from[0], NULL);
    else
        status = par_pe(which, &shape, to, from, NULL);
    node->seconds += crew_clock();
    if (status != JL_OK)
        fprintf(stderr, "%s: node %d: %s\n", run, which,
                jl_status_text(status));
    crew_leave(lcm, node, status != JL_OK, CREW_LINGER_US);
}

void crew_start_filter(pid_t *child, const char *run, int kind,
                       jl_u32 rto_us, const fault_set *set, struct crew_node *nodes)
{
    int i;

    for (i = 0; i <= CREW_PES; i++) {
        child[i] = crew_fork();
        if (child[i] == 0)
            live_in_filter(run, i, kind, rto_us, set, &nodes[i]);
    }
}

const struct par_trace *crew_serial(int kind)
{
    static struct par_trace trace;
    struct par_shape shape = shape_of(kind);

    par_serial(&trace, &shape);
    return &trace;
}
