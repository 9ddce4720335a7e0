/* The form joseph, for any size. */
#include "kf/kf_k.h"

static int predict(jl_real *xp, jl_real *Pp, const jl_mode *mode,
                   const jl_real *x, const jl_real *P, jl_real *scratch)
{
    return jli_kf_predict(xp, Pp, mode, x, P, scratch, mode->n);
}

static int update(jl_real *x, jl_real *P, jl_innovation *innovation,
                  const jl_mode *mode, const jl_real *xp, const jl_real *Pp,
                  const jl_real *z, jl_real *scratch)
{
    return jli_kf_update_joseph(x, P, innovation, mode, xp, Pp, z, scratch,
                                mode->n, mode->m);
}

const jl_kf_form jl_kf_joseph = { predict, update, &jl_cov_full, 0, 0 };
