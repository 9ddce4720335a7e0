/* The IMM spread over processing elements (PEs) joined by channels.
 *
 * Each mode has an owner.  For every measurement
 *     PE0 receives it from the host, and it is passed on to the others;
 *     every PE predicts and updates its own modes;
 *     one exchange (plan.h): every PE gives every other (status, l_j, x_j, P_j)
 *     of its own modes;
 *     every PE weighs all modes itself, with the same code in the same order;
 *     PE0 combines and answers the host.
 * All sums run over modes in index order, so the result has the bits of
 * jl_imm_step for any number of PEs, any owner table, topology and transport.
 * If a mode fails on any PE, all PEs see its status, and none changes its
 * filter.
 * (Pan, Dai, Zhang 1997, sections 3-6, with their three exchanges made one.)
 *
 * A constant-gain IMM (cgimm.h) is spread likewise, with the bits of
 * jl_cgimm_step; its exchange has (status, l_j, x_j) of a mode: in double, of
 * one axis, 2 + 8 (order + 1) octets, and 8 for the message.  Two PEs with a
 * mode of order 2 and one of 3 send 34 and 42 octets a step, where an IMM of 3
 * states sends twice 90.
 *
 * For sticky chains (imm.h) the exchange may instead be an all-reduce, whose
 * messages hold, whatever the number of modes, one estimate a PE: what mixing
 * needs of the others' modes is their pool.
 *     pool of PE p   W_p = sum mu_j, x_p = sum mu_j x_j / W_p,
 *                    P_p = sum mu_j (P_j + (x_j - x_p)(x_j - x_p)') / W_p
 *                    over the modes j of p; merged in the order of PEs
 * A PE then knows only its own modes' estimates.  Equal to the serial filter up
 * to rounding; the same bits for any topology and transport.
 *
 * When a PE cannot go on because of another, it tells its neighbours whose
 * fault it is, and they theirs, so that no relay is blamed for a dead PE.  That
 * needs channels that notice an end that closed or fell silent before the
 * deadline of a message passes (link.h: silence_us).  By deadlines alone, a PE
 * that hangs between two messages of an exchange may leave some PEs one step
 * ahead of others, and one that lives may be blamed.
 */
#ifndef JL_PAR_H
#define JL_PAR_H

#include "base.h"
#include "cgimm.h"
#include "chan.h"
#include "imm.h"
#include "plan.h"
#include "wire.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- messages ---------------------------------------------------------- */

/* A measurement.  dt is a difference and not a time, because an absolute time
 * outgrows a float. */
typedef struct jl_meas {
    jl_u32 seq;                 /* its number: each greater than the last   */
    int first;                  /* 1: a new record begins; `prepare` knows  */
    jl_real dt;                 /* [s] >= 0 since the one before            */
    const jl_real *z;           /* [m], or NULL: missing                    */
} jl_meas;

/* The answer to a measurement.  With a status other than JL_OK the filter did
 * not change and there is nothing but seq and status. */
typedef struct jl_estimate {
    jl_u32 seq;
    int status;                 /* JL_OK or why the step failed             */
    int verdict;                /* JL_ACCEPTED, JL_REJECTED; or JL_MISSING,
                                   also of one that a record starts with    */
    jl_real loglik;
    jl_real *x;                 /* [n]                                      */
    jl_real *P;                 /* [n,n]; NULL: of a jl_cgimm, has none     */
    jl_real *mu;                /* [M]                                      */
    int failed_pe;              /* the PE that PE0 gave up; -1: none        */
} jl_estimate;

/* Octets of the longest message of a filter with M modes, n states and m
 * measurements: a bound for one that carries all modes, the estimate, or z. */
#define JL_PAR_MODE(n) (2 + (1 + (n) + JL_PACKED(n)) * JL_REAL_OCTETS)
#define JL_PAR_MSG(M, n, m) \
    (16 + (M) * JL_PAR_MODE(n) \
     + ((M) + (m) + 2 + (n) + JL_PACKED(n)) * JL_REAL_OCTETS)

/* Octets of a PE's buffer: a message out and a message in. */
#define JL_PAR_BUF(M, n, m) (2 * JL_PAR_MSG(M, n, m))

/* Of a jl_cgimm. */
#define JL_PAR_CG_MODE(axes) (2 + (1 + 3 * (axes)) * JL_REAL_OCTETS)
#define JL_PAR_CG_MSG(M, axes) \
    (16 + (M) * JL_PAR_CG_MODE(axes) \
     + ((M) + 4 * (axes) + 2) * JL_REAL_OCTETS)
