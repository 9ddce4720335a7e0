/* Gates: measurements that are not believed. */
#include "kf/kf_form.h"

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

int jli_beyond_gate(jl_innovation *innovation, const jl_real *z, jl_real gate,
                    int m)
{
    if (!jl_vec_within(z, m, JL_LARGE)) {
        if (!jl_vec_within(z, m, JL_REAL_MAX))
            return JL_ENONFINITE;
        jli_copy(innovation->nu, z, m);         /* h(x-) is little beside it */
        set_infinite(innovation);
        return JL_OK;
    }
    if (innovation->nis <= gate)
        return JL_ENONFINITE;
    if (!(innovation->nis <= JL_REAL_MAX))
        set_infinite(innovation);
    return JL_OK;
}
