/* A parallel run over LCM: each PE a process, this one the host. */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "clock.h"
#include "complain.h"
#include "lcm_net.h"
#include "run.h"

/* How long a PE may take to leave after the end of a run. */
#define LEAVE_US 3e6

struct pe {
    pid_t pid;                  /* 0: not started, or waited for            */
    int status;                 /* of waitpid                               */
    FILE *words;                /* its standard output                      */
};

struct crew {
    int pes;
    struct pe pe[JL_MAX_PES];
};

/* --- starting ------------------------------------------------------------ */

/* In the child: become `jumplink pe`, and die with the parent. */
static void become_pe(int pe, const char *url, const char *run,
                      const struct model *model,
                      const struct options *options, pid_t parent)
{
    char which[16], pes[16], mode[16], timeout[32];
    const char *argv[24];
    int n = 0;

    snprintf(which, sizeof which, "%d", pe);
    snprintf(pes, sizeof pes, "%d", options->pes);
    snprintf(timeout, sizeof timeout, "%.6f",
             (double)options->timeout_us * 1e-6);
    argv[n++] = "jumplink";
    argv[n++] = "pe";
    argv[n++] = "--pe";
    argv[n++] = which;
    argv[n++] = "--pes";
    argv[n++] = pes;
    argv[n++] = "--model";
    argv[n++] = model->path;
    argv[n++] = "--lcm-url";
    argv[n++] = url;
    argv[n++] = "--run";
    argv[n++] = run;
    argv[n++] = "--timeout";
    argv[n++] = timeout;
    argv[n++] = "--form";
    argv[n++] = options->form == &jl_kf_joseph ? "joseph" : "standard";
    if (options->kf) {
        argv[n++] = "--filter";
        argv[n++] = "kf";
        if (options->mode >= 0) {
            snprintf(mode, sizeof mode, "%d", options->mode);
            argv[n++] = "--mode";
            argv[n++] = mode;
        }
    }
    argv[n] = NULL;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() == parent)
        execv("/proc/self/exe", (char *const *)argv);
    _exit(126);
}

static int start(struct crew *crew, const char *url, const char *run,
                 const struct model *model, const struct options *options)
{
    pid_t parent = getpid();
    int pe, ends[2];

    memset(crew, 0, sizeof *crew);
    crew->pes = options->pes;
    for (pe = 0; pe < crew->pes; pe++) {
        if (pipe(ends) != 0)
            break;
        crew->pe[pe].pid = fork();
        if (crew->pe[pe].pid == 0) {
            dup2(ends[1], STDOUT_FILENO);
            close(ends[0]);
            close(ends[1]);
            become_pe(pe, url, run, model, options, parent);
        }
        close(ends[1]);
        crew->pe[pe].words = fdopen(ends[0], "r");
        if (crew->pe[pe].pid < 0 || crew->pe[pe].words == NULL)
            break;
    }
    if (pe == crew->pes)
        return 0;
    complain("PEs", 0, NULL, "PE%d cannot be started: %s", pe,
             strerror(errno));
    return 1;
}

/* --- watching ------------------------------------------------------------ */

/* Take note of a PE that has ended; 1 if it has. */
static int ended(struct pe *pe)
{
    if (pe->pid > 0 && waitpid(pe->pid, &pe->status, WNOHANG) == pe->pid)
        pe->pid = 0;
    return pe->pid <= 0;
}

static void tell(int pe, const struct pe *p)
{
    if (WIFSIGNALED(p->status))
        complain("PEs", 0, NULL, "PE%d was ended by signal %d", pe,
                 WTERMSIG(p->status));
    else
        complain("PEs", 0, NULL, "PE%d ended with status %d", pe,
                 WEXITSTATUS(p->status));
}

static int crew_alive(void *context)
{
    struct crew *crew = context;
    int pe;

    for (pe = 0; pe < crew->pes; pe++)
        if (ended(&crew->pe[pe])) {
            tell(pe, &crew->pe[pe]);
            return 0;
        }
    return 1;
}

/* --- ending -------------------------------------------------------------- */

/* Add up what a PE printed when it left (cmd_pe.c). */
static int add_words(struct traffic *traffic, FILE *words)
{
    unsigned long messages, octets, resent;
    char line[200];
    int found = 0;

    while (fgets(line, sizeof line, words) != NULL)
        if (sscanf(line, "pe %*d of %*d: %lu messages, %lu octets, "
                   "%lu sent again", &messages, &octets, &resent) == 3) {
            traffic->messages += messages;
            traffic->octets += octets;
            traffic->resent += resent;
            found = 1;
        }
    return found;
}

/* Wait for all PEs; those that do not leave in time are ended.  Returns 0 if
 * all left of their own and reported, else 1 (after a message, if wanted). */
static int dismiss(struct crew *crew, struct traffic *traffic, int wanted)
{
    double deadline = clock_us() + (wanted ? LEAVE_US : 0);
    int pe, status = 0;

    for (pe = 0; pe < crew->pes; pe++) {
        struct pe *p = &crew->pe[pe];

        while (!ended(p) && clock_us() < deadline)
            poll(NULL, 0, 2);
        if (p->pid > 0) {
            kill(p->pid, SIGKILL);
            waitpid(p->pid, &p->status, 0);
            p->pid = 0;
        }
        if (p->words != NULL) {
            if ((!add_words(traffic, p->words) || p->status != 0)
                && wanted) {
                tell(pe, p);
                status = 1;
            }
            fclose(p->words);
        }
    }
    return status;
}

int run_lcm(struct estimates *e, struct traffic *traffic,
            const struct model *model, const struct data_file *data,
            const struct options *options)
{
    static int count;
    char run[17];
    const char *url = lcm_net_url(options);
    struct lcm_node node;
    struct crew crew;
    int status;

    snprintf(run, sizeof run, "r%d_%d", (int)getpid(), ++count);
    fflush(NULL);
    status = start(&crew, url, run, model, options);
    if (status == 0)
        status = lcm_node_open(&node, options->pes, url, run, model, options);
    if (status == 0) {
        struct run_host host = { node.to[0], node.from[0], crew_alive, &crew };

        status = run_host(e, &host, model, data, options);
        lcm_node_traffic(&node, traffic);
        lcm_node_close(&node);
    }
    if (dismiss(&crew, traffic, status == 0) != 0)
        status = 1;
    return status;
}

int run_by_hand(struct estimates *e, struct traffic *traffic,
                const struct model *model, const struct data_file *data,
                const struct options *options)
{
    struct lcm_node node;
    struct run_host host = { NULL, NULL, NULL, NULL };
    int status;

    if (lcm_node_open(&node, options->pes, options->lcm_url, options->run,
                      model, options) != 0)
        return 1;
    host.to = node.to[0];
    host.from = node.from[0];
    status = run_host(e, &host, model, data, options);
    lcm_node_traffic(&node, traffic);
    lcm_node_close(&node);
    return status;
}
