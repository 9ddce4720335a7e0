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

int jl_kf_gate(jl_kf *kf, jl_real nis, int most)
{
    if (!(nis >= 0 && nis <= JL_REAL_MAX) || most < 0)
        return JL_ERANGE;
    kf->gate = nis;
    kf->most = most;
    return JL_OK;
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

/* Take down what an update gave: the estimate xP [n + n n] unless the gate
 * rejects it.  Returns 1 if it is accepted. */
static int commit(jl_kf *kf, const jl_real *xP, const jl_innovation *got)
{
    jl_real *nu = kf->innovation.nu;
    int n = kf->mode->n;

    jli_copy(nu, got->nu, kf->mode->m);
    kf->innovation = *got;
    kf->innovation.nu = nu;
    if (kf->gate > 0 && got->nis > kf->gate && kf->run < kf->most) {
        kf->run++;
        kf->rejected++;
        return 0;
    }
    kf->run = 0;
    kf->accepted++;
    kf->nis_mean += (got->nis - kf->nis_mean) / (jl_real)kf->accepted;
    jli_copy(kf->x, xP, n + n * n);
    return 1;
}

int jl_kf_update(jl_kf *kf, jl_real *loglik, const jl_real *z,
                 jl_real *scratch)
{
    int n = kf->mode->n, status;
    jl_real *x = scratch, *P = x + n, l = 0;
    jl_innovation got;

    if (z != NULL) {
        got.nu = P + n * n;
        status = kf->form->update(x, P, &got, kf->mode, kf->x, kf->P, z,
                                  got.nu + kf->mode->m);
        if (status != JL_OK)
            return status;
        if (commit(kf, x, &got))
            l = got.loglik;
    }
    if (loglik != NULL)
        *loglik = l;
    return JL_OK;
}

int jl_kf_step(jl_kf *kf, jl_real *loglik, const jl_real *z,
               jl_real *scratch)
{
    int n = kf->mode->n, status;
    jl_real *xp = scratch, *x = xp + n + n * n, *nu = x + n + n * n, l = 0;
    jl_real *rest = nu + kf->mode->m;
    jl_innovation got;

    status = kf->form->predict(xp, xp + n, kf->mode, kf->x, kf->P, rest);
    if (status != JL_OK)
        return status;
    if (z != NULL) {
        got.nu = nu;
        status = kf->form->update(x, x + n, &got, kf->mode, xp, xp + n, z,
                                  rest);
        if (status != JL_OK)
            return status;
        if (commit(kf, x, &got))
            l = got.loglik;
    }
    if (z == NULL || kf->run > 0)
        jli_copy(kf->x, xp, n + n * n);         /* x and P */
    if (loglik != NULL)
        *loglik = l;
    return JL_OK;
}
