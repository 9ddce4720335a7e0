/* The Kalman filter of one mode.
 *
 *     predict   x- = F x + G w_bar,  P- = F P F' + G Q G'
 *     update    nu = z - H x-,  S = H P- H' + R,  K = P- H' S^-1
 *               x = x- + K nu
 *               P = (I - K H) P- (I - K H)' + K R K'      form joseph
 *               P = P- - K S K'                           form standard
 *               P = U' D U, of which U and D are kept     form sqrt
 *     loglik    log N(nu; 0, S)
 *     nis       nu' S^-1 nu, the normalised innovation squared: chi-square with
 *               m degrees of freedom if the model is right
 *
 * The forms are equal in exact arithmetic (Bucy and Joseph 1968; the standard
 * form is computed as P- - Z' D^-1 Z, Z = L^-1 H P-, S = L D L').  Rounding tells
 * them apart, by r = R / (H P- H').  A covariance holds what measurements told
 * as differences of numbers as large as P-: at a start from next to nothing
 * variances have a relative error of eps / 4 r in form joseph and eps / r in
 * form standard, which is 1% at an r of 3e-6 and 1e-5 in float, 6e-15 and 2e-14
 * in double (measured with 3 states).  From r = eps on no digit is left, and a
 * variance or S may come out negative.  In float that is a gap in a record:
 * after 957 s, where r is 1e-10, standard gave a variance of the glider of
 * sim/data below 0; joseph was within 0.003 sigma of double all along.
 *
 * Form sqrt adds rows to a factor, and multiplies D by what is positive: D
 * stays >= 0, no square root is taken, and that error is some eps for any r.
 * (Bierman 1977 for the update; rotations without square roots, Gentleman 1973,
 * for the prediction and the sums of an IMM, where Thornton 1976 has Gram-
 * Schmidt.)  States are best in the order in which they become known, position,
 * velocity, acceleration.  Once settled, all forms are alike, and none gets
 * worse with time.  (Of random models, with I - K H far from normal, joseph's
 * two products with it lost up to 3 digits more than standard: P to 1e-8.)
 *
 * Leading multiplications:
 *               predict                     update
 *     joseph    3/2 n^3                     3/2 n^3 + 5/2 n^2 m
 *     standard  3/2 n^3                     3/2 n^2 m
 *     sqrt      3/2 n^3 + 3/2 n^2 p         3/2 n^2 m
 * (sqrt with F of a motion: 1/2 n^3 + 3/2 n^2 p; the others with the zeros that
 * model.h calls block and every: predict 3/2 n^2 block, update n^2 m less), and
 * for each estimate mixed into another n^2, sqrt n^3 / 2 + 3/2 n^2.  A form is a
 * const table of functions: a program that names one does not link the other.
 */
#ifndef JL_KF_H
#define JL_KF_H

#include "base.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- forms ------------------------------------------------------------- */

/* How a form keeps a covariance S [n,n], and the sums over estimates (x, S)
 * that an IMM makes of it.  w: weights >= 0 that sum to 1; d = x - mean.
 *     take    S = P, a covariance; scratch [n n + 2 n]; S may be P
 *     give    P = the covariance that S stands for
 *     pool    mean = sum w_i x_i, S = sum w_i (S_i + d_i d_i') over M estimates
 *             x [M,n], Ss [M,n,n]; scratch [2 n]
 *     blend   the same of two: a (x1, S1) + b (x2, S2) + a b d d', d = x1 - x2;
 *             x, S may be x1, S1; scratch [2 n]
 *     part    S [k,k] = rows and columns map[0] < map[1] < .. of Sn [n,n];
 *             scratch [n]
 *     whole   ... and back: Sn [n,n] from S [k,k], with the variances var [n]
 *             for what the map leaves out
 * These cannot fail. */
typedef struct jl_cov {
    int factored;               /* 0: S is P, symmetric to the bit.  1: a factor,
                                   U' D U of jl_mat_ud with zeros below the
                                   diagonal                                 */
    void (*take)(jl_real *S, const jl_real *P, jl_real *scratch, int n);
    void (*give)(jl_real *P, const jl_real *S, int n);
    void (*pool)(jl_real *mean, jl_real *S, const jl_real *w, const jl_real *x,
                 const jl_real *Ss, jl_real *scratch, int M, int n);
    void (*blend)(jl_real *x, jl_real *S, jl_real a, const jl_real *x1,
                  const jl_real *S1, jl_real b, const jl_real *x2,
                  const jl_real *S2, jl_real *scratch, int n);
    void (*part)(jl_real *S, const jl_real *Sn, const int *map,
                 jl_real *scratch, int k, int n);
    void (*whole)(jl_real *Sn, const jl_real *S, const int *map,
                  const jl_real *var, int k, int n);
} jl_cov;

