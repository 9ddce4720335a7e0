/* The library, through its public interface. */
#include "sizes.h"

#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "jumplink.h"

struct jumplink_filter {
    struct sizes_filter base;
    const struct sizes_model *model;
    jl_mode *modes;
    jl_kf kf;
    jl_imm imm;
    jl_real *state, *scratch;
    jl_real *P;                         /* of the Kalman filter             */
};

static struct jumplink_filter *of(struct sizes_filter *f)
{
    return (struct jumplink_filter *)f;
}

static void start(struct sizes_filter *f)
{
    struct jumplink_filter *j = of(f);
    const struct sizes_model *model = j->model;

    if (model->kalman)
        bench_must(jl_kf_set(&j->kf, model->x, model->P, j->scratch)
                   == JL_OK, "jl_kf_set");
    else
        bench_must(jl_imm_set(&j->imm, model->x, model->P, model->mu,
                              j->scratch) == JL_OK, "jl_imm_set");
}

static jl_real step_kalman(struct sizes_filter *f, const jl_real *z)
{
    struct jumplink_filter *j = of(f);
    jl_real loglik;

    bench_must(jl_kf_step(&j->kf, &loglik, z, j->scratch) == JL_OK,
               "jl_kf_step");
    return loglik;
}

static jl_real step_imm(struct sizes_filter *f, const jl_real *z)
{
    struct jumplink_filter *j = of(f);

    bench_must(jl_imm_step(&j->imm, z, j->scratch) == JL_OK, "jl_imm_step");
    return j->imm.loglik;
}

static struct sizes_estimate estimate(struct sizes_filter *f)
{
    static const jl_real one = 1;
    const struct jumplink_filter *j = of(f);
    struct sizes_estimate kalman = { j->kf.x, j->P, &one };
    struct sizes_estimate imm = { j->imm.xhat, j->imm.Phat, j->imm.mu };

    if (!j->model->kalman)
        return imm;
    jl_kf_cov(&j->kf, j->P);
    return kalman;
}

static jl_real *reals(int count)
{
    jl_real *r = calloc((size_t)count, sizeof *r);

    bench_must(r != NULL, "memory");
    return r;
}

static void set_mode(jl_mode *mode, const struct sizes_model *model, int j)
{
    int n = model->n, m = model->m, size = JL_MODE_MEM(n, m, n), i;
    jl_real *G = reals(n * n), *scratch = reals(JL_MODE_SCRATCH(n, m, n));

    for (i = 0; i < n; i++)
        G[i * (n + 1)] = 1;                     /* so that Q is W */
    bench_must(jl_mode_init(mode, n, m, n, reals(size), size) == JL_OK
               && jl_mode_set(mode, model->F + j * n * n, G,
                              model->W + j * n * n, model->u + j * n,
                              model->H + j * m * n, model->R + j * m * m,
                              scratch) == JL_OK, "a mode");
    free(G);
    free(scratch);
}

static struct sizes_filter *new_filter(const struct sizes_model *model,
                                       const jl_kf_form *form)
{
    int M = model->M, n = model->n, j, status;
    struct jumplink_filter *f = calloc(1, sizeof *f);

    bench_must(f != NULL, "memory");
    f->base.start = start;
    f->base.step = model->kalman ? step_kalman : step_imm;
    f->base.estimate = estimate;
    f->model = model;
    f->modes = calloc((size_t)M, sizeof *f->modes);
    bench_must(f->modes != NULL, "memory");
    for (j = 0; j < M; j++)
        set_mode(&f->modes[j], model, j);
    f->P = reals(n * n);
    f->state = reals(JL_IMM_STATE(M, n, model->m));
    f->scratch = reals(JL_IMM_SCRATCH(M, n, model->m)
                       + JL_KF_SCRATCH(n, model->m));
    if (model->kalman) {
        status = jl_kf_init(&f->kf, f->modes, form, f->state,
                            JL_KF_STATE(n, model->m));
    } else {
        status = jl_imm_init(&f->imm, M, f->modes, form,
                             model->sticky ? JL_MIX_AUTO : JL_MIX_GENERAL,
                             f->state, JL_IMM_STATE(M, n, model->m));
        if (status == JL_OK)
            status = jl_imm_chain(&f->imm, model->Pi);
        bench_must(f->imm.sticky == model->sticky, "the kind of chain");
    }
    bench_must(status == JL_OK, "the filter");
    start(&f->base);
    return &f->base;
}

static const jl_kf_form *const forms[] = { &jl_kf_standard, &jl_kf_joseph,
                                           &jl_kf_sqrt };

struct sizes_filter *sizes_any(const struct sizes_model *model,
                               enum sizes_form form)
{
    return new_filter(model, forms[form]);
}

struct sizes_filter *sizes_fixed(const struct sizes_model *model,
                                 enum sizes_form form)
{
    const jl_kf_form *fixed = jl_kf_fixed(forms[form], model->n, model->m);

    return fixed->n == 0 ? NULL : new_filter(model, fixed);
}

struct sizes_filter *sizes_dense(const struct sizes_model *model,
                                 enum sizes_form form)
{
    struct sizes_filter *filter = form == SQRT ? NULL
        : sizes_fixed(model, form);
    jl_mode *modes = filter == NULL ? NULL : of(filter)->modes;
    int j;

    for (j = 0; modes != NULL && j < model->M; j++) {
        modes[j].block = model->n;
        modes[j].every = 0;
    }
    return filter;
}