#define JL_PAR_CG_BUF(M, axes) (2 * JL_PAR_CG_MSG(M, axes))

/* --- the host's side --------------------------------------------------- */

/* Wait for the PEs: PE0 says that all are there and agree on `fingerprint`.
 * buf [cap] octets, 16 are enough.
 * Returns JL_OK, JL_EMODEL, or the channel's error; or, when PE0 cannot go on
 * because of another PE, the error of that channel.  *failed_pe is that PE, or
 * the one whose fingerprint differs; -1: none. */
int jl_host_ready(jl_chan *from_pe0, jl_u32 fingerprint, int *failed_pe,
                  unsigned char *buf, int cap, long timeout_us);

/* Send a measurement with m components; receive the answer to each before the
 * next, or at most 2 slots + 1 may be on their way (slots of the channels).
 * buf [cap], cap >= JL_PAR_MSG(1, 1, m).
 * Returns JL_OK, JL_ENOMEM, or the channel's error. */
int jl_host_send(jl_chan *to_pe0, const jl_meas *meas, int m,
                 unsigned char *buf, int cap, long timeout_us);

/* Receive the answer; x [n], P [n,n], mu [M] of *estimate are the caller's.  Of
 * a jl_cgimm n is axes * order, and P must be NULL.
 * buf [cap], cap >= JL_PAR_MSG(M, n, 1), or JL_PAR_CG_MSG(M, axes).
 * Returns JL_OK (look at estimate->status), JL_EMSG, JL_ELENGTH, or the
 * channel's error; or, when PE0 cannot go on because of another PE, the error
 * of that channel, with estimate->failed_pe: the run is over. */
int jl_host_recv(jl_chan *from_pe0, jl_estimate *estimate, int M, int n,
                 unsigned char *buf, int cap, long timeout_us);

/* Tell the PEs that the run is over.  buf [cap], 16 are enough.
 * Returns JL_OK, JL_ENOMEM, or the channel's error. */
int jl_host_stop(jl_chan *to_pe0, unsigned char *buf, int cap,
                 long timeout_us);

/* --- the PE's side ----------------------------------------------------- */

/* Called before a step on every PE that owns modes, with the same arguments:
 * for models rebuilt for meas->dt (jl_mode_motion, then jl_imm_chain), or
 * started from a first measurement (jl_imm_set).  Must do the same on every
 * PE, and if it changes a mode it must also call jl_imm_chain or jl_imm_set,
 * which void what was computed ahead.  (A mode that other PEs own is used, too:
 * judge, imm.h, may have to update it.)
 * Returns JL_OK (now the step), JL_STARTED (the measurement was used to set
 * the state: no step), or a negative code: the step fails with it. */
#define JL_STARTED 1
typedef int (*jl_prepare)(void *context, jl_imm *imm, const jl_meas *meas);

/* The same of a jl_cgimm, to start it (jl_cgimm_set), let its gains start again
 * (jl_cgimm_restart), or refuse a dt that is not its T, which is not looked at
 * elsewhere. */
typedef int (*jl_prepare_cg)(void *context, jl_cgimm *cg,
                             const jl_meas *meas);

enum {                          /* what the exchange carries */
    JL_EXCHANGE_GATHER = 0,     /* every mode's estimate                    */
    JL_EXCHANGE_REDUCE = 1      /* ... every PE's pool: sticky chains only  */
};

typedef struct jl_par_config {
    int pe, npe;                /* which of how many: 0 <= pe < npe         */
    const unsigned char *owner; /* [M] the PE of each mode; the PEs 0..A-1
                                   own at least one each, the rest none     */
    int topology;               /* JL_TOPO_...; a ring of which some PEs own
                                   no mode is used as a chain               */
    int exchange;               /* JL_EXCHANGE_...                          */
    jl_chan *const *to;         /* [npe] channels to the PEs joined to this */
    jl_chan *const *from;       /* [npe] ... and from them; others: not used */
    jl_chan *to_host;           /* PE0 only                                 */
    jl_chan *from_host;
    jl_prepare prepare;         /* or NULL: the model does not change       */
    jl_prepare_cg prepare_cg;   /* ... of a jl_cgimm                        */
    void *context;
    jl_u32 fingerprint;         /* of the model: equal on all PEs and host  */
    long start_us;              /* longest wait for the others at the start */
    long timeout_us;            /* ... and for each message of a step; an
                                   eighth more for each that must come
                                   before it (jl_hop.level); either may be
                                   JL_FOREVER; the wait for the next
                                   measurement has no limit                 */
} jl_par_config;

