/* What motion.c needs of singer.c. */
#ifndef JL_SINGER_H
#define JL_SINGER_H

#include "jumplink/model.h"

#if JL_REAL_FLOAT
#define jli_singer jli_singer_f32
#endif

/* One axis of Singer's motion over dt: F [3,3]; W = sum_k q_k N_k' N_k with
 * q [3] and the rows of N [3,3]. */
void jli_singer(jl_real *F, jl_real *N, jl_real *q, const jl_motion *motion,
                jl_real dt);

#endif
