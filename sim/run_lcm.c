/* A parallel run over LCM: each PE a process, this one the host. */
#include <errno.h>
#include <fcntl.h>
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
#include "progress.h"
#include "run.h"

/* How long PEs may take to leave after the end of a run, and to say what was
 * wrong after a failure. */
#define LEAVE_US 10e6
#define FAIL_US 3e5

struct pe {
    pid_t pid;                  /* 0: not started, or waited for            */
    int status;                 /* of waitpid                               */
    int overdue;                /* ended by us, for it did not leave        */
    FILE *words;                /* what it prints                           */
};

struct crew {
    int pes;
    struct pe pe[JL_MAX_PES];
    char complaint[200];        /* the first of a PE about itself           */
    char hearsay[200];          /* ... about another                        */
};

/* --- starting ------------------------------------------------------------ */

/* In the child: become `jumplink pe`, and die with the parent. */
static void become_pe(int pe, const char *url, const char *run,
                      const struct model *model,
                      const struct options *options, pid_t parent)
{
    char which[16], pes[16], mode[16], timeout[32], wait[32];
    char gate[32], most[16];
    const char *argv[32];
    int n = 0;

    snprintf(which, sizeof which, "%d", pe);
    snprintf(pes, sizeof pes, "%d", options->pes);
    snprintf(timeout, sizeof timeout, "%.6f",
             (double)options->timeout_us * 1e-6);
    snprintf(wait, sizeof wait, "%.6f", (double)options->start_us * 1e-6);
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
    argv[n++] = "--start";
    argv[n++] = wait;
    argv[n++] = "--topology";
    argv[n++] = options_topology(options);
    if (options->exchange == JL_EXCHANGE_REDUCE) {
        argv[n++] = "--exchange";
        argv[n++] = "reduce";
    }
    if (options->form_given) {
        argv[n++] = "--form";
        argv[n++] = options_form(options);
    }
    if (options->filter == FILTER_KF) {
        argv[n++] = "--filter";
        argv[n++] = "kf";
        if (options->mode >= 0) {
            snprintf(mode, sizeof mode, "%d", options->mode);
            argv[n++] = "--mode";
            argv[n++] = mode;
        }
    }
    if (options->gate > 0) {
        snprintf(gate, sizeof gate, "%.17g", options->gate);
        snprintf(most, sizeof most, "%d", options->gate_most);
        argv[n++] = "--gate";
        argv[n++] = gate;
        argv[n++] = "--gate-most";
        argv[n++] = most;
    }
    argv[n] = NULL;
    close_range(3, ~0u, 0);             /* LCM's sockets are not for it */
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    signal(SIGINT, SIG_IGN);            /* to all of them: the host ends    */
    signal(SIGHUP, SIG_IGN);            /* the run in order; without a host */
    signal(SIGTERM, SIG_IGN);           /* they die at once                 */
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
        if (pipe2(ends, O_CLOEXEC) != 0)
            break;
        crew->pe[pe].pid = fork();
        if (crew->pe[pe].pid == 0) {
            dup2(ends[1], STDOUT_FILENO);
            dup2(ends[1], STDERR_FILENO);
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

static int crew_alive(void *context)
{
    struct crew *crew = context;
    int pe;

    for (pe = 0; pe < crew->pes; pe++)
        if (ended(&crew->pe[pe]))
            return 0;
    return 1;
}

/* --- ending -------------------------------------------------------------- */

/* Add up what a PE printed when it left (cmd_pe.c), and keep complaints.
 * Returns 1 if it left in order. */
static int take_words(struct crew *crew, struct pe *pe,
                      struct traffic *traffic)
{
    static const char complains[] = "jumplink: ";
    unsigned long messages, octets, resent, refused;
    char line[200], *keep;
    int left = 0;

    while (fgets(line, sizeof line, pe->words) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        if (sscanf(line, "pe %*d of %*d: %lu messages, %lu octets, "
                   "%lu sent again, %lu refused", &messages, &octets, &resent,
                   &refused) == 4) {
            traffic->messages += messages;
            traffic->octets += octets;
            traffic->resent += resent;
            traffic->refused += refused;
            left = 1;
        } else if (strncmp(line, complains, sizeof complains - 1) == 0) {
            keep = strstr(line, ": no word from ") != NULL
                || strstr(line, ": given up by ") != NULL
                ? crew->hearsay : crew->complaint;
            if (keep[0] == '\0')
                strcpy(keep, line + sizeof complains - 1);
        }
    }
    fclose(pe->words);
    return left && pe->status == 0;
}

/* Wait for all PEs to leave; end those that do not.  Returns 0 if all left in
 * order, else 1. */
static int dismiss(struct crew *crew, struct traffic *traffic, double wait_us)
{
    double deadline = clock_us() + wait_us;
    int pe, bad = 0;

    for (pe = 0; pe < crew->pes; pe++) {
        struct pe *p = &crew->pe[pe];

        while (!ended(p) && clock_us() < deadline)
            poll(NULL, 0, 2);
        if (p->pid > 0) {
            kill(p->pid, SIGKILL);
            waitpid(p->pid, &p->status, 0);
            p->pid = 0;
            p->overdue = 1;
        }
    }
    for (pe = 0; pe < crew->pes; pe++)
        if (crew->pe[pe].words != NULL)
            bad |= !take_words(crew, &crew->pe[pe], traffic);
    return bad;
}

/* Why the run failed, in one line.  A PE that a signal ended is the reason of
 * whatever others complain about; then what a PE says of itself; then one that
 * fell silent; then what a PE says of another, and what the host met. */
static void say_why(const struct crew *crew, const struct data_file *data,
                    long row, int status, const struct run_host *host)
{
    int pe;

    for (pe = 0; pe < crew->pes; pe++) {
        const struct pe *p = &crew->pe[pe];

        if (!p->overdue && p->pid == 0 && WIFSIGNALED(p->status)) {
            complain("PEs", 0, NULL, "PE%d was ended by signal %d (%s)", pe,
                     WTERMSIG(p->status), strsignal(WTERMSIG(p->status)));
            return;
        }
    }
    progress_clear();
    if (crew->complaint[0] != '\0')
        fprintf(stderr, "jumplink: %s\n", crew->complaint);
    else if (host->failed_pe >= 0)
        (void)run_failed(data, row, status, host->failed_pe);
    else if (crew->hearsay[0] != '\0')
        fprintf(stderr, "jumplink: %s\n", crew->hearsay);
    else if (status != JL_OK)
        (void)run_failed(data, row, status, -1);
    else
        complain("PEs", 0, NULL, "a PE did not leave in order");
}

int run_lcm(struct estimates *e, struct traffic *traffic,
            const struct model *model, const struct data_file *data,
            const struct options *options)
{
    static int count;
    char run[17];
    const char *url = lcm_net_url(options);
    struct run_host host = { NULL, NULL, crew_alive, NULL, -1 };
    struct lcm_node node;
    struct crew crew;
    long row = -1;
    int status, bad;

    snprintf(run, sizeof run, "r%d_%d", (int)getpid(), ++count);
    fflush(NULL);
    bad = start(&crew, url, run, model, options) != 0
        || lcm_node_open(&node, options->pes, url, run, model, options) != 0;
    if (bad) {
        (void)dismiss(&crew, traffic, 0);
        return 1;
    }
    host.to = node.to[0];
    host.from = node.from[0];
    host.context = &crew;
    status = run_host(e, &row, &host, model, data, options);
    if (run_is_channels(status) && host.failed_pe < 0)
        host.failed_pe = lcm_node_silent(&node, options);
    lcm_node_traffic(&node, traffic);
    lcm_node_close(&node, status == JL_OK);
    bad = dismiss(&crew, traffic, status == JL_OK ? LEAVE_US : FAIL_US);
    if (status == JL_OK && !bad) {
        lcm_say_refused(traffic);
        return 0;
    }
    if (run_is_channels(status) || status == JL_OK)
        say_why(&crew, data, row, status, &host);
    else
        (void)run_failed(data, row, status, -1);
    return 1;
}

int run_by_hand(struct estimates *e, struct traffic *traffic,
                const struct model *model, const struct data_file *data,
                const struct options *options)
{
    struct run_host host = { NULL, NULL, NULL, NULL, -1 };
    struct lcm_node node;
    long row;
    int status;

    if (lcm_node_open(&node, options->pes, options->lcm_url, options->run,
                      model, options) != 0)
        return 1;
    host.to = node.to[0];
    host.from = node.from[0];
    status = run_host(e, &row, &host, model, data, options);
    lcm_node_traffic(&node, traffic);
    if (status != JL_OK) {
        if (run_is_channels(status) && host.failed_pe < 0)
            host.failed_pe = lcm_node_silent(&node, options);
        (void)run_failed(data, row, status, host.failed_pe);
        lcm_node_hint(&node);
    } else {
        lcm_say_refused(traffic);
    }
    lcm_node_close(&node, status == JL_OK);
    return status == JL_OK ? 0 : 1;
}
