/* Gates: measurements that are not believed. */
#include "kf/kf_gate.h"

#include "mat/mat_k.h"

int jl_kf_gate(jl_kf *kf, jl_real nis, int most)
{
    if (!(nis >= 0 && nis <= JL_REAL_MAX) || most < 0)
        return JL_ERANGE;
    kf->gate = nis;
    kf->most = most;
    return JL_OK;
}

/* Beyond any gate: the sum overflowed, or infinities met on the way to it. */
static void set_infinite(jl_innovation *innovation)
{
    innovation->nis = -jl_log(0);
    innovation->loglik = jl_log(0);
}

int jli_gated_update(jl_real *x, jl_real *P, jl_innovation *innovation,
                     const jl_kf_form *form, const jl_mode *mode,
                     const jl_real *xp, const jl_real *Pp, const jl_real *z,
                     jl_real gate, jl_real *scratch)
{
    int m = mode->m, status;

    if (gate > 0 && !jl_vec_within(z, m, JL_LARGE)
        && jl_vec_within(z, m, JL_REAL_MAX)) {
        jli_copy(innovation->nu, z, m);         /* h(x-) is little beside it */
        set_infinite(innovation);
        return JL_OK;
    }
    innovation->nis = innovation->loglik = 0;
    status = form->update(x, P, innovation, mode, xp, Pp, z, scratch);
    if (status != JL_ENONFINITE || !(gate > 0) || innovation->nis <= gate)
        return status;
    if (!(innovation->nis <= JL_REAL_MAX))
        set_infinite(innovation);
    return JL_OK;
}
