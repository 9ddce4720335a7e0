/* A model's functions, checked, and the matrices F, G, H that they make. */
#include "mekf/mekf_parts.h"

#include "mat/differences.h"
#include "mat/mat_k.h"

static jl_real *zeros(jl_real *a, int n)
{
    memset(a, 0, (size_t)n * sizeof *a);
    return a;
}

/* B [rows,cols] as a block of a matrix whose rows are `width` long */
static void put(jl_real *A, int width, const jl_real *B, int rows, int cols)
{
    int i;

    for (i = 0; i < rows; i++)
        jli_copy(A + i * width, B + i * cols, cols);
}

/* --- functions of one vector, for differences ---------------------------- */

struct part {
    const jl_mekf_model *model;
    const jl_real *x;                   /* of fx                            */
    jl_real *matrix;                    /* work of fx and cx                */
};

/* f(y) x of y */
static int fx(jl_real *out, const jl_real *y, void *context)
{
    const struct part *part = context;
    const jl_mekf_model *model = part->model;
    int n = model->n, status;

    status = model->f(zeros(part->matrix, n * n), y, model->context);
    jli_apply(out, part->matrix, part->x, NULL, n, n);
    return jli_checked(status, part->matrix, n * n);
}

/* h(x, y) of [x; y] */
static int hxy(jl_real *out, const jl_real *at, void *context)
{
    const struct part *part = context;
    const jl_mekf_model *model = part->model;

    return model->h(zeros(out, model->m), at, at + model->n, model->context);
}

/* c(x, y) x of [x; y] */
static int cx(jl_real *out, const jl_real *at, void *context)
{
    const struct part *part = context;
    const jl_mekf_model *model = part->model;
    int status = jli_mekf_c(part->matrix, model, at, at + model->n);

    jli_apply(out, part->matrix, at, NULL, model->r, model->n);
    return status;
}

/* --- the state's motion -------------------------------------------------- */

static int move_x(jl_real *xp, jl_real *F, const jl_mekf_model *model,
                  const jl_real *x, const jl_real *y, jl_real *scratch)
{
    int n = model->n, m = model->m, status;
    jl_real *f = zeros(scratch, n * n), *J = zeros(f + n * n, n * m);
    struct part part;

    status = jli_checked(model->f(f, y, model->context), f, n * n);
    if (status != JL_OK)
        return status;
    jli_apply(xp, f, x, NULL, n, n);
    put(F, n + m, f, n, n);
    part.model = model;
    part.x = x;
    part.matrix = f;
    status = model->df != NULL ? model->df(J, x, y, model->context)
        : jli_differences(J, fx, NULL, &part, y, J + n * m, n, m);
    put(F + n, n + m, J, n, m);
    return jli_checked(status, J, n * m);
}

/* at = [x; y] */
static int move_y(jl_real *yp, jl_real *J, const jl_mekf_model *model,
                  const jl_real *at, jl_real *scratch)
{
    int n = model->n, m = model->m, i, status;
    struct part part;

    zeros(J, m * (n + m));
    if (model->h == NULL) {
        jli_copy(yp, at + n, m);
        for (i = 0; i < m; i++)
            J[i * (n + m) + n + i] = 1;
        return JL_OK;
    }
    part.model = model;
    status = jli_checked(hxy(yp, at, &part), yp, m);
    if (status != JL_OK)
        return status;
    status = model->dh != NULL ? model->dh(J, at, at + n, model->context)
        : jli_differences(J, hxy, NULL, &part, at, scratch, m, n + m);
    return jli_checked(status, J, m * (n + m));
}

int jli_mekf_move(struct jli_linear *l, const jl_mekf_model *model,
                  const jl_real *x, const jl_real *y, jl_real *scratch)
{
    int n = model->n, m = model->m, status;
    jl_real *at = scratch;

    status = move_x(l->xp, l->F, model, x, y, scratch);
    if (status != JL_OK)
        return status;
    jli_copy(at, x, n);
    jli_copy(at + n, y, m);
    status = move_y(l->xp + n, l->F + n * (n + m), model, at, at + n + m);
    if (status != JL_OK)
        return status;
    return jl_vec_within(l->xp, n + m, JL_LARGE) ? JL_OK : JL_ENONFINITE;
}

int jli_mekf_drive(struct jli_linear *l, const jl_mekf_model *model,
                   const jl_real *x, const jl_real *y, jl_real *scratch)
{
    int n = model->n, m = model->m, p1 = model->p1, p2 = model->p2, status;
    int p = p1 + p2, all = n * p1 + m * p;
    jl_real *G1 = zeros(scratch, all), *G2 = G1 + n * p1, *G3 = G2 + m * p1;

    status = model->G(G1, G2, G3, x, y, model->context);
    zeros(l->G, (n + m) * p);
    put(l->G, p, G1, n, p1);
    put(l->G + n * p, p, G2, m, p1);
    put(l->G + n * p + p1, p, G3, m, p2);
    return jli_checked(status, G1, all);
}

/* --- what is measured ---------------------------------------------------- */

int jli_mekf_c(jl_real *c, const jl_mekf_model *model, const jl_real *x,
               const jl_real *y)
{
    int rn = model->r * model->n;

    return jli_checked(model->c(zeros(c, rn), x, y, model->context), c, rn);
}

void jli_mekf_innovate(jl_real *nu, const jl_real *z, const jl_real *c,
                       const jl_real *x, int n, int r)
{
    int i;

    jli_apply(nu, c, x, NULL, r, n);
    for (i = 0; i < r; i++)
        nu[i] = z[i] - nu[i];
}

int jli_mekf_sense(struct jli_linear *l, const jl_mekf_model *model,
                   jl_real *scratch)
{
    const jl_real *xp = l->xp;
    int n = model->n, N = n + model->m, r = model->r, status;
    struct part part;

    status = jli_mekf_c(l->c, model, xp, xp + n);
    if (status != JL_OK)
        return status;
    zeros(l->H, r * N);
    part.model = model;
    part.matrix = scratch;
    status = model->dc != NULL
        ? model->dc(l->H, xp, xp + n, model->context)
        : jli_differences(l->H, cx, NULL, &part, xp, scratch + r * n, r, N);
    return jli_checked(status, l->H, r * N);
}

/* --- all of it ----------------------------------------------------------- */

int jli_mekf_linearise(struct jli_linear *l, jl_real *mem,
                       const jl_mekf_model *model, const jl_real *xhat,
                       const jl_real *xbar, const jl_real *z,
                       jl_real *scratch)
{
    const jl_real *ybar = xbar + model->n;
    int n = model->n, N = n + model->m, r = model->r, status;

    l->F = mem;
    l->G = l->F + N * N;
    l->H = l->G + N * (model->p1 + model->p2);
    l->c = l->H + r * N;
    l->xp = l->c + r * n;
    l->nu = l->xp + N;
    if (z != NULL && !jl_vec_within(z, r, JL_LARGE))
        return JL_ENONFINITE;
    status = jli_mekf_move(l, model, xhat, ybar, scratch);
    if (status == JL_OK)
        status = jli_mekf_drive(l, model, xbar, ybar, scratch);
    if (status == JL_OK && z != NULL)
        status = jli_mekf_sense(l, model, scratch);
    if (status == JL_OK && z != NULL)
        jli_mekf_innovate(l->nu, z, l->c, l->xp, n, r);
    return status;
}
