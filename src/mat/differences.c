/* Jacobians by central differences. */
#include "mat/differences.h"

#include <string.h>

#include "base/mathx.h"

/* The error of central differences falls with the square of their step, that of
 * rounding grows with its inverse: eps^(1/3) balances them. */
#if JL_REAL_FLOAT
#define STEP JL_C(4.918e-3)
#else
#define STEP JL_C(6.055e-6)
#endif

int jli_checked(int status, const jl_real *v, int n)
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

int jli_differences(jl_real *J, jli_function of, jli_residual residual,
                    void *context, const jl_real *x, jl_real *scratch,
                    int rows, int n)
{
    jl_real *at = scratch, *up = at + n, *down = up + rows;
    int i, a, status;

    memcpy(at, x, (size_t)n * sizeof *at);
    for (i = 0; i < n; i++) {
        jl_real step = STEP * (jli_abs(x[i]) > 1 ? jli_abs(x[i]) : 1);
        jl_real above = x[i] + step, below = x[i] - step;

        at[i] = above;
        status = jli_checked(of(up, at, context), up, rows);
        if (status != JL_OK)
            return status;
        at[i] = below;
        status = jli_checked(of(down, at, context), down, rows);
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
