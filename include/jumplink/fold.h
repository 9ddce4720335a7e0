/* The MEKF (mekf.h) folded onto processing elements (PEs) joined in a chain:
 * PE p owns a block of consecutive rows of both triangles of the systolic array
 * and talks to PEs p - 1 and p + 1 only.
 *
 * The left triangle (filter A) has the rows 0 .. r+n+m-1: r of V', then one for
 * each state and parameter; the right one (B) r + n.  PE p owns rows
 * rows[p] .. rows[p+1]-1 of the left one, and of the right one those with the
 * same numbers: its borders are the left one's, cut off at r + n.  So what
 * belongs to a state is on one PE in both filters.
 *
 * A step has three phases, each one message a link:
 *     up    multiply: a PE makes the products U F', U1 f' of its rows of U, U1,
 *           and adds them to those of the PEs behind it.  PE0 makes the whole
 *           arrays of them, with H, G, c.
 *     down  QR and Faddeev: a PE makes its rows of the triangles; what is left
 *           of the arrays, right of its last column and without the rows it
 *           has kept, goes on, and with it the Faddeev row [nu' | x'] and the
 *           diagonal of V V' so far.  Rows, never rotations.
 *     up    the last PE's verdict, and the estimates: all commit, or none.
 * With JL_MEKF_FILT the right triangle's c is known only then: down and up
 * again for B.
 *
 * The rows meet each other as in jl_mekf_step, by the same code: the same bits
 * for any number of PEs, any borders, any transport.
 *
 * What it is for: to run the array's data flow, counted, on real PEs; not for
 * speed.  All PEs multiply at once, while PE0 waits for its measurement; but as
 * a phase is one message, a PE begins its rotations when the one before it has
 * done.  Every PE has the memory of a whole filter.
 *
 * Octets of the messages on the link at left row b, with o octets a real,
 * N = n + m, p = p1 + p2, b1 = min(b, r+n); s = 1, q = N with `spread`, else 0:
 *     up    8 + o sum over states k >= max(b - r, 0) of (N + n [k < n] + s n)
 *     down  8 + 4 + o ((r+N+p - b)(r+N - b) + 2 max(r - b, 0) + N
 *                      + (r+n+p1+q - b1)(r+n - b1) + 2 max(r - b1, 0) + n)
 *     up    8 + o (N + n)
 * Without a measurement r = 0 and b less by r; JL_MEKF_FILT: 8 more down and 8
 * more up.  For (n,m,r) = (8,4,4), p1 = 8,
 * p2 = 4, o = 8, rows 0 4 6 9 16:
 *     link      up    down   up    all three
 *     0 - 1    1672   3500   168   5340
 *     1 - 2    1352   2604   168   4124
 *     2 - 3     872   1500   168   2540
 */
#ifndef JL_FOLD_H
#define JL_FOLD_H

#include "base.h"
#include "chan.h"
#include "mekf.h"
#include "wire.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct jl_fold_config {
    int pe, npe;                /* which of how many: 0 <= pe < npe         */
    const int *rows;            /* [npe+1] borders, 0 = rows[0] <= rows[1]
                                   .. <= rows[npe] = r+n+m; a PE may own
                                   none                                     */
    jl_chan *to_prev;           /* to and from PE pe - 1; not used by PE0   */
    jl_chan *from_prev;
    jl_chan *to_next;           /* ... PE pe + 1; not used by the last      */
    jl_chan *from_next;
    long timeout_us;            /* longest wait for each message, an eighth
                                   more for each that must come before it,
                                   or JL_FOREVER; the others wait for PE0's
                                   next step without limit                  */
} jl_fold_config;

typedef struct jl_fold {
    jl_fold_config config;
    jl_mekf *filter;
    jl_u32 seq;                 /* steps                                    */
    int failed;                 /* JL_OK, or the error of a channel         */
    int failed_pe;              /* ... to or from this PE                   */
    unsigned char *buf;         /* [cap]                                    */
    int cap;
} jl_fold;

/* Octets of the longest message, a bound; of a PE's buffer: a message out and
 * one in; reals of scratch. */
#define JL_FOLD_MSG(n, m, r, p1, p2) \
    (12 + (JL_MEKF_ARRAY(n, m, r, p1, p2) + JL_MEKF_ARRAY_B(n, m, r, p1) \
           + 4 * (r) + 2 * (n) + (m) + (n) * (m)) * JL_REAL_OCTETS)
#define JL_FOLD_BUF(n, m, r, p1, p2) (2 * JL_FOLD_MSG(n, m, r, p1, p2))
#define JL_FOLD_SCRATCH(n, m, r, p1, p2) \
    (JL_MEKF_SCRATCH(n, m, r, p1, p2) + 2 * (r))

/* Borders that give every PE about the same work of rotations.
 * rows [npe+1], 1 <= npe <= JL_MAX_PES */
void jl_fold_deal(int *rows, int npe, const jl_mekf_model *model);

/* Bind a PE's part to its filter and memory, which outlive it, as does
 * config->rows.  Every PE has a filter of the same model, c, spread and state
 * (jl_mekf_init, _set); of its U, U1 those rows are brought up to date that the
 * PE owns, x and xhat on all.  buf [cap] octets, cap >= JL_FOLD_BUF.
 * Returns JL_OK, JL_EDIM (pe, npe, rows), JL_ENOMEM, JL_ETOOLONG (a channel's
 * max_len is below JL_FOLD_MSG); *fold is untouched on error. */
int jl_fold_init(jl_fold *fold, jl_mekf *filter, const jl_fold_config *config,
                 unsigned char *buf, int cap);

/* A step on every PE.  z [r], or NULL: no measurement; PE0's counts, the
 * others' is not looked at.  f, h, G, df, dh are called on every PE, c and dc
 * on PE0.  scratch [JL_FOLD_SCRATCH]
 * Returns, on all PEs the same, JL_OK or jl_mekf_step's code, the filter being
 * unchanged then; or JL_FOLD_OVER, when PE0 has called jl_fold_stop; or the
 * error of a channel (JL_EMSG, JL_ELENGTH: a message that does not belong
 * here), with fold->failed and failed_pe: the run is over, and the PEs may
 * differ by a step. */
#define JL_FOLD_OVER 1
int jl_fold_step(jl_fold *fold, const jl_real *z, jl_real *scratch);

/* PE0: no more steps.  Returns JL_OK, or the error of a channel. */
int jl_fold_stop(jl_fold *fold);

#ifdef __cplusplus
}
#endif
#endif
