/* The same body on nodes of any port. */
#include "bench.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "jumplink/config.h"
#include "jumplink/wire.h"
#include "lcm/port_lcm.h"
#include "loop/port_loop.h"
#include "private_net.h"
#include "threads/port_threads.h"

#define URL "udpm://239.255.76.67:7667?ttl=0"
#define CHILD_SECONDS 120U
#define NODES (JL_MAX_PES + 1)

const char *const bench_port_names[] = { "loop", "threads", "lcm" };

int bench_network(void)
{
    if (private_net_enter() == 0)
        return 1;
    fprintf(stderr, "bench: without LCM: no private network: %s\n",
            strerror(errno));
    return 0;
}

struct job {
    int n, max_len;
    bench_body body;
    void *context;
    jl_loop *loop;
    jl_threads *threads;
    char run[16];               /* the name of a run over LCM               */
};

/* --- threads ------------------------------------------------------------- */

static void on_thread(int node, void *context)
{
    struct job *job = context;
    jl_chan *to[NODES] = { NULL }, *from[NODES] = { NULL };
    int i;

    for (i = 0; i < job->n; i++)
        if (i != node && job->loop != NULL) {
            to[i] = jl_loop_tx(job->loop, node, i);
            from[i] = jl_loop_rx(job->loop, i, node);
        } else if (i != node) {
            to[i] = jl_threads_tx(job->threads, node, i);
            from[i] = jl_threads_rx(job->threads, i, node);
        }
    job->body(node, to, from, job->context);
}

static void run_loop(struct job *job)
{
    job->loop = jl_loop_new(job->n, job->max_len, BENCH_SLOTS);
    bench_must(job->loop != NULL, "memory for port loop");
    bench_must(jl_loop_run(job->loop, on_thread, job) == JL_OK, "port loop");
    jl_loop_free(job->loop);
}

static void run_threads(struct job *job)
{
    job->threads = jl_threads_new(job->n, job->max_len, BENCH_SLOTS);
    bench_must(job->threads != NULL, "memory for port threads");
    bench_must(jl_threads_run(job->threads, on_thread, job) == JL_OK,
               "port threads");
    jl_threads_free(job->threads);
}

/* --- processes ----------------------------------------------------------- */

static void on_lcm(const struct job *job, int node)
{
    jl_chan *to[NODES] = { NULL }, *from[NODES] = { NULL };
    jl_lcm_config config = { 0 };
    const char *why;
    jl_lcm *lcm;
    int i;

    config.url = URL;
    config.run = job->run;
    config.node = node;
    config.nodes = job->n;
    config.number = JL_REAL_OCTETS;
    config.max_len = job->max_len;
    config.slots = BENCH_SLOTS;
    lcm = jl_lcm_open(&config, &why);
    bench_must(lcm != NULL, why == NULL ? "LCM" : why);
    for (i = 0; i < job->n; i++) {
        to[i] = jl_lcm_tx(lcm, i);
        from[i] = jl_lcm_rx(lcm, i);
    }
    job->body(node, to, from, job->context);
    jl_lcm_close(lcm, BENCH_WAIT_US);
}

static pid_t start(const struct job *job, int node)
{
    pid_t parent = getpid(), child;

    fflush(NULL);
    child = fork();
    bench_must(child >= 0, "fork");
    if (child > 0)
        return child;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent)
        _exit(1);
    alarm(CHILD_SECONDS);
    on_lcm(job, node);
    _exit(0);
}

static void run_lcm(struct job *job, int here)
{
    static int runs;
    pid_t child[NODES] = { 0 };
    int i, status;

    snprintf(job->run, sizeof job->run, "bench%d", runs++);
    for (i = 0; i < job->n; i++)
        if (i != here)
            child[i] = start(job, i);
    on_lcm(job, here);
    for (i = 0; i < job->n; i++)
        if (i != here)
            bench_must(waitpid(child[i], &status, 0) == child[i]
                       && status == 0, "a process of a run over LCM");
}

void bench_run(enum bench_port port, int n, int here, int max_len,
               bench_body body, void *context)
{
    struct job job = { 0 };

    job.n = n;
    job.max_len = max_len;
    job.body = body;
    job.context = context;
    if (port == ON_LOOP)
        run_loop(&job);
    else if (port == ON_THREADS)
        run_threads(&job);
    else
        run_lcm(&job, here);
}
