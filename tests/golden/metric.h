/* The reference cases, and the unit in which they measure: x in sigma =
 * sqrt(P_aa), floored at 1e-6 of its median over time, P_ab in sigma_a sigma_b,
 * mu absolute, loglik by 1 + |loglik|. */
#ifndef TESTS_METRIC_H
#define TESTS_METRIC_H

#include "close.h"

#include <stdlib.h>

struct imm_case {
    const char *name;
    int M, n, m, p, rows;
    const double *F, *G, *Q, *H, *R, *w_bar, *x0, *P0, *Pi, *mu0, *z;
    const double *expected;             /* rows of x, P packed, mu, loglik */
};

#include "imm_cases.h"

#define ROWS 2048

static inline int metric_ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

/* The columns of a case's expected rows. */
static inline int metric_width(const struct imm_case *c)
{
    return c->n + c->n * (c->n + 1) / 2 + c->M + 1;
}

/* sigma [rows,n] of a case, floored. */
static inline void metric_sigmas(double *sigma, const struct imm_case *c)
{
    static double sorted[ROWS];
    int width = metric_width(c), a, k, at = c->n;

    assert_true(c->rows <= ROWS);
    for (a = 0; a < c->n; at += c->n - a, a++) {
        for (k = 0; k < c->rows; k++)
            sorted[k] = sigma[k * c->n + a] = sqrt(c->expected[k * width + at]);
        qsort(sorted, (size_t)c->rows, sizeof *sorted, metric_ascending);
        for (k = 0; k < c->rows; k++)
            if (sigma[k * c->n + a] < 1e-6 * sorted[c->rows / 2])
                sigma[k * c->n + a] = 1e-6 * sorted[c->rows / 2];
    }
}

#endif
