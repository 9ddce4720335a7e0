/* The modified extended Kalman filter (MEKF) in square-root form, for systems
 * that are linear in their states as long as some parameters are known:
 *     x(k+1) = f(y) x + G1 w1            n states
 *     y(k+1) = h(x, y) + G2 w1 + G3 w2   m parameters
 *     z(k)   = c(x, y) x + v             r measurements, c an r x n matrix
 *     cov(w1, w2) = Q,  cov(v) = R,  white, and v apart from w
 * f, c, G1, G2, G3 are matrix functions.  Two filters feed each other: A, an
 * extended one of x and y, and B, a linear one of x in which the parameters are
 * A's (Chui, Chen, Chui 1990; square-root form and its array: Mu, Dai).
 *
 * A step, from xbar, ybar (A), xhat (B) and the factors U'U = P (A), U1'U1 = P1
 * (B), upper triangular, Q = U_Q' U_Q, Q1 its leading block, R = U_R' U_R:
 *     F  = [ f, d(f x)/dy ; dh/dx, dh/dy ]       at xhat, ybar
 *     G  = [ G1 0 ; G2 G3 ]                      at xbar, ybar; G1 for B too
 *     xp = f xhat,  yp = h(xhat, ybar)
 *     c  = c(xp, yp),  H = d(c x)/d[x; y]        at xp, yp
 *     A  Givens rotations take, to an upper triangle,
 *        [ U F'H'     U F'   ]      [ V'  V^-1 H Pp ]
 *        [ U_Q G'H'   U_Q G' ]  to  [ 0   U         ]
 *        [ U_R        0      ]      [ 0   0         ]
 *        xbar, ybar = xp, yp + (H Pp)' (V V')^-1 (z - c xp)
 *     B  the same with f, G1, U1, U_Q1 and, in H's place, cc:
 *        JL_MEKF_PREV  c at xbar, ybar before the step (the paper)
 *        JL_MEKF_PRED  c at xp, yp
 *        JL_MEKF_FILT  c at xbar, ybar after A's update
 *        xhat = xp + (cc P1p)' (V1 V1')^-1 (z - cc xp)
 *
 * When it pays: seldom.  B takes the parameters as known, so its gain falls too
 * low.  Measured (`jumplink sim --scenario ar1|spring2|turn`), a plain extended
 * filter of x and y (jl_ekf below) is the better one in most runs; MEKF gains,
 * a little, where the parameter's variance is given too small or the noise much
 * too large, and that not in every system (spring2, not turn).  `spread` repairs
 * most of it: over 10000 runs of `turn` xhat's positions are 27.6 m off (rms),
 * with spread 10.4 m, the EKF's 7.5 m.
 */
#ifndef JL_MEKF_H
#define JL_MEKF_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- models -------------------------------------------------------------- */

/* Functions return JL_OK, or a negative code of base.h that ends the step.
 * Each must depend on nothing but its arguments and what context points to.
 * What they write is 0 before. */
typedef struct jl_mekf_model {
    int n, m, r;                /* states, parameters, measurements         */
    int p1, p2;                 /* noises w1, w2                            */

    /* f [n,n] at y [m] */
    int (*f)(jl_real *f, const jl_real *y, void *context);
    /* y_next [m] = h(x, y), x [n]; NULL: y */
    int (*h)(jl_real *y_next, const jl_real *x, const jl_real *y,
             void *context);
    /* c [r,n] at x, y */
    int (*c)(jl_real *c, const jl_real *x, const jl_real *y, void *context);
    /* G1 [n,p1], G2 [m,p1], G3 [m,p2] at x, y */
    int (*G)(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
             const jl_real *y, void *context);

    /* Derivatives; NULL: by central differences, as of jl_mode_move (model.h),
     * with 2 calls of f, h or c for each variable. */
    /* J [n,m] = d(f(y) x)/dy */
    int (*df)(jl_real *J, const jl_real *x, const jl_real *y, void *context);
    /* J [m,n+m] = d h/d[x; y] */
    int (*dh)(jl_real *J, const jl_real *x, const jl_real *y, void *context);
    /* J [r,n+m] = d(c(x, y) x)/d[x; y] */
    int (*dc)(jl_real *J, const jl_real *x, const jl_real *y, void *context);
    void *context;
} jl_mekf_model;

/* --- the filter ---------------------------------------------------------- */

typedef enum jl_mekf_c {
    JL_MEKF_PREV, JL_MEKF_PRED, JL_MEKF_FILT
} jl_mekf_c;

typedef struct jl_mekf {
    const jl_mekf_model *model;
    jl_mekf_c c;                /* as set by the user; init: JL_MEKF_PREV   */
    int spread;                 /* 1: B's predicted covariance also has
                                   J P_yy J', J = d(f x)/dy, P_yy of A before
                                   the step: what not knowing the parameters
                                   does to x.  The papers do without; init: 0 */
    jl_real *x;                 /* [n+m] xbar, ybar                         */
    jl_real *xhat;              /* [n]                                      */
    jl_real *U;                 /* [n+m,n+m] upper, diagonal >= 0           */
    jl_real *U1;                /* [n,n]                                    */
    jl_real *UQ;                /* [p1+p2,p1+p2]; its leading block is U_Q1 */
    jl_real *UR;                /* [r,r]                                    */
} jl_mekf;

/* Reals of state, and of scratch, which means nothing between calls. */
#define JL_MEKF_STATE(n, m, r, p1, p2) \
    (((n) + (m)) * ((n) + (m) + 1) + (n) * ((n) + 1) \
     + ((p1) + (p2)) * ((p1) + (p2)) + (r) * (r))
