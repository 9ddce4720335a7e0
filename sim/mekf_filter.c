#include "mekf_filter.h"

#include <string.h>

int mekf_filter_start(struct mekf_filter *filter,
                      const struct mekf_setup *setup)
{
    int status;

    filter->setup = setup;
    if (setup->plain) {
        status = jl_ekf_init(&filter->ekf, &setup->model, setup->Q, setup->R,
                             filter->mem, MEKF_MEM, filter->scratch);
        return status != JL_OK ? status
            : jl_ekf_set(&filter->ekf, setup->x, setup->P, filter->scratch);
    }
    status = jl_mekf_init(&filter->mekf, &setup->model, setup->Q, setup->R,
                          filter->mem, MEKF_MEM, filter->scratch);
    if (status != JL_OK)
        return status;
    filter->mekf.c = setup->c;
    filter->mekf.spread = setup->spread;
    return jl_mekf_set(&filter->mekf, setup->x, setup->P, setup->P1,
                       filter->scratch);
}

int mekf_filter_step(struct mekf_filter *filter, const jl_real *z)
{
    return filter->setup->plain
        ? jl_ekf_step(&filter->ekf, z, filter->scratch)
        : jl_mekf_step(&filter->mekf, z, filter->scratch);
}

int mekf_filter_columns(const struct mekf_setup *setup)
{
    int n = setup->model.n, N = n + setup->model.m;

    return setup->plain ? 2 * N : 2 * (N + n);
}

static void put_names(const char *name, int count, FILE *out)
{
    int i;

    for (i = 1; i <= count; i++)
        fprintf(out, ",%s%d", name, i);
}

static void put_diagonal(const char *name, int count, FILE *out)
{
    int i;

    for (i = 1; i <= count; i++)
        fprintf(out, ",%s%d%d", name, i, i);
}

void mekf_filter_names(const struct mekf_setup *setup, FILE *out)
{
    int n = setup->model.n, m = setup->model.m;

    put_names(setup->plain ? "x" : "xbar", n, out);
    put_names(setup->plain ? "y" : "ybar", m, out);
    if (!setup->plain)
        put_names("xhat", n, out);
    put_diagonal("P", n + m, out);
    if (!setup->plain)
        put_diagonal("P1_", n, out);
}

static void diagonal(jl_real *d, const jl_real *P, int n)
{
    int i;

    for (i = 0; i < n; i++)
        d[i] = P[i * (n + 1)];
}

jl_real *mekf_filter_row(struct mekf_filter *filter)
{
    int n = filter->setup->model.n, N = n + filter->setup->model.m;
    jl_real *row = filter->row, *rest = row + N;
    jl_real P[ZOO_STATES * ZOO_STATES], P1[ZOO_STATES * ZOO_STATES];
    int plain = filter->setup->plain;

    memcpy(row, plain ? filter->ekf.x : filter->mekf.x,
           (size_t)N * sizeof *row);
    if (plain) {
        diagonal(rest, filter->ekf.P, N);
        return row;
    }
    jl_mekf_cov(&filter->mekf, P, P1);
    memcpy(rest, filter->mekf.xhat, (size_t)n * sizeof *row);
    diagonal(rest + n, P, N);
    diagonal(rest + n + N, P1, n);
    return row;
}
