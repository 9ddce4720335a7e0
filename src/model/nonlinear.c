/* Modes given by functions. */
#include "jumplink/model.h"

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

/* What a function of the mode's returned, and v [n], what it computed: a form
 * that keeps factors must never see what is not finite. */
static int checked(int status, const jl_real *v, int n)
{
    JL_ASSERT(status <= JL_OK);
    if (status != JL_OK)
        return status;
    return jl_vec_within(v, n, JL_LARGE) ? JL_OK : JL_ENONFINITE;
}

static void plain_difference(jl_real *d, const jl_real *a, const jl_real *b,
                             int n)
{
    int i;

    for (i = 0; i < n; i++)
        d[i] = a[i] - b[i];
}

/* --- Jacobians ----------------------------------------------------------- */

/* The error of central differences falls with the square of their step, that of
 * rounding grows with its inverse: eps^(1/3) balances them. */
#if JL_REAL_FLOAT
#define STEP JL_C(4.918e-3)
#else
#define STEP JL_C(6.055e-6)
#endif

typedef int (*function)(jl_real *y, const jl_real *x, void *context);
typedef void (*difference)(jl_real *d, const jl_real *a, const jl_real *b,
                           void *context);

/* J [rows,n] of a function at x; residual may be NULL; scratch [n + 2 rows] */
static int differences(jl_real *J, function of, difference residual,
                       void *context, const jl_real *x, jl_real *scratch,
                       int rows, int n)
{
    jl_real *at = scratch, *up = at + n, *down = up + rows;
    int i, a, status;

    jli_copy(at, x, n);
    for (i = 0; i < n; i++) {
        jl_real step = STEP * (jli_abs(x[i]) > 1 ? jli_abs(x[i]) : 1);
        jl_real above = x[i] + step, below = x[i] - step;

        at[i] = above;
        status = checked(of(up, at, context), up, rows);
        if (status != JL_OK)
            return status;
        at[i] = below;
        status = checked(of(down, at, context), down, rows);
        if (status != JL_OK)
            return status;
        at[i] = x[i];
        if (residual != NULL)
            residual(up, up, down, context);
        else
            plain_difference(up, up, down, rows);
        for (a = 0; a < rows; a++)
            J[a * n + i] = up[a] / (above - below);
    }
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
    status = checked(nl->f(xp, x, nl->context), xp, n);
    if (status != JL_OK)
        return status;
    for (i = 0; i < n; i++)
        xp[i] += mode->u[i];
    if (F == NULL)
        return JL_OK;
    status = nl->jacobian_f != NULL ? nl->jacobian_f(F, x, nl->context)
        : differences(F, nl->f, NULL, nl->context, x, scratch, n, n);
    return checked(status, F, n * n);
}

int jl_mode_sense(jl_real *nu, jl_real *H, const jl_mode *mode,
                  const jl_real *z, const jl_real *x, jl_real *scratch)
{
    const jl_nonlinear *nl = mode->nonlinear;
    int n = mode->n, m = mode->m, status;

    if (nl == NULL || nl->h == NULL) {
        jli_apply(nu, mode->H, x, NULL, m, n);
        if (H != NULL)
            jli_copy(H, mode->H, m * n);
    } else {
        status = checked(nl->h(nu, x, nl->context), nu, m);
        if (status == JL_OK && H != NULL) {
            status = nl->jacobian_h != NULL
                ? nl->jacobian_h(H, x, nl->context)
                : differences(H, nl->h, nl->residual, nl->context, x,
                              scratch, m, n);
            status = checked(status, H, m * n);
        }
        if (status != JL_OK)
            return status;
    }
    if (nl != NULL && nl->residual != NULL)
        nl->residual(nu, z, nu, nl->context);
    else
        plain_difference(nu, z, nu, m);
    return jl_vec_within(nu, m, JL_REAL_MAX) ? JL_OK : JL_ENONFINITE;
}
