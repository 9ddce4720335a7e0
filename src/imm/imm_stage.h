/* What the files of the IMM share. */
#ifndef JL_IMM_STAGE_H
#define JL_IMM_STAGE_H

#include "jumplink/imm.h"

#include "base/cc.h"

/* What may come next: JLI_FAILED ends a step of which a mode has failed. */
enum {
    JLI_IDLE = 0, JLI_MIXED = 1, JLI_FILTERED = 2, JLI_JUDGED = 3,
    JLI_FAILED = 4
};

/* Probabilities above this are summed as they are: terms of such a sum that
 * have underflowed are below eps^2 of it.  Sums below it, zero included, are
 * formed from logarithms, which are kept of those alone (0 for the others). */
#define JLI_SMALL (JL_REAL_MIN / JL_EPSILON / JL_EPSILON)

JL_INLINE jl_real jli_log_of(jl_real p, jl_real log_p)
{
    return p > JLI_SMALL ? jl_log(p) : log_p;
}

#if JL_REAL_FLOAT
#define jli_log_sum_exp jli_log_sum_exp_f32
#define jli_weights jli_weights_f32
#define jli_log_weight jli_log_weight_f32
#define jli_imm_update jli_imm_update_f32
#define jli_check_sizes jli_check_sizes_f32
#define jli_own_states jli_own_states_f32
#define jli_all_states jli_all_states_f32
#endif

/* log sum exp of v [n], any of which may be -infinity; v is overwritten with
 * exp(v - max), *sum is the sum of those. */
jl_real jli_log_sum_exp(jl_real *v, int n, jl_real *sum);

/* Of the modes that are a PE's (owner NULL: of all), 0 for the others:
 *     e_j = c_j exp(l_j - *best),  *sum = sum e_j
 * or, if that is below eps^2, as many times more as makes the largest e_j 1:
 * so e_j has all digits where e_j / *sum is above JLI_SMALL, and no logarithm
 * is kept.  Returns the log of the former sum.  *best is the largest l_j of
 * those that are possible: differences to it keep the digits of c, however large a
 * likelihood's logarithm is; after an outlier of 1e5 sigma that is 1e10. */
jl_real jli_weights(jl_imm *imm, const unsigned char *owner, int pe,
                    jl_real *best, jl_real *sum);

/* log of c_j exp(l_j - best) */
jl_real jli_log_weight(const jl_imm *imm, int j, jl_real best);

/* 1 if mode j can be entered. */
JL_INLINE int jli_is_possible(const jl_imm *imm, int j)
{
    return imm->logc[j] >= -JL_REAL_MAX;
}

/* Update mode j in xw, Pw.  With a gate, a mode outside it stays as it is, until
 * all know that the measurement is accepted; so does one that is impossible, and
 * has no say. */
int jli_imm_update(jl_imm *imm, int j, const jl_real *z, jl_real gate,
                   jl_real *scratch);

/* --- modes of different states (imm_sizes.c) ------------------------------ */

#define JLI_LACKS(imm, j) ((imm)->modes[j].n < (imm)->n)

/* What jl_imm_init_sizes is given: JL_OK, JL_EDIM, or a prior's code. */
int jli_check_sizes(int M, int n, const jl_mode *modes,
                    const int *const *map, const jl_real *prior_x,
                    const jl_real *prior_var, const jl_kf_form *form);

/* Of a mode that lacks components: what it has of (x, P), into (own_x, own_P),
 * scratch [n]; and all n again, with the prior of what it lacks. */
void jli_own_states(jl_real *own_x, jl_real *own_P, const jl_imm *imm, int j,
                    const jl_real *x, const jl_real *P, jl_real *scratch);
void jli_all_states(jl_real *x, jl_real *P, const jl_imm *imm, int j,
                    const jl_real *own_x, const jl_real *own_P);

#endif
