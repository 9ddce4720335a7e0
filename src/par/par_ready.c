/* The start: every PE's word goes up the tree to PE0; PE0's word, that all are
 * there and alike, comes down it, and goes to the host.  Like the exchange, one
 * list of messages in one order, of which each PE executes its part. */
#include <string.h>

#include "par/par_parts.h"

struct start {
    jl_par *par;
    int level[JL_MAX_PES];      /* of each PE's next message (jl_hop)       */
    int odd;                    /* the PE that is not like this one; -1     */
};

static int parent_of(const struct start *start, int pe)
{
    return jl_topo_parent(start->par->config.topology,
                          start->par->config.npe, pe);
}

static int depth_of(const struct start *start, int pe)
{
    int depth = 0;

    for (; pe != 0; pe = parent_of(start, pe))
        depth++;
    return depth;
}

static int write_word(const jl_par *par, unsigned char *buf, int about,
                      jl_u32 fingerprint)
{
    return jli_msg_plain(buf, JLI_READY, about, par->config.npe, fingerprint);
}

/* Receive the word about a PE; -1: about any.  Notes an odd one. */
static int receive_word(struct start *start, int from, int about, int level)
{
    jl_par *par = start->par;
    const unsigned char *in = JLI_IN(par);
    int len = jli_par_recv(par, from, par->config.start_us, level);

    if (len < 0)
        return len;
    if (len != JLI_MSG_HEADER || in[0] != JLI_READY
        || in[1] >= par->config.npe || (about >= 0 && in[1] != about))
        return jli_par_fault(par, from, JL_EMSG);
    if ((int)jl_get_u16(in + 2) != par->config.npe
        || jl_get_u32(in + 4) != par->config.fingerprint)
        start->odd = in[1];
    return JL_OK;
}

/* One message of the list, as far as this PE has a part in it; what it passes
 * on lies where it was received. */
static int pass(struct start *start, int from, int to, int about)
{
    jl_par *par = start->par;
    int *a = &start->level[from], *b = &start->level[to];
    int level = *a > *b ? *a : *b;

    *a = *b = level + 1;
    if (par->config.pe == from)
        return jli_par_send(par, to, JLI_IN(par), JLI_MSG_HEADER,
                            par->config.start_us, level);
    return par->config.pe == to ? receive_word(start, from, about, level)
        : JL_OK;
}

/* Word after word, those from near PE0 first, each all the way. */
static int gather(struct start *start)
{
    jl_par *par = start->par;
    int depth, pe, at, status = JL_OK;

    for (depth = 1; depth < par->config.npe; depth++)
        for (pe = 1; pe < par->config.npe; pe++) {
            if (depth_of(start, pe) != depth)
                continue;
            if (pe == par->config.pe)
                (void)write_word(par, JLI_IN(par), pe,
                                 par->config.fingerprint);
            for (at = pe; at != 0 && status == JL_OK;
                 at = parent_of(start, at))
                status = pass(start, at, parent_of(start, at), pe);
        }
    return status;
}

/* PE0's word; one about another PE, with a fingerprint that is nobody's, says
 * that this one is not like PE0.  It is passed on although one cannot be told:
 * the others can. */
static int spread(struct start *start)
{
    jl_par *par = start->par;
    const jl_par_config *config = &par->config;
    int depth, pe, status, worst = JL_OK;

    if (config->pe == 0)
        (void)write_word(par, JLI_IN(par), start->odd < 0 ? 0 : start->odd,
                         start->odd < 0 ? config->fingerprint
                         : ~config->fingerprint & (jl_u32)0xFFFFFFFFUL);
    for (depth = 1; depth < config->npe; depth++)
        for (pe = 1; pe < config->npe; pe++) {
            if (depth_of(start, pe) != depth)
                continue;
            status = pass(start, parent_of(start, pe), pe, -1);
            if (status != JL_OK)
                worst = status;
            if (worst != JL_OK && start->odd < 0)
                return worst;
        }
    if (config->pe == 0) {
        status = jli_par_send(par, config->npe, JLI_IN(par), JLI_MSG_HEADER,
                              config->start_us, 0);
        if (status != JL_OK)
            worst = status;
    }
    return worst;
}

int jli_par_ready(jl_par *par)
{
    struct start start;
    int status;

    memset(&start, 0, sizeof start);
    start.par = par;
    start.odd = -1;
    status = gather(&start);
    if (par->config.pe != 0)
        start.odd = -1;         /* it is PE0 who judges */
    if (status == JL_OK)
        status = spread(&start);
    return start.odd < 0 ? status : jli_par_fault(par, start.odd, JL_EMODEL);
}
