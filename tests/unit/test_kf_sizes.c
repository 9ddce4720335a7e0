/* Forms of fixed size: the bits of the form for any size, in the Kalman filter
 * and in the IMM, whatever the compiler made of the sizes. */
#include "close.h"

#include <stdlib.h>

#include "jumplink/imm.h"
#include "jumplink/kf.h"

#define N_MAX 9
#define M_MAX 3
#define MODES 4
#define RUNS 5
#define STEPS 25

struct size {
    int n, m;
    const jl_kf_form *fixed[3];         /* as any[] */
};

static const jl_kf_form *const any[] = { &jl_kf_joseph, &jl_kf_standard,
                                         &jl_kf_sqrt };
#define FORMS 3

#define JL_KF_SIZE(n, m) \
    { n, m, { &JL_KF_FIXED(joseph, n, m), &JL_KF_FIXED(standard, n, m), \
              &JL_KF_FIXED(sqrt, n, m) } },
static const struct size sizes[] = {
#include JL_KF_SIZES_FILE
    { 0, 0, { NULL, NULL, NULL } }
};

/* --- random models -------------------------------------------------------- */

static uint32_t seed;

static jl_real rnd(void)                /* in [-1, 1) */
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

static void fill(jl_real *v, int count, jl_real scale)
{
    int i;

    for (i = 0; i < count; i++)
        v[i] = scale * rnd();
}

/* A = B B' + c I */
static void make_cov(jl_real *A, int n, jl_real c)
{
    jl_real B[N_MAX * N_MAX];
    int i, j, k;

    fill(B, n * n, 1);
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            jl_real s = i == j ? c : 0;

            for (k = 0; k < n; k++)
                s += B[i * n + k] * B[j * n + k];
            A[i * n + j] = A[j * n + i] = s;
        }
}

static jl_mode modes[MODES];
static jl_real mode_mem[MODES][JL_MODE_MEM(N_MAX, M_MAX, N_MAX)];
static jl_real scratch[JL_IMM_SCRATCH(MODES, N_MAX, M_MAX)
                       + JL_MODE_SCRATCH(N_MAX, M_MAX, N_MAX)];
static jl_real x0[MODES * N_MAX], P0[MODES * N_MAX * N_MAX], mu0[MODES];

static int bends_f(jl_real *y, const jl_real *x, void *context)
{
    int i, n = *(const int *)context;

    for (i = 0; i < n; i++)
        y[i] = JL_C(0.8) * x[i] + x[(i + 1) % n] / (4 + x[i] * x[i]);
    return JL_OK;
}

static int bends_h(jl_real *z, const jl_real *x, void *context)
{
    const int *nm = context;
    int i;

    for (i = 0; i < nm[1]; i++)
        z[i] = x[i] + x[nm[0] - 1] / (2 + x[i] * x[i]);
    return JL_OK;
}

/* Modes of size n, m and where they start; the last of them nonlinear if
 * asked for. */
static void make_modes(int n, int m, int nonlinear)
{
    static int context[2];
    static jl_nonlinear functions;
    jl_real F[N_MAX * N_MAX], G[N_MAX * N_MAX], Q[N_MAX * N_MAX];
    jl_real H[M_MAX * N_MAX], R[M_MAX * M_MAX], w_bar[N_MAX];
    int i, j;

    for (j = 0; j < MODES; j++) {
        fill(F, n * n, 1 / (jl_real)n);
        for (i = 0; i < n; i++)
            F[i * (n + 1)] += JL_C(0.5);
        fill(G, n * n, 1);
        fill(H, m * n, 1);
        fill(w_bar, n, 1);
        make_cov(Q, n, JL_C(0.01));
        make_cov(R, m, JL_C(0.5));
        assert_int_equal(jl_mode_init(&modes[j], n, m, n, mode_mem[j],
                                      JL_MODE_MEM(n, m, n)), JL_OK);
        assert_int_equal(jl_mode_set(&modes[j], F, G, Q, w_bar, H, R,
                                     scratch), JL_OK);
        fill(x0 + j * n, n, 2);
        make_cov(P0 + j * n * n, n, JL_C(0.1));
        mu0[j] = 1 / (jl_real)MODES;
    }
    if (nonlinear) {
        context[0] = n;
        context[1] = m;
        memset(&functions, 0, sizeof functions);
        functions.f = bends_f;
        functions.h = bends_h;
        functions.context = context;
        assert_int_equal(jl_mode_nonlinear(&modes[MODES - 1], &functions),
                         JL_OK);
    }
}

