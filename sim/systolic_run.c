#include "systolic_run.h"

#include <stdint.h>
#include <stdlib.h>
#include <tgmath.h>

#include "complain.h"

/* --- a system of any size ------------------------------------------------- */

struct made {
    jl_mekf_model model;
    int known;
};

/* A number in [-1, 1) that depends on i, j, k only. */
static jl_real scatter(int i, int j, int k)
{
    uint32_t h = (uint32_t)(i * 1021 + j * 73 + k * 7919 + 17);

    h = (h ^ h >> 7) * 2654435761u;
    h = (h ^ h >> 13) * 2246822519u;
    return (jl_real)(h >> 9) / 4194304 - 1;
}

/* Between -1/2 and 1/2: nothing grows. */
static jl_real bent(jl_real x)
{
    return x / (1 + x * x);
}

static jl_real slope(jl_real x)
{
    return (1 - x * x) / ((1 + x * x) * (1 + x * x));
}

static int made_f(jl_real *f, const jl_real *y, void *context)
{
    const struct made *made = context;
    int n = made->model.n, m = made->model.m, i, j;
    jl_real of_y = made->known & JL_SYSTOLIC_KNOW_F ? 0 : 1;

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            f[i * n + j] = (i == j ? JL_C(0.7) : 0) + scatter(i, j, 1)
                * (JL_C(0.2) + of_y * bent(y[(i + j) % m]) / 3) / (jl_real)n;
    return JL_OK;
}

static int made_h(jl_real *y_next, const jl_real *x, const jl_real *y,
                  void *context)
{
    const struct made *made = context;
    int n = made->model.n, m = made->model.m, i;
    jl_real bends = made->known & JL_SYSTOLIC_KNOW_F ? 0 : 1;

    for (i = 0; i < m; i++)
        y_next[i] = JL_C(0.9) * y[i] + JL_C(0.1) * x[i % n]
            + bends * bent(x[i % n] * y[(i + 1) % m]) / 5;
    return JL_OK;
}

static int made_c(jl_real *c, const jl_real *x, const jl_real *y, void *context)
{
    const struct made *made = context;
    int n = made->model.n, m = made->model.m, r = made->model.r, i, j;
    jl_real bends = made->known & JL_SYSTOLIC_KNOW_C ? 0 : 1;

    for (i = 0; i < r; i++)
        for (j = 0; j < n; j++)
            c[i * n + j] = (i % n == j) + JL_C(0.3) * scatter(i, j, 2)
                + bends * bent(x[(i + j) % n] + y[i % m]) / 3;
    return JL_OK;
}

static int made_G(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
                  const jl_real *y, void *context)
{
    const struct made *made = context;
    int n = made->model.n, m = made->model.m, i;
    jl_real bends = made->known & JL_SYSTOLIC_KNOW_G ? 0 : 1;

    (void)G2;
    for (i = 0; i < n; i++)
        G1[i * (n + 1)] = 1 + bends * bent(x[i]) / 3;
    for (i = 0; i < m; i++)
        G3[i * (m + 1)] = 1 + bends * bent(y[i]) / 3;
    return JL_OK;
}

/* --- its derivatives ------------------------------------------------------- */

static int made_df(jl_real *J, const jl_real *x, const jl_real *y,
                   void *context)
{
    const struct made *made = context;
    int n = made->model.n, m = made->model.m, i, j;

    for (i = 0; i < n && !(made->known & JL_SYSTOLIC_KNOW_F); i++)
        for (j = 0; j < n; j++)
            J[i * m + (i + j) % m] += scatter(i, j, 1)
                * slope(y[(i + j) % m]) / 3 / (jl_real)n * x[j];
    return JL_OK;
}

static int made_dh(jl_real *J, const jl_real *x, const jl_real *y,
                   void *context)
{
    const struct made *made = context;
    int n = made->model.n, m = made->model.m, i;
    jl_real bends = made->known & JL_SYSTOLIC_KNOW_F ? 0 : 1;

    for (i = 0; i < m; i++) {
        jl_real *row = J + i * (n + m), other = y[(i + 1) % m];
        jl_real d = bends * slope(x[i % n] * other) / 5;

        row[n + i] += JL_C(0.9);
        row[i % n] += JL_C(0.1) + d * other;
        row[n + (i + 1) % m] += d * x[i % n];
    }
    return JL_OK;
}

static int made_dc(jl_real *J, const jl_real *x, const jl_real *y,
                   void *context)
{
    const struct made *made = context;
    int n = made->model.n, m = made->model.m, r = made->model.r, i, j;
    jl_real bends = made->known & JL_SYSTOLIC_KNOW_C ? 0 : 1;

    for (i = 0; i < r; i++)
        for (j = 0; j < n; j++) {
            jl_real *row = J + i * (n + m), at = x[(i + j) % n] + y[i % m];
            jl_real d = bends * slope(at) / 3 * x[j];

            row[j] += (i % n == j) + JL_C(0.3) * scatter(i, j, 2)
                + bends * bent(at) / 3;
            row[(i + j) % n] += d;
            row[n + i % m] += d;
        }
    return JL_OK;
}

