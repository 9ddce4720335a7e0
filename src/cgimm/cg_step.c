/* A step of the constant-gain IMM.
 *
 * Of two modes differences are formed once, d = x_0 - x_1, and used three times:
 * xhat = x_1 + mu_0 d, and in the next step x0_t = x_1 + mu_0t d.  A state that
 * only one mode has is that mode's share of it. */
#include "cgimm/cg_gains.h"

#include <string.h>

#include "jumplink/mat.h"

#define LOG_2PI JL_C(1.8378770664093454836)

/* How many components the two have in common, and who has the third. */
static int in_common(const jl_cgimm *cg)
{
    int a = cg->gains[0].order, b = cg->gains[1].order;

    return a < b ? a : b;
}

/* --- mix ----------------------------------------------------------------- */

/* x = x_1 + share d, and of a component that only mode `owner` has
 * part x_owner. */
static void between(jl_real *x, const jl_cgimm *cg, jl_real share,
                    int components, jl_real part, int owner)
{
    const jl_real *x1 = cg->x + 3 * cg->axes, *own = cg->x, *d = cg->d;
    int a, i, common = in_common(cg);

    if (owner == 1)
        own = x1;
    for (a = 0; a < cg->axes; a++, x += 3, x1 += 3, own += 3, d += 3) {
        for (i = 0; i < common; i++)
            x[i] = x1[i] + share * d[i];
        if (components > common)
            x[2] = part * own[2];
    }
}

static void mix_two(jl_cgimm *cg)
{
    const jl_real *Pi = cg->Pi;
    int owner = cg->gains[0].order < cg->gains[1].order;
    jl_real from_0[2], from_1[2], share;
    int t;

    from_0[0] = Pi[0] * cg->mu[0];
    from_0[1] = Pi[1] * cg->mu[0];
    from_1[0] = Pi[2] * cg->mu[1];
    from_1[1] = cg->mu[1] - from_1[0];
    if (from_1[1] < 0)                  /* rows sum to 1, nearly */
        from_1[1] = 0;
    for (t = 0; t < 2; t++) {
        cg->c[t] = from_0[t] + from_1[t];
        share = cg->c[t] > 0 ? from_0[t] / cg->c[t] : (jl_real)(t == 0);
        between(cg->mixed + t * 3 * cg->axes, cg, share, cg->gains[t].order,
                owner == 0 ? share : 1 - share, owner);
    }
}

static void mix_mode(jl_cgimm *cg, int t)
{
    int M = cg->M, state = 3 * cg->axes, i, s;
    jl_real *x = cg->mixed + t * state, c = 0, r;

    for (s = 0; s < M; s++) {
        cg->e[s] = cg->Pi[s * M + t] * cg->mu[s];
        c += cg->e[s];
    }
    cg->c[t] = c;
    if (!(c > 0)) {                     /* cannot be entered */
        memcpy(x, cg->x + t * state, (size_t)state * sizeof *x);
        return;
    }
    r = 1 / c;
    memset(x, 0, (size_t)state * sizeof *x);
    for (s = 0; s < M; s++) {
        const jl_real share = cg->e[s] * r, *xs = cg->x + s * state;

        for (i = 0; i < state; i++)
            x[i] += share * xs[i];
    }
}

/* --- gains --------------------------------------------------------------- */

static void advance(jl_cgimm *cg, int j)
{
    jl_real *w = cg->w + 3 * j, rest;
    const jl_real *goal = cg->goal + 3 * j, *rate = cg->rate + 3 * j;
    int i, order = cg->gains[j].order, there = 1;

    for (i = 0; i < order; i++) {
        jl_real left = goal[i] - w[i];

        w[i] += rate[i] * left;
        there &= left <= 2 * JL_EPSILON && left >= -2 * JL_EPSILON;
    }
    if (there) {
        memcpy(w, goal, (size_t)order * sizeof *w);
        cg->moving[j] = 0;
    }
    rest = 1 - w[0];
    cg->g[j] = -rest / (2 * cg->R);
    cg->q[j] = (jl_real)cg->axes * (jl_log(rest / cg->R) - LOG_2PI) / 2;
}

/* --- filter -------------------------------------------------------------- */

/* x- = F x0 in place: p + v T + a T^2 / 2, v T + a T^2. */
static void predict(jl_real *x, int order)
{
    if (order == 3) {
        jl_real half = x[1] + x[2];     /* v half way, times T */

        x[0] += half;
        x[1] = half + x[2];
    } else {
        x[0] += x[1];
    }
}

