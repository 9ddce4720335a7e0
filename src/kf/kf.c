/* The Kalman filter as an object: a form's steps, committed when they went
 * well. */
#include "jumplink/kf.h"

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
    return kf->form->predict(kf->x, kf->P, kf->mode, scratch);
}

/* Above this nis a measurement is rejected; 0: never. */
static jl_real limit(const jl_kf *kf)
{
    return kf->gate > 0 && kf->run >= kf->most ? JL_REAL_MAX : kf->gate;
}

/* Without a measurement. */
static void miss(jl_kf *kf, jl_real *loglik)
{
    kf->verdict = JL_MISSING;
    if (loglik != NULL)
        *loglik = 0;
}

/* The form's update or step.  Counts stay where they are as large as can be: a
 * mean divides by one, and one that is signed must not overflow. */
static int measure(jl_kf *kf, jl_real *loglik, const jl_real *z,
                   jl_real *scratch,
                   int (*take)(jl_real *x, jl_real *P,
                               jl_innovation *innovation, const jl_mode *mode,
                               const jl_real *z, jl_real gate,
                               jl_real *scratch))
{
    int m = kf->mode->m, status, a;
    jl_real gate = limit(kf), *nu = kf->innovation.nu;
    jl_innovation got;

    got.nu = scratch;
    status = take(kf->x, kf->P, &got, kf->mode, z, gate, scratch + m);
    if (status != JL_OK)
        return status;
    for (a = 0; a < m; a++)
        nu[a] = scratch[a];
    kf->innovation.nis = got.nis;
    kf->innovation.loglik = got.loglik;
    if (gate > 0 && got.nis > gate) {
        kf->verdict = JL_REJECTED;
        kf->run += kf->run < INT_MAX;
        kf->rejected++;
        got.loglik = 0;
    } else {
        kf->verdict = JL_ACCEPTED;
        kf->run = 0;
        kf->accepted += kf->accepted < ULONG_MAX;
        kf->nis_mean += (got.nis - kf->nis_mean) / (jl_real)kf->accepted;
    }
    if (loglik != NULL)
        *loglik = got.loglik;
    return JL_OK;
}

int jl_kf_update(jl_kf *kf, jl_real *loglik, const jl_real *z,
                 jl_real *scratch)
{
    if (z != NULL)
        return measure(kf, loglik, z, scratch, kf->form->update);
    miss(kf, loglik);
    return JL_OK;
}

int jl_kf_step(jl_kf *kf, jl_real *loglik, const jl_real *z,
               jl_real *scratch)
{
    int status;

    if (z != NULL)
        return measure(kf, loglik, z, scratch, kf->form->step);
    status = jl_kf_predict(kf, scratch);
    if (status == JL_OK)
        miss(kf, loglik);
    return status;
}
