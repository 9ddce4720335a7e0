/* What the readers of the kinds of models share. */
#ifndef SIM_MODEL_PARTS_H
#define SIM_MODEL_PARTS_H

#include "json_take.h"
#include "model_file.h"

/* All return 0, or -1 after a message. */

int model_no_memory(const struct json_at *at);

/* n m k zeroed reals; never NULL by being empty. */
jl_real *model_reals(int n, int m, int k);

/* A number above 0; `usual` when it may be left out, else 0. */
int model_take_above_0(jl_real *value, const struct json_at *at,
                       const char *key, jl_real usual);

/* mu0 [M], which may be missing, uniform then, unless it is needed. */
int model_take_mu0(struct model *model, const struct json_at *top, int needed);

/* Pi [M,M]. */
int model_take_Pi(struct model *model, const struct json_at *top);

/* A covariance A [n,n], positive semidefinite or definite. */
int model_take_cov(jl_real *A, const struct json_at *at, const char *key,
                   int n, int definite);

/* All of a model of kind mekf. */
int model_read_mekf(struct model *model, const struct json_at *top);

/* All of a model of kind cgimm but mode count and mu0. */
int model_read_cgimm(struct model *model, const struct json_at *top);

#endif