static void filter_mode(jl_cgimm *cg, int j, const jl_real *z)
{
    int order = cg->gains[j].order, state = 3 * cg->axes, a, i;
    const jl_real *mixed = cg->mixed + j * state, *w = cg->w + 3 * j;
    jl_real *x = cg->x + j * state, sum = 0;

    memcpy(x, mixed, (size_t)state * sizeof *x);
    for (a = 0; a < cg->axes; a++, x += 3) {
        jl_real nu;

        predict(x, order);
        if (z == NULL)
            continue;
        nu = z[a] - x[0];
        for (i = 0; i < order; i++)
            x[i] += w[i] * nu;
        sum = a == 0 ? nu * nu : sum + nu * nu;
    }
    cg->l[j] = cg->g[j] * sum;
    if (!(cg->l[j] >= -JL_REAL_MAX))
        cg->l[j] = -JL_REAL_MAX;
}

/* --- weigh --------------------------------------------------------------- */

/* By the better mode's likelihood, so that nothing overflows. */
static void weigh_two(jl_cgimm *cg)
{
    const jl_real *l = cg->l, *q = cg->q, *c = cg->c;
    jl_real more = (q[0] - q[1]) + l[0] - l[1], other, sum;
    int best = c[0] > 0 && (more > 0 || !(c[1] > 0)) ? 0 : 1;

    other = c[1 - best] * jl_exp(best == 0 ? -more : more);
    if (!(c[1 - best] > 0))
        other = 0;
    sum = c[best] + other;
    cg->mu[1 - best] = other / sum;
    cg->mu[best] = 1 - cg->mu[1 - best];
    cg->loglik = q[best] + l[best] + jl_log(sum);
}

static void weigh_all(jl_cgimm *cg)
{
    int j, M = cg->M;
    jl_real best = -JL_REAL_MAX, sum = 0, r;

    for (j = 0; j < M; j++)
        if (cg->c[j] > 0 && cg->q[j] + cg->l[j] > best)
            best = cg->q[j] + cg->l[j];
    for (j = 0; j < M; j++) {
        cg->mu[j] = cg->c[j] > 0
            ? cg->c[j] * jl_exp(cg->q[j] + cg->l[j] - best) : 0;
        sum += cg->mu[j];
    }
    r = 1 / sum;
    for (j = 0; j < M; j++)
        cg->mu[j] *= r;
    cg->loglik = best + jl_log(sum);
}

/* --- combine ------------------------------------------------------------- */

static void combine_two(jl_cgimm *cg)
{
    const jl_real *x0 = cg->x, *x1 = x0 + 3 * cg->axes;
    int owner = cg->gains[0].order < cg->gains[1].order;
    int common = in_common(cg), a, i;

    for (a = 0; a < cg->axes; a++)
        for (i = 0; i < common; i++)
            cg->d[3 * a + i] = x0[3 * a + i] - x1[3 * a + i];
    between(cg->xhat, cg, cg->mu[0], cg->order, cg->mu[owner], owner);
}

void jli_cg_combine(jl_cgimm *cg)
{
    int state = 3 * cg->axes, i, j;

    if (cg->M == 2) {
        combine_two(cg);
        return;
    }
    memset(cg->xhat, 0, (size_t)state * sizeof *cg->xhat);
    for (j = 0; j < cg->M; j++)
        for (i = 0; i < state; i++)
            cg->xhat[i] += cg->mu[j] * cg->x[j * state + i];
}

int jl_cgimm_step(jl_cgimm *cg, const jl_real *z)
{
    int M = cg->M, j;

    if (z != NULL && !jl_vec_within(z, cg->axes, JL_LARGE))
        return JL_ENONFINITE;
    if (M == 2)
        mix_two(cg);
    for (j = 0; j < M && M != 2; j++)
        mix_mode(cg, j);
    for (j = 0; j < M; j++) {
        if (z != NULL && cg->moving[j] > 0)
            advance(cg, j);
        filter_mode(cg, j, z);
    }
    if (z == NULL) {
        memcpy(cg->mu, cg->c, (size_t)M * sizeof *cg->mu);
        cg->loglik = 0;
    } else if (M == 2) {
        weigh_two(cg);
    } else {
        weigh_all(cg);
    }
    jli_cg_combine(cg);
    return JL_OK;
}
