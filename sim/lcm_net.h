/* Which network a run over LCM uses, and a node on it. */
#ifndef SIM_LCM_NET_H
#define SIM_LCM_NET_H

#include "jumplink/chan.h"
#include "lcm/port_lcm.h"
#include "options.h"
#include "run.h"

/* The address for the PEs of runs that this process starts: the one of
 * --lcm-url as it is; else a private network, which the process enters at the
 * first call; else, said in one line, the machine's own with ttl 0 and an
 * address of the run's own. */
const char *lcm_net_url(const struct options *options);

/* A node of a run and its channels. */
struct lcm_node {
    jl_lcm *lcm;
    int nodes;
    jl_chan *to[JL_MAX_PES + 1], *from[JL_MAX_PES + 1];
};

/* Join as node `node` of pes + 1.  Returns 0, or 1 after a message. */
int lcm_node_open(struct lcm_node *node, int which, const char *url,
                  const char *run, const struct model *model,
                  const struct options *options);

/* Add what this node sent, and what it refused. */
void lcm_node_traffic(const struct lcm_node *node, struct traffic *traffic);

/* After a run that went well: if datagrams were refused, a line says so. */
void lcm_say_refused(const struct traffic *traffic);

/* After a failure: the PE that has been silent for longest, and for half of the
 * timeout (and a quarter of a second) at least; -1: none. */
int lcm_node_silent(const struct lcm_node *node,
                    const struct options *options);

/* After a failure: if datagrams were refused, a line that says what that may
 * mean. */
void lcm_node_hint(const struct lcm_node *node);

/* Leave: when all that was sent has arrived, if all is well; else soon. */
void lcm_node_close(struct lcm_node *node, int well);

#endif
