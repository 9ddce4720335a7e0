/* The array as an object: a filter's state is put into it, it ticks through a
 * step, a covariance is read. */
#include "systolic/systolic_parts.h"

#include <string.h>

#include "mat/mat_k.h"

/* --- memory --------------------------------------------------------------- */

static jl_real *some(jl_real **mem, int reals)
{
    jl_real *p = *mem;

    *mem += reals;
    return p;
}

static void bind_triangle(jl_systolic_triangle *t, jl_real **mem, int r)
{
    int inner = t->N - r;

    t->map = some(mem, (inner + 2 * r) * inner);
    t->product = some(mem, inner * t->N);
    t->noise = some(mem, t->noises * t->N);
}

static void bind(jl_systolic *array, jl_systolic_cell *cell, jl_real *mem)
{
    int n = array->n, r = array->r, N = n + array->m;
    int p = array->p1 + array->p2;

    array->cell = cell;
    array->mem = mem;
    array->x = some(&mem, N);
    array->xhat = some(&mem, n);
    array->z = some(&mem, r);
    array->f = some(&mem, n * n);
    array->F = some(&mem, N * N);
    array->G = some(&mem, N * p);
    array->H = some(&mem, r * N);
    array->c_A = some(&mem, r * n);
    array->c_B = some(&mem, r * n);
    array->xp = some(&mem, N);
    array->xp_host = some(&mem, N);
    array->sum = some(&mem, 2 * r);
    array->UQ = some(&mem, p * p);
    array->work = some(&mem, N * (N + p) + r * (N + r));
    bind_triangle(&array->left, &mem, r);
    bind_triangle(&array->right, &mem, r);
}

/* --- the cells ------------------------------------------------------------ */

/* Cells of a triangle, U [N-r,N-r] in the lower rows. */
static void lay_triangle(jl_systolic *array, jl_systolic_triangle *t,
                         const jl_real *U, const jl_real *UR)
{
    int r = array->r, i, j;

    for (i = 0; i < t->N; i++)
        for (j = i; j < t->N; j++) {
            jl_systolic_cell *cell = array->cell + JLI_CELL(t, i, j);

            memset(cell, 0, sizeof *cell);
            cell->part = t->delay ? JL_SYSTOLIC_RIGHT : JL_SYSTOLIC_LEFT;
            cell->row = i;
            cell->column = j;
            cell->north = i == 0 ? -1 : t->delay && i == r
                ? JLI_DIAMOND(array, j) : JLI_CELL(t, i - 1, j);
            cell->west = j == i ? -1 : JLI_CELL(t, i, j - 1);
            cell->start = j < r ? UR[i * r + j] : 0;
            cell->r = i >= r ? U[(i - r) * (t->N - r) + j - r] : cell->start;
            cell->end = cell->r;
        }
}

static void lay_others(jl_systolic *array)
{
    int n = array->n, r = array->r, k;

    for (k = 0; k <= n; k++) {
        jl_systolic_cell *cell = array->cell + JLI_DIAMOND(array, r + k);

        memset(cell, 0, sizeof *cell);
        cell->part = k < n ? JL_SYSTOLIC_DIAMOND : JL_SYSTOLIC_SUBTRACTOR;
        cell->row = r;
        cell->column = r + k;
        cell->north = k < n ? JLI_CELL(&array->right, r - 1, r + k) : -1;
        cell->west = k > 0 && k < n ? JLI_DIAMOND(array, r + k - 1) : -1;
        cell->r = k < n ? array->xhat[k] : 0;
    }
}

static void size_triangle(jl_systolic_triangle *t, int first, int N, int delay,
                          int noises)
{
    memset(t, 0, sizeof *t);
    t->first = first;
    t->N = N;
    t->delay = delay;
    t->noises = noises;
    t->step = 1;
    t->block = -1;
    t->busy = -N;
}

static int is_schedule(const jl_systolic_schedule *s)
{
    return s->known >= 0 && s->known <= 7
        && s->products >= 0 && s->products <= JL_SYSTOLIC_ROWS
        && (s->y_first | s->noise_first | s->inside | 1) == 1;
}

