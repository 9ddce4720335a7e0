/* A parallel run inside this process: PEs and host are threads, that take turns
 * (port loop) or run at the same time (port threads). */
#include <string.h>

#include "complain.h"
#include "loop/port_loop.h"
#include "run.h"
#include "threads/port_threads.h"

struct job {
    jl_loop *loop;                      /* one of the two, as options->port */
    jl_threads *threads;
    struct estimates *e;
    const struct model *model;
    const struct data_file *data;
    const struct options *options;
    int status;
};

/* --- either port --------------------------------------------------------- */

static int open_port(struct job *job, int nodes, int max_len)
{
    int slots = run_slots(job->options);

    if (job->options->port == PORT_LOOP)
        job->loop = jl_loop_new(nodes, max_len, slots);
    else
        job->threads = jl_threads_new(nodes, max_len, slots);
    return job->loop != NULL || job->threads != NULL;
}

static void close_port(struct job *job)
{
    jl_loop_free(job->loop);
    jl_threads_free(job->threads);
}

static jl_chan *tx(const struct job *job, int from, int to)
{
    return job->loop != NULL ? jl_loop_tx(job->loop, from, to)
                             : jl_threads_tx(job->threads, from, to);
}

static jl_chan *rx(const struct job *job, int from, int to)
{
    return job->loop != NULL ? jl_loop_rx(job->loop, from, to)
                             : jl_threads_rx(job->threads, from, to);
}

static int run_port(struct job *job, void (*body)(int node, void *context))
{
    return job->loop != NULL ? jl_loop_run(job->loop, body, job)
                             : jl_threads_run(job->threads, body, job);
}

/* --- the run ------------------------------------------------------------- */

static void body(int node, void *context)
{
    struct job *job = context;
    int pes = job->options->pes, i;
    jl_chan *to[JL_MAX_PES + 1], *from[JL_MAX_PES + 1];

    memset(to, 0, sizeof to);
    memset(from, 0, sizeof from);
    for (i = 0; i <= pes; i++)
        if (i != node) {
            to[i] = tx(job, node, i);
            from[i] = rx(job, i, node);
        }
    if (node == pes) {
        struct run_host host = { to[0], from[0], NULL, NULL, -1 };
        long row;
        int status = run_host(job->e, &row, &host, job->model, job->data,
                              job->options);

        job->status = status == JL_OK ? 0
            : run_failed(job->data, row, status, host.failed_pe);
    } else {
        (void)run_pe(node, job->model, job->options, to, from);
    }
}

/* After the run, when nobody counts any more. */
static void add_up(const struct job *job, struct traffic *traffic)
{
    int nodes = job->options->pes + 1, from, to;

    for (from = 0; from < nodes; from++)
        for (to = 0; to < nodes; to++)
            if (from != to) {
                traffic->messages += tx(job, from, to)->messages;
                traffic->octets += tx(job, from, to)->octets;
            }
}

int run_inside(struct estimates *e, struct traffic *traffic,
               const struct model *model, const struct data_file *data,
               const struct options *options)
{
    const char *port = options_port_name(options->port);
    struct job job = { NULL, NULL, e, model, data, options, 1 };
    int status;

    if (!open_port(&job, options->pes + 1, run_max_len(model))) {
        complain(port, 0, NULL, "no memory for %d PEs", options->pes);
        return 1;
    }
    status = run_port(&job, body);
    add_up(&job, traffic);
    close_port(&job);
    if (status != JL_OK)
        complain(port, 0, NULL, "%s", jl_status_text(status));
    return status == JL_OK ? job.status : 1;
}
