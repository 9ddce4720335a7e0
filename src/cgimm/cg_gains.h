/* What the files of the constant-gain IMM share. */
#ifndef JL_CG_GAINS_H
#define JL_CG_GAINS_H

#include "jumplink/cgimm.h"

#if JL_REAL_FLOAT
#define jli_cg_stable jli_cg_stable_f32
#endif

/* 1 if w [order] are the gains of a stable filter with 0 < alpha < 1. */
int jli_cg_stable(const jl_real *w, int order);

/* What may come next in a step under way. */
enum {
    JLI_CG_IDLE = 0, JLI_CG_MIXED = 1, JLI_CG_FILTERED = 2
};

#endif