extern const jl_cov jl_cov_full;        /* P itself: forms joseph, standard */
extern const jl_cov jl_cov_ud;          /* U' D U: forms sqrt, unscented    */

/* What an update tells besides the estimate. */
typedef struct jl_innovation {
    jl_real loglik;             /* log N(nu; 0, S)                          */
    jl_real nis;                /* nu' S^-1 nu                              */
    jl_real *nu;                /* [m] z - h(x-); the caller's memory       */
} jl_innovation;

/* A step's pieces, on arrays: x [n], P [n,n] as `cov` keeps it, in place and
 * unchanged on error; scratch [JL_FORM_SCRATCH(n, m)], which overlaps nothing.
 *     predict
 *     update    with z [m]; *innovation is set, on error undefined.  A nis above
 *               the gate leaves x, P as they are; gate 0: none
 *     step      predict, and update: the same bits in less time
 * They return JL_OK, JL_ENONFINITE, update and step also JL_ESINGULAR, or the
 * code of a nonlinear mode's function.  With a gate, a finite z that is too
 * large to be used is outside: its nis is infinite, its loglik -infinite, or the
 * nis is what it is, though x would be beyond JL_LARGE. */
typedef struct jl_kf_form {
    int (*predict)(jl_real *x, jl_real *P, const jl_mode *mode,
                   jl_real *scratch);
    int (*update)(jl_real *x, jl_real *P, jl_innovation *innovation,
                  const jl_mode *mode, const jl_real *z, jl_real gate,
                  jl_real *scratch);
    int (*step)(jl_real *x, jl_real *P, jl_innovation *innovation,
                const jl_mode *mode, const jl_real *z, jl_real gate,
                jl_real *scratch);
    const jl_cov *cov;
    int n, m;                   /* the sizes it is for; 0: any              */
} jl_kf_form;

extern const jl_kf_form jl_kf_joseph;
extern const jl_kf_form jl_kf_standard;
extern const jl_kf_form jl_kf_sqrt;     /* factors U' D U                   */
extern const jl_kf_form jl_kf_unscented;        /* sigma points; factors    */

/* The form unscented (Julier, Uhlmann, Durrant-Whyte 2000) takes the functions
 * of a nonlinear mode at 2 n + 1 points,
 *     x, weight kappa / (n + kappa), and, for P = U' D U,
 *     x +- sqrt((n + kappa) D_k) U_k, weight 1 / 2 (n + kappa) each,
 * and the means and covariances of their values; matrices as the form sqrt.  It
 * needs no Jacobian, and where a Jacobian misses how much a function bends
 * within a deviation it is the better one.  kappa = 0 is the cubature rule
 * (Arasaratnam, Haykin 2009); 3 - n, for n <= 3, has a normal distribution's
 * fourth moments along the points.  As no weight is negative, covariances stay
 * positive semidefinite.  Leading multiplications: predict 3 n^3, update
 * 3 n^2 m, with 2 n + 1 calls each. */

/* Forms of fixed size, for the sizes that kf_sizes.def lists: the same bits in
 * a third to a half of the time (sqrt: 0.7 to 0.9 of it), for more code.
 *     &JL_KF_FIXED(standard, 6, 3)    form standard, n = 6, m = 3 */
#if JL_REAL_FLOAT
#define JL_KF_FIXED(form, n, m) jl_kf_##form##_##n##_##m##_f32
#else
#define JL_KF_FIXED(form, n, m) jl_kf_##form##_##n##_##m
#endif
#define JL_KF_SIZE(n, m) \
    extern const jl_kf_form JL_KF_FIXED(joseph, n, m); \
    extern const jl_kf_form JL_KF_FIXED(standard, n, m); \
    extern const jl_kf_form JL_KF_FIXED(sqrt, n, m);
#include JL_KF_SIZES_FILE
#undef JL_KF_SIZE

/* The form's equal of fixed size n, m, if there is one; else the form itself.
 * A program that calls it links them all. */
const jl_kf_form *jl_kf_fixed(const jl_kf_form *form, int n, int m);

#define JL_FORM_SCRATCH(n, m) \
    (5 * (n) * (n) + 4 * (n) * (m) + 2 * (m) * (m) + 7 * (n) + 5 * (m))

