/* Messages between the host and the PEs, and among the PEs.
 *
 * Each begins with a header of 8 octets: type, an octet and a 16-bit number
 * whose meaning depends on the type, and a 32-bit number; then reals.
 *
 *     type       octet  16 bits     32 bits      then
 *     READY      pe     npe         fingerprint
 *     MEAS       first  m; 0: lost  seq          dt, z [m]
 *     MODES      pe     count       seq          status (16 bits) [count],
 *                                                (l, x, P packed) [count]
 *     ESTIMATE   -      -status     seq          loglik, x, P packed, mu [M];
 *                                                nothing if status is not 0
 *     STOP       -      -           -
 *
 * What is marked - is 0.  MODES lists the sender's modes in index order.
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
#define jli_hop_rounds jli_hop_rounds_f32
#define jli_hop_partner jli_hop_partner_f32
#endif

enum {
    JLI_READY = 1, JLI_MEAS = 2, JLI_MODES = 3, JLI_ESTIMATE = 4, JLI_STOP = 5
};

#define JLI_MSG_HEADER 8

/* A message of nothing but the header; returns its length. */
int jli_msg_plain(unsigned char *buf, int type, int octet, int number,
                  jl_u32 word);

/* Each writes a message to buf, large enough, and returns its length; each
 * _read returns JL_OK, JL_EMSG (another type, other modes) or JL_ELENGTH. */
int jli_msg_meas(unsigned char *buf, const jl_meas *meas, int m);
int jli_msg_meas_read(jl_meas *meas, jl_real *z, int m,
                      const unsigned char *buf, int len);

int jli_msg_modes(unsigned char *buf, const jl_par *par);
int jli_msg_modes_read(jl_par *par, int pe, const unsigned char *buf,
                       int len);

int jli_msg_estimate(unsigned char *buf, const jl_imm *imm, jl_u32 seq,
                     int status);
int jli_msg_estimate_read(jl_estimate *estimate, int M, int n,
                          const unsigned char *buf, int len);

/* The exchange's order: whom PE pe meets in round r of a tournament of n PEs in
 * which each meets each once, or -1: nobody.  In a meeting the PE of lower
 * index sends first. */
int jli_hop_rounds(int n);
int jli_hop_partner(int n, int pe, int r);

#endif
