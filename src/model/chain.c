/* The Markov chain between the modes. */
#include "jumplink/model.h"

#include "base/mathx.h"

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
        jl_real stay = M > 1 ? jl_exp(-dt / sojourn_s[i]) : 1;

        for (j = 0; j < M; j++)
            Pi[i * M + j] = i == j ? stay : (1 - stay) / (jl_real)(M - 1);
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
    return jli_abs(sum - 1) <= JL_PROB_TOLERANCE ? JL_OK : JL_EPROB;
}

int jl_chain_check(const jl_real *Pi, const jl_real *mu, int M)
{
    int i, status = mu != NULL ? distribution(mu, M) : JL_OK;

    for (i = 0; Pi != NULL && i < M && status == JL_OK; i++)
        status = distribution(Pi + i * M, M);
    return status;
}