#define JL_MEKF_SCRATCH(n, m, r, p1, p2) \
    (JL_MEKF_ARRAY(n, m, r, p1, p2) + JL_MEKF_ARRAY_B(n, m, r, p1) \
     + JL_MEKF_LINEAR(n, m, r, p1, p2) + ((r) + 1) * (n) + (r) \
     + ((p1) + (p2)) * ((p1) + (p2)))

/* ... of which: the arrays of A and of B that are made triangular (the latter
 * with rows for `spread`), and F, G, H, c, xp, z - c xp. */
#define JL_MEKF_ARRAY(n, m, r, p1, p2) \
    (((r) + (n) + (m) + (p1) + (p2)) * ((r) + (n) + (m)))
#define JL_MEKF_ARRAY_B(n, m, r, p1) \
    (((r) + 2 * (n) + (m) + (p1)) * ((r) + (n)))
#define JL_MEKF_LINEAR(n, m, r, p1, p2) \
    (((n) + (m)) * ((n) + (m) + (p1) + (p2) + (r) + 1) + (r) * ((n) + 1))

/* Bind a filter to its model, which outlives it, and its memory: mem [cap],
 * cap >= JL_MEKF_STATE.  Q [p1+p2,p1+p2], R [r,r] positive semidefinite: R may
 * be singular where V stays regular.  State 0, covariances the unit matrix.
 * scratch [JL_MEKF_SCRATCH].  filter->c and ->spread may be set from then on.
 * Returns JL_OK, JL_EDIM (n, m, r, p1 not in 1.., p2 not in 0.., n + m, r,
 * p1 + p2 not to JL_MAX_STATES; f, c or G missing), JL_ENOMEM, JL_ENONFINITE,
 * JL_EASYM, JL_EDEF; *filter is untouched on error. */
int jl_mekf_init(jl_mekf *filter, const jl_mekf_model *model,
                 const jl_real *Q, const jl_real *R, jl_real *mem, int cap,
                 jl_real *scratch);

/* Set the state: x [n+m], also of B's x, P [n+m,n+m], P1 [n,n] or NULL: P's
 * leading block.
 * Returns JL_OK, JL_ENONFINITE, JL_EASYM, JL_EDEF; unchanged on error. */
int jl_mekf_set(jl_mekf *filter, const jl_real *x, const jl_real *P,
                const jl_real *P1, jl_real *scratch);

/* A step with z [r]; NULL: no measurement, all is predicted.
 * Returns JL_OK, JL_ENONFINITE (z, what a function computed, or a state or a
 * deviation beyond JL_LARGE), JL_ESINGULAR (V or V1: a diagonal element is
 * rounding, 4 JL_EPSILON times the array's rows, of its component's deviation),
 * or a function's code: unchanged then.  Most of its time takes A's triangle:
 * 2 (n+m+r)^2 (2 (n+m+r) / 3 + p1 + p2) multiplications. */
int jl_mekf_step(jl_mekf *filter, const jl_real *z, jl_real *scratch);

/* P = U'U [n+m,n+m] of A; P1 [n,n] of B; NULL for what is not wanted. */
void jl_mekf_cov(const jl_mekf *filter, jl_real *P, jl_real *P1);

/* --- the plain extended Kalman filter of [x; y] --------------------------- */

/* The rival, with covariances:
 *     F, G, H as above but all at its own estimate and prediction,
 *     Pp = F P F' + G Q G',  S = H Pp H' + R,  K = Pp H' S^-1
 *     [x; y] = [f x; h] + K (z - c xp),  P = Pp - K S K'
 * Measurements that are much better than what is known (tests/golden/mekf,
 * stress32 and stress32_ct4: R / P 6e-8 and 1e-10) cost it digits: there its
 * variances are wrong by 3e-9 and 2e-6 of themselves, MEKF's by 6e-13; in float
 * by 0.5 and 800, MEKF's by 4e-4. */
typedef struct jl_ekf {
    const jl_mekf_model *model;
    jl_real *x;                 /* [n+m]                                    */
    jl_real *P;                 /* [n+m,n+m]                                */
    jl_real *Q;                 /* [p1+p2,p1+p2]                            */
    jl_real *R;                 /* [r,r]                                    */
} jl_ekf;

#define JL_EKF_STATE(n, m, r, p1, p2) \
    (((n) + (m)) * ((n) + (m) + 1) + ((p1) + (p2)) * ((p1) + (p2)) \
     + (r) * (r))
#define JL_EKF_SCRATCH(n, m, r, p1, p2) \
    (JL_MEKF_LINEAR(n, m, r, p1, p2) \
     + ((n) + (m)) * (2 * ((n) + (m)) + (p1) + (p2) + (r)) + (r) * (r) \
     + ((p1) + (p2)) * ((p1) + (p2)))

/* As jl_mekf_init, _set and _step, and with the same codes; JL_ESINGULAR is of
 * S.  scratch [JL_EKF_SCRATCH] */
int jl_ekf_init(jl_ekf *filter, const jl_mekf_model *model, const jl_real *Q,
                const jl_real *R, jl_real *mem, int cap, jl_real *scratch);
int jl_ekf_set(jl_ekf *filter, const jl_real *x, const jl_real *P,
               jl_real *scratch);
int jl_ekf_step(jl_ekf *filter, const jl_real *z, jl_real *scratch);

#ifdef __cplusplus
}
#endif
#endif
