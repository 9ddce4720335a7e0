/* What the files of the IMM share. */
#ifndef JL_IMM_STAGE_H
#define JL_IMM_STAGE_H

#include "jumplink/imm.h"

/* What may come next: JLI_FAILED ends a step of which a mode has failed. */
enum { JLI_IDLE = 0, JLI_MIXED = 1, JLI_FILTERED = 2, JLI_FAILED = 3 };

/* Probabilities above this are summed as they are: terms of such a sum that
 * have underflowed are below eps^2 of it.  Sums below it, zero included, are
 * formed from logarithms. */
#define JLI_SMALL (JL_REAL_MIN / JL_EPSILON / JL_EPSILON)

#if JL_REAL_FLOAT
#define jli_log_sum_exp jli_log_sum_exp_f32
#define jli_pool jli_pool_f32
#endif

/* log sum exp of v [n], any of which may be -infinity; v is overwritten with
 * exp(v - max), *sum is the sum of those. */
jl_real jli_log_sum_exp(jl_real *v, int n, jl_real *sum);

/* mean = sum_i w_i x_i, cov = sum_i w_i (P_i + (x_i - mean)(x_i - mean)')
 *     mean [n], cov [n,n], w [M], x [M,n], P [M,n,n], d [n] work          */
void jli_pool(jl_real *mean, jl_real *cov, const jl_real *w,
              const jl_real *x, const jl_real *P, jl_real *d, int M, int n);

#endif
