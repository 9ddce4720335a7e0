/* The usual pair, a mode of order 2 and one of order 3: stage by stage, and a
 * whole step in one go, in which what passes from stage to stage stays in
 * registers.  Both use the same functions, so they have the same bits.
 *
 * Of what the two have the difference d = x_0 - x_1 is formed once and used
 * three times: xhat = x_1 + mu_0 d, in the next step x0_t = x_1 + share_t d.
 * What mode 1 would predict without its acceleration and without mixing,
 * base = p_1 + v_1 T, is common to both predictions, so that in z - base is
 * waiting when the shares come: nothing but their product with d_p + d_v T is
 * between them and the innovations, which is what a step's time hangs on. */
#include "cgimm/cg_parts.h"

#include <string.h>

/* A number for each mode. */
struct two {
    jl_real of_0, of_1;
};

/* --- foresee ------------------------------------------------------------- */

/* part / c, the share of mode 0; c is 0 where a mode cannot be entered. */
JL_INLINE jl_real share_of(jl_real *c, jl_real part, jl_real rest,
                           jl_real none)
{
    *c = part + rest;
    if (*c >= JL_REAL_MIN)
        return part / *c;
    *c = 0;
    return none;
}

/* c, and the share of mode 0 in what either mode starts from. */
JL_INLINE struct two foresee(struct two *c, const jl_cgimm *cg)
{
    const jl_real *Pi = cg->Pi, *w = cg->weight;
    struct two share;

    share.of_0 = share_of(&c->of_0, Pi[0] * w[0], Pi[2] * w[1], 1);
    share.of_1 = share_of(&c->of_1, Pi[1] * w[0], Pi[3] * w[1], 0);
    return share;
}

void jli_pair_foresee(jl_cgimm *cg)
{
    struct two c, share = foresee(&c, cg);

    cg->c[0] = c.of_0;
    cg->c[1] = c.of_1;
    cg->e[0] = share.of_0;
    cg->e[1] = share.of_1;
}

/* --- mix ----------------------------------------------------------------- */

/* Predictions of an axis, from y, mode 1's state: the position less base. */
JL_INLINE void mix_0(jl_real *x, const jl_real *y, const jl_real *d,
                     jl_real share)
{
    x[1] = y[1] + share * d[1];
    x[0] = share * d[0];
}

JL_INLINE void mix_1(jl_real *x, const jl_real *y, const jl_real *d,
                     jl_real share)
{
    const jl_real a = (1 - share) * y[2];

    x[1] = y[1] + share * d[1] + (a + a);
    x[0] = share * d[0] + a;
    x[2] = a;
}

void jli_pair_mix(jl_cgimm *cg, int j)
{
    const int state = 3 * cg->axes;
    const jl_real *y = cg->x + state, *d = cg->d;
    jl_real *x = cg->mixed + j * state;
    int i;

    for (i = 0; i < state; i += 3)
        if (j == 0)
            mix_0(x + i, y + i, d + i, cg->e[0]);
        else
            mix_1(x + i, y + i, d + i, cg->e[1]);
}

/* --- weigh --------------------------------------------------------------- */

/* By how much mode 0 is likelier.  Sums beyond all numbers are cut, but where
 * nothing waits for it. */
JL_INLINE jl_real likelier(jl_cgimm *cg, struct two sum)
{
    const jl_real more = cg->q_more + cg->h * (sum.of_0 - sum.of_1);

    if (more >= -JL_REAL_MAX && more <= JL_REAL_MAX)
        return more;
    cg->diverged = !(sum.of_0 <= JL_REAL_MAX && sum.of_1 <= JL_REAL_MAX);
    return jli_cg_loglik(cg, sum.of_0) - jli_cg_loglik(cg, sum.of_1);
}

/* By the better mode's likelihood, so that nothing overflows.  The larger mu
 * is what the smaller one leaves. */
JL_INLINE void weigh(jl_cgimm *cg, struct two c, struct two sum)
{
    const jl_real more = likelier(cg, sum);
    const int best = (more > 0 && c.of_0 > 0) || !(c.of_1 > 0) ? 0 : 1;
    jl_real all;

    if (best == 0) {
        cg->weight[0] = c.of_0;
        c.of_1 = c.of_1 > 0 ? c.of_1 * jl_exp(-more) : 0;
        cg->weight[1] = c.of_1;
    } else {
        cg->weight[1] = c.of_1;
        c.of_0 = c.of_0 > 0 ? c.of_0 * jl_exp(more) : 0;
        cg->weight[0] = c.of_0;
    }
    all = c.of_0 + c.of_1;
    if (c.of_0 < c.of_1) {
        cg->mu[0] = c.of_0 / all;
        cg->mu[1] = 1 - cg->mu[0];
    } else {
        cg->mu[1] = c.of_1 / all;
        cg->mu[0] = 1 - cg->mu[1];
    }
    jli_cg_weighed(cg, all, best, best == 0 ? sum.of_0 : sum.of_1);
}

void jli_pair_weigh(jl_cgimm *cg)
{
    struct two c, sum;

    c.of_0 = cg->c[0];
    c.of_1 = cg->c[1];
    sum.of_0 = cg->l[0];
    sum.of_1 = cg->l[1];
    weigh(cg, c, sum);
}

/* --- combine ------------------------------------------------------------- */

void jli_pair_combine(jl_cgimm *cg)
{
    const jl_real *x = cg->x, *y = x + 3 * cg->axes;
    const jl_real mu_0 = cg->mu[0], mu_1 = cg->mu[1];
    jl_real *d = cg->d, *xhat = cg->xhat;
    int i;

    for (i = 0; i < 3 * cg->axes; i += 3) {
        const jl_real d_p = x[i] - y[i], d_v = x[i + 1] - y[i + 1];

        d[i] = d_p + d_v;
        d[i + 1] = d_v;
        d[i + 2] = y[i] + y[i + 1];
        xhat[i] = y[i] + mu_0 * d_p;
        xhat[i + 1] = y[i + 1] + mu_0 * d_v;
        xhat[i + 2] = mu_1 * y[i + 2];
    }
}

/* --- all of it ----------------------------------------------------------- */

/* Without stages nothing can fail half way, and the state is used in place. */
void jli_pair_step(jl_cgimm *cg, const jl_real *z)
{
    const int axes = cg->axes;
    const jl_real *d = cg->d, *w = cg->w;
    const jl_real keep_0 = cg->keep[0], keep_1 = cg->keep[1];
    struct two c, share = foresee(&c, cg), sum = { 0, 0 };
    jl_real *x = cg->x, *y = x + 3 * axes;
    int a;

    for (a = 0; a < axes; a++, x += 3, y += 3, d += 3) {
        jl_real next[2], next_y[3];
        struct two square;

        mix_0(next, y, d, share.of_0);
        mix_1(next_y, y, d, share.of_1);
        square.of_0 = jli_cg_correct(next, 2, d[2], z[a], w, keep_0);
        square.of_1 = jli_cg_correct(next_y, 3, d[2], z[a], w + 3, keep_1);
        sum.of_0 = a == 0 ? square.of_0 : sum.of_0 + square.of_0;
        sum.of_1 = a == 0 ? square.of_1 : sum.of_1 + square.of_1;
        x[0] = next[0];
        x[1] = next[1];
        y[0] = next_y[0];
        y[1] = next_y[1];
        y[2] = next_y[2];
    }
    weigh(cg, c, sum);
    jli_pair_combine(cg);
}
