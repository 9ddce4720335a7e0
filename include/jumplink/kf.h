/* The Kalman filter of one mode.
 *
 *     predict   x- = F x + G w_bar,  P- = F P F' + G Q G'
 *     update    nu = z - H x-,  S = H P- H' + R,  K = P- H' S^-1
 *               x = x- + K nu
 *               P = (I - K H) P- (I - K H)' + K R K'      form joseph
 *               P = P- - K S K'                           form standard
 *     loglik    log N(nu; 0, S)
 *
 * The forms are equal in exact arithmetic (Bucy and Joseph 1968; the standard
 * form is computed as P- - Y'Y with Y = L^-1 H P-, S = L L').  Joseph keeps P
 * positive semidefinite where measurements are far better than the prior, as
 * long as R / (H P- H') is above the number type's epsilon; standard is cheaper
 * and fine otherwise.  Leading multiplications: predict 3/2 n^3; update joseph
 * 3/2 n^3 + 5/2 n^2 m, standard 3/2 n^2 m.  A form is a const table of
 * functions: a program that names one does not link the other.
 */
#ifndef JL_KF_H
#define JL_KF_H

#include "base.h"
#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One step's pieces, on arrays: x [n], P [n,n]; outputs must not overlap
 * inputs.
 *     predict   returns JL_OK or JL_ENONFINITE
 *     update    *loglik is set; returns JL_OK, JL_ESINGULAR, JL_ENONFINITE
 * On error the outputs are undefined, and no other array has changed. */
typedef struct jl_kf_form {
    int (*predict)(jl_real *xp, jl_real *Pp, const jl_mode *mode,
                   const jl_real *x, const jl_real *P, jl_real *scratch);
    int (*update)(jl_real *x, jl_real *P, jl_real *loglik,
                  const jl_mode *mode, const jl_real *xp, const jl_real *Pp,
                  const jl_real *z, jl_real *scratch);
} jl_kf_form;

extern const jl_kf_form jl_kf_joseph;
extern const jl_kf_form jl_kf_standard;

/* Reals of state (x, P) and of scratch.  Scratch means nothing between calls
 * and may be shared by all filters of a thread. */
#define JL_KF_STATE(n) ((n) + (n) * (n))
#define JL_KF_SCRATCH(n, m) \
    (2 * ((n) + (n) * (n)) + 2 * (n) * (n) + 2 * (n) * (m) + (m) * (m) \
     + 2 * (m))

typedef struct jl_kf {
    const jl_mode *mode;
    const jl_kf_form *form;
    jl_real *x;                 /* [n]                                      */
    jl_real *P;                 /* [n,n]                                    */
} jl_kf;

/* Bind a filter to its mode, form and memory: mem [cap], cap >=
 * JL_KF_STATE(mode->n); mode, form and mem outlive the filter.  x = 0, P = I.
 * Returns JL_OK or JL_ENOMEM; *kf is untouched on error. */
int jl_kf_init(jl_kf *kf, const jl_mode *mode, const jl_kf_form *form,
               jl_real *mem, int cap);

/* Set the estimate: x [n], P [n,n] symmetric, positive semidefinite (copied);
 * scratch [JL_KF_SCRATCH(n, m)].
 * Returns JL_OK, JL_ENONFINITE, JL_EASYM, JL_EDEF; unchanged on error. */
int jl_kf_set(jl_kf *kf, const jl_real *x, const jl_real *P,
              jl_real *scratch);

/* One time step; scratch [JL_KF_SCRATCH(n, m)].
 * Returns JL_OK or JL_ENONFINITE; unchanged on error. */
int jl_kf_predict(jl_kf *kf, jl_real *scratch);

/* One measurement z [m]; NULL: it is missing, the estimate stays as it is and
 * *loglik is 0.  loglik may be NULL.
 * Returns JL_OK, JL_ENONFINITE (z, or a result), JL_ESINGULAR; on error
 * neither the filter nor *loglik has changed. */
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
