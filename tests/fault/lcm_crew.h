/* Nodes over LCM, each a process, in a network of the test's own; between a node
 * and LCM a bad carrier may stand. */
#ifndef LCM_CREW_H
#define LCM_CREW_H

#include <sys/types.h>

#include "conform/par_case.h"
#include "fault.h"
#include "lcm/port_lcm.h"

#define CREW_NODES 128          /* of all runs at once                      */
#define CREW_PORT 10000         /* and so many more                         */
#define CREW_PORTS 10000
#define CREW_PES 3              /* of the parallel filter; and its host     */

/* What a node leaves behind for the test to see. */
struct crew_node {
    jl_link_count count;
    fault fault;
    struct par_trace trace;     /* of the host of a filter                  */
    double seconds;
};

extern struct crew_node *crew_nodes;    /* [CREW_NODES], shared by all      */

/* Before any test: enter a network, share the memory. */
void crew_prepare(void);

/* Skip the test, with a word, if there is no network. */
void crew_need_net(void);

/* Fork: a child that ends with this process, and in any case soon. */
pid_t crew_fork(void);

/* Wait for children; returns how many failed. */
int crew_failures(const pid_t *child, int n);

/* In a child: be node `which` of n; rto_us as in jl_lcm_config; set NULL: no
 * faults but the network's own.  Ends the process if LCM cannot be used. */
jl_lcm *crew_join(const char *run, int which, int n, int max_len,
                  jl_u32 rto_us, const fault_set *set, struct crew_node *node);

/* In a child: close, which waits for what is not acknowledged yet, note what
 * happened, end. */
void crew_leave(jl_lcm *lcm, struct crew_node *node, int failed,
                long linger_us);
#define CREW_LINGER_US 4000000L         /* dozens of repetitions            */

/* An IMM, with a chain of any kind or a sticky one; a constant-gain IMM. */
enum { CREW_GENERAL, CREW_STICKY, CREW_CG, CREW_KINDS };

/* Start a parallel filter of CREW_PES and its host: nodes[CREW_PES + 1],
 * child[CREW_PES + 1].  The host's trace is to be crew_serial's. */
void crew_start_filter(pid_t *child, const char *run, int kind,
                       jl_u32 rto_us, const fault_set *set, struct crew_node *nodes);
const struct par_trace *crew_serial(int kind);

double crew_clock(void);        /* s */

#endif
