/* The constant-gain IMM: modes are alpha-beta and alpha-beta-gamma filters, one
 * an axis, whose gains are known beforehand.  No covariance, no matrix, a dozen
 * multiplications a mode: for the smallest processors.
 *
 * Over T seconds a mode of order 2 moves at constant velocity, one of order 3
 * at constant acceleration (the accelerations of order 2 are 0); positions are
 * measured with variance R.  A step, for modes s, t (Liang, Pan, Zhang 2000):
 *     mix      c_t = sum_s Pi[s][t] mu_s,   mu_st = Pi[s][t] mu_s / c_t
 *              x0_t = sum_s mu_st x_s
 *     gains    w += (1 - exp(-1/k)) (w_inf - w) for w = alpha, beta, gamma / 2
 *     filter   x- = F x0,  nu = z - x-[0],
 *              x = x- + (alpha, beta / T, gamma / 2 T^2) nu,  an axis
 *     weigh    S = R / (1 - alpha),  l_t = sum over axes log N(nu; 0, S)
 *              mu_t = c_t exp(l_t) / sum of them
 *     combine  xhat = sum_t mu_t x_t
 * S = R / (1 - alpha) is exact for the gains of a Kalman filter.  A c_t below
 * 1024 JL_REAL_MIN may count as 0, and so may a likelihood whose ratio to the
 * best one is less than JL_REAL_MIN: a mode that is entered from no other may
 * be lost for good.
 *
 * Two modes of order 2 and 3 with steady gains, one axis: 24 multiplications
 * and divisions, 27 additions, an exponential (tests/count), where the paper
 * has 76 and 46, and an IMM of matrices 11 times as many.
 *
 * What it is worth (paper's scenario, `jumplink sim --scenario manoeuvre1d`):
 * positions as good as the IMM's; in the quiet phase after a manoeuvre
 * velocities are 1.17, accelerations 1.34 times as far off.  Whether a pair of
 * modes is fit for it: jl_cg_coupling_of.
 */
#ifndef JL_CGIMM_H
#define JL_CGIMM_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- gains --------------------------------------------------------------- */

/* Gains are w [order] = alpha, beta, and with order 3 gamma / 2. */
typedef struct jl_cg_gains {
    int order;                  /* 2 or 3                                   */
    jl_real start[3];           /* at the start, and after a restart        */
    jl_real steady[3];          /* in the end                               */
    jl_real k[3];               /* steps in which the way there shrinks to
                                   1 / e; 0: steady from the first step     */
} jl_cg_gains;

/* Steady gains w [order] of a Kalman filter, by its tracking index
 *     lambda = T^2 sqrt(Q / R)
 * for noise of variance Q [(m/s^2)^2] on G = [T^2/2, T] (order 2) or
 * [T^2/2, T, 1] (order 3).  With s = sqrt(1 - alpha):
 *     order 2   s = (4 + lambda - sqrt(lambda^2 + 8 lambda)) / 4
 *     order 3   2 (1 - s)^3 = lambda s (1 + s),  gamma / 2 = lambda s
 *     alpha = 1 - s^2,  beta = 2 (1 - s)^2
 * Returns JL_OK, JL_EDIM (order), JL_ERANGE (lambda not in 1e-6 .. 1e6); w is
 * untouched on error. */
int jl_cg_steady(jl_real *w, int order, jl_real lambda);

/* Steady covariance P [order,order] of the estimate that goes with steady gains
 * w: P[0][0] = alpha R and so on.
 * Returns JL_OK, JL_EDIM, JL_ERANGE (gains of no stable filter, T or R not
 * above 0); P is untouched on error. */
int jl_cg_cov(jl_real *P, const jl_real *w, int order, jl_real T, jl_real R);

/* All of a mode's gains for T [s], Q [(m/s^2)^2], R [m^2]: the steady ones; for
 * the start those of an exact fit of 2 or 3 positions, (1, 1) and (1, 3/2, 1);
 * and the k for which start and steady with exp(-i/k), i = 1..25, are nearest,
 * in least squares, to the gains of the Kalman filter that starts from this
 * fit.  For a program's start: about 1e4 operations an order.
 * Returns JL_OK, JL_EDIM, JL_ENONFINITE, JL_ERANGE (T, Q or R not above 0, or a
 * lambda beyond jl_cg_steady's); *gains is untouched on error. */
int jl_cg_design(jl_cg_gains *gains, int order, jl_real T, jl_real Q,
                 jl_real R);

/* What a mode i loses when its gains do not heed what is mixed into it from
 * mode j, by their steady covariances P_i, P_j and with
 *     weight = Pi[j][i] mu_j / (Pi[i][i] mu_i + Pi[j][i] mu_j)
 * the mixed covariance, but for the spread of means, is P_i + weight (P_j - P_i):
 *     change        weight |P_j - P_i| / |P_i|, 2-norms (an acceleration that a
 *                   mode lacks has variance 0)
 *     conservative  1: P_i - P_j >= 0, so that P_i is more than it would be
 * Mode i decouples from j where the change is below what is put up with, 0.05
 * say: the conditions (3.3), for the mode that matches, and (3.5), for all, of
 * the paper; (3.6), which has the wrong sign there, is `conservative`.  With
 * the paper's modes the matched one has 0.0114 (CV), 0.0021 (CA) at mu = 0.9; a
 * mode that is not matched 0.78: it is coupled, and its mu shows it. */
