/* The plain extended Kalman filter of states and parameters. */
#include "mekf/mekf_parts.h"

#include "mat/mat_k.h"

int jl_ekf_init(jl_ekf *filter, const jl_mekf_model *model, const jl_real *Q,
                const jl_real *R, jl_real *mem, int cap, jl_real *scratch)
{
    int r = model->r, N, p, i, status;

    status = jli_mekf_check(model, Q, R, scratch);
    if (status != JL_OK)
        return status;
    N = model->n + model->m;
    p = model->p1 + model->p2;
    if (cap < JL_EKF_STATE(model->n, model->m, r, model->p1, model->p2))
        return JL_ENOMEM;
    filter->model = model;
    filter->x = mem;
    filter->P = filter->x + N;
    filter->Q = filter->P + N * N;
    filter->R = filter->Q + p * p;
    memset(mem, 0, (size_t)(filter->Q - mem) * sizeof *mem);
    for (i = 0; i < N; i++)
        filter->P[i * (N + 1)] = 1;
    jli_copy(filter->Q, Q, p * p);
    jli_copy(filter->R, R, r * r);
    return JL_OK;
}

int jl_ekf_set(jl_ekf *filter, const jl_real *x, const jl_real *P,
               jl_real *scratch)
{
    int N = filter->model->n + filter->model->m, status;

    if (!jl_vec_within(x, N, JL_LARGE))
        return JL_ENONFINITE;
    status = jl_mat_check_cov(P, scratch, N);
    if (status != JL_OK)
        return status;
    jli_copy(filter->x, x, N);
    jli_copy(filter->P, P, N * N);
    return JL_OK;
}

/* xp, Pp on to the estimate; scratch [r N + r r].  With S = L L', W = L^-1 H Pp
 * and e = L^-1 nu:  K nu = W' e,  K S K' = W' W. */
static int update(struct jli_linear *l, jl_real *Pp, const jl_real *R,
                  jl_real *scratch, int N, int r)
{
    jl_real *W = scratch, *S = W + r * N, *e = l->nu;
    int i, j, k;

    jli_mul(W, l->H, Pp, r, N, N);
    jli_mul_t_sym(S, W, l->H, R, r, N);
    if (!jl_vec_within(S, r * r, JL_LARGE * JL_LARGE))
        return JL_ENONFINITE;
    if (jli_cholesky(S, S, r) != JL_OK)
        return JL_ESINGULAR;
    jli_lower_solve(S, W, r, N);
    jli_lower_solve(S, e, r, 1);
    for (k = 0; k < r; k++)
        for (i = 0; i < N; i++) {
            l->xp[i] += W[k * N + i] * e[k];
            for (j = 0; j < N; j++)
                Pp[i * N + j] -= W[k * N + i] * W[k * N + j];
        }
    return JL_OK;
}

int jl_ekf_step(jl_ekf *filter, const jl_real *z, jl_real *scratch)
{
    const jl_mekf_model *model = filter->model;
    int N = model->n + model->m, p = model->p1 + model->p2, r = model->r;
    jl_real *Pp = scratch, *FP = Pp + N * N, *W = FP + N * N;
    jl_real *GQ = W + r * N + r * r;
    struct jli_linear l;
    int status;

    status = jli_mekf_linearise(&l, GQ + N * p, model, filter->x, filter->x,
                                z, scratch);
    if (status != JL_OK)
        return status;
    jl_mat_sandwich(Pp, l.G, filter->Q, NULL, GQ, N, p);
    jl_mat_sandwich(Pp, l.F, filter->P, Pp, FP, N, N);
    if (z != NULL)
        status = update(&l, Pp, filter->R, W, N, r);
    if (status != JL_OK)
        return status;
    if (!jl_vec_within(l.xp, N, JL_LARGE)
        || !jl_vec_within(Pp, N * N, JL_LARGE * JL_LARGE))
        return JL_ENONFINITE;
    jli_copy(filter->x, l.xp, N);
    jli_copy(filter->P, Pp, N * N);
    return JL_OK;
}
