/* A parallel run on port loop: PEs and host in this process. */
#include <string.h>

#include "complain.h"
#include "loop/port_loop.h"
#include "run.h"

struct job {
    jl_loop *loop;
    struct estimates *e;
    struct traffic *traffic;
    const struct model *model;
    const struct data_file *data;
    const struct options *options;
    int status;
};

static void body(int node, void *context)
{
    struct job *job = context;
    int pes = job->options->pes, i;
    jl_chan *to[JL_MAX_PES + 1], *from[JL_MAX_PES + 1];

    memset(to, 0, sizeof to);
    memset(from, 0, sizeof from);
    for (i = 0; i <= pes; i++)
        if (i != node) {
            to[i] = jl_loop_tx(job->loop, node, i);
            from[i] = jl_loop_rx(job->loop, i, node);
        }
    if (node == pes) {
        struct run_host host = { to[0], from[0], NULL, NULL };
        long row;
        int status = run_host(job->e, &row, &host, job->model, job->data,
                              job->options);

        job->status = status == JL_OK ? 0
            : run_failed(job->data, row, status);
    } else {
        (void)run_pe(node, job->model, job->options, to, from);
    }
    for (i = 0; i <= pes; i++)          /* one PE at a time runs: no race */
        if (i != node) {
            job->traffic->messages += to[i]->messages;
            job->traffic->octets += to[i]->octets;
        }
}

int run_loop(struct estimates *e, struct traffic *traffic,
             const struct model *model, const struct data_file *data,
             const struct options *options)
{
    struct job job = { NULL, e, traffic, model, data, options, 1 };
    int status;

    job.loop = jl_loop_new(options->pes + 1, run_max_len(model),
                           run_slots(options));
    if (job.loop == NULL) {
        complain("port loop", 0, NULL, "no memory for %d PEs", options->pes);
        return 1;
    }
    status = jl_loop_run(job.loop, body, &job);
    jl_loop_free(job.loop);
    if (status != JL_OK)
        complain("port loop", 0, NULL, "%s", jl_status_text(status));
    return status == JL_OK ? job.status : 1;
}
