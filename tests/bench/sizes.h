/* Who is timed by bench_sizes: filters of the same equations on the same data,
 * by different means.  C and C++ include it. */
#ifndef SIZES_H
#define SIZES_H

#include "jumplink/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What a filter is made of; matrices row by row, as the library has them. */
struct sizes_model {
    int kalman;                 /* 1: one Kalman filter (M = 1); 0: an IMM  */
    int M, n, m;
    jl_real *F, *W, *u, *H, *R;  /* [M,n,n] [M,n,n] [M,n] [M,m,n] [M,m,m]    */
    jl_real *x, *P, *mu;         /* the start: [M,n] [M,n,n] [M]             */
    jl_real *Pi;                 /* [M,M]                                    */
    int sticky;                 /* mix as it suits Pi, if the filter can    */
};

enum sizes_form { STANDARD, JOSEPH, SQRT, SIZES_FORMS };

/* The estimate after a step: x [n], P [n,n], mu [M]. */
struct sizes_estimate {
    const jl_real *x, *P, *mu;
};

/* A filter: the first member of whatever a contestant needs. */
struct sizes_filter {
    /* Go (back) to the start of the model. */
    void (*start)(struct sizes_filter *f);
    /* One step with a measurement z [m]; returns its log-likelihood. */
    jl_real (*step)(struct sizes_filter *f, const jl_real *z);
    struct sizes_estimate (*estimate)(struct sizes_filter *f);
};

/* Returns NULL where a contestant does not have the sizes or the form.  The model must
 * outlive the filter; a filter is not freed. */
typedef struct sizes_filter *sizes_make(const struct sizes_model *model,
                                        enum sizes_form form);

/* sizes_dense: as sizes_fixed, of modes that do not know where F and H are zero,
 * as Eigen and plain C do not. */
sizes_make sizes_fixed, sizes_dense, sizes_any, sizes_plain, sizes_eigen;

/* The constant-gain IMM of modes CV and CA in one axis, gains steady: the Q of
 * a mode is W[1][1], T = 1; it has no P, and the log-likelihood if asked. */
struct sizes_filter *sizes_constant_gain(const struct sizes_model *model,
                                         int loglik);

#ifdef __cplusplus
}
#endif
#endif
