/* A form's functions, from its kernels, which read and write apart. */
#ifndef JL_KF_FORM_H
#define JL_KF_FORM_H

#include "jumplink/kf.h"

#include "mat/mat_k.h"

#if JL_REAL_FLOAT
#define jli_beyond_gate jli_beyond_gate_f32
#endif

/* (x-, P-) of (x, P); on error undefined.  b and e are what is expected of the
 * mode's `block` and `every`: constants where n and m are, so that loops unroll
 * where they are right. */
typedef int jli_predict_kernel(jl_real *xp, jl_real *Pp, const jl_mode *mode,
                               const jl_real *x, const jl_real *P,
                               jl_real *scratch, int n, int b);

/* (x, P) of (x-, P-) and z; on error undefined.  With JL_ENONFINITE the
 * innovation's nis is what it was, or what it is. */
typedef int jli_update_kernel(jl_real *x, jl_real *P,
                              jl_innovation *innovation, const jl_mode *mode,
                              const jl_real *xp, const jl_real *Pp,
                              const jl_real *z, jl_real *scratch, int n,
                              int m, int e);

/* After an update that failed with JL_ENONFINITE: JL_OK, and a nis above the
 * gate, if that is because of a measurement that a gate rejects; else
 * JL_ENONFINITE.  (kf_gate.c) */
int jli_beyond_gate(jl_innovation *innovation, const jl_real *z, jl_real gate,
                    int m);

JL_INLINE void jli_settle(jl_real *x, jl_real *P, const jl_real *new_x,
                          const jl_real *new_P, int n)
{
    jli_move(x, new_x, 1, n);
    jli_move(P, new_P, n, n);
}

/* jl_kf_form.predict */
JL_INLINE int jli_form_predict(jli_predict_kernel *predict, jl_real *x,
                               jl_real *P, const jl_mode *mode,
                               jl_real *scratch, int n, int b)
{
    jl_real *xp = scratch, *Pp = xp + n;
    int status = predict(xp, Pp, mode, x, P, Pp + n * n, n, b);

    if (status == JL_OK)
        jli_settle(x, P, xp, Pp, n);
    return status;
}

/* What update and step have in common: (x, P) from (x-, P-), which may be the
 * same. */
JL_INLINE int jli_form_absorb(jli_update_kernel *update, jl_real *x,
                              jl_real *P, jl_innovation *innovation,
                              const jl_mode *mode, const jl_real *xp,
                              const jl_real *Pp, const jl_real *z,
                              jl_real gate, jl_real *scratch, int n, int m,
                              int e)
{
    jl_real *new_x = scratch, *new_P = new_x + n;
    int status;

    innovation->nis = innovation->loglik = 0;
    status = update(new_x, new_P, innovation, mode, xp, Pp, z,
                    new_P + n * n, n, m, e);
    if (status == JL_ENONFINITE && gate > 0)
        status = jli_beyond_gate(innovation, z, gate, m);
    if (status != JL_OK)
        return status;
    if (!(gate > 0 && innovation->nis > gate))
        jli_settle(x, P, new_x, new_P, n);
    else if (x != xp)
        jli_settle(x, P, xp, Pp, n);
    return JL_OK;
}

/* jl_kf_form.update */
JL_INLINE int jli_form_update(jli_update_kernel *update, jl_real *x,
                              jl_real *P, jl_innovation *innovation,
                              const jl_mode *mode, const jl_real *z,
                              jl_real gate, jl_real *scratch, int n, int m,
                              int e)
{
    return jli_form_absorb(update, x, P, innovation, mode, x, P, z, gate,
                           scratch, n, m, e);
}

/* jl_kf_form.step */
JL_INLINE int jli_form_step(jli_predict_kernel *predict,
                            jli_update_kernel *update, jl_real *x, jl_real *P,
                            jl_innovation *innovation, const jl_mode *mode,
                            const jl_real *z, jl_real gate, jl_real *scratch,
                            int n, int m, int b, int e)
{
    jl_real *xp = scratch, *Pp = xp + n, *rest = Pp + n * n;
    int status = predict(xp, Pp, mode, x, P, rest, n, b);

    return status == JL_OK
        ? jli_form_absorb(update, x, P, innovation, mode, xp, Pp, z, gate,
                          rest, n, m, e)
        : status;
}

/* `name`_predict, `name`_update and `name`_step for the sizes n, m. */
#define JLI_FORM_FUNCTIONS(name, predict, update, n, m, b, e) \
    static int name##_predict(jl_real *x, jl_real *P, const jl_mode *mode, \
                              jl_real *scratch) \
    { \
        return jli_form_predict(predict, x, P, mode, scratch, n, b); \
    } \
    \
    static int name##_update(jl_real *x, jl_real *P, \
                             jl_innovation *innovation, const jl_mode *mode, \
                             const jl_real *z, jl_real gate, \
                             jl_real *scratch) \
    { \
        return jli_form_update(update, x, P, innovation, mode, z, gate, \
                               scratch, n, m, e); \
    } \
    \
    static int name##_step(jl_real *x, jl_real *P, \
                           jl_innovation *innovation, const jl_mode *mode, \
                           const jl_real *z, jl_real gate, jl_real *scratch) \
    { \
        return jli_form_step(predict, update, x, P, innovation, mode, z, \
                             gate, scratch, n, m, b, e); \
    }

/* The same with the kernels called, not written out in each: for any size, and
 * where there are no lanes and code is dearer than time. */
#define JLI_FORM_CALLS(name, predict, update, n, m, b, e) \
    static int name##_foresee(jl_real *xp, jl_real *Pp, const jl_mode *mode, \
                              const jl_real *x, const jl_real *P, \
                              jl_real *scratch, int states, int block) \
    { \
        (void)states, (void)block; \
        return predict(xp, Pp, mode, x, P, scratch, n, b); \
    } \
    \
    static int name##_absorb(jl_real *x, jl_real *P, \
                             jl_innovation *innovation, const jl_mode *mode, \
                             const jl_real *xp, const jl_real *Pp, \
                             const jl_real *z, jl_real *scratch, int states, \
                             int measured, int every) \
    { \
        (void)states, (void)measured, (void)every; \
        return update(x, P, innovation, mode, xp, Pp, z, scratch, n, m, e); \
    } \
    \
    JLI_FORM_FUNCTIONS(name, name##_foresee, name##_absorb, n, m, b, e)

#endif
