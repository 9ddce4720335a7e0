/* Gains of alpha-beta and alpha-beta-gamma filters: steady ones by the tracking
 * index (Kalata 1984, IEEE Trans. AES 20, 174), and on the way there. */
#include "cgimm/cg_parts.h"

#include <string.h>

#include "base/mathx.h"

/* u = 1 - s of 2 u^3 = lambda (1 - u) (2 - u), 0 < u < 1: the left side less the
 * right one grows with u.  Newton's step, or to the middle where it leads out. */
static jl_real root(jl_real lambda)
{
    jl_real low = 0, high = 1, u = JL_C(0.5);
    int i;

    for (i = 0; i < 80; i++) {
        jl_real h = 2 * u * u * u - lambda * (1 - u) * (2 - u), next;

        if (h > 0)
            high = u;
        else
            low = u;
        next = u - h / (6 * u * u + lambda * (3 - 2 * u));
        u = next > low && next < high ? next : (low + high) / 2;
    }
    return u;
}

int jl_cg_steady(jl_real *w, int order, jl_real lambda)
{
    jl_real u;

    if (order != 2 && order != 3)
        return JL_EDIM;
    if (!(lambda >= JL_C(1e-6) && lambda <= JL_C(1e6)))
        return JL_ERANGE;
    u = order == 3 ? root(lambda)
        : 2 * lambda / (jli_sqrt(lambda * lambda + 8 * lambda) + lambda);
    w[0] = u * (2 - u);
    w[1] = 2 * u * u;
    if (order == 3)
        w[2] = 2 * u * u * u / (2 - u);
    return JL_OK;
}

int jli_cg_stable(const jl_real *w, int order)
{
    const jl_real alpha = w[0], beta = w[1];

    return alpha > 0 && alpha < 1 && beta > 0 && beta < 4 - 2 * alpha
        && (order == 2
            || (w[2] > 0 && w[2] < 2 * alpha * beta / (2 - alpha)));
}

/* Bar-Shalom, Li, Kirubarajan 2001, Estimation with Applications, 6.5. */
int jl_cg_cov(jl_real *P, const jl_real *w, int order, jl_real T, jl_real R)
{
    const jl_real alpha = w[0], beta = w[1];
    jl_real rest, gamma;

    if (order != 2 && order != 3)
        return JL_EDIM;
    if (!jli_cg_stable(w, order) || !(T > 0 && T <= JL_LARGE)
        || !(R > 0 && R <= JL_LARGE))
        return JL_ERANGE;
    rest = 1 - alpha;
    P[0] = alpha * R;
    P[1] = P[order] = beta * R / T;
    if (order == 2) {
        P[3] = beta * (alpha - beta / 2) / rest * R / T / T;
        return JL_OK;
    }
    gamma = 2 * w[2];
    P[2] = P[6] = w[2] * R / T / T;
    P[4] = (8 * alpha * beta + gamma * (beta - 2 * alpha - 4)) / (8 * rest)
        * R / T / T;
    P[5] = P[7] = beta * (2 * beta - gamma) / (4 * rest) * R / T / T / T;
    P[8] = gamma * (2 * beta - gamma) / (4 * rest) * R / T / T / T / T;
    return JL_OK;
}

/* --- the transient ------------------------------------------------------- */

#define STEPS 25                        /* of a Kalman filter are looked at */

/* One step of a Kalman filter with T = R = 1 and noise lambda^2 on G: P and its
 * gains w.  F = [1 1 1/2; 0 1 1; 0 0 1], or its first two rows and columns. */