/* --- the filter -------------------------------------------------------- */

enum {                          /* the verdict on a measurement */
    JL_MISSING = 0,             /* there is none                            */
    JL_ACCEPTED = 1,
    JL_REJECTED = 2             /* by the gate                              */
};

/* Reals of state (x, P, nu) and of scratch.  Scratch means nothing between
 * calls and may be shared by all filters of a thread. */
#define JL_KF_STATE(n, m) ((n) + (n) * (n) + (m))
#define JL_KF_SCRATCH(n, m) ((m) + JL_FORM_SCRATCH(n, m))

typedef struct jl_kf {
    const jl_mode *mode;
    const jl_kf_form *form;
    jl_real *x;                 /* [n]                                      */
    jl_real *P;                 /* [n,n] as the form keeps it: jl_kf_cov    */

    int verdict;                /* on the last z: JL_ACCEPTED, ...          */
    jl_innovation innovation;   /* of the last that was not missing         */
    jl_real nis_mean;           /* mean nis of those accepted since set     */
    unsigned long accepted;     /* ... so many                              */

    /* gate */
    jl_real gate;               /* reject above this nis; 0: accept all     */
    int most;                   /* rejections in a row; then accept         */
    int run;                    /* ... so many since the last accepted      */
    unsigned long rejected;     /* all since set                            */
} jl_kf;

/* Bind a filter to its mode, form and memory: mem [cap], cap >=
 * JL_KF_STATE(n, m) of the mode; mode, form and mem outlive the filter.  x = 0,
 * P = I, no gate.
 * Returns JL_OK, JL_EDIM (a form for other sizes) or JL_ENOMEM; *kf is
 * untouched on error. */
int jl_kf_init(jl_kf *kf, const jl_mode *mode, const jl_kf_form *form,
               jl_real *mem, int cap);

/* Set the estimate: x [n], P [n,n] symmetric, positive semidefinite (copied);
 * scratch [JL_KF_SCRATCH(n, m)].
 * Returns JL_OK, JL_ENONFINITE, JL_EASYM, JL_EDEF; unchanged on error. */
int jl_kf_set(jl_kf *kf, const jl_real *x, const jl_real *P,
              jl_real *scratch);

/* The covariance P [n,n] of the present estimate, in any form. */
void jl_kf_cov(const jl_kf *kf, jl_real *P);

/* Gate: a measurement whose nis is above `nis` is rejected, which is as if it
 * were missing; but after `most` rejections in a row the next is accepted, for
 * then it is the filter that is wrong.  Missing ones do not end the row: they
 * say nothing against it.  nis 0: no gate.  With probability p a good
 * measurement passes the chi-square quantile:
 *     m           1      2      3      4      5      6
 *     p 0.99    6.63   9.21  11.34  13.28  15.09  16.81
 *     p 0.999  10.83  13.82  16.27  18.47  20.52  22.46
 *     p 0.9999 15.14  18.42  21.11  23.51  25.74  27.86
 * What is finite but too large to be used, a z beyond JL_LARGE or an infinite
 * nis, is an error without a gate, and with one always rejected.
 * Returns JL_OK, or JL_ERANGE (nis not finite or below 0, most below 0). */
int jl_kf_gate(jl_kf *kf, jl_real nis, int most);
#define JL_GATE_MOST 5          /* what `most` usually is */

/* One time step; scratch [JL_KF_SCRATCH(n, m)].
 * Returns JL_OK, JL_ENONFINITE, or the code of a nonlinear mode's function;
 * unchanged on error. */
int jl_kf_predict(jl_kf *kf, jl_real *scratch);

/* One measurement z [m]; NULL: it is missing, the estimate stays as it is and
 * *loglik is 0, and so it is with one that the gate rejects (kf->verdict).
 * loglik may be NULL.
 * Returns JL_OK, JL_ENONFINITE (z, or a result), JL_ESINGULAR, or the code of a
 * nonlinear mode's function; on error neither the filter nor *loglik has
 * changed. */
int jl_kf_update(jl_kf *kf, jl_real *loglik, const jl_real *z,
                 jl_real *scratch);

/* Predict and update in one; arguments and codes as theirs.  On error the
 * filter is as before the step. */
int jl_kf_step(jl_kf *kf, jl_real *loglik, const jl_real *z,
               jl_real *scratch);

#ifdef __cplusplus
}
#endif
#endif
