/* The Kalman filter as an object: a form's steps, committed when they went
 * well. */
#include "jumplink/kf.h"

#include "mat/mat_k.h"

int jl_kf_init(jl_kf *kf, const jl_mode *mode, const jl_kf_form *form,
               jl_real *mem, int cap)
{
    int n = mode->n, i;

    if (cap < JL_KF_STATE(n))
        return JL_ENOMEM;
    kf->mode = mode;
    kf->form = form;
    kf->x = mem;
    kf->P = mem + n;
    memset(mem, 0, (size_t)JL_KF_STATE(n) * sizeof *mem);
    for (i = 0; i < n; i++)
        kf->P[i * (n + 1)] = 1;
    return JL_OK;
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
    jl_mat_pack(scratch, P, n);         /* exactly symmetric from here on */
    jl_mat_unpack(kf->P, scratch, n);
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

int jl_kf_update(jl_kf *kf, jl_real *loglik, const jl_real *z,
                 jl_real *scratch)
{
    int n = kf->mode->n, status;
    jl_real *x = scratch, *P = x + n, l = 0;

    if (z != NULL) {
        status = kf->form->update(x, P, &l, kf->mode, kf->x, kf->P, z,
                                  P + n * n);
        if (status != JL_OK)
            return status;
        jli_copy(kf->x, x, n + n * n);
    }
    if (loglik != NULL)
        *loglik = l;
    return JL_OK;
}

int jl_kf_step(jl_kf *kf, jl_real *loglik, const jl_real *z,
               jl_real *scratch)
{
    int n = kf->mode->n, status;
    jl_real *xp = scratch, *x = xp + n + n * n, *rest = x + n + n * n, l = 0;

    status = kf->form->predict(xp, xp + n, kf->mode, kf->x, kf->P, rest);
    if (status == JL_OK && z != NULL)
        status = kf->form->update(x, x + n, &l, kf->mode, xp, xp + n, z,
                                  rest);
    if (status != JL_OK)
        return status;
    jli_copy(kf->x, z != NULL ? x : xp, n + n * n);     /* x and P */
    if (loglik != NULL)
        *loglik = l;
    return JL_OK;
}