typedef struct jl_cg_coupling {
    jl_real weight, change;
    int conservative;
} jl_cg_coupling;

/* `stay` = Pi[i][i], `jump` = Pi[j][i]; T, R as in jl_cg_design.
 * Returns JL_OK, JL_ERANGE (gains, T, R), JL_EPROB (probabilities not in 0..1,
 * or all 0); *c is untouched on error. */
int jl_cg_coupling_of(jl_cg_coupling *c, const jl_cg_gains *i,
                      const jl_cg_gains *j, jl_real stay, jl_real jump,
                      jl_real mu_i, jl_real mu_j, jl_real T, jl_real R);

/* --- the filter ---------------------------------------------------------- */

/* Reals of state. */
#define JL_CGIMM_STATE(M, axes) \
    ((M) * (M) + (M) * (6 * (axes) + 17) + 6 * (axes))

typedef struct jl_cgimm {
    int M, axes;
    int order;                  /* the largest of the modes                 */
    jl_real T, R, h;            /* h = -1 / 2 R                             */
    const jl_cg_gains *gains;   /* [M]                                      */
    int stage;                  /* what may come next; see the calls        */

    jl_real *mu;                /* [M]                                      */

    /* For each mode; states are scaled, p, v T, a T^2 / 2, [axes,3]. */
    jl_real *x;                 /* [M,axes,3]                               */
    jl_real *mixed;             /* [M,axes,3] mixed and predicted (the position
                                   less base), then filtered, then x        */
    jl_real *xhat;              /* [axes,3]                                 */
    jl_real *w;                 /* [M,3] present gains, gamma / 4           */
    jl_real *goal;              /* [M,3] steady ones                        */
    jl_real *rate;              /* [M,3] 1 - exp(-1/k)                      */
    jl_real *keep;              /* [M]   1 - alpha                          */
    jl_real *q;                 /* [M]   axes log(1 / 2 pi S) / 2           */
    jl_real q_more;             /* of two modes, q_0 - q_1                  */
    jl_real *weight;            /* [M]   mu times their sum, 2^-10 to 2      */
    jl_real all, all_before, all_left;  /* sums of weights: after and before the
                                   last measurement, as kept for the next   */
    int best;                   /* likeliest mode there; -1: no measurement */
    jl_real best_sum;           /* its l                                    */
    int diverged;               /* 1: a mode's l has overflowed             */
    jl_real *c;                 /* [M]   predicted weights                  */
    jl_real *l;                 /* [M]   the axes' sum of (1 - alpha) nu^2  */
    jl_real *moving;            /* [M]   0: gains are what they will be     */
    jl_real *e;                 /* [M]   work                               */
    jl_real *d;                 /* [axes,3] of orders 2 and 3 (else 0): of
                                   d = x_0 - x_1 d_p + d_v T, d_v T; and base,
                                   p_1 + v_1 T                              */
    jl_real *Pi;                /* [M,M]                                    */
} jl_cgimm;

/* Bind a filter to its gains [M], which outlive it, and its memory: mem [cap],
 * cap >= JL_CGIMM_STATE(M, axes).  x = 0, mu uniform, gains at their start.
 * Pi [M,M], rows sum to 1.
 * Returns JL_OK, JL_EDIM (M outside 1..JL_MAX_MODES, axes outside
 * 1..JL_MAX_STATES, an order), JL_ENOMEM, JL_ENONFINITE, JL_EPROB (Pi),
 * JL_ERANGE (T or R not above 0; gains of no stable filter: alpha not in 0..1,
 * beta not in 0..4 - 2 alpha, gamma not in 0..4 alpha beta / (2 - alpha); an
 * alpha within 2 JL_EPSILON of 1, in the end or after the first measurement, as
 * of a lambda above 3e3 in float; k not in 0..1e6); *cg is untouched on
 * error. */
int jl_cgimm_init(jl_cgimm *cg, int M, const jl_cg_gains *gains, int axes,
                  jl_real T, jl_real R, const jl_real *Pi, jl_real *mem,
                  int cap);

/* Set the state: x [M,axes,order] of all modes, axis by axis p, v and, if a mode
 * has order 3, a; mu [M] or NULL (uniform).  Gains go to their start.
 * Returns JL_OK, JL_ENONFINITE (or v T, a T^2 / 2 beyond JL_LARGE), JL_EPROB;
 * unchanged on error. */
int jl_cgimm_set(jl_cgimm *cg, const jl_real *x, const jl_real *mu);

/* Let mode j's gains start again, as when a target is met anew.  Ends a step
 * under way, as jl_cgimm_set does. */
