/* A bank of constant-gain filters with measurements, for par_case.h. */
#ifndef PAR_CG_CASE_H
#define PAR_CG_CASE_H

#include "close.h"

#include "jumplink.h"

#define PAR_CG_M 64
#define PAR_CG_AXES 3
#define PAR_ASLEEP_US 1000000000L

/* Every PE builds its own. */
struct par_cg_bank {
    jl_cg_gains gains[PAR_CG_M];
    jl_real mem[JL_CGIMM_STATE(PAR_CG_M, PAR_CG_AXES)];
    jl_real scratch[3 * PAR_CG_AXES];
    jl_cgimm cg;
    jl_chan *silent;            /* nothing ever comes here                  */
    int hangs_at;               /* or -1                                    */
};

/* Who has the accelerations depends on the axes: of two modes the second, the
 * first, neither. */
static inline int par_cg_order(int j, int M, int axes)
{
    return M == 2 && axes == 3 ? 2 : 3 - (j + axes) % 2;
}

static inline void par_cg_init(struct par_cg_bank *bank, int M, int axes)
{
    jl_real Pi[PAR_CG_M * PAR_CG_M];
    int i, j;

    for (j = 0; j < M; j++) {
        jl_real out = JL_C(0.02) * (jl_real)(j % 8 + 1);    /* leaving mode j */

        assert_int_equal(jl_cg_design(&bank->gains[j],
                                      par_cg_order(j, M, axes), 1,
                                      (jl_real)(100 + 700 * j), 1e4), 0);
        for (i = 0; i < M; i++)
            Pi[j * M + i] = M == 1 ? 1
                : i == j ? 1 - out : out / (jl_real)(M - 1);
    }
    assert_int_equal(jl_cgimm_init(&bank->cg, M, bank->gains, axes, 1, 1e4,
                                   Pi, bank->mem,
                                   JL_CGIMM_STATE(PAR_CG_M, PAR_CG_AXES)), 0);
    bank->silent = NULL;
    bank->hangs_at = -1;
}

/* All modes at z, with velocities. */
static inline int par_cg_set(jl_cgimm *cg, const jl_real *z)
{
    jl_real x[PAR_CG_M * PAR_CG_AXES * 3];
    int k;

    memset(x, 0, sizeof x);
    for (k = 0; k < cg->M * cg->axes; k++) {
        x[k * cg->order] = z[k % cg->axes];
        x[k * cg->order + 1] = 400;
    }
    return jl_cgimm_set(cg, x, NULL);
}

/* A filter that is started twice, of which a mode's gains start again now and
 * then, in a prepare that once fails, and spoils the scratch. */
static inline int par_cg_prepare(void *context, jl_cgimm *cg,
                                 const jl_meas *meas)
{
    struct par_cg_bank *bank = context;
    int seq = (int)meas->seq;

    if (seq == bank->hangs_at)
        (void)jl_chan_recv(bank->silent, NULL, 0, PAR_ASLEEP_US);
    memset(bank->scratch, 0xff, sizeof bank->scratch);
    if (seq == 44)
        return JL_ERANGE;
    if (seq % 11 == 0)
        jl_cgimm_restart(cg, seq % cg->M);
    if (seq != 1 && seq != 35)
        return JL_OK;
    assert_int_equal(par_cg_set(cg, meas->z), JL_OK);
    return JL_STARTED;
}

/* Measurement k: a path with noise, at last one that accelerates; some are
 * missing, one is an outlier, two cannot be used, some are as large as can
 * be. */
static inline void par_cg_meas(jl_meas *meas, jl_real *z, int k, int axes)
{
    unsigned r = (unsigned)k * 2654435761u;
    int i;

    for (i = 0; i < axes; i++) {
        r = r * 1664525u + 1013904223u;
        z[i] = (jl_real)(450 - 200 * i) * (jl_real)k
            + (jl_real)(r >> 16) / 200 - 160
            + (k > 36 ? 40 * (jl_real)((k - 36) * (k - 36)) : 0);
        if (k == 18 && i == axes - 1)
            z[i] = -JL_REAL_MAX;
        if (k >= 50 && k < 54)
            z[i] = JL_LARGE;
    }
    if (k == 20)
        z[0] = -jl_log(0);
    if (k == 25)
        z[0] += 100000;
    meas->seq = (jl_u32)k + 1;
    meas->first = k == 0;
    meas->dt = 1;
    meas->z = k % 7 == 5 ? NULL : z;
}

/* The reference: jl_cgimm_step, on one processor. */
static inline int par_cg_step(struct par_cg_bank *bank, const jl_meas *meas,
                              int *verdict)
{
    int status = par_cg_prepare(bank, &bank->cg, meas);

    *verdict = JL_MISSING;
    if (status == JL_STARTED)
        return JL_OK;
    if (status == JL_OK)
        status = jl_cgimm_step(&bank->cg, meas->z);
    if (status == JL_OK && meas->z != NULL)
        *verdict = JL_ACCEPTED;
    return status;
}

#endif
