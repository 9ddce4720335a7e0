/* The MEKF as an object. */
#include "mekf/mekf_parts.h"

#include "mat/mat_k.h"

int jli_mekf_check(const jl_mekf_model *model, const jl_real *Q,
                   const jl_real *R, jl_real *scratch)
{
    int status;

    if (model->n < 1 || model->m < 1 || model->n > JL_MAX_STATES
        || model->m > JL_MAX_STATES - model->n
        || model->r < 1 || model->r > JL_MAX_STATES
        || model->p1 < 1 || model->p1 > JL_MAX_STATES
        || model->p2 < 0 || model->p2 > JL_MAX_STATES - model->p1
        || model->f == NULL || model->c == NULL || model->G == NULL)
        return JL_EDIM;
    status = jl_mat_check_cov(Q, scratch, model->p1 + model->p2);
    return status != JL_OK ? status
        : jl_mat_check_cov(R, scratch, model->r);
}

/* Whether what row i of the factors S adds to A is A's rounding. */
static int is_rounding(const jl_real *S, const jl_real *A, int i, int n)
{
    jl_real d = S[i * (n + 1)], most = 2 * (jl_real)n * JL_EPSILON;
    int j;

    if (d > most * A[i * (n + 1)])
        return 0;
    for (j = i + 1; j < n; j++)
        if (d * S[i * n + j] * S[i * n + j] > most * A[j * (n + 1)])
            return 0;
    return 1;
}

/* U [n,n] upper, diagonal >= 0, U'U = A.  By pivots, and a singular A gets
 * rows of zeros and not the roots of rounding, which would make a singular V
 * look regular.  scratch [n n + 2 n] */
static void factor(jl_real *U, const jl_real *A, jl_real *scratch, int n)
{
    int i, j;

    jl_mat_ud(U, A, scratch, n);
    for (i = 0; i < n; i++) {
        jl_real root = is_rounding(U, A, i, n) ? 0 : jli_sqrt(U[i * (n + 1)]);

        U[i * (n + 1)] = root;
        for (j = i + 1; j < n; j++)
            U[i * n + j] *= root;
    }
}

/* U1 = leading block of U, which is a factor of P's. */
static void leading(jl_real *U1, const jl_real *U, int n, int N)
{
    int i;

    for (i = 0; i < n; i++)
        jli_copy(U1 + i * n, U + i * N, n);
}

int jl_mekf_init(jl_mekf *filter, const jl_mekf_model *model,
                 const jl_real *Q, const jl_real *R, jl_real *mem, int cap,
                 jl_real *scratch)
{
    int n = model->n, r = model->r, N, p, i, status;

    status = jli_mekf_check(model, Q, R, scratch);
    if (status != JL_OK)
        return status;
    N = n + model->m;
    p = model->p1 + model->p2;
    if (cap < JL_MEKF_STATE(n, model->m, r, model->p1, model->p2))
        return JL_ENOMEM;
    memset(filter, 0, sizeof *filter);
    filter->model = model;
    filter->c = JL_MEKF_PREV;
    filter->x = mem;
    filter->xhat = filter->x + N;
    filter->U = filter->xhat + n;
    filter->U1 = filter->U + N * N;
    filter->UQ = filter->U1 + n * n;
    filter->UR = filter->UQ + p * p;
    memset(mem, 0, (size_t)(filter->UQ - mem) * sizeof *mem);
    for (i = 0; i < N; i++)
        filter->U[i * (N + 1)] = 1;
    leading(filter->U1, filter->U, n, N);
    factor(filter->UQ, Q, scratch, p);
    factor(filter->UR, R, scratch, r);
    return JL_OK;
}

int jl_mekf_set(jl_mekf *filter, const jl_real *x, const jl_real *P,
                const jl_real *P1, jl_real *scratch)
{
    int n = filter->model->n, N = n + filter->model->m, status;

    if (!jl_vec_within(x, N, JL_LARGE))
        return JL_ENONFINITE;
    status = jl_mat_check_cov(P, scratch, N);
    if (status == JL_OK && P1 != NULL)
        status = jl_mat_check_cov(P1, scratch, n);
    if (status != JL_OK)
        return status;
    jli_copy(filter->x, x, N);
    jli_copy(filter->xhat, x, n);
    factor(filter->U, P, scratch, N);
    if (P1 != NULL)
        factor(filter->U1, P1, scratch, n);
    else
        leading(filter->U1, filter->U, n, N);
    return JL_OK;
}

/* P = U'U */
static void square(jl_real *P, const jl_real *U, int n)
{
    int i, j, k;

    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) {
            jl_real s = U[i] * U[j];

            for (k = 1; k <= i; k++)
                s += U[k * n + i] * U[k * n + j];
            P[i * n + j] = P[j * n + i] = s;
        }
}

void jl_mekf_cov(const jl_mekf *filter, jl_real *P, jl_real *P1)
{
    int n = filter->model->n;

    if (P != NULL)
        square(P, filter->U, n + filter->model->m);
    if (P1 != NULL)
        square(P1, filter->U1, n);
}