/* Measurement k: now and then there is none. */
static const jl_real *next_z(jl_real *z, int m, int k)
{
    fill(z, m, 3);
    return k % 7 == 3 ? NULL : z;
}

/* --- tests ---------------------------------------------------------------- */

/* All sizes, forms and runs: what(size, form, run). */
static void for_all(void (*what)(const struct size *s, int f, int run))
{
    const struct size *s;
    int f, run;

    if (sizes[0].n == 0)
        skip();                         /* kf_sizes.def is empty */
    for (s = sizes; s->n > 0; s++)
        for (f = 0; f < FORMS; f++)
            for (run = 0; run < RUNS; run++) {
                seed = (uint32_t)(s->n * 1000 + s->m * 100 + run);
                what(s, f, run);
            }
}

static void compare_kf(const struct size *s, int f, int run)
{
    jl_real mem[2][JL_KF_STATE(N_MAX, M_MAX)], z[M_MAX], loglik[2];
    jl_kf kf[2];
    int i, k, n = s->n, m = s->m;

    make_modes(n, m, run % 2);
    for (i = 0; i < 2; i++) {
        assert_int_equal(jl_kf_init(&kf[i], &modes[MODES - 1],
                                    i == 0 ? any[f] : s->fixed[f], mem[i],
                                    JL_KF_STATE(n, m)), JL_OK);
        assert_int_equal(jl_kf_set(&kf[i], x0, P0, scratch), JL_OK);
    }
    for (k = 0; k < STEPS; k++) {
        const jl_real *zk = next_z(z, m, k);

        for (i = 0; i < 2; i++)
            assert_int_equal(jl_kf_step(&kf[i], &loglik[i], zk, scratch),
                             JL_OK);
        assert_same_bits(mem[0], mem[1], sizeof(jl_real)
                         * (size_t)JL_KF_STATE(n, m));
        assert_same_bits(&loglik[0], &loglik[1], sizeof loglik[0]);
        assert_same_bits(&kf[0].innovation.nis, &kf[1].innovation.nis,
                         sizeof(jl_real));
    }
}

static void test_fixed_kf_has_the_bits_of_any_size(void **state)
{
    (void)state;
    for_all(compare_kf);
}

static void compare_imm(const struct size *s, int f, int mixing, int M,
                        int run)
{
    static jl_real mem[2][JL_IMM_STATE(MODES, N_MAX, M_MAX)];
    jl_real Pi[MODES * MODES], z[M_MAX];
    jl_imm imm[2];
    int i, j, k, n = s->n, m = s->m, state = JL_IMM_STATE(M, n, m);

    make_modes(n, m, run % 2);
    for (i = 0; i < M; i++)
        for (j = 0; j < M; j++)
            Pi[i * M + j] = i == j ? JL_C(0.875) : JL_C(0.125)
                / (jl_real)(M - 1);
    for (j = 0; j < M; j++)
        mu0[j] = 1 / (jl_real)M;
    for (i = 0; i < 2; i++) {
        assert_int_equal(jl_imm_init(&imm[i], M, modes + MODES - M,
                                     i == 0 ? any[f] : s->fixed[f], mixing,
                                     mem[i], state), JL_OK);
        assert_int_equal(jl_imm_chain(&imm[i], Pi), JL_OK);
        assert_int_equal(imm[i].sticky, mixing == JL_MIX_AUTO);
        assert_int_equal(jl_imm_set(&imm[i], x0, P0, mu0, scratch), JL_OK);
    }
    for (k = 0; k < STEPS; k++) {
        const jl_real *zk = next_z(z, m, k);

        for (i = 0; i < 2; i++)
            assert_int_equal(jl_imm_step(&imm[i], zk, scratch), JL_OK);
        assert_same_bits(mem[0], mem[1], sizeof(jl_real) * (size_t)state);
        assert_same_bits(&imm[0].loglik, &imm[1].loglik, sizeof(jl_real));
    }
}