/* --- array and filter ------------------------------------------------------ */

struct machine {
    struct made made;
    jl_mekf filter;
    jl_systolic array;
    jl_systolic_cell *cell;
    jl_real *mem, *state, *scratch, *Q, *R, *z;
};

static void unit(jl_real *A, int n, jl_real variance)
{
    int i;

    for (i = 0; i < n; i++)
        A[i * (n + 1)] = variance;
}

static int open_machine(struct machine *a, const struct systolic_run *run,
                        const jl_systolic_schedule *schedule, int known)
{
    int n = run->n, m = run->m, r = run->r, p = n + m, status;
    int state = JL_MEKF_STATE(n, m, r, n, m);
    int mem = JL_SYSTOLIC_STATE(n, m, r, n, m);
    int cells = 2 * JL_SYSTOLIC_CELLS(n, m, r);
    jl_systolic_schedule with = *schedule;

    a->made.known = with.known = known;
    a->made.model.n = a->made.model.p1 = n;
    a->made.model.m = a->made.model.p2 = m;
    a->made.model.r = r;
    a->made.model.f = made_f;
    a->made.model.h = made_h;
    a->made.model.c = made_c;
    a->made.model.G = made_G;
    a->made.model.df = made_df;
    a->made.model.dh = made_dh;
    a->made.model.dc = made_dc;
    a->made.model.context = &a->made;
    a->state = calloc((size_t)state, sizeof *a->state);
    a->scratch = calloc((size_t)JL_MEKF_SCRATCH(n, m, r, n, m),
                        sizeof *a->scratch);
    a->cell = calloc((size_t)cells, sizeof *a->cell);
    a->mem = calloc((size_t)mem, sizeof *a->mem);
    a->Q = calloc((size_t)(p * p), sizeof *a->Q);
    a->R = calloc((size_t)(r * r), sizeof *a->R);
    a->z = calloc((size_t)r, sizeof *a->z);
    if (a->state == NULL || a->scratch == NULL || a->cell == NULL
        || a->mem == NULL || a->Q == NULL || a->R == NULL || a->z == NULL)
        return JL_ENOMEM;
    unit(a->Q, p, JL_C(0.01));
    unit(a->R, r, JL_C(0.25));
    status = jl_mekf_init(&a->filter, &a->made.model, a->Q, a->R, a->state,
                          state, a->scratch);
    return status != JL_OK ? status
        : jl_systolic_init(&a->array, &a->filter, &with, a->cell, cells,
                           a->mem, mem);
}

static void close_machine(struct machine *a)
{
    free(a->state);
    free(a->scratch);
    free(a->cell);
    free(a->mem);
    free(a->Q);
    free(a->R);
    free(a->z);
}

static void compare(double *most, const jl_real *is, const jl_real *should,
                    int count)
{
    int i;

    for (i = 0; i < count; i++) {
        double apart = fabs((double)(is[i] - should[i]))
            / fmax(1, fabs((double)should[i]));

        *most = fmax(*most, apart);
    }
}

static int step(struct machine *a, struct systolic_run *run, int k)
{
    long tick = a->array.tick, work = JL_SYSTOLIC_WORK(a->array.count);
    int i, status;

    for (i = 0; i < run->r; i++)
        a->z[i] = sin((jl_real)(k * (i + 1)) / 3) + scatter(i, k, 3) / 2;
    status = jl_mekf_step(&a->filter, a->z, a->scratch);
    if (status == JL_OK)
        status = jl_systolic_step(&a->array, a->z);
    if (status != JL_OK)
        return status;
    compare(&run->apart, a->array.x, a->filter.x, run->n + run->m);
    compare(&run->apart, a->array.xhat, a->filter.xhat, run->n);
    if (k >= SYSTOLIC_STEPS - 4 && a->array.tick - tick >= run->ticks) {
        run->ticks = a->array.tick - tick;
        run->work = JL_SYSTOLIC_WORK(a->array.count) - work;
    }
    return JL_OK;
}

int systolic_run(struct systolic_run *run,
                 const jl_systolic_schedule *schedule, int known,
                 jl_systolic_trace trace, void *context)
{
    struct machine a = { .state = NULL };
    int k, status = open_machine(&a, run, schedule, known);

    run->ticks = run->work = 0;
    run->apart = 0;
    if (status == JL_OK) {
        run->cells = a.array.cells;
        a.array.trace = trace;
        a.array.context = context;
    }
    for (k = 0; k < SYSTOLIC_STEPS && status == JL_OK; k++)
        status = step(&a, run, k);
    close_machine(&a);
    if (status == JL_OK)
        return 0;
    complain("systolic", 0, NULL, "%d,%d,%d: %s", run->n, run->m, run->r,
             jl_status_text(status));
    return 1;
}
