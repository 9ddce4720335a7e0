/* A step of the constant-gain IMM, of any modes; cg_pair.c has the usual two.
 *
 * Modes are mixed, predicted and filtered in `mixed`; weigh, which cannot fail,
 * makes that the state, and the gains used the present ones. */
#include "cgimm/cg_parts.h"

#include <string.h>

#include "jumplink/mat.h"

#define LOG_2PI JL_C(1.8378770664093454836)

static int is_pair(const jl_cgimm *cg)
{
    return cg->M == 2 && cg->gains[0].order == 2 && cg->gains[1].order == 3;
}

/* --- mix ----------------------------------------------------------------- */

/* e[t] is 1 / c_t, or 0 if the mode cannot be entered. */
static void foresee_all(jl_cgimm *cg)
{
    int M = cg->M, s, t;

    for (t = 0; t < M; t++) {
        jl_real c = 0;

        for (s = 0; s < M; s++)
            c += cg->Pi[s * M + t] * cg->weight[s];
        cg->c[t] = c >= JL_REAL_MIN ? c : 0;
        cg->e[t] = c >= JL_REAL_MIN ? 1 / c : 0;
    }
}

void jl_cgimm_foresee(jl_cgimm *cg)
{
    if (is_pair(cg))
        jli_pair_foresee(cg);
    else
        foresee_all(cg);
    cg->stage = JLI_CG_MIXED;
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
        const jl_real share = cg->Pi[s * M + t] * cg->weight[s] * cg->e[t];
        const jl_real *xs = cg->x + s * state;

        for (a = 0; a < state; a += 3)
            for (i = a; i < a + order; i++)
                x[i] += share * xs[i];
    }
}

/* x- = F x0 in place: p + v T + a T^2 / 2, v T + a T^2. */
static void predict(jl_cgimm *cg, int t)
{
    jl_real *x = cg->mixed + t * 3 * cg->axes;
    int a;

    for (a = 0; a < cg->axes; a++, x += 3) {
        jl_real half = x[1] + x[2];     /* v half way, times T */

        x[0] += half;
        x[1] = half + x[2];
    }
}

void jl_cgimm_mix_mode(jl_cgimm *cg, int j)
{
    JL_ASSERT(j >= 0 && j < cg->M);
    if (is_pair(cg)) {
        jli_pair_mix(cg, j);
    } else {
        mix_all(cg, j);
        predict(cg, j);
    }
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
    cg->moving[j] = (jl_real)next_gains(cg->w + 3 * j, cg, j);
    cg->keep[j] = 1 - cg->w[3 * j];
    cg->q[j] = (jl_real)cg->axes * (jl_log(cg->keep[j] / cg->R) - LOG_2PI) / 2;
    if (cg->M == 2)
        cg->q_more = cg->q[0] - cg->q[1];
}

/* --- filter -------------------------------------------------------------- */

static void filter(jl_cgimm *cg, int j, const jl_real *z)
{
    const int order = cg->gains[j].order;
    const jl_real *w = cg->w + 3 * j, *d = cg->d;
    jl_real *x = cg->mixed + j * 3 * cg->axes;
    jl_real keep = cg->keep[j], next[3], sum = 0;
    int a;

    if (z != NULL && cg->moving[j] > 0) {
        (void)next_gains(next, cg, j);
        w = next;
        keep = 1 - next[0];
    }
    for (a = 0; a < cg->axes; a++, x += 3, d += 3) {
        jl_real square;

        if (z == NULL) {
            x[0] += d[2];
            continue;
        }
        square = jli_cg_correct(x, order, d[2], z[a], w, keep);
        sum = a == 0 ? square : sum + square;
    }
    cg->l[j] = sum;
    cg->stage = JLI_CG_FILTERED;
}

static int is_usable(const jl_cgimm *cg, const jl_real *z)
{
    return !cg->diverged
        && (z == NULL || jl_vec_within(z, cg->axes, JL_LARGE));
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

static void weigh_all(jl_cgimm *cg)
{
    int j, M = cg->M, best = -1;
    jl_real all = 0, r;

    for (j = 0; j < M; j++) {
        cg->e[j] = cg->q[j] + jli_cg_loglik(cg, cg->l[j]);
        cg->diverged |= !(cg->l[j] <= JL_REAL_MAX);
        if (cg->c[j] > 0 && (best < 0 || cg->e[j] > cg->e[best]))
            best = j;
    }
    for (j = 0; j < M; j++) {
        cg->weight[j] = cg->c[j] > 0
            ? cg->c[j] * jl_exp(cg->e[j] - cg->e[best]) : 0;
        all += cg->weight[j];
    }
    r = 1 / all;
    for (j = 0; j < M; j++)
        cg->mu[j] = cg->weight[j] * r;
    jli_cg_weighed(cg, all, best, cg->l[best]);
}

static void weigh(jl_cgimm *cg)
{
    int j;

    for (j = 0; j < cg->M; j++)
        if (cg->moving[j] > 0)
            advance(cg, j);
    if (is_pair(cg))
        jli_pair_weigh(cg);
    else
        weigh_all(cg);
}

/* Without a measurement. */
static void keep_weights(jl_cgimm *cg)
{
    int j;
    jl_real all = 0;

    for (j = 0; j < cg->M; j++)
        all += cg->c[j];
    for (j = 0; j < cg->M; j++)
        cg->mu[j] = cg->c[j] / all;
    jli_cg_weights_are_mu(cg);
    cg->best = -1;
}

int jl_cgimm_weigh(jl_cgimm *cg, const jl_real *z)
{
    jl_real *x = cg->x;

    if (cg->stage != JLI_CG_FILTERED)
        return JL_EORDER;
    if (z != NULL)
        weigh(cg);
    else
        keep_weights(cg);
    cg->x = cg->mixed;
    cg->mixed = x;
    cg->stage = JLI_CG_IDLE;
    return JL_OK;
}

jl_real jl_cgimm_loglik(const jl_cgimm *cg)
{
    if (cg->best < 0)
        return 0;
    return cg->q[cg->best] + jli_cg_loglik(cg, cg->best_sum)
        + jl_log(cg->all / cg->all_before);
}

/* --- combine ------------------------------------------------------------- */

void jl_cgimm_combine(jl_cgimm *cg)
{
    int state = 3 * cg->axes, i, j;

    if (is_pair(cg)) {
        jli_pair_combine(cg);
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
