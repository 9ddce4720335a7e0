/* A step: both filters by the same array. */
#include "mekf/mekf_parts.h"

#include "mat/mat_k.h"

/* The triangle of an array, and x [n] += W' V^-1 nu; nu [r] is used up. */
static int solve(struct jli_array *a, const jl_real *H, jl_real *x,
                 jl_real *nu, jl_real *S)
{
    struct jli_feed feed;
    int status = jli_array_sense(a, H);

    feed.nu = nu;
    feed.x = x;
    feed.S = S;
    memset(S, 0, (size_t)a->r * sizeof *S);
    if (status == JL_OK)
        status = jli_array_triangle(a, a->r + a->n, &feed);
    if (status != JL_OK)
        return status;
    return jl_vec_within(x, a->n, JL_LARGE) ? JL_OK : JL_ENONFINITE;
}

int jli_mekf_choose(jl_real *cc, const jl_mekf *filter,
                    const struct jli_linear *l, const jl_real *x)
{
    const jl_mekf_model *model = filter->model;
    int n = model->n;

    if (filter->c == JL_MEKF_FILT)
        return jli_mekf_c(cc, model, x, x + n);
    if (filter->c == JL_MEKF_PREV)
        return jli_mekf_c(cc, model, filter->x, filter->x + n);
    jli_copy(cc, l->c, model->r * n);
    return JL_OK;
}

int jl_mekf_step(jl_mekf *filter, const jl_real *z, jl_real *scratch)
{
    const jl_mekf_model *model = filter->model;
    int n = model->n, m = model->m, N = n + m, r = z != NULL ? model->r : 0;
    int p1 = model->p1, p2 = model->p2, p = p1 + p2, status;
    int more = filter->spread ? N : 0;
    jl_real *B = scratch + JL_MEKF_ARRAY(n, m, model->r, p1, p2);
    jl_real *xh = B + JL_MEKF_ARRAY_B(n, m, model->r, p1), *cc = xh + n;
    jl_real *S = cc + model->r * n;
    struct jli_linear l;
    struct jli_array a, b;

    status = jli_mekf_linearise(&l, S + model->r, model, filter->xhat,
                                filter->x, z, scratch);
    if (status != JL_OK)
        return status;
    jli_copy(xh, l.xp, n);

    jli_array_start(&a, scratch, filter->UR, N, r, r + N + p);
    jli_array_products(jli_array_row(&a, r), r + N, filter->U, N, l.F, N, N,
                       N, N);
    jli_array_products(jli_array_row(&a, r + N), r + N, filter->UQ, p, l.G, p,
                       p, N, p);
    status = solve(&a, l.H, l.xp, l.nu, S);
    if (status == JL_OK && r > 0)
        status = jli_mekf_choose(cc, filter, &l, l.xp);
    if (status != JL_OK)
        return status;

    jli_array_start(&b, B, filter->UR, n, r, r + n + p1 + more);
    jli_array_products(jli_array_row(&b, r), r + n, filter->U1, n, l.F, N, n,
                       n, n);
    jli_array_products(jli_array_row(&b, r + n), r + n, filter->UQ, p, l.G, p,
                       p1, n, p1);
    jli_array_products(jli_array_row(&b, r + n + p1), r + n, filter->U + n, N,
                       l.F + n, N, more, n, m);
    if (r > 0)
        jli_mekf_innovate(l.nu, z, cc, xh, n, r);
    status = solve(&b, cc, xh, l.nu, S);
    if (status != JL_OK)
        return status;

    jli_copy(filter->x, l.xp, N);
    jli_copy(filter->xhat, xh, n);
    jli_array_take(filter->U, &a, r + N);
    jli_array_take(filter->U1, &b, r + n);
    return JL_OK;
}
