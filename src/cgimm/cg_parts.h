/* What the files of the constant-gain IMM share. */
#ifndef JL_CG_PARTS_H
#define JL_CG_PARTS_H

#include "base/cc.h"
#include "jumplink/cgimm.h"

#if JL_REAL_FLOAT
#define jli_cg_stable jli_cg_stable_f32
#define jli_pair_foresee jli_pair_foresee_f32
#define jli_pair_mix jli_pair_mix_f32
#define jli_pair_weigh jli_pair_weigh_f32
#define jli_pair_combine jli_pair_combine_f32
#define jli_pair_step jli_pair_step_f32
#endif

/* What may come next in a step under way. */
enum {
    JLI_CG_IDLE = 0, JLI_CG_MIXED = 1, JLI_CG_FILTERED = 2
};

/* 1 if w [order] are the gains of a stable filter with 0 < alpha < 1. */
int jli_cg_stable(const jl_real *w, int order);

/* --- the usual pair, of order 2 and order 3 (cg_pair.c) ------------------- */

void jli_pair_foresee(jl_cgimm *cg);
void jli_pair_mix(jl_cgimm *cg, int j);
void jli_pair_weigh(jl_cgimm *cg);
void jli_pair_combine(jl_cgimm *cg);

/* A whole step; gains steady, z not NULL. */
void jli_pair_step(jl_cgimm *cg, const jl_real *z);

/* --- for any modes ------------------------------------------------------- */

/* Correct an axis' prediction x, whose position is given less `base`, by z:
 * x = x- + w nu, of which the position is z - (1 - alpha) nu.
 * Returns (1 - alpha) nu^2 = R nu^2 / S. */
JL_INLINE jl_real jli_cg_correct(jl_real *x, int order, jl_real base,
                                 jl_real z, const jl_real *w, jl_real keep)
{
    const jl_real nu = (z - base) - x[0], left = keep * nu;

    x[0] = z - left;
    x[1] += w[1] * nu;
    if (order == 3)
        x[2] += w[2] * nu;
    return left * nu;
}

/* -nu' nu / 2 S of a mode's sum, however far off. */
JL_INLINE jl_real jli_cg_loglik(const jl_cgimm *cg, jl_real sum)
{
    const jl_real l = cg->h * sum;

    if (l >= -JL_REAL_MAX)
        return l;
    return -JL_REAL_MAX;
}

/* Weights become mu, their sum 1. */
JL_INLINE void jli_cg_weights_are_mu(jl_cgimm *cg)
{
    int j;

    for (j = 0; j < cg->M; j++)
        cg->weight[j] = cg->mu[j];
    cg->all_left = 1;
}

/* End a weighing: the new weights add up to `all`, to be multiplied by mode
 * `best`'s likelihood, of the sum `sum`.  The next step need not wait for the
 * division that makes mu of them: only where the sum has gone far from 1 they
 * become mu. */
JL_INLINE void jli_cg_weighed(jl_cgimm *cg, jl_real all, int best,
                              jl_real sum)
{
    cg->best = best;
    cg->best_sum = sum;
    cg->all_before = cg->all_left;
    cg->all = cg->all_left = all;
    if (!(all >= JL_C(0.0009765625) && all <= 2))
        jli_cg_weights_are_mu(cg);
}

#endif
