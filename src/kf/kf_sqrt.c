/* The form sqrt, for any size. */
#include "kf/sqrt_k.h"

static int predict(jl_real *xp, jl_real *Sp, const jl_mode *mode,
                   const jl_real *x, const jl_real *S, jl_real *scratch)
{
    return jli_sqrt_predict(xp, Sp, mode, x, S, scratch, mode->n);
}

static int update(jl_real *x, jl_real *S, jl_innovation *innovation,
                  const jl_mode *mode, const jl_real *xp, const jl_real *Sp,
                  const jl_real *z, jl_real *scratch)
{
    return jli_sqrt_update(x, S, innovation, mode, xp, Sp, z, scratch,
                           mode->n, mode->m);
}

const jl_kf_form jl_kf_sqrt = { predict, update, &jl_cov_ud, 0, 0 };
