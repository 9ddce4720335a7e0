/* The constant-gain IMM as an object. */
#include "cgimm/cg_parts.h"

#include <string.h>

#include "base/mathx.h"
#include "jumplink/mat.h"
#include "jumplink/model.h"

static void layout(jl_cgimm *cg, jl_real *mem)
{
    int M = cg->M, state = 3 * cg->axes;

    cg->x = mem;
    cg->mixed = cg->x + M * state;
    cg->xhat = cg->mixed + M * state;
    cg->d = cg->xhat + state;
    cg->w = cg->d + state;
    cg->goal = cg->w + 3 * M;
    cg->rate = cg->goal + 3 * M;
    cg->keep = cg->rate + 3 * M;
    cg->q = cg->keep + M;
    cg->c = cg->q + M;
    cg->l = cg->c + M;
    cg->moving = cg->l + M;
    cg->e = cg->moving + M;
    cg->mu = cg->e + M;
    cg->weight = cg->mu + M;
    cg->Pi = cg->weight + M;
}

static jl_real rate_of(jl_real k)
{
    return k > 0 ? 1 - jl_exp(-1 / k) : 1;
}

static void set_goal(jl_cgimm *cg, int j)
{
    const jl_cg_gains *g = &cg->gains[j];
    int i;

    for (i = 0; i < g->order; i++) {
        cg->goal[3 * j + i] = i < 2 ? g->steady[i] : g->steady[i] / 2;
        cg->rate[3 * j + i] = rate_of(g->k[i]);
    }
}

/* Gains and probabilities as at a start. */
static void start(jl_cgimm *cg, const jl_real *mu)
{
    int j, M = cg->M;

    for (j = 0; j < M; j++) {
        cg->mu[j] = mu != NULL ? mu[j] : 1 / (jl_real)M;
        jl_cgimm_restart(cg, j);
    }
    jli_cg_weights_are_mu(cg);
    cg->best = -1;
    cg->diverged = 0;
    jl_cgimm_combine(cg);
}

/* 1 if 1 - alpha is more than rounding, in the end and from the first
 * measurement on: S = R / (1 - alpha). */
static int leaves_one(const jl_cg_gains *g)
{
    const jl_real start = g->start[0], steady = g->steady[0];
    const jl_real first = start + rate_of(g->k[0]) * (steady - start);

    return 1 - steady >= 2 * JL_EPSILON && 1 - first >= 2 * JL_EPSILON;
}

static int check_gains(const jl_cg_gains *g)
{
    int i;

    if (g->order != 2 && g->order != 3)
        return JL_EDIM;
    if (!jl_vec_within(g->start, g->order, JL_LARGE)
        || !jl_vec_within(g->steady, g->order, JL_LARGE)
        || !jl_vec_within(g->k, g->order, JL_LARGE))
        return JL_ENONFINITE;
    if (!jli_cg_stable(g->steady, g->order)
        || !(g->start[0] > 0 && g->start[0] <= 1))
        return JL_ERANGE;
    for (i = 0; i < g->order; i++)
        if (g->start[i] < 0 || !(g->k[i] >= 0 && g->k[i] <= JL_C(1e6)))
            return JL_ERANGE;
    return leaves_one(g) ? JL_OK : JL_ERANGE;
}

int jl_cgimm_init(jl_cgimm *cg, int M, const jl_cg_gains *gains, int axes,
                  jl_real T, jl_real R, const jl_real *Pi, jl_real *mem,
                  int cap)
{
    int j, order = 2, status;

    if (M < 1 || M > JL_MAX_MODES || axes < 1 || axes > JL_MAX_STATES)
        return JL_EDIM;
    for (j = 0; j < M; j++) {
        status = check_gains(&gains[j]);
        if (status != JL_OK)
            return status;
        if (gains[j].order > order)
            order = gains[j].order;
    }
    if (!jl_vec_within(&T, 1, JL_LARGE) || !jl_vec_within(&R, 1, JL_LARGE))
        return JL_ENONFINITE;
    if (!(T > 0) || !(R >= JL_REAL_MIN / JL_EPSILON))
        return JL_ERANGE;
    status = jl_chain_check(Pi, NULL, M);
    if (status != JL_OK)
        return status;
    if (cap < JL_CGIMM_STATE(M, axes))
        return JL_ENOMEM;
    memset(cg, 0, sizeof *cg);
    memset(mem, 0, (size_t)JL_CGIMM_STATE(M, axes) * sizeof *mem);
    cg->M = M;
    cg->axes = axes;
    cg->order = order;
    cg->T = T;
    cg->R = R;
    cg->h = -1 / (2 * R);
    cg->gains = gains;
    layout(cg, mem);
    memcpy(cg->Pi, Pi, (size_t)(M * M) * sizeof *Pi);
    for (j = 0; j < M; j++)
        set_goal(cg, j);
    start(cg, NULL);
    return JL_OK;
}

/* An axis of a mode as the filter keeps it. */
static void scaled(jl_real *s, const jl_real *x, int order, jl_real T)
{
    s[0] = x[0];
    s[1] = x[1] * T;
    s[2] = order == 3 ? x[2] * T * T / 2 : 0;
}

int jl_cgimm_set(jl_cgimm *cg, const jl_real *x, const jl_real *mu)
{
    int M = cg->M, axes = cg->axes, order = cg->order, j, a, i, status;
    jl_real s[3], *to = cg->x;

    for (i = 0; i < M * axes * order; i += order) {
        scaled(s, x + i, order, cg->T);
        if (!jl_vec_within(x + i, order, JL_LARGE)
            || !jl_vec_within(s, 3, JL_LARGE))
            return JL_ENONFINITE;
    }
    status = jl_chain_check(NULL, mu, M);
    if (status != JL_OK)
        return status;
    for (j = 0; j < M; j++)
        for (a = 0; a < axes; a++, x += order, to += 3)
            scaled(to, x, cg->gains[j].order, cg->T);
    start(cg, mu);
    return JL_OK;
}

void jl_cgimm_restart(jl_cgimm *cg, int j)
{
    const jl_cg_gains *g = &cg->gains[j];

    JL_ASSERT(j >= 0 && j < cg->M);
    cg->w[3 * j] = g->start[0];
    cg->w[3 * j + 1] = g->start[1];
    cg->w[3 * j + 2] = g->order == 3 ? g->start[2] / 2 : 0;
    cg->moving[j] = 1;
    cg->stage = JLI_CG_IDLE;
}

void jl_cgimm_estimate(const jl_cgimm *cg, jl_real *x)
{
    int a;

    for (a = 0; a < cg->axes; a++, x += cg->order) {
        const jl_real *s = cg->xhat + 3 * a;

        x[0] = s[0];
        x[1] = s[1] / cg->T;
        if (cg->order == 3)
            x[2] = 2 * s[2] / (cg->T * cg->T);
    }
}
