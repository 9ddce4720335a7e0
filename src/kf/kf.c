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
    int n = kf->mode->n, size = n + n * n, status;
    jl_real *before = scratch;

    jli_copy(before, kf->x, size);              /* x and P */
    status = kf->form->predict(kf->x, kf->P, kf->mode, before, before + n,
                               before + size);
    if (status != JL_OK)
        jli_copy(kf->x, before, size);
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

/* The prediction xp [n + n n], and z or NULL, become the estimate.  The update
 * writes it where it is kept, so that the next step need not wait for a copy;
 * on failure it is again what is in `before`. */
static int absorb(jl_kf *kf, jl_real *loglik, const jl_real *xp,
                  const jl_real *before, const jl_real *z, jl_real *scratch)
{
    int n = kf->mode->n, size = n + n * n, status, verdict = JL_MISSING;
    jl_real *nu = scratch, gate = limit(kf);
    jl_innovation got;

    if (z != NULL) {
        jl_real *rest = nu + kf->mode->m;

        got.nu = nu;
        status = gate > 0
            ? jli_gated_update(kf->x, kf->P, &got, kf->form, kf->mode, xp,
                               xp + n, z, gate, rest)
            : kf->form->update(kf->x, kf->P, &got, kf->mode, xp, xp + n, z,
                               rest);
        if (status != JL_OK) {
            jli_copy(kf->x, before, size);
            return status;
        }
        verdict = gate > 0 && got.nis > gate ? JL_REJECTED : JL_ACCEPTED;
    }
    kf->verdict = verdict;
    if (z != NULL)
        count(kf, &got);
    if (verdict != JL_ACCEPTED)
        jli_copy(kf->x, xp, size);
    if (loglik != NULL)
        *loglik = verdict == JL_ACCEPTED ? got.loglik : 0;
    return JL_OK;
}

int jl_kf_update(jl_kf *kf, jl_real *loglik, const jl_real *z,
                 jl_real *scratch)
{
    int n = kf->mode->n, size = n + n * n;

    jli_copy(scratch, kf->x, size);
    return absorb(kf, loglik, scratch, scratch, z, scratch + size);
}

int jl_kf_step(jl_kf *kf, jl_real *loglik, const jl_real *z,
               jl_real *scratch)
{
    int n = kf->mode->n, size = n + n * n, status;
    jl_real *before = scratch, *xp = before + size, *rest = xp + size;

    status = kf->form->predict(xp, xp + n, kf->mode, kf->x, kf->P, rest);
    if (status != JL_OK)
        return status;
    jli_copy(before, kf->x, size);
    return absorb(kf, loglik, xp, before, z, rest);
}