typedef struct jl_par {
    jl_par_config config;
    const struct jl_par_kind *kind;     /* of filter                        */
    jl_imm *imm;                /* the filter, or NULL                      */
    jl_cgimm *cg;               /* ... the other                            */
    int M, n, m;                /* modes, states, components of z           */
    jl_real *l;                 /* [M] the filter's                         */
    int active;                 /* PEs that own modes                       */
    int ahead;                  /* own modes are already mixed, predicted   */
    int failed;                 /* JL_OK, or the error of a channel         */
    int failed_pe;              /* ... to or from this PE; npe: the host    */
    jl_hop hops[JL_HOPS_OF_PE(JL_MAX_PES)];     /* own part of the exchange */
    int hop_count;
    jl_real *pool;              /* [n + n*n] of the own modes (all-reduce)  */
    jl_u32 seq;                 /* of the last measurement                  */
    int verdict;                /* ... on it, if it was not refused         */
    unsigned long steps;        /* measurements used, failed steps too      */
    unsigned long refused;      /* ... and refused, with their code         */
    unsigned char *buf;         /* [cap]                                    */
    int cap;
    int *status;                /* [M] of the modes, in the present step    */
    jl_real *z;                 /* [m] the present measurement              */
} jl_par;

/* The owner table that deals modes out in turn, j to PE j mod npe: the mapping
 * that the paper's heuristic finds for modes of equal cost.  owner [M];
 * 1 <= npe <= JL_MAX_PES. */
void jl_par_deal(unsigned char *owner, int M, int npe);

/* Bind a PE's part to its filter (all M modes on every PE) and memory, which
 * outlive it, as do the arrays that config points to: buf
 * [cap] octets, cap >= JL_PAR_BUF(M, n, m); status [M]; z [m].
 * Returns JL_OK, JL_EDIM (pe, npe, owner, topology, exchange), JL_ENOMEM,
 * JL_ETOOLONG (a channel's max_len is below what its messages need); *par is
 * untouched on error. */
int jl_par_init(jl_par *par, jl_imm *imm, const jl_par_config *config,
                unsigned char *buf, int cap, int *status, jl_real *z);

/* The same for a constant-gain IMM: cap >= JL_PAR_CG_BUF(M, axes), z [axes].
 * Also returns JL_ECHAIN for an all-reduce, which it cannot have. */
int jl_par_init_cg(jl_par *par, jl_cgimm *cg, const jl_par_config *config,
                   unsigned char *buf, int cap, int *status, jl_real *z);

/* Serve until the host says stop: first all PEs tell PE0 that they are ready,
 * and PE0 tells them and the host that all are; then step after step.  A
 * measurement that cannot be used (not of the model's size, not finite, without
 * a gate also beyond JL_LARGE, a number or a time that goes back) is refused:
 * the host is told why.  scratch [JL_IMM_SCRATCH(M, n, m)], of a jl_cgimm
 * [3 axes], for all three calls; `prepare` may use it too.
 * Returns JL_OK after a stop, JL_EMODEL (the fingerprints differ), or the error
 * of the channel that failed, here or at another PE: par->failed_pe says to
 * which PE, the one that is to blame as far as this PE was told. */
int jl_par_serve(jl_par *par, jl_real *scratch);

/* One step, when the measurement is already on every PE and every PE calls
 * this: returns on all of them that own modes the same JL_OK or code of the
 * first mode that failed, as jl_imm_step, or JL_ECHAIN (an all-reduce and a
 * chain that is not sticky), JL_EGATE (an all-reduce and a gate: a PE's pool
 * would depend on the verdict of all); or the error of the channel that failed.
 * The combined estimate is computed on PE0 (on the others call jl_imm_combine;
 * an all-reduce computes it on all, and jl_imm_combine is of no use); that of a
 * jl_cgimm on all.  Of nis,
 * nu and nis_mean a PE knows those of its own modes.
 * After the error of a channel the PEs may differ: the run is over. */
int jl_par_step(jl_par *par, const jl_meas *meas, jl_real *scratch);

/* Mix and predict the own modes before the next measurement is there: unless
 * `prepare` then changes the model, the next step is the shorter for it.
 * Optional, and of no influence on any result. */
void jl_par_ahead(jl_par *par, jl_real *scratch);

#ifdef __cplusplus
}
#endif
#endif
