/* Models: what one mode of a jumping system does.
 *
 *     x(k+1) = F x(k) + G (w + w_bar),   w ~ N(0, Q)     n states, p noises
 *     z(k)   = H x(k) + v,               v ~ N(0, R)     m measurements
 *
 * given by matrices, or from a catalogue of motions that can be rebuilt for
 * any time step; and the Markov chain that jumps between the modes.
 * (Pan, Dai, Zhang 1997, eq. 1-3; F is their Phi, G their Gamma.)
 */
#ifndef JL_MODEL_H
#define JL_MODEL_H

#include "base.h"
#include "mat.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reals of memory for a mode: F, H, R; of G, Q, w_bar what the filters need,
 * G Q G' and G w_bar; and the noises as factors, for forms that keep factors. */
#define JL_MODE_MEM(n, m, p) \
    (2 * (n) * (n) + (n) + (m) * (n) + 2 * (m) * (m) + (n) * (p) + (p))

typedef struct jl_mode jl_mode;
struct jl_nonlinear;

/* Matrices that are written by other means than jl_mode_set and jl_mode_motion
 * want `block` and `every` 0, which is right for any: products leave out the
 * zeros that these promise. */
struct jl_mode {
    int n, m, p;                /* states, measurements, noises             */
    jl_real *F;                 /* [n,n]                                    */
    jl_real *W;                 /* [n,n] G Q G', process noise              */
    jl_real *u;                 /* [n]   G w_bar, its mean                  */
    jl_real *H;                 /* [m,n]                                    */
    jl_real *R;                 /* [m,m]                                    */
    jl_real *V;                 /* [m,m] R = U' D U as jl_mat_ud has it     */
    jl_real *N;                 /* [p,n] rows N_k of noise, and ...         */
    jl_real *q;                 /* [p]   their weights: W = sum q_k N_k' N_k */
    int block;                  /* F couples i, k only if i / block and k / block
                                   are equal: the states of one axis; n, or 0:
                                   any do                                   */
    int every;                  /* H picks states 0, every, 2 every, ..: the
                                   positions; or 0                          */

    const struct jl_nonlinear *nonlinear;       /* or NULL: F x + u, H x    */
    int (*move)(jl_real *xp, jl_real *F, const jl_mode *mode,
                const jl_real *x, jl_real *scratch);    /* jl_mode_move     */
    int (*sense)(jl_real *nu, jl_real *H, const jl_mode *mode,
                 const jl_real *z, const jl_real *x,
                 jl_real *scratch);                     /* jl_mode_sense;
                                   both NULL if linear, so that only programs
                                   with nonlinear modes link what these need */
};

/* Reals of scratch for jl_mode_set. */
#define JL_MODE_SCRATCH(n, m, p) \
    (2 * (n) * (n) + 2 * (n) * (p) + (n) + 2 * (m) * (m) + 2 * (p) * (p) \
     + 2 * (m) + 2 * (p))

/* Bind a mode to its memory: mem [cap], cap >= JL_MODE_MEM(n, m, p); all
 * matrices are zero until jl_mode_set or jl_mode_motion fills them.
 * Returns JL_OK, JL_EDIM (n, m, p outside 1..JL_MAX_STATES), JL_ENOMEM;
 * *mode is untouched on error. */
int jl_mode_init(jl_mode *mode, int n, int m, int p, jl_real *mem, int cap);

/* Give a mode its matrices (copied): F [n,n] G [n,p] Q [p,p] w_bar [p], H [m,n]
 * R [m,m]; scratch [JL_MODE_SCRATCH(n, m, p)].  NULL for w_bar is 0, and so it
 * is for F and H, in modes that have functions in their place.
 * Q must be positive semidefinite, R positive definite, with pivots of at least
 * JL_REAL_MIN.
 * Returns JL_OK, JL_ENONFINITE, JL_EASYM, JL_EDEF; *mode is untouched on
 * error. */
int jl_mode_set(jl_mode *mode, const jl_real *F, const jl_real *G,
                const jl_real *Q, const jl_real *w_bar, const jl_real *H,
                const jl_real *R, jl_real *scratch);

/* --- nonlinear modes --------------------------------------------------- */

/* What a mode does that no matrix says, with the noises of its mode:
 *     x(k+1) = f(x(k)) + G (w + w_bar),     z(k) = h(x(k)) + v
 * Each function returns JL_OK, or a negative code of base.h that ends the step
 * (a bearing has no value at range 0: JL_ERANGE).  It must depend on nothing
 * but its arguments, which are finite, and what context points to (a time step
 * that varies is there), and be the same on every PE; same bits everywhere need
 * base.h's elementary functions.
 * The forms joseph, standard and sqrt linearise f at the estimate and h at the
 * prediction (extended Kalman filter: Jazwinski 1970, chapter 8); the form
 * unscented does not.  States are averaged as they are: an angle among them
 * must not be wrapped. */
