/* A step: both filters by the same array. */
#include "mekf/mekf_parts.h"

#include "mat/givens_k.h"
#include "mat/mat_k.h"

/* The array of a filter of n states and r measurements, rows of r + n:
 *     [ U_R       0     ]       [ V'  V^-1 H Pp ]
 *     [ L M' H'   L M'  ]  ->   [ 0   U         ]
 *     [ ..        ..    ]       [ 0   0         ]
 * with as many products L M' as Pp is a sum of squares of.  U_R comes first,
 * for it is triangular already.  r = 0: a prediction. */
struct array {
    jl_real *A;
    int rows, n, r;
};

static void start(struct array *a, jl_real *A, const jl_real *UR, int n, int r)
{
    int i;

    a->A = A;
    a->rows = r;
    a->n = n;
    a->r = r;
    memset(A, 0, (size_t)(r * (r + n)) * sizeof *A);
    for (i = 0; i < r; i++)
        jli_copy(A + i * (r + n), UR + i * r, r);
}

/* Rows L M'; L [rows,inner], M [n,inner], in matrices with rows of lw, mw. */
static void add(struct array *a, const jl_real *L, int lw, const jl_real *M,
                int mw, const jl_real *H, int rows, int inner)
{
    int n = a->n, r = a->r, i, j, k;

    for (k = 0; k < rows; k++) {
        jl_real *row = a->A + a->rows++ * (r + n);

        for (i = 0; i < n; i++) {
            row[r + i] = 0;
            for (j = 0; j < inner; j++)
                row[r + i] += L[k * lw + j] * M[i * mw + j];
        }
        jli_apply(row, H, row + r, NULL, r, n);
    }
}

/* The triangle of A, and x [n] += W' V^-1 nu, W = V^-1 H Pp: what the array
 * does with a last row [-nu' | x'], by Gauss (Faddeev).  nu [r] is used up.
 * A singular V shows by what rounding leaves of its diagonal. */
static int solve(struct array *a, jl_real *x, jl_real *nu)
{
    int r = a->r, width = r + a->n, i, j, k;
    jl_real least = 4 * (jl_real)a->rows * JL_EPSILON;

    if (!jl_vec_within(a->A, a->rows * width, JL_LARGE))
        return JL_ENONFINITE;
    jli_givens(a->A, a->rows, width);
    if (!jl_vec_within(a->A, width * width, JL_LARGE))
        return JL_ENONFINITE;
    for (i = 0; i < r; i++) {
        const jl_real *row = a->A + i * width;
        jl_real S = 0, e;

        for (k = 0; k <= i; k++)
            S += a->A[k * width + i] * a->A[k * width + i];
        if (row[i] <= least * jli_sqrt(S))
            return JL_ESINGULAR;
        e = nu[i] / row[i];
        for (j = i + 1; j < r; j++)
            nu[j] -= row[j] * e;
        for (j = 0; j < a->n; j++)
            x[j] += row[r + j] * e;
    }
    return jl_vec_within(x, a->n, JL_LARGE) ? JL_OK : JL_ENONFINITE;
}

/* U out of the triangle */
static void take(jl_real *U, const struct array *a)
{
    int r = a->r, n = a->n, i;

    for (i = 0; i < n; i++)
        jli_copy(U + i * n, a->A + (r + i) * (r + n) + r, n);
}

/* c for B; l->xp is A's estimate by now, l->c is at its prediction. */
static int choose(jl_real *cc, const jl_mekf *filter,
                  const struct jli_linear *l)
{
    const jl_mekf_model *model = filter->model;
    int n = model->n;

    if (filter->c == JL_MEKF_FILT)
        return jli_mekf_c(cc, model, l->xp, l->xp + n);
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
    jl_real *B = scratch + JL_MEKF_ARRAY(n, m, model->r, p1, p2);
    jl_real *xh = B + JL_MEKF_ARRAY_B(n, m, model->r, p1), *cc = xh + n;
    struct jli_linear l;
    struct array a, b;

    status = jli_mekf_linearise(&l, cc + model->r * n, model, filter->xhat,
                                filter->x, z, scratch);
    if (status != JL_OK)
        return status;
    jli_copy(xh, l.xp, n);

    start(&a, scratch, filter->UR, N, r);
    add(&a, filter->U, N, l.F, N, l.H, N, N);
    add(&a, filter->UQ, p, l.G, p, l.H, p, p);
    status = solve(&a, l.xp, l.nu);
    if (status == JL_OK && r > 0)
        status = choose(cc, filter, &l);
    if (status != JL_OK)
        return status;

    start(&b, B, filter->UR, n, r);
    add(&b, filter->U1, n, l.F, N, cc, n, n);
    add(&b, filter->UQ, p, l.G, p, cc, p1, p1);
    if (filter->spread)
        add(&b, filter->U + n, N, l.F + n, N, cc, N, m);
    if (r > 0)
        jli_mekf_innovate(l.nu, z, cc, xh, n, r);
    status = solve(&b, xh, l.nu);
    if (status != JL_OK)
        return status;

    jli_copy(filter->x, l.xp, N);
    jli_copy(filter->xhat, xh, n);
    take(filter->U, &a);
    take(filter->U1, &b);
    return JL_OK;
}
