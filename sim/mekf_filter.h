/* A filter of a model of the zoo, ready to run: MEKF or plain EKF. */
#ifndef SIM_MEKF_FILTER_H
#define SIM_MEKF_FILTER_H

#include <stdio.h>

#include "mekf_zoo.h"

/* What init and set are given; stays where it is, as its model points into it. */
struct mekf_setup {
    struct mekf_zoo zoo;
    jl_mekf_model model;
    int plain;                  /* 1: the EKF of x and y, and no MEKF       */
    jl_mekf_c c;
    int spread;
    jl_real x[ZOO_STATES], P[ZOO_STATES * ZOO_STATES];  /* x0, y0; P0       */
    jl_real P1[ZOO_STATES * ZOO_STATES];
    jl_real Q[ZOO_NOISES * ZOO_NOISES], R[ZOO_R * ZOO_R];
};

enum {                          /* memory for any model of the zoo */
    MEKF_MEM = JL_MEKF_STATE(4, 2, ZOO_R, 2, 1),
    MEKF_SCRATCH = JL_MEKF_SCRATCH(4, 2, ZOO_R, 2, 1)
        + JL_EKF_SCRATCH(4, 2, ZOO_R, 2, 1),
    MEKF_COLUMNS = 4 * ZOO_STATES
};

struct mekf_filter {
    const struct mekf_setup *setup;
    jl_mekf mekf;               /* one of them                              */
    jl_ekf ekf;
    jl_real mem[MEKF_MEM], scratch[MEKF_SCRATCH], row[MEKF_COLUMNS];
};

/* At the start.  Returns what the library's init or set does. */
int mekf_filter_start(struct mekf_filter *filter,
                      const struct mekf_setup *setup);

/* As jl_mekf_step. */
int mekf_filter_step(struct mekf_filter *filter, const jl_real *z);

/* Columns of its estimates: xbar, ybar, xhat, diagonals of P and P1; of the
 * EKF x, y, diagonal of P.  How many; their names, each after a comma; their
 * values, the filter's until the next call. */
int mekf_filter_columns(const struct mekf_setup *setup);
void mekf_filter_names(const struct mekf_setup *setup, FILE *out);
jl_real *mekf_filter_row(struct mekf_filter *filter);

#endif
