#include "lcm_net.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "clock.h"
#include "complain.h"
#include "jumplink/wire.h"
#include "private_net.h"

/* How long to go on until everything sent has arrived. */
#define WELL_US 5000000L
#define FAILED_US 200000L

/* A PE that gets no processor for less than the first is not dead. */
#define SILENCE_MIN_US 500000L
#define SILENCE_MAX_US 60000000L

const char *lcm_net_url(const struct options *options)
{
    static char url[80];

    if (options->lcm_url != NULL)
        return options->lcm_url;
    if (url[0] != '\0')
        return url;
    if (private_net_enter() == 0) {
        strcpy(url, "udpm://239.255.76.67:7667?ttl=0");
    } else {
        int why = errno;        /* ENOSPC: of namespaces, not of a disk */

        private_net_shared_url(url, sizeof url, (unsigned)getpid()
                               * 2654435761u + (unsigned)clock_us());
        fprintf(stderr, "jumplink: no private network is allowed here (%s): "
                "using the machine's own, %s\n", why == ENOSPC
                ? "limit of namespaces" : strerror(why), url);
    }
    return url;
}

static jl_u32 silence_us(const struct options *options)
{
    long us = options->timeout_us;

    return (jl_u32)(us < SILENCE_MIN_US ? SILENCE_MIN_US
                    : us > SILENCE_MAX_US ? SILENCE_MAX_US : us);
}

int lcm_node_open(struct lcm_node *node, int which, const char *url,
                  const char *run, const struct model *model,
                  const struct options *options)
{
    jl_lcm_config config;
    const char *why = "";
    int i;

    memset(node, 0, sizeof *node);
    node->nodes = options->pes + 1;
    memset(&config, 0, sizeof config);
    config.url = url;
    config.run = run;
    config.node = which;
    config.nodes = node->nodes;
    config.number = JL_REAL_OCTETS;
    config.max_len = run_max_len(model);
    config.slots = run_slots(options);
    config.silence_us = silence_us(options);
    config.beat_us = config.silence_us / 8;
    node->lcm = jl_lcm_open(&config, &why);
    if (node->lcm == NULL) {
        complain(url, 0, NULL, "LCM cannot be used: %s", why);
        return 1;
    }
    for (i = 0; i < node->nodes; i++)
        if (i != which) {
            node->to[i] = jl_lcm_tx(node->lcm, i);
            node->from[i] = jl_lcm_rx(node->lcm, i);
        }
    return 0;
}

void lcm_node_traffic(const struct lcm_node *node, struct traffic *traffic)
{
    jl_link_count count = jl_lcm_count(node->lcm);
    int i;

    for (i = 0; i < node->nodes; i++)
        if (node->to[i] != NULL) {
            traffic->messages += node->to[i]->messages;
            traffic->octets += node->to[i]->octets;
        }
    traffic->resent += count.resent;
    traffic->refused += count.refused + count.stale;
}

void lcm_say_refused(const struct traffic *traffic)
{
    if (traffic->refused > 0)
        complain("LCM", 0, NULL, "%lu datagrams that do not belong to this "
                 "run were refused", traffic->refused);
}

int lcm_node_silent(const struct lcm_node *node,
                    const struct options *options)
{
    long us, most = (long)silence_us(options) / 2;     /* four beats */
    int pe, silent = -1;

    for (pe = 0; pe < node->nodes - 1; pe++) {
        us = jl_lcm_silence(node->lcm, pe);
        if (us >= most) {
            most = us;
            silent = pe;
        }
    }
    return silent;
}

void lcm_node_hint(const struct lcm_node *node)
{
    unsigned long refused = jl_lcm_count(node->lcm).refused;

    if (refused > 0)
        complain("LCM", 0, NULL, "%lu datagrams were refused: is a PE built "
                 "for another type of number, or a stranger on this address?",
                 refused);
}

void lcm_node_close(struct lcm_node *node, int well)
{
    jl_lcm_close(node->lcm, well ? WELL_US : FAILED_US);
    memset(node, 0, sizeof *node);
}
