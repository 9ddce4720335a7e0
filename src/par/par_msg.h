/* Messages between the host and the PEs, and among the PEs.
 *
 * Each begins with a header of 8 octets: type, an octet and a 16-bit number
 * whose meaning depends on the type, and a 32-bit number; then reals.
 *
 *     type       octet  16 bits     32 bits      then
 *     READY      pe     npe         fingerprint
 *     MEAS       first  m; 0: lost  seq          dt, z [m]
 *     MODES      pe     count       seq          status (16 bits) [count],
 *                                                l [count], (x, P packed)
 *     ESTIMATE   verdict -status    seq          loglik, x, P packed, mu [M];
 *                                                nothing if status is not 0
 *     STOP       -      -           -
 *     FAULT      culprit  -status   -
 *     CG_MODES, CG_ESTIMATE         of a constant-gain IMM (below)
 *
 * What is marked - is 0.  READY bears the PE that its numbers are of: a PE
 * passes on those that differ from its own.  MODES lists, in index order, the
 * modes of the PEs whose blocks the hop carries; (x, P) follow of each mode, or,
 * in an all-reduce, the pool of each PE, at the place of its first mode; P as
 * the form keeps it, covariance or factor.  Bit 15 of a status says that the
 * measurement is outside the mode's gate: then, and if the mode is impossible,
 * (x, P) are predicted only.  The verdict is 0 if the status is not.  FAULT
 * names the PE (npe: the host) that cannot be gone on with.
 *
 * A constant-gain IMM has no P, and in MODES, in the place of l, the axes' sum
 * of (1 - alpha) nu^2, and x as it keeps it: axis by axis p, v T and, of order 3, a T^2 / 2.
 * Types of its own, for an IMM's message may have the same length.
 */
#ifndef JL_PAR_MSG_H
#define JL_PAR_MSG_H

#include "jumplink/par.h"

#if JL_REAL_FLOAT
#define jli_msg_meas jli_msg_meas_f32
#define jli_msg_meas_read jli_msg_meas_read_f32
#define jli_msg_modes jli_msg_modes_f32
#define jli_msg_modes_read jli_msg_modes_read_f32
#define jli_msg_estimate jli_msg_estimate_f32
#define jli_msg_estimate_read jli_msg_estimate_read_f32
#define jli_msg_plain jli_msg_plain_f32
#define jli_put_upper jli_put_upper_f32
#define jli_get_upper jli_get_upper_f32
#define jli_msg_fault_read jli_msg_fault_read_f32
#define jli_par_send jli_par_send_f32
#define jli_par_recv jli_par_recv_f32
#define jli_patience jli_patience_f32
#define jli_par_fault jli_par_fault_f32
#define jli_par_tell_fault jli_par_tell_fault_f32
#define jli_par_ready jli_par_ready_f32
#define jli_par_order jli_par_order_f32
#define jli_par_exchange jli_par_exchange_f32
#define jli_par_bind jli_par_bind_f32
#define jli_pool_own jli_pool_own_f32
#define jli_pool_merge jli_pool_merge_f32
#endif

enum {
    JLI_READY = 1, JLI_MEAS = 2, JLI_MODES = 3, JLI_ESTIMATE = 4, JLI_STOP = 5,
    JLI_FAULT = 6, JLI_CG_MODES = 7, JLI_CG_ESTIMATE = 8
};

#define JLI_MSG_HEADER 8

/* A message of nothing but the header; returns its length. */
int jli_msg_plain(unsigned char *buf, int type, int octet, int number,
                  jl_u32 word);

/* Each writes a message to buf, large enough, and returns its length; each
 * _read returns JL_OK, JL_EMSG (another type, other modes, a mode that has not
 * failed with numbers that are not finite) or JL_ELENGTH. */
int jli_msg_meas(unsigned char *buf, const jl_meas *meas, int m);
int jli_msg_meas_read(jl_meas *meas, jl_real *z, int m,
                      const unsigned char *buf, int len);

int jli_msg_modes(unsigned char *buf, const jl_par *par, const jl_hop *hop);
int jli_msg_modes_read(jl_par *par, const jl_hop *hop,
                       const unsigned char *buf, int len);

/* Of a constant-gain IMM if estimate->P is NULL. */
int jli_msg_estimate(unsigned char *buf, const jl_estimate *estimate, int M,
                     int n);
int jli_msg_estimate_read(jl_estimate *estimate, int M, int n,
                          const unsigned char *buf, int len);

/* The lower half of a covariance is not sent: it mirrors the upper, or, of a
 * factor, is zero.  Return what follows. */
unsigned char *jli_put_upper(unsigned char *p, const jl_real *P, int n);
const unsigned char *jli_get_upper(const unsigned char *p, jl_real *P,
                                   int factored, int n);

/* Whom a FAULT accuses, and of what: JL_OK, JL_EMSG or JL_ELENGTH. */
int jli_msg_fault_read(int *culprit, int *status, int npe,
                       const unsigned char *buf, int len);

#endif
