/* The exchange: this PE's part of one static list of hops (plan.h). */
#include "par/par_parts.h"

static int share_a_block(const jl_hop *a, const jl_hop *b, int npe)
{
    return JLI_CARRIES(a, b->first, npe) || JLI_CARRIES(b, a->first, npe);
}

/* Messages that this PE sends in the exchange to the same PE as `hop`. */
static int alike(const jl_par *par, const jl_hop *hop)
{
    int k, count = 0;

    for (k = 0; k < par->hop_count; k++)
        count += par->hops[k].from == hop->from && par->hops[k].to == hop->to;
    return count;
}

/* Moving a send before a receive saves a turn.  It cannot deadlock if the
 * channel holds all that is sent to a PE in one exchange: a send then waits at
 * most for the exchange before, which no later one can hold up. */
static void hoist(jl_par *par, int k)
{
    jl_hop *hops = par->hops, moved = hops[k];
    int pe = par->config.pe;

    if (moved.from != pe
        || par->config.to[moved.to]->slots < alike(par, &moved))
        return;
    for (; k > 0 && hops[k - 1].from != pe
         && !share_a_block(&hops[k - 1], &moved, par->active); k--)
        hops[k] = hops[k - 1];
    hops[k] = moved;
}

void jli_par_order(jl_par *par)
{
    const jl_par_config *config = &par->config;
    int k;

    par->hop_count = 0;
    if (config->pe >= par->active)
        return;
    par->hop_count = jl_hops_exchange(par->hops,
                                      JL_HOPS_OF_PE(JL_MAX_PES),
                                      config->topology, par->active,
                                      config->pe);
    for (k = 1; k < par->hop_count; k++)
        hoist(par, k);
}

static int receive(jl_par *par, const jl_hop *hop)
{
    int len = jli_par_recv(par, hop->from, par->config.timeout_us,
                           hop->level);
    int status = len < 0 ? len
        : jli_msg_modes_read(par, hop, JLI_IN(par), len);

    return len < 0 || status == JL_OK ? status
        : jli_par_fault(par, hop->from, status);
}

int jli_par_exchange(jl_par *par)
{
    const jl_hop *hop, *packed = NULL;
    int k, len = 0, status = JL_OK;

    for (k = 0; k < par->hop_count && status == JL_OK; k++) {
        hop = &par->hops[k];
        if (hop->to == par->config.pe) {
            status = receive(par, hop);
            continue;
        }
        if (packed == NULL || packed->first != hop->first
            || packed->count != hop->count)
            len = jli_msg_modes(JLI_OUT(par), par, hop);
        packed = hop;
        status = jli_par_send(par, hop->to, JLI_OUT(par), len,
                              par->config.timeout_us, hop->level);
    }
    return status;
}