int jl_systolic_init(jl_systolic *array, const jl_mekf *filter,
                     const jl_systolic_schedule *schedule,
                     jl_systolic_cell *cell, int cap_cells, jl_real *mem,
                     int cap)
{
    const jl_mekf_model *model = filter->model;
    int n = model->n, m = model->m, r = model->r, N = n + m, i, j, status;
    int p1 = model->p1, p2 = model->p2, p = p1 + p2;
    jl_systolic a;

    if (filter->spread || !is_schedule(schedule))
        return JL_ERANGE;
    if (cap_cells < 2 * JL_SYSTOLIC_CELLS(n, m, r)
        || cap < JL_SYSTOLIC_STATE(n, m, r, p1, p2))
        return JL_ENOMEM;
    memset(&a, 0, sizeof a);
    a.model = model;
    a.c = filter->c;
    a.schedule = *schedule;
    a.n = n;
    a.m = m;
    a.r = r;
    a.p1 = p1;
    a.p2 = p2;
    a.cells = JL_SYSTOLIC_CELLS(n, m, r);
    a.reals = JL_SYSTOLIC_STATE(n, m, r, p1, p2) / 2;
    size_triangle(&a.left, 0, N + r, 0, p);
    size_triangle(&a.right, JLI_CELL(&a.left, N + r, N + r), n + r, 1, p1);
    memset(mem, 0, (size_t)a.reals * sizeof *mem);
    bind(&a, cell, mem);
    jli_copy(a.x, filter->x, N);
    jli_copy(a.xhat, filter->xhat, n);
    jli_copy(a.UQ, filter->UQ, p * p);
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++)
            a.work[i * N + j] = filter->U[i * N + JLI_STATE_OF(&a, j)];
    jl_mat_givens(a.work, N, N);
    lay_triangle(&a, &a.left, a.work, filter->UR);
    lay_triangle(&a, &a.right, filter->U1, filter->UR);
    lay_others(&a);
    status = jli_systolic_prepare(&a);
    if (status == JL_OK)
        *array = a;
    return status;
}

/* --- a step --------------------------------------------------------------- */

static void copy_memory(const jl_systolic *array, int to, int from)
{
    memcpy(array->cell + to * array->cells, array->cell + from * array->cells,
           (size_t)array->cells * sizeof *array->cell);
    memcpy(array->mem + to * array->reals, array->mem + from * array->reals,
           (size_t)array->reals * sizeof *array->mem);
}

static int run(jl_systolic *array)
{
    int step = array->step + 1;

    while (array->has_x < step || array->has_xhat < step) {
        int status = jli_systolic_evaluate(array);

        if (status != JL_OK)
            return status;
        jli_systolic_feed(array, 1);
        jli_systolic_work(array);
        jli_systolic_collect(array);
        if (array->status != JL_OK)
            return array->status;
    }
    array->step = step;
    return JL_OK;
}

int jl_systolic_step(jl_systolic *array, const jl_real *z)
{
    jl_systolic before = *array;
    int status;

    if (z == NULL)
        return JL_ERANGE;
    if (!jl_vec_within(z, array->r, JL_LARGE))
        return JL_ENONFINITE;
    copy_memory(array, 1, 0);
    jli_copy(array->z, z, array->r);
    status = run(array);
    if (status != JL_OK) {
        *array = before;
        copy_memory(array, 0, 1);
    }
    return status;
}

/* --- the covariances ------------------------------------------------------ */

/* P = U'U of what the last QR left. */
static void square(jl_real *P, const jl_systolic *array,
                   const jl_systolic_triangle *t)
{
    int r = array->r, n = t->N - r, i, j, k;

    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) {
            int a = t->delay ? i : JLI_STATE_OF(array, i);
            int b = t->delay ? j : JLI_STATE_OF(array, j);
            jl_real s = 0;

            for (k = r; k <= r + i; k++)
                s += array->cell[JLI_CELL(t, k, r + i)].end
                    * array->cell[JLI_CELL(t, k, r + j)].end;
            P[a * n + b] = P[b * n + a] = s;
        }
}

void jl_systolic_cov(jl_systolic *array, jl_real *P, jl_real *P1)
{
    jl_systolic on = *array;
    int ticks;

    copy_memory(array, 1, 0);
    bind(&on, array->cell + array->cells, array->mem + array->reals);
    on.trace = NULL;
    for (ticks = 2 * on.left.N + 2; ticks > 0; ticks--) {
        jli_systolic_feed(&on, 0);
        jli_systolic_work(&on);
        jli_systolic_collect(&on);
    }
    if (P != NULL)
        square(P, &on, &on.left);
    if (P1 != NULL)
        square(P1, &on, &on.right);
}
