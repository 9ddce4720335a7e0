/* An IMM of the catalogue's motions is the IMM of their matrices: with a mode
 * whose noise has full rank (Singer) beside such as have one an axis. */
#include "close.h"

#include "jumplink.h"

#define AXES 2
#define DIM (3 * AXES)
#define M 3
#define STEPS 80
#define SIZE (DIM * DIM)

#if JL_REAL_FLOAT
#define NEAR 2e-3
#else
#define NEAR 1e-9
#endif

static const jl_motion motions[M] = {
    { JL_MOTION_SINGER, AXES, 3, 3, 0, 20, 4 },
    { JL_MOTION_CV, AXES, 3, JL_C(0.5), 0, 20, 0 },
    { JL_MOTION_CA, AXES, 3, 1, 0, 20, 0 }
};

/* F and W of an axis over T as published (Singer 1970; Bar-Shalom, Li,
 * Kirubarajan 2001, eq. 8.2.3): in long double there are digits to spare. */
static void matrices(long double F[3][3], long double W[3][3],
                     const jl_motion *motion, long double T)
{
    const long double s = motion->accel_std, tau = motion->tau_s;
    const long double t = T / tau, e = expl(-t);
    const long double plain[3][3] = { { 1, T, T * T / 2 }, { 0, 1, T },
                                      { 0, 0, 1 } };
    const long double g[3] = { T * T / 2, T, 1 };
    const int order = motion->kind == JL_MOTION_CV ? 2 : 3;
    int i, j;

    memset(F, 0, 9 * sizeof F[0][0]);
    memset(W, 0, 9 * sizeof W[0][0]);
    for (i = 0; i < order; i++)
        for (j = 0; j < order; j++) {
            F[i][j] = plain[i][j];
            W[i][j] = s * s * g[i] * g[j];
        }
    if (motion->kind != JL_MOTION_SINGER)
        return;
    F[0][2] = tau * tau * (t - 1 + e);
    F[1][2] = tau * (1 - e);
    F[2][2] = e;
    W[0][0] = powl(tau, 4) * (1 - e * e + 2 * t + 2 * t * t * t / 3
                              - 2 * t * t - 4 * t * e);
    W[0][1] = powl(tau, 3) * (e * e + 1 - 2 * e + 2 * t * e - 2 * t + t * t);
    W[0][2] = tau * tau * (1 - e * e - 2 * t * e);
    W[1][1] = tau * tau * (4 * e - 3 - e * e + 2 * t);
    W[1][2] = tau * (e * e + 1 - 2 * e);
    W[2][2] = 1 - e * e;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            W[i][j] = (i <= j ? W[i][j] : W[j][i]) * (i <= j ? s * s : 1);
}

/* A mode of n noises: G = I, Q = W. */
static void set_matrices(jl_mode *mode, jl_real *mem, const jl_motion *motion,
                         jl_real dt)
{
    static jl_real scratch[JL_MODE_SCRATCH(DIM, AXES, DIM)];
    jl_real F[SIZE] = { 0 }, G[SIZE] = { 0 }, Q[SIZE] = { 0 };
    jl_real H[AXES * DIM] = { 0 }, R[AXES * AXES] = { 0 };
    long double f[3][3], w[3][3];
    int a, i, j;

    matrices(f, w, motion, dt);
    for (a = 0; a < AXES; a++) {
        for (i = 0; i < 3; i++)
            for (j = 0; j < 3; j++) {
                F[(3 * a + i) * DIM + 3 * a + j] = (jl_real)f[i][j];
                Q[(3 * a + i) * DIM + 3 * a + j] = (jl_real)w[i][j];
            }
        H[a * DIM + 3 * a] = 1;
        R[a * AXES + a] = motion->sigma_z * motion->sigma_z;
    }
    for (i = 0; i < DIM; i++)
        G[i * (DIM + 1)] = 1;
    assert_int_equal(jl_mode_init(mode, DIM, AXES, DIM, mem,
                                  JL_MODE_MEM(DIM, AXES, DIM)), JL_OK);
    assert_int_equal(jl_mode_set(mode, F, G, Q, NULL, H, R, scratch), JL_OK);
}

static void set_motion(jl_mode *mode, jl_real *mem, const jl_motion *motion,
                       jl_real dt)
{
    assert_int_equal(jl_mode_init(mode, DIM, AXES, jl_motion_noises(motion),
                                  mem, JL_MODE_MEM(DIM, AXES, DIM)), JL_OK);
    assert_int_equal(jl_mode_motion(mode, motion, dt), JL_OK);
}

