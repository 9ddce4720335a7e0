/* The library's constant-gain IMM, through its public interface. */
#include "sizes.h"

#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "jumplink.h"

struct constant_filter {
    struct sizes_filter base;
    const struct sizes_model *model;
    jl_cg_gains gains[2];
    jl_cgimm cg;
    jl_real mem[JL_CGIMM_STATE(2, 1)];
    jl_real x[3];
};

static struct constant_filter *of(struct sizes_filter *f)
{
    return (struct constant_filter *)f;
}

static void start(struct sizes_filter *f)
{
    struct constant_filter *c = of(f);

    bench_must(jl_cgimm_set(&c->cg, c->model->x, c->model->mu) == JL_OK,
               "jl_cgimm_set");
}

static jl_real step(struct sizes_filter *f, const jl_real *z)
{
    struct constant_filter *c = of(f);

    bench_must(jl_cgimm_step(&c->cg, z) == JL_OK, "jl_cgimm_step");
    return c->cg.mu[0];
}

static jl_real step_and_loglik(struct sizes_filter *f, const jl_real *z)
{
    (void)step(f, z);
    return jl_cgimm_loglik(&of(f)->cg);
}

static struct sizes_estimate estimate(struct sizes_filter *f)
{
    struct constant_filter *c = of(f);
    struct sizes_estimate is = { c->x, NULL, c->cg.mu };

    jl_cgimm_estimate(&c->cg, c->x);
    return is;
}

struct sizes_filter *sizes_constant_gain(const struct sizes_model *model,
                                         int loglik)
{
    struct constant_filter *c = calloc(1, sizeof *c);
    int j;

    bench_must(c != NULL && model->M == 2 && model->n == 3 && model->m == 1,
               "a constant-gain IMM");
    c->base.start = start;
    c->base.step = loglik ? step_and_loglik : step;
    c->base.estimate = estimate;
    c->model = model;
    for (j = 0; j < 2; j++) {
        bench_must(jl_cg_design(&c->gains[j], 2 + j, 1, model->W[j * 9 + 4],
                                model->R[j]) == JL_OK, "jl_cg_design");
        memset(c->gains[j].k, 0, sizeof c->gains[j].k);
    }
    bench_must(jl_cgimm_init(&c->cg, 2, c->gains, 1, 1, model->R[0], model->Pi,
                             c->mem, JL_CGIMM_STATE(2, 1)) == JL_OK,
               "jl_cgimm_init");
    start(&c->base);
    return &c->base;
}
