/* Two modes: what goes before and after their filters, from numbers to numbers,
 * so that a step in one go (cg_pair.c) need not read what it has written. */
#ifndef JL_CG_TWO_H
#define JL_CG_TWO_H

#include "cgimm/cg_gains.h"

/* A number for each mode. */
struct jli_two {
    jl_real of_0, of_1;
};

/* part / c, the share of mode 0; c is 0 where a mode cannot be entered. */
JL_INLINE jl_real jli_share(jl_real *c, jl_real part, jl_real rest,
                            jl_real none)
{
    *c = part + rest;
    if (*c >= JL_REAL_MIN)
        return part / *c;
    *c = 0;
    return none;
}

/* c, and the share of mode 0 in what either mode starts from.  A row of Pi sums
 * to 1: the larger part of mu_1 is what the smaller one leaves. */
JL_INLINE struct jli_two jli_foresee_two(struct jli_two *c, const jl_real *Pi,
                                         const jl_real *mu)
{
    const jl_real mu_1 = mu[1];
    const jl_real from_00 = Pi[0] * mu[0], from_01 = Pi[1] * mu[0];
    struct jli_two share;
    jl_real from_10, from_11;

    if (Pi[2] > Pi[3]) {
        from_11 = Pi[3] * mu_1;
        from_10 = mu_1 - from_11;
    } else {
        from_10 = Pi[2] * mu_1;
        from_11 = mu_1 - from_10;
    }
    share.of_0 = jli_share(&c->of_0, from_00, from_10, 1);
    share.of_1 = jli_share(&c->of_1, from_01, from_11, 0);
    return share;
}

/* mu [2], of l = -nu' nu / 2 S.  By the better mode's likelihood, so that
 * nothing overflows.  The larger mu is what the smaller one leaves, which so
 * keeps its digits. */
JL_INLINE void jli_weigh_two(jl_cgimm *cg, struct jli_two c, struct jli_two l)
{
    const jl_real more = cg->q_more + l.of_0 - l.of_1;
    const int best = (more > 0 && c.of_0 > 0) || !(c.of_1 > 0) ? 0 : 1;
    jl_real likely, sum;

    if (best == 0)
        c.of_1 = c.of_1 > 0 ? c.of_1 * jl_exp(-more) : 0;
    else
        c.of_0 = c.of_0 > 0 ? c.of_0 * jl_exp(more) : 0;
    sum = c.of_0 + c.of_1;
    if (c.of_0 < c.of_1) {
        cg->mu[0] = c.of_0 / sum;
        cg->mu[1] = 1 - cg->mu[0];
    } else {
        cg->mu[1] = c.of_1 / sum;
        cg->mu[0] = 1 - cg->mu[1];
    }
    likely = best == 0 ? l.of_0 : l.of_1;
    cg->loglik = cg->q[best] + likely + jl_log(sum);
}

#endif