static void kalman(jl_real *w, jl_real P[3][3], int order, jl_real lambda)
{
    static const jl_real F[3][3] = {
        { 1, 1, JL_C(0.5) }, { 0, 1, 1 }, { 0, 0, 1 }
    };
    static const jl_real G[3] = { JL_C(0.5), 1, 1 };
    jl_real FP[3][3], M[3][3];
    int i, j, k;

    for (i = 0; i < order; i++)
        for (j = 0; j < order; j++)
            for (k = 0, FP[i][j] = 0; k < order; k++)
                FP[i][j] += F[i][k] * P[k][j];
    for (i = 0; i < order; i++)
        for (j = 0; j < order; j++)
            for (k = 0, M[i][j] = G[i] * G[j] * lambda * lambda; k < order;
                 k++)
                M[i][j] += FP[i][k] * F[j][k];
    for (i = 0; i < order; i++)
        w[i] = M[i][0] / (M[0][0] + 1);
    for (i = 0; i < order; i++)
        for (j = 0; j < order; j++)
            P[i][j] = M[i][j] - w[i] * M[0][j];
}

/* What an exact fit of 2 or 3 positions, each of variance 1, knows. */
static const jl_real fit_of_two[3][3] = { { 1, 1, 0 }, { 1, 2, 0 }, { 0, 0, 0 } };
static const jl_real fit_of_three[3][3] = {
    { 1, JL_C(1.5), 1 }, { JL_C(1.5), JL_C(6.5), 6 }, { 1, 6, 6 }
};

/* Sum of squares of steady + (start - steady) exp(-i/k) less the gains [STEPS],
 * k = exp(logk). */
static jl_real misfit(jl_real logk, jl_real start, jl_real steady,
                      const jl_real *gain)
{
    jl_real shrink = jl_exp(-jl_exp(-logk)), part = 1, sum = 0;
    int i;

    for (i = 0; i < STEPS; i++) {
        jl_real e;

        part *= shrink;
        e = steady + (start - steady) * part - gain[i];
        sum += e * e;
    }
    return sum;
}

/* The best k: the neighbourhood by a scan, then the golden section. */
static jl_real best_k(jl_real start, jl_real steady, const jl_real *gain)
{
    const jl_real ratio = JL_C(0.6180339887498949), step = JL_C(0.25);
    jl_real best = -3, least, low, high;
    int i;

    least = misfit(best, start, steady, gain);
    for (i = 1; i <= 40; i++) {                 /* k from 0.05 to 1100 */
        jl_real logk = -3 + step * (jl_real)i;
        jl_real m = misfit(logk, start, steady, gain);

        if (m < least) {
            least = m;
            best = logk;
        }
    }
    low = best - step;
    high = best + step;
    for (i = 0; i < 50; i++) {
        jl_real a = high - ratio * (high - low), b = low + ratio * (high - low);

        if (misfit(a, start, steady, gain) < misfit(b, start, steady, gain))
            high = b;
        else
            low = a;
    }
    return jl_exp((low + high) / 2);
}

static int is_positive(jl_real v)
{
    return v > 0 && v <= JL_LARGE;
}

int jl_cg_design(jl_cg_gains *gains, int order, jl_real T, jl_real Q,
                 jl_real R)
{
    jl_cg_gains g;
    jl_real P[3][3], gain[3][STEPS], w[3], lambda;
    int i, k, status;

    if (order != 2 && order != 3)
        return JL_EDIM;
    if (!jli_finite(T) || !jli_finite(Q) || !jli_finite(R))
        return JL_ENONFINITE;
    if (!is_positive(T) || !is_positive(Q) || !is_positive(R))
        return JL_ERANGE;
    lambda = T * T * jli_sqrt(Q / R);
    memset(&g, 0, sizeof g);
    g.order = order;
    status = jl_cg_steady(g.steady, order, lambda);
    if (status != JL_OK)
        return status;
    g.start[0] = 1;
    g.start[1] = order == 2 ? 1 : JL_C(1.5);
    g.start[2] = order == 2 ? 0 : 1;
    memcpy(P, order == 2 ? fit_of_two : fit_of_three, sizeof P);
    for (k = 0; k < STEPS; k++) {
        kalman(w, P, order, lambda);
        for (i = 0; i < order; i++)
            gain[i][k] = w[i];
    }
    for (i = 0; i < order; i++)
        g.k[i] = best_k(g.start[i], g.steady[i], gain[i]);
    *gains = g;
    return JL_OK;
}
