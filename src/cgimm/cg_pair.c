/* Mixing and filtering of the usual pair, a mode of order 2 and one of order 3,
 * in one go: what is mixed stays in registers.  The same sums in the same order
 * as stage by stage (cg_step.c), so the same bits. */
#include "cgimm/cg_gains.h"

/* The shares of mode 0 in what either mode starts from are e [2], the gains
 * the present ones.  `mixed` becomes the filtered states, l [2] the sums of
 * nu^2. */
void jli_pair_filter(jl_cgimm *cg, const jl_real *z)
{
    const jl_real share_0 = cg->e[0], share_1 = cg->e[1], rest = 1 - share_1;
    const jl_real *now = cg->x + 3 * cg->axes, *d = cg->d, *w = cg->w;
    jl_real *x = cg->mixed, *y = x + 3 * cg->axes, sum_0 = 0, sum_1 = 0;
    int a;

    for (a = 0; a < cg->axes; a++, now += 3, d += 3, x += 3, y += 3) {
        const jl_real v_0 = now[1] + share_0 * d[1];
        const jl_real p_0 = now[0] + share_0 * d[0] + v_0;
        const jl_real nu_0 = z[a] - p_0;
        const jl_real acc = rest * now[2];
        const jl_real half = now[1] + share_1 * d[1] + acc;
        const jl_real p_1 = now[0] + share_1 * d[0] + half;
        const jl_real nu_1 = z[a] - p_1;

        x[0] = p_0 + w[0] * nu_0;
        x[1] = v_0 + w[1] * nu_0;
        y[0] = p_1 + w[3] * nu_1;
        y[1] = half + acc + w[4] * nu_1;
        y[2] = acc + w[5] * nu_1;
        sum_0 = a == 0 ? nu_0 * nu_0 : sum_0 + nu_0 * nu_0;
        sum_1 = a == 0 ? nu_1 * nu_1 : sum_1 + nu_1 * nu_1;
    }
    cg->l[0] = sum_0;
    cg->l[1] = sum_1;
}

void jli_pair_combine(jl_cgimm *cg)
{
    const jl_real *x = cg->x, *y = x + 3 * cg->axes;
    const jl_real mu_0 = cg->mu[0], mu_1 = cg->mu[1];
    jl_real *d = cg->d, *xhat = cg->xhat;
    int a;

    for (a = 0; a < 3 * cg->axes; a += 3) {
        d[a] = x[a] - y[a];
        d[a + 1] = x[a + 1] - y[a + 1];
        xhat[a] = y[a] + mu_0 * d[a];
        xhat[a + 1] = y[a + 1] + mu_0 * d[a + 1];
        xhat[a + 2] = mu_1 * y[a + 2];
    }
}
