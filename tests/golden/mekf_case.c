#include "mekf_case.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "mekf_cases.h"

const struct mekf_case *mekf_case(int i)
{
    int n = sizeof mekf_cases / sizeof *mekf_cases;

    return i < n ? &mekf_cases[i] : NULL;
}

const struct mekf_case *mekf_case_named(const char *name)
{
    const struct mekf_case *c;
    int i;

    for (i = 0; (c = mekf_case(i)) != NULL; i++)
        if (strcmp(c->name, name) == 0)
            break;
    return c;
}

static void real(jl_real *to, const double *from, int n)
{
    int i;

    for (i = 0; i < n; i++)
        to[i] = (jl_real)from[i];
}

static void give_gen32(struct mekf_zoo *zoo, const struct mekf_case *c)
{
    real(zoo->A0, c->A0, 9);
    real(zoo->A1, c->A1, 9);
    real(zoo->A2, c->A2, 9);
    real(zoo->C0, c->C0, 6);
    real(zoo->C1, c->C1, 6);
    real(zoo->C2, c->C2, 6);
    real(zoo->B1, c->B1, 6);
    real(zoo->B2, c->B2, 4);
    real(zoo->B3, c->B3, 2);
    real(&zoo->a1, c->a1, 1);
    real(&zoo->a2, c->a2, 1);
    real(&zoo->b1, c->b1, 1);
    real(&zoo->b2, c->b2, 1);
    real(&zoo->g, c->g, 1);
}

void mekf_give(struct mekf_given *g, const struct mekf_case *c)
{
    int n = c->n, N = n + c->m, p = c->p1 + c->p2, found;

    assert(N <= CASE_N && c->r <= CASE_R && p <= CASE_P);
    memset(g, 0, sizeof *g);
    g->zoo.r = c->r;
    real(&g->zoo.T, c->T, 1);
    real(&g->zoo.d, c->d, 1);
    if (strcmp(c->model, "spring2") == 0)
        real(g->zoo.C, c->C, 2 * c->r);
    if (strcmp(c->model, "gen32") == 0)
        give_gen32(&g->zoo, c);
    found = mekf_zoo_model(&g->model, c->model, &g->zoo) == 0;
    assert(found && g->model.n == n && g->model.m == c->m);
    assert(g->model.r == c->r && g->model.p1 == c->p1 && g->model.p2 == c->p2);
    (void)found;
    g->c = strcmp(c->c, "filt") == 0 ? JL_MEKF_FILT
        : strcmp(c->c, "pred") == 0 ? JL_MEKF_PRED : JL_MEKF_PREV;
    real(g->x, c->x0, n);
    real(g->x + n, c->y0, c->m);
    real(g->P, c->P0, N * N);
    real(g->P1, c->P10, n * n);
    real(g->Q, c->Q, p * p);
    real(g->R, c->R, c->r * c->r);
}

const jl_real *mekf_z(jl_real *z, const struct mekf_case *c, int row)
{
    real(z, c->z + row * c->r, c->r);
    return z;
}

int mekf_start(struct mekf_filter *m, const struct mekf_given *g)
{
    int status = jl_mekf_init(&m->f, &g->model, g->Q, g->R, m->mem,
                              (int)(sizeof m->mem / sizeof *m->mem),
                              m->scratch);

    if (status != JL_OK)
        return status;
    m->f.c = g->c;
    m->f.spread = g->spread;
    return jl_mekf_set(&m->f, g->x, g->P, g->P1, m->scratch);
}

int mekf_start_ekf(struct mekf_filter *m, const struct mekf_given *g)
{
    int status = jl_ekf_init(&m->ekf, &g->model, g->Q, g->R, m->ekf_mem,
                             (int)(sizeof m->ekf_mem / sizeof *m->ekf_mem),
                             m->scratch);

    return status != JL_OK ? status
        : jl_ekf_set(&m->ekf, g->x, g->P, m->scratch);
}

static double worse(double a, double b)
{
    return a >= b ? a : b;              /* b if it is NaN */
}

void mekf_judge(struct mekf_worst *worst, const jl_real *x,
                const double *var, const double *want,
                const double *want_var, int n)
{
    int i;

    for (i = 0; i < n; i++) {
        double error = fabs((double)x[i] - want[i]);

        worst->state = worse(worst->state, error / fmax(1, fabs(want[i])));
        worst->sigma = worse(worst->sigma, error / sqrt(want_var[i]));
        worst->var = worse(worst->var, fabs(var[i] / want_var[i] - 1));
    }
}

void mekf_variances(double *var, const jl_real *U, int n)
{
    int i, k;

    for (i = 0; i < n; i++)
        for (var[i] = 0, k = 0; k <= i; k++)
            var[i] += (double)U[k * n + i] * (double)U[k * n + i];
}