typedef struct jl_nonlinear {
    /* y [n] = f(x), x [n]; NULL: the mode's F x */
    int (*f)(jl_real *y, const jl_real *x, void *context);
    /* F [n,n] = df/dx at x; NULL: by central differences */
    int (*jacobian_f)(jl_real *F, const jl_real *x, void *context);
    /* z [m] = h(x), x [n]; NULL: the mode's H x */
    int (*h)(jl_real *z, const jl_real *x, void *context);
    /* H [m,n] = dh/dx at x; NULL: by central differences */
    int (*jacobian_h)(jl_real *H, const jl_real *x, void *context);
    /* d [m] = a - b, with angles brought to [-pi, pi), of measurements or of
     * differences; d may be a or b.  NULL: the plain difference. */
    void (*residual)(jl_real *d, const jl_real *a, const jl_real *b,
                     void *context);
    void *context;
    jl_real kappa;              /* >= 0, usually 0: spread of the points of the
                                   form unscented (kf.h)                    */
} jl_nonlinear;

/* Make a mode, which has its noises by jl_mode_set or jl_mode_motion,
 * nonlinear; NULL makes it linear again.  *nonlinear outlives the mode, which
 * later calls of jl_mode_set and jl_mode_motion leave nonlinear, and
 * jl_mode_init makes linear.
 * Returns JL_OK, or JL_ERANGE (kappa not finite or below 0): *mode is
 * untouched. */
int jl_mode_nonlinear(jl_mode *mode, const jl_nonlinear *nonlinear);

/* x- and, unless F is NULL, the Jacobian of a mode at x:
 *     xp [n] = f(x) + u, or F x + u;  F [n,n];  x [n];  scratch [3 n]
 * A numerical Jacobian takes 2 n calls of f with steps of eps^(1/3) s, s =
 * max(|x_i|, 1).  Its error is about eps^(2/3) (s^2 |f'''| / 6 + |f| / s);
 * eps^(2/3) = 4e-11 (float: 2e-5).
 * Returns JL_OK, JL_ENONFINITE (a function gave NaN, or more than JL_LARGE), or
 * the code of a function. */
int jl_mode_move(jl_real *xp, jl_real *F, const jl_mode *mode,
                 const jl_real *x, jl_real *scratch);

/* The innovation and, unless H is NULL, the Jacobian of a mode at x:
 *     nu [m] = z - h(x), or z - H x;  H [m,n];  z [m];  scratch [n + 2 m]
 * Differences are the residual's, also in a numerical Jacobian.
 * Returns as jl_mode_move. */
int jl_mode_sense(jl_real *nu, jl_real *H, const jl_mode *mode,
                  const jl_real *z, const jl_real *x, jl_real *scratch);

/* --- catalogue --------------------------------------------------------- */

enum {
    JL_MOTION_CV = 1,           /* constant velocity                        */
    JL_MOTION_CA = 2,           /* constant acceleration                    */
    JL_MOTION_CT = 3,           /* coordinated turn of known rate, 2 axes   */
    JL_MOTION_SINGER = 4        /* acceleration that decays                 */
};

/* A motion along `axes` coordinates.  The state holds per axis position and
 * velocity (order 2) or position, velocity, acceleration (order 3), axis by
 * axis; positions are measured with standard deviation sigma_z.  With T the
 * time step, per axis:
 *     CV  F = [1 T; 0 1], G = [T^2/2; T]; with order 3 the acceleration has a
 *         zero row in both (beside a CA, order 2 and jl_imm_init_sizes see
 *         manoeuvres sooner)
 *     CA  F = [1 T T^2/2; 0 1 T; 0 0 1], G = [T^2/2; T; 1]       (order 3)
 *     CT  the velocity turns by turn_rate T and the position follows; G as CV
 *         (axes 2; order 2, or 3 with zero acceleration)
 * and Q = accel_std^2 I, one noise an axis;
 *     Singer  the acceleration is a Markov process of standard deviation
 *         accel_std and correlation time tau_s: with a = 1 / tau_s,
 *         F = [1 T (a T - 1 + exp(-a T)) / a^2; 0 1 (1 - exp(-a T)) / a;
 *              0 0 exp(-a T)],  W = 2 a accel_std^2 * integral over 0..T of f f'
 *         where f is F's last column (Singer 1970).  W has full rank: three
 *         noises an axis.                                     (order 3)
 * R = sigma_z^2 I.  Singer's F, W, N, q are within 5 JL_EPSILON of themselves,
 * exp(-a T) within JL_EPSILON of 1, for any T / tau_s. */
