/* A step of the usual pair, a mode of order 2 and one of order 3 with steady
 * gains, in one go: what passes from stage to stage stays in registers.  The
 * same sums in the same order as stage by stage (cg_step.c), so the same bits.
 *
 * Of what the two have the difference d = x_0 - x_1 is formed once and used
 * three times: xhat = x_1 + mu_0 d, in the next step x0_t = x_1 + mu_0t d. */
#include "cgimm/cg_two.h"

/* Mix and filter; returns the sums of nu^2. */
JL_INLINE struct jli_two filter(jl_cgimm *cg, struct jli_two share,
                                const jl_real *z)
{
    const jl_real rest = 1 - share.of_1;
    const jl_real *d = cg->d, *w = cg->w;
    jl_real *x = cg->x, *y = x + 3 * cg->axes;
    struct jli_two sum = { 0, 0 };
    int a;

    for (a = 0; a < cg->axes; a++, d += 3, x += 3, y += 3) {
        const jl_real p = y[0], v = y[1], d_p = d[0], d_v = d[1];
        const jl_real v_0 = v + share.of_0 * d_v;
        const jl_real p_0 = p + share.of_0 * d_p + v_0;
        const jl_real nu_0 = z[a] - p_0;
        const jl_real acc = rest * y[2];
        const jl_real half = v + share.of_1 * d_v + acc;
        const jl_real p_1 = p + share.of_1 * d_p + half;
        const jl_real nu_1 = z[a] - p_1;

        x[0] = p_0 + w[0] * nu_0;
        x[1] = v_0 + w[1] * nu_0;
        y[0] = p_1 + w[3] * nu_1;
        y[1] = half + acc + w[4] * nu_1;
        y[2] = acc + w[5] * nu_1;
        if (a == 0) {
            sum.of_0 = nu_0 * nu_0;
            sum.of_1 = nu_1 * nu_1;
        } else {
            sum.of_0 += nu_0 * nu_0;
            sum.of_1 += nu_1 * nu_1;
        }
    }
    return sum;
}

void jli_pair_combine(jl_cgimm *cg)
{
    const jl_real *x = cg->x, *y = x + 3 * cg->axes;
    const jl_real mu_0 = cg->mu[0], mu_1 = cg->mu[1];
    jl_real *d = cg->d, *xhat = cg->xhat;
    int a;

    for (a = 0; a < 3 * cg->axes; a += 3) {
        const jl_real d_p = x[a] - y[a], d_v = x[a + 1] - y[a + 1];

        d[a] = d_p;
        d[a + 1] = d_v;
        xhat[a] = y[a] + mu_0 * d_p;
        xhat[a + 1] = y[a + 1] + mu_0 * d_v;
        xhat[a + 2] = mu_1 * y[a + 2];
    }
}

void jli_pair_step(jl_cgimm *cg, const jl_real *z)
{
    struct jli_two c, l;

    l = filter(cg, jli_foresee_two(&c, cg->Pi, cg->mu), z);
    l.of_0 = jli_cg_bounded(cg->g[0] * l.of_0);
    l.of_1 = jli_cg_bounded(cg->g[1] * l.of_1);
    jli_weigh_two(cg, c, l);
    jli_pair_combine(cg);
}