static void compare_imms(const struct size *s, int f, int run)
{
    int M;

    for (M = 2; M <= MODES; M++) {
        compare_imm(s, f, JL_MIX_AUTO, M, run);
        compare_imm(s, f, JL_MIX_GENERAL, M, run);
    }
}

static void test_fixed_imm_has_the_bits_of_any_size(void **state)
{
    (void)state;
    for_all(compare_imms);
}

/* A measurement that is not a number, one that is beyond JL_LARGE. */
static void refuse(const struct size *s, int f, int run)
{
    jl_real mem[JL_KF_STATE(N_MAX, M_MAX)], before[JL_KF_STATE(N_MAX, M_MAX)];
    jl_real z[M_MAX], loglik = 5;
    jl_kf kf;

    make_modes(s->n, s->m, 0);
    jl_kf_init(&kf, &modes[0], s->fixed[f], mem, JL_KF_STATE(s->n, s->m));
    jl_kf_set(&kf, x0, P0, scratch);
    memcpy(before, mem, sizeof mem);
    fill(z, s->m, 1);
    z[run % s->m] = run % 2 ? (jl_real)NAN : -2 * JL_LARGE;
    assert_int_equal(jl_kf_step(&kf, &loglik, z, scratch), JL_ENONFINITE);
    assert_int_equal(jl_kf_update(&kf, &loglik, z, scratch), JL_ENONFINITE);
    assert_same_bits(mem, before, sizeof(jl_real)
                     * (size_t)JL_KF_STATE(s->n, s->m));
    assert_true(loglik >= 5 && loglik <= 5);
}

static void test_fixed_kf_is_unchanged_by_bad_measurements(void **state)
{
    (void)state;
    for_all(refuse);
}

static void test_fixed_is_looked_up(void **state)
{
    const struct size *s;
    int f;

    (void)state;
    for (s = sizes; s->n > 0; s++)
        for (f = 0; f < FORMS; f++) {
            const jl_kf_form *fixed = jl_kf_fixed(any[f], s->n, s->m);

            assert_ptr_equal(fixed, s->fixed[f]);
            assert_int_equal(fixed->n, s->n);
            assert_int_equal(fixed->m, s->m);
            assert_int_equal(fixed->cov->factored, any[f]->cov->factored);
            assert_ptr_equal(jl_kf_fixed(fixed, s->n, s->m), fixed);
        }
    for (f = 0; f < FORMS; f++) {
        assert_ptr_equal(jl_kf_fixed(any[f], 7, 5), any[f]);
        assert_ptr_equal(jl_kf_fixed(any[f], 0, 0), any[f]);
    }
    assert_ptr_equal(jl_kf_fixed(&jl_kf_unscented, 4, 2), &jl_kf_unscented);
}

static void test_fixed_refuses_other_sizes(void **state)
{
    static jl_real mem[JL_IMM_STATE(MODES, N_MAX, M_MAX)];
    const struct size *s;
    jl_imm imm;
    jl_kf kf;
    int f;

    (void)state;
    for (s = sizes; s->n > 0; s++)
        for (f = 0; f < FORMS; f++) {
            make_modes(5, 2, 0);
            assert_int_equal(jl_kf_init(&kf, modes, s->fixed[f], mem,
                                        JL_KF_STATE(5, 2)), JL_EDIM);
            assert_int_equal(jl_imm_init(&imm, MODES, modes, s->fixed[f],
                                         JL_MIX_AUTO, mem,
                                         JL_IMM_STATE(MODES, 5, 2)),
                             JL_EDIM);
            make_modes(s->n, s->m == 1 ? 2 : 1, 0);
            assert_int_equal(jl_kf_init(&kf, modes, s->fixed[f], mem,
                                        JL_KF_STATE(s->n, 2)), JL_EDIM);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fixed_kf_has_the_bits_of_any_size),
        cmocka_unit_test(test_fixed_imm_has_the_bits_of_any_size),
        cmocka_unit_test(test_fixed_kf_is_unchanged_by_bad_measurements),
        cmocka_unit_test(test_fixed_is_looked_up),
        cmocka_unit_test(test_fixed_refuses_other_sizes),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
