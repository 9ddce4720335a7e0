/* What the files of the constant-gain IMM share. */
#ifndef JL_CG_GAINS_H
#define JL_CG_GAINS_H

#include "base/cc.h"
#include "jumplink/cgimm.h"

#if JL_REAL_FLOAT
#define jli_cg_stable jli_cg_stable_f32
#define jli_pair_step jli_pair_step_f32
#define jli_pair_combine jli_pair_combine_f32
#endif

/* 1 if w [order] are the gains of a stable filter with 0 < alpha < 1. */
int jli_cg_stable(const jl_real *w, int order);

/* l, however far off. */
JL_INLINE jl_real jli_cg_bounded(jl_real l)
{
    if (l >= -JL_REAL_MAX)
        return l;
    return -JL_REAL_MAX;
}

/* --- two modes, of order 2 and of order 3 (cg_pair.c) --------------------- */

/* A whole step, gains steady, z not NULL; and its last stage. */
void jli_pair_step(jl_cgimm *cg, const jl_real *z);
void jli_pair_combine(jl_cgimm *cg);

/* What may come next in a step under way. */
enum {
    JLI_CG_IDLE = 0, JLI_CG_MIXED = 1, JLI_CG_FILTERED = 2
};

#endif