void jl_cgimm_restart(jl_cgimm *cg, int j);

/* One step with z [axes]; NULL: no measurement, all is predicted, gains wait.
 *
 * Gains are those of measurements T apart.  Where for long only every n-th comes
 * a mode's errors die out only if n beta < 4 - 2 alpha and, with order 3,
 * n gamma < 4 alpha beta / (2 - alpha): with the paper's modes up to n = 40
 * (CV), but 3 (CA); beyond it they grow without end.
 *
 * Returns JL_OK, or JL_ENONFINITE: z not finite or beyond JL_LARGE; or, from
 * then on until jl_cgimm_set, a mode has diverged, so far that nu^2 has
 * overflowed.  Unchanged then, and still finite. */
int jl_cgimm_step(jl_cgimm *cg, const jl_real *z);

/* The stages of a step, for filters spread over several processors (par.h):
 * foresee, then mix_mode and filter_mode for every j, weigh, combine.  A
 * processor mixes and filters the modes it owns; mixed[j], l[j] of the others
 * come to it by message; then, if no mode has failed anywhere, it weighs, which
 * also advances all gains, and combines.  (It must own a mode: filter_mode
 * opens weigh.)  Until weigh the filter is as before the step.
 * 0 <= j < M; z the same in filter_mode and weigh, which asks only whether it
 * is NULL.  foresee may be called at any time and starts the step anew, combine
 * right after weigh only: it has what the next mixing needs.
 * filter_mode and weigh return JL_OK, JL_EORDER (filter without foresee, weigh
 * without filter), filter_mode JL_ENONFINITE as jl_cgimm_step. */
void jl_cgimm_foresee(jl_cgimm *cg);
void jl_cgimm_mix_mode(jl_cgimm *cg, int j);
int jl_cgimm_filter_mode(jl_cgimm *cg, int j, const jl_real *z);
int jl_cgimm_weigh(jl_cgimm *cg, const jl_real *z);
void jl_cgimm_combine(jl_cgimm *cg);

/* The combined state x [axes,order], as jl_cgimm_set has it. */
void jl_cgimm_estimate(const jl_cgimm *cg, jl_real *x);

/* log p(z | what was measured before) of the last step, 0 without a
 * measurement: a logarithm, for who wants it. */
jl_real jl_cgimm_loglik(const jl_cgimm *cg);

/* --- a baseline ---------------------------------------------------------- */

/* One alpha-beta filter, an axis, with two levels of steady gains: low (0) for a
 * target that flies straight, high (1) for one that manoeuvres.  The paper
 * compares with such a filter; this is a form of our own.  A step:
 *     x- = F x,  nu = z - x-[0]
 *     s = s + c (nu - s)
 *     d = sum over axes s^2 / (S c / (2 - c)),  S = R / (1 - alpha)
 *     level 0 and d > up: 1;  level 1 and d < down: 0
 *     x = x- + (alpha, beta / T) nu,  gains of the level
 * With gains that fit the target's noise nu is white, of variance S, and d
 * chi-square with as many degrees of freedom as axes.  At an acceleration a both
 * levels stay behind for good, by (1 - alpha) a T^2 / beta in position and
 * a T (2 alpha - beta) / 2 beta in velocity: what the IMM does without. */
typedef struct jl_cg_adaptive {
    int axes;
    int level;
    jl_real T;
    jl_real w[2][2];            /* alpha, beta of each level                */
    jl_real c, up, down;
    jl_real per_d[2];           /* (2 - c) / (c S) of each level            */
    jl_real *x;                 /* [axes,2] p, v                            */
    jl_real *s;                 /* [axes]                                   */
} jl_cg_adaptive;

/* Reals of state. */
#define JL_CG_ADAPTIVE_STATE(axes) (3 * (axes))

/* Gains low, high [2] (jl_cg_steady), smoothing c in (0, 1], 0 <= down <= up;
 * mem [cap], cap >= JL_CG_ADAPTIVE_STATE(axes).  x = 0, level 1.
 * Returns JL_OK, JL_EDIM (axes outside 1..JL_MAX_STATES), JL_ENOMEM, JL_ERANGE
 * (gains of no stable filter, or another argument); *f is untouched on error. */
int jl_cg_adaptive_init(jl_cg_adaptive *f, int axes, jl_real T, jl_real R,
                        const jl_real *low, const jl_real *high, jl_real c,
                        jl_real up, jl_real down, jl_real *mem, int cap);

/* Set x [axes,2]; s = 0, level 1.
 * Returns JL_OK or JL_ENONFINITE: unchanged then. */
int jl_cg_adaptive_set(jl_cg_adaptive *f, const jl_real *x);

/* One step with z [axes]; NULL: no measurement, x is predicted.
 * Returns JL_OK or JL_ENONFINITE: unchanged then. */
int jl_cg_adaptive_step(jl_cg_adaptive *f, const jl_real *z);

#ifdef __cplusplus
}
#endif
#endif
