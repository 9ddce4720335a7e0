/* The reference cases of the MEKF, and their unit of error. */
#ifndef TESTS_MEKF_CASE_H
#define TESTS_MEKF_CASE_H

#include "jumplink/mekf.h"
#include "mekf_zoo.h"

struct mekf_case {
    const char *name, *model, *c;
    int n, m, r, p1, p2, rows;
    const double *x0, *y0, *P0, *P10, *Q, *R;
    const double *T, *d, *C, *A0, *A1, *A2, *C0, *C1, *C2, *B1, *B2, *B3;
    const double *a1, *a2, *b1, *b2, *g;
    const double *z;
    const double *expected;             /* rows xbar, ybar, xhat, diag P, P1 */
    const double *expected_ekf;         /* rows x, y, diag P                */
};

enum { CASE_N = 5, CASE_R = 3, CASE_P = 3 };    /* largest n + m, r, p1 + p2 */

/* Case i, or NULL behind the last; the one of a name. */
const struct mekf_case *mekf_case(int i);
const struct mekf_case *mekf_case_named(const char *name);

/* A case's model and numbers, for jl_real. */
struct mekf_given {
    struct mekf_zoo zoo;
    jl_mekf_model model;
    jl_mekf_c c;
    int spread;
    jl_real x[CASE_N], P[CASE_N * CASE_N], P1[CASE_N * CASE_N];
    jl_real Q[CASE_P * CASE_P], R[CASE_R * CASE_R];
};

void mekf_give(struct mekf_given *g, const struct mekf_case *c);

/* z [r] of a row */
const jl_real *mekf_z(jl_real *z, const struct mekf_case *c, int row);

/* The filters, with memory for any case. */
struct mekf_filter {
    jl_mekf f;
    jl_ekf ekf;
    jl_real mem[JL_MEKF_STATE(4, 1, 3, 2, 1)];
    jl_real ekf_mem[JL_EKF_STATE(4, 1, 3, 2, 1)];
    jl_real scratch[JL_MEKF_SCRATCH(4, 1, 3, 2, 1)
                    + JL_EKF_SCRATCH(4, 1, 3, 2, 1)];
};

/* Both, as a case begins: what init and set return. */
int mekf_start(struct mekf_filter *m, const struct mekf_given *g);
int mekf_start_ekf(struct mekf_filter *m, const struct mekf_given *g);

/* The largest errors met: of states by max(1, |x|) and by sigma, of variances
 * by themselves. */
struct mekf_worst {
    double state, sigma, var;
};

void mekf_judge(struct mekf_worst *worst, const jl_real *x,
                const double *var, const double *want,
                const double *want_var, int n);

/* The variances that a factor U [n,n] stands for, in double. */
void mekf_variances(double *var, const jl_real *U, int n);

#endif
