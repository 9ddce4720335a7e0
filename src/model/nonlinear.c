/* Modes given by functions. */
#include "jumplink/model.h"

#include "mat/mat_k.h"

void jl_mode_nonlinear(jl_mode *mode, const jl_nonlinear *nonlinear)
{
    mode->nonlinear = nonlinear;
    mode->move = nonlinear != NULL ? jl_mode_move : NULL;
    mode->sense = nonlinear != NULL ? jl_mode_sense : NULL;
}

/* J [rows,n] of a function by central differences, whose error falls with the
 * step's square while rounding grows with its inverse: eps^(1/3) balances. */
#if JL_REAL_FLOAT
#define STEP JL_C(4.9e-3)
#else
#define STEP JL_C(6.1e-6)
#endif

typedef int (*function)(jl_real *y, const jl_real *x, void *context);

static void plain_difference(jl_real *d, const jl_real *a, const jl_real *b,
                             int n)
{
    int i;

    for (i = 0; i < n; i++)
        d[i] = a[i] - b[i];
}

/* scratch [n + 2 rows]; residual may be NULL */
static int differences(jl_real *J, function of, const jl_nonlinear *nonlinear,
                       void (*residual)(jl_real *d, const jl_real *a,
                                        const jl_real *b, void *context),
                       const jl_real *x, jl_real *scratch, int rows, int n)
{
    jl_real *at = scratch, *up = at + n, *down = up + rows;
    int i, a, status;

    jli_copy(at, x, n);
    for (i = 0; i < n; i++) {
        jl_real size = jli_abs(x[i]) > 1 ? jli_abs(x[i]) : 1, above, below;

        above = at[i] = x[i] + STEP * size;
        status = of(up, at, nonlinear->context);
        if (status != JL_OK)
            return status;
        below = at[i] = x[i] - STEP * size;
        status = of(down, at, nonlinear->context);
        if (status != JL_OK)
            return status;
        at[i] = x[i];
        if (residual != NULL)
            residual(up, up, down, nonlinear->context);
        else
            plain_difference(up, up, down, rows);
        for (a = 0; a < rows; a++)
            J[a * n + i] = up[a] / (above - below);
    }
    return JL_OK;
}

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
    status = nl->f(xp, x, nl->context);
    if (status == JL_OK && F != NULL)
        status = nl->jacobian_f != NULL ? nl->jacobian_f(F, x, nl->context)
            : differences(F, nl->f, nl, NULL, x, scratch, n, n);
    for (i = 0; i < n; i++)
        xp[i] += mode->u[i];
    return status;
}

int jl_mode_sense(jl_real *nu, jl_real *H, const jl_mode *mode,
                  const jl_real *z, const jl_real *x, jl_real *scratch)
{
    const jl_nonlinear *nl = mode->nonlinear;
    int n = mode->n, m = mode->m, status = JL_OK;

    if (nl == NULL || nl->h == NULL) {
        jli_apply(nu, mode->H, x, NULL, m, n);
        if (H != NULL)
            jli_copy(H, mode->H, m * n);
    } else {
        status = nl->h(nu, x, nl->context);
        if (status == JL_OK && H != NULL)
            status = nl->jacobian_h != NULL
                ? nl->jacobian_h(H, x, nl->context)
                : differences(H, nl->h, nl, nl->residual, x, scratch, m, n);
    }
    if (status != JL_OK)
        return status;
    if (nl != NULL && nl->residual != NULL)
        nl->residual(nu, z, nu, nl->context);   /* d may be b, too */
    else
        plain_difference(nu, z, nu, m);
    return JL_OK;
}
