/* A step of the constant-gain IMM.
 *
 * Of two modes differences are formed once, d = x_0 - x_1, for three uses:
 * xhat = x_1 + mu_0 d, and in the next step x0_t = x_1 + mu_0t d.  A state that
 * only one mode has is that mode's share of it.
 *
 * Modes are mixed and filtered in `mixed`; weigh, which cannot fail, makes that
 * the state, and the gains used the present ones. */
#include "cgimm/cg_two.h"

#include <string.h>

#include "jumplink/mat.h"

#define LOG_2PI JL_C(1.8378770664093454836)

/* How many components the two have in common, and who has the third. */
static int in_common(const jl_cgimm *cg)
{
    int a = cg->gains[0].order, b = cg->gains[1].order;

    return a < b ? a : b;
}

static int is_pair(const jl_cgimm *cg)
{
    return cg->M == 2 && cg->gains[0].order == 2 && cg->gains[1].order == 3;
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

/* e[t] is the share of mode 0 in mode t's mixture. */
static void foresee_two(jl_cgimm *cg)
{
    struct jli_two c, share = jli_foresee_two(&c, cg->Pi, cg->mu);

    cg->c[0] = c.of_0;
    cg->c[1] = c.of_1;
    cg->e[0] = share.of_0;
    cg->e[1] = share.of_1;
}

/* e[t] is 1 / c_t, or 0 if the mode cannot be entered. */
static void foresee_all(jl_cgimm *cg)
{
    int M = cg->M, s, t;

    for (t = 0; t < M; t++) {
        jl_real c = 0;

        for (s = 0; s < M; s++)
            c += cg->Pi[s * M + t] * cg->mu[s];
        cg->c[t] = c >= JL_REAL_MIN ? c : 0;
        cg->e[t] = c >= JL_REAL_MIN ? 1 / c : 0;
    }
}

void jl_cgimm_foresee(jl_cgimm *cg)
{
    if (cg->M == 2)
        foresee_two(cg);
    else
        foresee_all(cg);
    cg->stage = JLI_CG_MIXED;
}

static void mix_two(jl_cgimm *cg, int t)
{
    int owner = cg->gains[0].order < cg->gains[1].order;

    /* of a component that mode t alone has, what comes from itself */
    between(cg->mixed + t * 3 * cg->axes, cg, cg->e[t], cg->gains[t].order,
            t == 0 ? cg->e[t] : 1 - cg->e[t], owner);
}

static void mix_all(jl_cgimm *cg, int t)
{
    int M = cg->M, state = 3 * cg->axes, order = cg->gains[t].order, i, s, a;
    jl_real *x = cg->mixed + t * state;

    if (!(cg->c[t] > 0)) {              /* cannot be entered */
        memcpy(x, cg->x + t * state, (size_t)state * sizeof *x);
        return;
    }
    memset(x, 0, (size_t)state * sizeof *x);
    for (s = 0; s < M; s++) {
        const jl_real share = cg->Pi[s * M + t] * cg->mu[s] * cg->e[t];
        const jl_real *xs = cg->x + s * state;

        for (a = 0; a < state; a += 3)
            for (i = a; i < a + order; i++)
                x[i] += share * xs[i];
    }
}

void jl_cgimm_mix_mode(jl_cgimm *cg, int j)
{
    JL_ASSERT(j >= 0 && j < cg->M);
    if (cg->M == 2)
        mix_two(cg, j);
    else
        mix_all(cg, j);
}

/* --- gains --------------------------------------------------------------- */

/* What mode j's gains w become by a measurement; w may be the present ones.
 * Returns 1 if they will move on. */
static int next_gains(jl_real *w, const jl_cgimm *cg, int j)
{
    const jl_real *now = cg->w + 3 * j;
    const jl_real *goal = cg->goal + 3 * j, *rate = cg->rate + 3 * j;
    int i, order = cg->gains[j].order, there = 1;

    for (i = 0; i < order; i++) {
        jl_real left = goal[i] - now[i];

        w[i] = now[i] + rate[i] * left;
        there &= left <= 2 * JL_EPSILON && left >= -2 * JL_EPSILON;
    }
    if (there)
        memcpy(w, goal, (size_t)order * sizeof *w);
    return !there;
}

static void advance(jl_cgimm *cg, int j)
{
    jl_real rest;

    cg->moving[j] = (jl_real)next_gains(cg->w + 3 * j, cg, j);
    rest = 1 - cg->w[3 * j];
    cg->g[j] = -rest / (2 * cg->R);
    cg->q[j] = (jl_real)cg->axes * (jl_log(rest / cg->R) - LOG_2PI) / 2;
    if (cg->M == 2)
        cg->q_more = cg->q[0] - cg->q[1];
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

static void filter(jl_cgimm *cg, int j, const jl_real *z)
{
    int order = cg->gains[j].order, a, i;
    jl_real *x = cg->mixed + j * 3 * cg->axes, next[3], sum = 0;
    const jl_real *w = cg->w + 3 * j;

    if (z != NULL && cg->moving[j] > 0) {
        (void)next_gains(next, cg, j);
        w = next;
    }
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
    cg->l[j] = sum;
    cg->stage = JLI_CG_FILTERED;
}

static int is_usable(const jl_cgimm *cg, const jl_real *z)
{
    return z == NULL || jl_vec_within(z, cg->axes, JL_LARGE);
}

int jl_cgimm_filter_mode(jl_cgimm *cg, int j, const jl_real *z)
{
    JL_ASSERT(j >= 0 && j < cg->M);
    if (cg->stage == JLI_CG_IDLE)
        return JL_EORDER;
    if (!is_usable(cg, z))
        return JL_ENONFINITE;
    filter(cg, j, z);
    return JL_OK;
}

/* --- weigh --------------------------------------------------------------- */

static void weigh_two(jl_cgimm *cg)
{
    struct jli_two c, l;

    c.of_0 = cg->c[0];
    c.of_1 = cg->c[1];
    l.of_0 = cg->l[0];
    l.of_1 = cg->l[1];
    jli_weigh_two(cg, c, l);
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

static void weigh(jl_cgimm *cg)
{
    int j;

    for (j = 0; j < cg->M; j++) {
        if (cg->moving[j] > 0)
            advance(cg, j);
        cg->l[j] = jli_cg_bounded(cg->g[j] * cg->l[j]);
    }
    if (cg->M == 2)
        weigh_two(cg);
    else
        weigh_all(cg);
}

int jl_cgimm_weigh(jl_cgimm *cg, const jl_real *z)
{
    jl_real *x = cg->x;

    if (cg->stage != JLI_CG_FILTERED)
        return JL_EORDER;
    if (z != NULL) {
        weigh(cg);
    } else {
        memcpy(cg->mu, cg->c, (size_t)cg->M * sizeof *cg->mu);
        cg->loglik = 0;
    }
    cg->x = cg->mixed;
    cg->mixed = x;
    cg->stage = JLI_CG_IDLE;
    return JL_OK;
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

void jl_cgimm_combine(jl_cgimm *cg)
{
    int state = 3 * cg->axes, i, j;

    if (is_pair(cg)) {
        jli_pair_combine(cg);
        return;
    }
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
    int j;

    if (!is_usable(cg, z))
        return JL_ENONFINITE;
    if (is_pair(cg) && z != NULL && !(cg->moving[0] > 0)
        && !(cg->moving[1] > 0)) {
        jli_pair_step(cg, z);
        cg->stage = JLI_CG_IDLE;
        return JL_OK;
    }
    jl_cgimm_foresee(cg);
    for (j = 0; j < cg->M; j++) {
        jl_cgimm_mix_mode(cg, j);
        filter(cg, j, z);
    }
    (void)jl_cgimm_weigh(cg, z);
    jl_cgimm_combine(cg);
    return JL_OK;
}
