/* Modes given by functions. */
#include "jumplink/model.h"

#include "mat/differences.h"
#include "mat/mat_k.h"

int jl_mode_nonlinear(jl_mode *mode, const jl_nonlinear *nonlinear)
{
    if (nonlinear != NULL
        && !(nonlinear->kappa >= 0 && nonlinear->kappa <= JL_LARGE))
        return JL_ERANGE;
    mode->nonlinear = nonlinear;
    mode->move = nonlinear != NULL ? jl_mode_move : NULL;
    mode->sense = nonlinear != NULL ? jl_mode_sense : NULL;
    return JL_OK;
}

/* --- the two models ------------------------------------------------------ */

int jl_mode_move(jl_real *xp, jl_real *F, const jl_mode *mode,
                 const jl_real *x, jl_real *scratch)
{
    const jl_nonlinear *nl = mode->nonlinear;
    int n = mode->n, i, status;

    if (nl == NULL || nl->f == NULL) {
        jli_apply(xp, mode->F, x, mode->u, n, n);
        if (F != NULL)
            jli_copy(F, mode->F, n * n);
        return JL_OK;
    }
    status = jli_checked(nl->f(xp, x, nl->context), xp, n);
    if (status != JL_OK)
        return status;
    for (i = 0; i < n; i++)
        xp[i] += mode->u[i];
    if (F == NULL)
        return JL_OK;
    status = nl->jacobian_f != NULL ? nl->jacobian_f(F, x, nl->context)
        : jli_differences(F, nl->f, NULL, nl->context, x, scratch, n, n);
    return jli_checked(status, F, n * n);
}

int jl_mode_sense(jl_real *nu, jl_real *H, const jl_mode *mode,
                  const jl_real *z, const jl_real *x, jl_real *scratch)
{
    const jl_nonlinear *nl = mode->nonlinear;
    int n = mode->n, m = mode->m, a, status;

    if (nl == NULL || nl->h == NULL) {
        jli_apply(nu, mode->H, x, NULL, m, n);
        if (H != NULL)
            jli_copy(H, mode->H, m * n);
    } else {
        status = jli_checked(nl->h(nu, x, nl->context), nu, m);
        if (status == JL_OK && H != NULL) {
            status = nl->jacobian_h != NULL
                ? nl->jacobian_h(H, x, nl->context)
                : jli_differences(H, nl->h, nl->residual, nl->context, x,
                              scratch, m, n);
            status = jli_checked(status, H, m * n);
        }
        if (status != JL_OK)
            return status;
    }
    if (nl != NULL && nl->residual != NULL)
        nl->residual(nu, z, nu, nl->context);
    else
        for (a = 0; a < m; a++)
            nu[a] = z[a] - nu[a];
    return jl_vec_within(nu, m, JL_REAL_MAX) ? JL_OK : JL_ENONFINITE;
}
