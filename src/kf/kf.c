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
    int n = kf->mode->n, size = n + n * n, status;
    jl_real *before = scratch, *rest = before + size;

    jli_copy(before, kf->x, size);              /* x and P */
    status = kf->form->predict(kf->x, kf->P, kf->mode, before, before + n,
                               rest);
    if (status != JL_OK)
        jli_copy(kf->x, before, size);
    return status;
}

/* Whether the gate rejects it. */
static int rejects(const jl_kf *kf, jl_real nis)
{
    return kf->gate > 0 && nis > kf->gate && kf->run < kf->most;
}

/* Take down what an update gave. */
static void count(jl_kf *kf, const jl_innovation *got)
{
    jl_real *nu = kf->innovation.nu;

    jli_copy(nu, got->nu, kf->mode->m);
    kf->innovation = *got;
    kf->innovation.nu = nu;
    if (rejects(kf, got->nis)) {
        kf->run++;
        kf->rejected++;
    } else {
        kf->run = 0;
        kf->accepted++;
        kf->nis_mean += (got->nis - kf->nis_mean) / (jl_real)kf->accepted;
    }
}

/* Update from the estimate `prior`, which is also what a measurement that is
 * missing or rejected leaves; what becomes of the filter otherwise is written to
 * it at once, and on failure it is as in `before`.  x and P lie together. */
static int update(jl_kf *kf, jl_real *loglik, const jl_real *z,
                  const jl_real *prior, const jl_real *before,
                  jl_real *scratch)
{
    int n = kf->mode->n, size = n + n * n, status;
    jl_innovation got;

    got.nu = scratch;
    got.loglik = 0;
    if (z != NULL) {
        status = kf->form->update(kf->x, kf->P, &got, kf->mode, prior,
                                  prior + n, z, scratch + kf->mode->m);
        if (status != JL_OK) {
            jli_copy(kf->x, before, size);
            return status;
        }
        count(kf, &got);
    }
    if (z == NULL || kf->run > 0) {
        jli_copy(kf->x, prior, size);
        got.loglik = 0;
    }
    if (loglik != NULL)
        *loglik = got.loglik;
    return JL_OK;
}

int jl_kf_update(jl_kf *kf, jl_real *loglik, const jl_real *z,
                 jl_real *scratch)
{
    int n = kf->mode->n, size = n + n * n;

    jli_copy(scratch, kf->x, size);
    return update(kf, loglik, z, scratch, scratch, scratch + size);
}

int jl_kf_step(jl_kf *kf, jl_real *loglik, const jl_real *z,
               jl_real *scratch)
{
    int n = kf->mode->n, size = n + n * n, status;
    jl_real *before = scratch, *prior = before + size, *rest = prior + size;

    status = kf->form->predict(prior, prior + n, kf->mode, kf->x, kf->P,
                               rest);
    if (status != JL_OK)
        return status;
    jli_copy(before, kf->x, size);
    return update(kf, loglik, z, prior, before, rest);
}
