/* The Kalman filter as an object: a form's steps, committed when they went
 * well. */
#include "kf/kf_gate.h"

#include "mat/mat_k.h"

int jl_kf_init(jl_kf *kf, const jl_mode *mode, const jl_kf_form *form,
               jl_real *mem, int cap)
{
    int n = mode->n, m = mode->m, i;

    if (form->n != 0 && (form->n != n || form->m != m))
        return JL_EDIM;
    if (cap < JL_KF_STATE(n, m))
        return JL_ENOMEM;
    memset(kf, 0, sizeof *kf);
    kf->mode = mode;
    kf->form = form;
    kf->x = mem;
    kf->P = mem + n;
    kf->innovation.nu = kf->P + n * n;
    memset(mem, 0, (size_t)JL_KF_STATE(n, m) * sizeof *mem);
    for (i = 0; i < n; i++)
        kf->P[i * (n + 1)] = 1;         /* a covariance, and a factor of it */
    return JL_OK;
}

static void forget(jl_kf *kf)
{
    jl_real *nu = kf->innovation.nu;

    memset(&kf->innovation, 0, sizeof kf->innovation);
    memset(nu, 0, (size_t)kf->mode->m * sizeof *nu);
    kf->innovation.nu = nu;
    kf->nis_mean = 0;
    kf->accepted = 0;
    kf->rejected = 0;
    kf->run = 0;
    kf->verdict = JL_MISSING;
}

int jl_kf_set(jl_kf *kf, const jl_real *x, const jl_real *P,
              jl_real *scratch)
{
    int n = kf->mode->n, status;

    if (!jl_vec_within(x, n, JL_LARGE))
        return JL_ENONFINITE;
    status = jl_mat_check_cov(P, scratch, n);
    if (status != JL_OK)
        return status;
    jli_copy(kf->x, x, n);
    kf->form->cov->take(kf->P, P, scratch, n);
    forget(kf);
    return JL_OK;
}

void jl_kf_cov(const jl_kf *kf, jl_real *P)
{
    kf->form->cov->give(P, kf->P, kf->mode->n);
}

int jl_kf_predict(jl_kf *kf, jl_real *scratch)
{
    int n = kf->mode->n, status;
    jl_real *x = scratch, *P = x + n;

    status = kf->form->predict(x, P, kf->mode, kf->x, kf->P, P + n * n);
    if (status == JL_OK)
        jli_copy(kf->x, x, n + n * n);
    return status;
}

/* Above this nis a measurement is rejected; 0: never. */
static jl_real limit(const jl_kf *kf)
{
    return kf->gate > 0 && kf->run >= kf->most ? JL_REAL_MAX : kf->gate;
}

/* Counts stay where they are as large as can be: a mean divides by one, and one
 * that is signed must not overflow. */
static void count(jl_kf *kf, const jl_innovation *got)
{
    jl_real *nu = kf->innovation.nu;

    jli_copy(nu, got->nu, kf->mode->m);
    kf->innovation = *got;
    kf->innovation.nu = nu;
    if (kf->verdict == JL_REJECTED) {
        kf->run += kf->run < INT_MAX;
        kf->rejected++;
    } else {
        kf->run = 0;
        kf->accepted += kf->accepted < ULONG_MAX;
        kf->nis_mean += (got->nis - kf->nis_mean) / (jl_real)kf->accepted;
    }
}

/* The prediction xp [n + n n], and z or NULL, become the estimate. */
static int absorb(jl_kf *kf, jl_real *loglik, const jl_real *xp,
                  const jl_real *z, jl_real *scratch)
{
    int n = kf->mode->n, status, verdict = JL_MISSING;
    jl_real *x = scratch, *nu = x + n + n * n, gate = limit(kf);
    jl_innovation got;

    if (z != NULL) {
        got.nu = nu;
        status = jli_gated_update(x, x + n, &got, kf->form, kf->mode, xp,
                                  xp + n, z, gate, nu + kf->mode->m);
        if (status != JL_OK)
            return status;
        verdict = gate > 0 && got.nis > gate ? JL_REJECTED : JL_ACCEPTED;
    }
    kf->verdict = verdict;
    if (z != NULL)
        count(kf, &got);
    if (verdict == JL_ACCEPTED)
        jli_copy(kf->x, x, n + n * n);
    else if (xp != kf->x)
        jli_copy(kf->x, xp, n + n * n);
    if (loglik != NULL)
        *loglik = verdict == JL_ACCEPTED ? got.loglik : 0;
    return JL_OK;
}

int jl_kf_update(jl_kf *kf, jl_real *loglik, const jl_real *z,
                 jl_real *scratch)
{
    return absorb(kf, loglik, kf->x, z, scratch);
}

int jl_kf_step(jl_kf *kf, jl_real *loglik, const jl_real *z,
               jl_real *scratch)
{
    int n = kf->mode->n, status;
    jl_real *xp = scratch, *rest = xp + n + n * n;

    status = kf->form->predict(xp, xp + n, kf->mode, kf->x, kf->P, rest);
    return status == JL_OK ? absorb(kf, loglik, xp, z, rest) : status;
}
