/* The adaptive alpha-beta filter that the constant-gain IMM is compared with. */
#include "cgimm/cg_parts.h"

#include <string.h>

#include "jumplink/mat.h"

static int is_positive(jl_real v)
{
    return v > 0 && v <= JL_LARGE;
}

int jl_cg_adaptive_init(jl_cg_adaptive *f, int axes, jl_real T, jl_real R,
                        const jl_real *low, const jl_real *high, jl_real c,
                        jl_real up, jl_real down, jl_real *mem, int cap)
{
    int i;

    if (axes < 1 || axes > JL_MAX_STATES)
        return JL_EDIM;
    if (!jli_cg_stable(low, 2) || !jli_cg_stable(high, 2) || !is_positive(T)
        || !is_positive(R) || !(c > 0 && c <= 1)
        || !(down >= 0 && down <= up && up <= JL_LARGE))
        return JL_ERANGE;
    if (cap < JL_CG_ADAPTIVE_STATE(axes))
        return JL_ENOMEM;
    memset(f, 0, sizeof *f);
    f->axes = axes;
    f->level = 1;
    f->T = T;
    memcpy(f->w[0], low, sizeof f->w[0]);
    memcpy(f->w[1], high, sizeof f->w[1]);
    f->c = c;
    f->up = up;
    f->down = down;
    for (i = 0; i < 2; i++)
        f->per_d[i] = (2 - c) / c * (1 - f->w[i][0]) / R;
    f->x = mem;
    f->s = mem + 2 * axes;
    memset(mem, 0, (size_t)JL_CG_ADAPTIVE_STATE(axes) * sizeof *mem);
    return JL_OK;
}

int jl_cg_adaptive_set(jl_cg_adaptive *f, const jl_real *x)
{
    if (!jl_vec_within(x, 2 * f->axes, JL_LARGE))
        return JL_ENONFINITE;
    memcpy(f->x, x, (size_t)(2 * f->axes) * sizeof *x);
    memset(f->s, 0, (size_t)f->axes * sizeof *f->s);
    f->level = 1;
    return JL_OK;
}

int jl_cg_adaptive_step(jl_cg_adaptive *f, const jl_real *z)
{
    const jl_real *w;
    jl_real d = 0;
    int a;

    if (z != NULL && !jl_vec_within(z, f->axes, JL_LARGE))
        return JL_ENONFINITE;
    for (a = 0; a < f->axes; a++) {
        jl_real *x = f->x + 2 * a;

        x[0] += f->T * x[1];
        if (z == NULL)
            continue;
        f->s[a] += f->c * (z[a] - x[0] - f->s[a]);
        d += f->s[a] * f->s[a] * f->per_d[f->level];
    }
    if (z == NULL)
        return JL_OK;
    if (f->level == 0 ? d > f->up : d < f->down)
        f->level = 1 - f->level;
    w = f->w[f->level];
    for (a = 0; a < f->axes; a++) {
        jl_real *x = f->x + 2 * a, nu = z[a] - x[0];

        x[0] += w[0] * nu;
        x[1] += w[1] / f->T * nu;
    }
    return JL_OK;
}
