/* The smallest useful firmware, for its size: a filter of a motion in two axes
 * that takes one measurement.  FIRMWARE_IMM: the IMM of two modes; else a
 * Kalman filter. */
#include "jumplink.h"

#define N 4
#define Z 2
#define M 2

static jl_real mode_mem[M][JL_MODE_MEM(N, Z, Z)];
static jl_real x[M * N], P[M * N * N], z[Z];
static jl_mode modes[M];

static void set_up(int j)
{
    jl_motion motion = { JL_MOTION_CV, 2, 2, 1, 0, 20, 0 };

    (void)jl_mode_init(&modes[j], N, Z, Z, mode_mem[j],
                       JL_MODE_MEM(N, Z, Z));
    (void)jl_mode_motion(&modes[j], &motion, 1);
    (void)jl_motion_start(x + j * N, P + j * N * N, &motion, z, 100, 10);
}

#ifdef FIRMWARE_IMM
static jl_real mem[JL_IMM_STATE(M, N, Z)], scratch[JL_IMM_SCRATCH(M, N, Z)];

int main(void)
{
    static const jl_real Pi[M * M] = { JL_C(0.9), JL_C(0.1),
                                       JL_C(0.1), JL_C(0.9) };
    static const jl_real mu[M] = { JL_C(0.5), JL_C(0.5) };
    static jl_imm imm;

    set_up(0);
    set_up(1);
    (void)jl_imm_init(&imm, M, modes, &jl_kf_joseph, JL_MIX_AUTO, mem,
                      JL_IMM_STATE(M, N, Z));
    (void)jl_imm_chain(&imm, Pi);
    (void)jl_imm_set(&imm, x, P, mu, scratch);
    return jl_imm_step(&imm, z, scratch);
}
#else
static jl_real mem[JL_KF_STATE(N, Z)], scratch[JL_KF_SCRATCH(N, Z)];

int main(void)
{
    static jl_kf kf;

    set_up(0);
    (void)jl_kf_init(&kf, &modes[0], &jl_kf_joseph, mem, JL_KF_STATE(N, Z));
    (void)jl_kf_set(&kf, x, P, scratch);
    return jl_kf_step(&kf, NULL, z, scratch);
}
#endif
