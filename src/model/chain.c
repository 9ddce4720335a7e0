/* The Markov chain between the modes. */
#include "jumplink/model.h"

#include "base/mathx.h"

/* 1 - exp(-t), with all its digits for small t: t - t^2/2 + t^3/6 - ... */
static jl_real one_minus_exp(jl_real t)
{
    jl_real s = 1;
    int k;

    if (t > JL_C(0.5))
        return 1 - jl_exp(-t);
    for (k = 16; k > 1; k--)
        s = 1 - t / (jl_real)k * s;
    return t * s;
}

int jl_chain_sojourn(jl_real *Pi, const jl_real *sojourn_s, int M,
                     jl_real dt)
{
    int i, j;

    if (M < 1 || M > JL_MAX_MODES)
        return JL_EDIM;
    if (!jli_finite(dt) || !jl_vec_within(sojourn_s, M, JL_REAL_MAX))
        return JL_ENONFINITE;
    if (dt < 0)
        return JL_ETIME;
    for (i = 0; i < M; i++)
        if (sojourn_s[i] <= 0)
            return JL_ERANGE;
    for (i = 0; i < M; i++) {
        jl_real leave = M > 1 ? one_minus_exp(dt / sojourn_s[i]) : 0;

        for (j = 0; j < M; j++)
            Pi[i * M + j] = i == j ? 1 - leave : leave / (jl_real)(M - 1);
    }
    return JL_OK;
}

static int distribution(const jl_real *p, int M)
{
    jl_real sum = 0;
    int i;

    if (!jl_vec_within(p, M, JL_REAL_MAX))
        return JL_ENONFINITE;
    for (i = 0; i < M; i++) {
        if (p[i] < 0)
            return JL_EPROB;
        sum += p[i];
    }
    return jli_abs(sum - 1) <= JL_PROB_TOLERANCE
        + 2 * (jl_real)M * JL_EPSILON ? JL_OK : JL_EPROB;
}

int jl_chain_check(const jl_real *Pi, const jl_real *mu, int M)
{
    int i, status = mu != NULL ? distribution(mu, M) : JL_OK;

    for (i = 0; Pi != NULL && i < M && status == JL_OK; i++)
        status = distribution(Pi + i * M, M);
    return status;
}
