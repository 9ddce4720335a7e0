/* instructions FILTER STEPS: that many steps of a filter of two modes, CV and
 * CA, in one axis, for instructions.sh. */
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "jumplink.h"

static const jl_real Pi[] = { JL_C(0.98), JL_C(0.02), JL_C(0.02), JL_C(0.98) };
static const jl_motion motions[] = { { JL_MOTION_CV, 1, 3, 10, 0, 100, 0 },
                                     { JL_MOTION_CA, 1, 3, 63, 0, 100, 0 } };

static jl_real measured(int k)
{
    return (jl_real)(100 * k + (k % 10 < 5 ? 80 : -80));
}

static void run_cgimm(int steps)
{
    static jl_real mem[JL_CGIMM_STATE(2, 1)];
    jl_cg_gains gains[2];
    jl_cgimm cg;
    int j, k;

    for (j = 0; j < 2; j++) {
        bench_must(jl_cg_design(&gains[j], 2 + j, 1, j == 0 ? 100 : 4000, 10000)
                   == JL_OK, "jl_cg_design");
        memset(gains[j].k, 0, sizeof gains[j].k);       /* steady */
    }
    bench_must(jl_cgimm_init(&cg, 2, gains, 1, 1, 10000, Pi, mem,
                             JL_CGIMM_STATE(2, 1)) == JL_OK, "jl_cgimm_init");
    for (k = 0; k < steps; k++) {
        jl_real z = measured(k);

        bench_must(jl_cgimm_step(&cg, &z) == JL_OK, "jl_cgimm_step");
    }
}

static void run_imm(const jl_kf_form *form, int steps)
{
    static jl_real modes_mem[2][JL_MODE_MEM(3, 1, 1)];
    static jl_real mem[JL_IMM_STATE(2, 3, 1)], scratch[JL_IMM_SCRATCH(2, 3, 1)];
    jl_mode modes[2];
    jl_imm imm;
    jl_real x[6], P[18], z = 0;
    int j, k;

    for (j = 0; j < 2; j++)
        bench_must(jl_mode_init(&modes[j], 3, 1, 1, modes_mem[j],
                                JL_MODE_MEM(3, 1, 1)) == JL_OK
                   && jl_mode_motion(&modes[j], &motions[j], 1) == JL_OK
                   && jl_motion_start(x + 3 * j, P + 9 * j, &motions[j], &z,
                                      100, 10) == JL_OK, "a mode");
    bench_must(jl_imm_init(&imm, 2, modes, form, JL_MIX_GENERAL, mem,
                           JL_IMM_STATE(2, 3, 1)) == JL_OK
               && jl_imm_chain(&imm, Pi) == JL_OK
               && jl_imm_set(&imm, x, P, NULL, scratch) == JL_OK, "an IMM");
    for (k = 0; k < steps; k++) {
        z = measured(k);
        bench_must(jl_imm_step(&imm, &z, scratch) == JL_OK, "jl_imm_step");
    }
}

int main(int argc, char **argv)
{
    int steps;

    bench_must(argc == 3, "usage: instructions FILTER STEPS");
    steps = atoi(argv[2]);
    if (strcmp(argv[1], "cgimm") == 0)
        run_cgimm(steps);
    else if (strcmp(argv[1], "imm-fixed") == 0)
        run_imm(jl_kf_fixed(&jl_kf_standard, 3, 1), steps);
    else if (strcmp(argv[1], "imm-any") == 0)
        run_imm(&jl_kf_standard, steps);
    else
        bench_must(0, "FILTER: cgimm, imm-fixed or imm-any");
    return 0;
}