static jl_real mode_mem[2][M][JL_MODE_MEM(DIM, AXES, DIM)];
static jl_real mem[2][JL_IMM_STATE(M, DIM, AXES)];
static jl_real scratch[JL_IMM_SCRATCH(M, DIM, AXES)];

static void open_imm(jl_imm *imm, jl_mode *modes, jl_real *state,
                     const jl_kf_form *form)
{
    const jl_real z[AXES] = { 100, -50 }, mu[M] = { JL_C(0.25), JL_C(0.5),
                                                    JL_C(0.25) };
    jl_real x[M * DIM], P[M * SIZE];
    int j;

    for (j = 0; j < M; j++)
        assert_int_equal(jl_motion_start(x + j * DIM, P + j * SIZE, &motions[j],
                                         z, 100, 3), JL_OK);
    assert_int_equal(jl_imm_init(imm, M, modes, form, JL_MIX_AUTO, state,
                                 JL_IMM_STATE(M, DIM, AXES)), JL_OK);
    assert_int_equal(jl_imm_set(imm, x, P, mu, scratch), JL_OK);
}

/* Straight on, then a weaving turn, then a missing stretch. */
static const jl_real *measured(jl_real z[AXES], int k, double t)
{
    const double turning = k < 25 ? 0 : t - 25;

    z[0] = (jl_real)(100 + 60 * t + 7 * sin(5.0 * k));
    z[1] = (jl_real)(-50 + 300 * (1 - cos(turning / 6)) + 7 * cos(3.0 * k));
    return k % 9 == 0 || (k > 60 && k < 66) ? NULL : z;
}

static void check_same_filter(const jl_imm *a, const jl_imm *b)
{
    int i, j;

    for (i = 0; i < DIM; i++) {
        const double si = sqrt((double)b->Phat[i * (DIM + 1)]);

        assert_close((double)(a->xhat[i] - b->xhat[i]) / si, 0, NEAR);
        for (j = 0; j < DIM; j++)
            assert_close((double)(a->Phat[i * DIM + j] - b->Phat[i * DIM + j])
                         / si / sqrt((double)b->Phat[j * (DIM + 1)]), 0, NEAR);
    }
    for (j = 0; j < M; j++)
        assert_close(a->mu[j], b->mu[j], NEAR);
    assert_close(a->loglik, b->loglik, NEAR * (1 + fabs((double)b->loglik)));
}

static void run(const jl_kf_form *form)
{
    static const jl_real sojourn_s[M] = { 20, 40, 10 };
    static const jl_real dts[4] = { 1, JL_C(0.5), 2, JL_C(1.25) };
    jl_mode of_motions[M], of_matrices[M];
    jl_imm a, b;
    jl_real Pi[M * M], z[AXES];
    double t = 0, most = 0;
    int j, k;

    for (j = 0; j < M; j++) {
        set_motion(&of_motions[j], mode_mem[0][j], &motions[j], 1);
        set_matrices(&of_matrices[j], mode_mem[1][j], &motions[j], 1);
    }
    open_imm(&a, of_motions, mem[0], form);
    open_imm(&b, of_matrices, mem[1], form);
    for (k = 1; k <= STEPS; k++) {
        const jl_real dt = dts[k % 4], *got;

        t += (double)dt;
        got = measured(z, k, t);
        assert_int_equal(jl_chain_sojourn(Pi, sojourn_s, M, dt), JL_OK);
        assert_int_equal(jl_imm_chain(&a, Pi), JL_OK);
        assert_int_equal(jl_imm_chain(&b, Pi), JL_OK);
        for (j = 0; j < M; j++) {
            assert_int_equal(jl_mode_motion(&of_motions[j], &motions[j], dt),
                             JL_OK);
            set_matrices(&of_matrices[j], mode_mem[1][j], &motions[j], dt);
        }
        assert_int_equal(jl_imm_step(&a, got, scratch), JL_OK);
        assert_int_equal(jl_imm_step(&b, got, scratch), JL_OK);
        check_same_filter(&a, &b);
        if ((double)a.mu[0] > most)
            most = (double)a.mu[0];
    }
    assert_true(most > 0.5);            /* Singer's mode had its say */
}

static void test_imm_of_motions_is_of_their_matrices(void **state)
{
    (void)state;
    run(&jl_kf_joseph);
    run(&jl_kf_standard);
    run(&jl_kf_sqrt);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_imm_of_motions_is_of_their_matrices),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
