/* What the files of the parallel filter share. */
#ifndef JL_PAR_PARTS_H
#define JL_PAR_PARTS_H

#include "par/par_msg.h"

/* Messages go out of the first half of the buffer and come into the second. */
#define JLI_OUT(par) ((par)->buf)
#define JLI_IN(par) ((par)->buf + (par)->cap / 2)

/* 1 if PE pe's block is among those of the hop. */
#define JLI_CARRIES(hop, pe, npe) \
    (((pe) - (hop)->first + (npe)) % (npe) < (hop)->count)

#define JLI_OWNS(par, j) ((par)->config.owner[j] == (par)->config.pe)

/* --- par_imm.c, par_cg.c: what is distributed ----------------------------- */

/* What the parallel filter must know of a kind of filter; j is a mode. */
struct jl_par_kind {
    int modes;                  /* the type of its MODES */

    /* The largest magnitude a measurement may have. */
    jl_real (*largest)(const jl_par *par);

    /* JL_OK, now the step; JL_STARTED; or a code: the step fails with it. */
    int (*prepare)(jl_par *par, const jl_meas *meas);

    /* Mix the own modes, and whatever needs no measurement, unless that is
     * done; then the rest up to the exchange.  Both leave a status a mode. */
    void (*ahead)(jl_par *par, jl_real *scratch);
    void (*update)(jl_par *par, const jl_real *z, jl_real *scratch);

    /* No mode has failed anywhere: weigh, and combine. */
    int (*commit)(jl_par *par, const jl_real *z, jl_real *scratch);

    /* A mode in MODES: its status and, besides par->l[j], its estimate of so
     * many reals. */
    unsigned (*word)(const jl_par *par, int j);
    void (*read_word)(jl_par *par, int j, unsigned word);
    int (*reals)(const jl_par *par, int j);
    unsigned char *(*put)(unsigned char *p, const jl_par *par, int j);
    const unsigned char *(*get)(const unsigned char *p, jl_par *par, int j);

    /* 1 if l and the estimate of a mode that has not failed can be used; what a
     * PE of ours sends always can. */
    int (*is_sound)(const jl_par *par, int j);

    /* loglik, x, P (or NULL), mu of *estimate: the filter's own, or scratch. */
    void (*answer)(const jl_par *par, jl_estimate *estimate,
                   jl_real *scratch);
};

/* jl_par_init for any kind; need is its longest message.  The caller sets the
 * rest: the filter, its kind and its l. */
int jli_par_bind(jl_par *par, int M, int n, int m, int need,
                 const jl_par_config *config, unsigned char *buf, int cap,
                 int *status, jl_real *z);

/* --- par_fault.c: channels, and whose fault it is ------------------------ */

/* A message to or from a PE, or the host (npe).  Return JL_OK or, for recv, the
 * length of what is now in JLI_IN; else a code that is also in par->failed,
 * with par->failed_pe: of this channel, or what the other end tells of another.
 * The deadline is the later, the more levels of messages must come before. */
int jli_par_send(jl_par *par, int pe, const unsigned char *msg, int len,
                 long timeout_us, int level);
int jli_par_recv(jl_par *par, int pe, long timeout_us, int level);

int jli_par_fault(jl_par *par, int pe, int status);

/* That deadline. */
long jli_patience(long timeout_us, int level);

/* Tell the neighbours, and PE0 the host, of the failure in *par. */
void jli_par_tell_fault(jl_par *par);

/* --- par_ready.c ---------------------------------------------------------- */

/* All are there, and agree on the model: JL_OK on all of them and the host, or
 * JL_EMODEL, or the error of a channel. */
int jli_par_ready(jl_par *par);

/* --- par_exchange.c ------------------------------------------------------- */

/* List the own hops; then, where channels have room, send what does not depend
 * on what is received before it is received. */
void jli_par_order(jl_par *par);

/* l, the estimate and the status of all modes, or pools, to all active PEs.
 * Returns JL_OK, or the error of a channel. */
int jli_par_exchange(jl_par *par);

/* --- par_pool.c: the all-reduce ------------------------------------------- */

/* The pool of the own modes into par->pool, before they are weighed. */
void jli_pool_own(jl_par *par);

/* All pools into xhat and Phat, after all modes are weighed. */
void jli_pool_merge(jl_par *par);

#endif
