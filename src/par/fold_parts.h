/* What the files of the folded MEKF share.
 *
 * Messages have the header of par_msg.h:
 *
 *     type      octet  16 bits   32 bits  then
 *     PRODUCTS  pe     -status   seq      of each state of this PE and those
 *                                         behind it: its row of U F'; if it is
 *                                         one of x, of U1 f'; with spread, of
 *                                         U J'.  Nothing if status is not 0
 *     ARRAYS    which  -         seq      of A, B, if `which` has it: -status
 *                                         (16 bits); S, nu, x, the rows that
 *                                         are left; nothing if its status or
 *                                         that of one before it is not 0
 *     VERDICT   which  -status   seq      x of A, B; nothing if status is not 0
 *     STOP, FAULT                         as in par_msg.h
 */
#ifndef JL_FOLD_PARTS_H
#define JL_FOLD_PARTS_H

#include "jumplink/fold.h"
#include "mekf/mekf_parts.h"
#include "par/par_parts.h"

#if JL_REAL_FLOAT
#define jli_fold_send jli_fold_send_f32
#define jli_fold_recv jli_fold_recv_f32
#define jli_fold_fault jli_fold_fault_f32
#define jli_fold_tell_fault jli_fold_tell_fault_f32
#define jli_fold_receive jli_fold_receive_f32
#define jli_fold_begin jli_fold_begin_f32
#define jli_fold_pass_products jli_fold_pass_products_f32
#define jli_fold_choose jli_fold_choose_f32
#define jli_fold_pass_stop jli_fold_pass_stop_f32
#define jli_fold_round jli_fold_round_f32
#define jli_fold_own_rows jli_fold_own_rows_f32
#define jli_fold_states jli_fold_states_f32
#define jli_fold_border jli_fold_border_f32
#define jli_fold_shape jli_fold_shape_f32
#define jli_fold_products_join jli_fold_products_join_f32
#define jli_fold_products_read jli_fold_products_read_f32
#define jli_fold_products_take jli_fold_products_take_f32
#define jli_fold_products jli_fold_products_f32
#define jli_fold_arrays jli_fold_arrays_f32
#define jli_fold_arrays_read jli_fold_arrays_read_f32
#define jli_fold_verdict jli_fold_verdict_f32
#define jli_fold_verdict_read jli_fold_verdict_read_f32
#endif

enum { JLI_PRODUCTS = 16, JLI_ARRAYS = 17, JLI_VERDICT = 18 };

/* `which` */
enum {
    JLI_A = 1, JLI_B = 2,
    JLI_MEASURED = 4,           /* r is not 0                               */
    JLI_MORE = 8                /* B comes after this verdict               */
};

/* Both filters in a step: A is 0, B is 1. */
struct jli_folded {
    struct jli_linear l;
    struct jli_array array[2];
    struct jli_feed feed[2];
    jl_real *mem[2];            /* of the arrays                            */
    jl_real *cc;                /* [r,n]                                    */
    int which;
    int status[2];
};

/* The states [*first, *end) whose rows PE pe owns. */
void jli_fold_states(const jl_fold *fold, int pe, int *first, int *end);

/* The first row of filter i that PE pe owns, in an array with a->r. */
int jli_fold_border(const jl_fold *fold, const struct jli_array *a, int i,
                    int pe);

/* --- fold_msg.c ----------------------------------------------------------- */

/* Sizes of both arrays with r measurements or 0. */
void jli_fold_shape(struct jli_folded *w, const jl_fold *fold, int r);

/* Each writes a message into the buffer's first half and returns its length.
 * Each _read has one [len] in the second half and returns JL_OK, JL_EMSG or
 * JL_ELENGTH. */

/* The own products. */
int jli_fold_products(const jl_fold *fold, const struct jli_folded *w);

/* ... [own], and behind them those that came [len, 0: none]; or the status. */
int jli_fold_products_join(const jl_fold *fold, int own, int status, int len);

int jli_fold_products_read(int *status, const jl_fold *fold, int len);

/* The products [len] into the arrays, whose rows for them begin at row r. */
void jli_fold_products_take(const jl_fold *fold, struct jli_folded *w,
                            int len);

int jli_fold_arrays(const jl_fold *fold, const struct jli_folded *w);
int jli_fold_arrays_read(struct jli_folded *w, const jl_fold *fold, int len);

int jli_fold_verdict(const jl_fold *fold, const struct jli_folded *w,
                     int status);
int jli_fold_verdict_read(int *status, struct jli_folded *w,
                          const jl_fold *fold, int len);

/* --- fold_phases.c -------------------------------------------------------- */

/* Those that return a status: JL_OK, or the error of a channel, unless
 * something else is said; what goes wrong in the filter is w->status. */

/* The products of the PEs behind into the buffer [*len, none: 0]; *status: what
 * they report. */
int jli_fold_receive(jl_fold *fold, int *status, int *len);

/* PE0 makes the arrays of its own products and the others'; or, in place of
 * them, there is a status that is not JL_OK. */
int jli_fold_begin(jl_fold *fold, struct jli_folded *w, const jl_real *z,
                   int status);

/* The other PEs pass products on, and wait for PE0 as long as it takes. */
int jli_fold_pass_products(jl_fold *fold, const struct jli_folded *w,
                           int status);

/* PE0: c of B and what it makes of B's array; returns B's status. */
int jli_fold_choose(const jl_fold *fold, struct jli_folded *w,
                    const jl_real *z);

/* PE0 says, or another passes on, that there are no more steps. */
int jli_fold_pass_stop(jl_fold *fold);

/* Arrays down, verdict up; `first` of a step.  Also returns JL_FOLD_OVER. */
int jli_fold_round(jl_fold *fold, struct jli_folded *w, int first,
                   int *verdict);

/* How many rows of filter i's triangle this PE owns. */
int jli_fold_own_rows(const jl_fold *fold, const struct jli_folded *w, int i);

/* --- fold_chain.c --------------------------------------------------------- */

/* A message of the buffer's first half to a neighbour; one into the second
 * half, whose length is returned.  Else a code that is also in fold->failed. */
int jli_fold_send(jl_fold *fold, int pe, int len, long timeout_us);
int jli_fold_recv(jl_fold *fold, int pe, long timeout_us, int level);

int jli_fold_fault(jl_fold *fold, int pe, int status);
void jli_fold_tell_fault(jl_fold *fold);

#endif