typedef struct jl_motion {
    int kind;                   /* JL_MOTION_...                            */
    int axes;                   /* 1 or more; CT: 2                         */
    int order;                  /* 2 or 3; CA, Singer: 3                    */
    jl_real accel_std;          /* [m/s^2] >= 0                             */
    jl_real turn_rate;          /* [rad/s] CT only; may be 0                */
    jl_real sigma_z;            /* [m] > 0                                  */
    jl_real tau_s;              /* [s] > 0, Singer only                     */
} jl_motion;

/* The sizes of a motion's mode are n = axes order, m = axes, and p = this:
 * axes; Singer: 3 axes, as many as n.
 * Returns p, or JL_EDIM for a motion that is none (axes, order, kind). */
int jl_motion_noises(const jl_motion *motion);

/* Fill a mode (of the sizes above) for time step dt [s] >= 0; over dt = 0
 * positions and velocities stay.  Cheap enough for every step of an irregular
 * record; and no gap in one is too long: dt may be up to sqrt(JL_LARGE) (float:
 * 1e9 s), accel_std dt^2 / 2 up to JL_LARGE.  CT turns by turn_rate dt, rounded,
 * less whole turns: an angle that is off by JL_EPSILON |turn_rate| dt at most,
 * which becomes a turn in float at 5e7 rad.
 * Returns JL_OK, JL_EDIM (sizes, axes, order, kind), JL_ENONFINITE (a number
 * of the motion or dt above sqrt(JL_LARGE), or a product above JL_LARGE),
 * JL_ERANGE (accel_std < 0, sigma_z^2 < JL_REAL_MIN, tau_s <= 0 or tau_s
 * below 1 / sqrt(JL_LARGE)), JL_ETIME (dt < 0); *mode is untouched on error.
 *
 * With another sensor, such as a radar, fill a mode by this, and from it one
 * with p = n noises, where I [n,n] is the identity and H may be NULL:
 *     jl_mode_set(&radar, cv.F, I, cv.W, NULL, H, R, scratch) */
int jl_mode_motion(jl_mode *mode, const jl_motion *motion, jl_real dt);

/* The state after a first measurement z [axes]: x [n] at z with velocity 0 and
 * acceleration 0; P [n,n] diagonal: sigma_z^2, v0_std^2, a0_std^2 an axis.
 * Returns JL_OK, JL_EDIM, JL_ENONFINITE, JL_ERANGE (a deviation <= 0);
 * x and P are untouched on error. */
int jl_motion_start(jl_real *x, jl_real *P, const jl_motion *motion,
                    const jl_real *z, jl_real v0_std, jl_real a0_std);

/* --- the chain --------------------------------------------------------- */

/* Transition probabilities over dt [s] >= 0 from mean dwell times:
 *     Pi[i][i] = exp(-dt / sojourn_s[i]), the rest of row i shared evenly
 * Pi [M,M], sojourn_s [M] > 0.  With one mode Pi = 1.
 *
 * This is one jump at most: what leaves within dt does not come back.  Exact is
 * the exponential of the rates, in which it does; the difference is of second
 * order in dt.  Two modes of 20 s stay with 0.951 over 1 s, where 0.952 is
 * exact; 0.607 over 10 s, 0.684 exact; but 0.000 over 957 s, 0.500 exact, so
 * after a long gap they change places, and only small steps go to the
 * stationary distribution, sojourn_s / sum of sojourn_s.  Those are Pi(dt/k)^k
 * by jl_mat_mul, or better, as the motions are mixed too, k steps without a
 * measurement.  With steps h of up to an eighth of the shortest sojourn Pi is
 * within a tenth of h / that sojourn of the exponential.
 * Returns JL_OK, JL_EDIM, JL_ENONFINITE, JL_ERANGE (a sojourn <= 0), JL_ETIME
 * (dt < 0); Pi is untouched on error. */
int jl_chain_sojourn(jl_real *Pi, const jl_real *sojourn_s, int M,
                     jl_real dt);

/* Check a chain: Pi [M,M] and mu [M]; either may be NULL.
 * Returns JL_OK, JL_ENONFINITE, or JL_EPROB (an entry below 0, a row or mu
 * whose sum is further from 1 than JL_PROB_TOLERANCE + 2 M JL_EPSILON). */
#if JL_REAL_FLOAT
#define JL_PROB_TOLERANCE JL_C(1.0e-5)
#else
#define JL_PROB_TOLERANCE JL_C(1.0e-9)
#endif
int jl_chain_check(const jl_real *Pi, const jl_real *mu, int M);

#ifdef __cplusplus
}
#endif
#endif
