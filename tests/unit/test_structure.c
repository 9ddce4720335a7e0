/* What products leave out: a mode that knows where its zeros are gives the same
 * numbers as one that does not (a zero may have another sign), in every form. */
#include "close.h"

#include <stdlib.h>

#include "jumplink/imm.h"
#include "jumplink/kf.h"

#define N_MAX 12
#define M_MAX 6
#define MODES 3
#define STEPS 50

static const struct shape {
    int n, m, block, every;
} shapes[] = {
    { 4, 2, 2, 2 }, { 6, 2, 3, 3 }, { 6, 3, 2, 2 }, { 9, 3, 3, 3 },
    { 2, 1, 1, 2 }, { 3, 1, 1, 3 }, { 1, 1, 1, 1 }, { 4, 2, 1, 2 },
    { 4, 2, 4, 1 }, { 4, 2, 2, 1 }, { 4, 2, 2, 0 }, { 4, 2, 4, 2 },
    { 6, 1, 2, 6 }, { 6, 2, 2, 3 }, { 6, 2, 2, 5 }, { 6, 6, 3, 1 },
    { 5, 2, 5, 4 }, { 7, 2, 1, 3 }, { 8, 3, 4, 2 }, { 12, 5, 3, 2 }
};
#define SHAPES ((int)(sizeof shapes / sizeof *shapes))

static const jl_kf_form *const forms[] = { &jl_kf_joseph, &jl_kf_standard,
                                           &jl_kf_sqrt, &jl_kf_unscented };
#define FORMS 4

/* --- random models of a shape --------------------------------------------- */

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

static jl_mode modes[MODES], dense[MODES];
static jl_real mode_mem[MODES][JL_MODE_MEM(N_MAX, M_MAX, N_MAX)];
static jl_real scratch[JL_IMM_SCRATCH(MODES, N_MAX, M_MAX)
                       + JL_MODE_SCRATCH(N_MAX, M_MAX, N_MAX)];
static jl_real x0[MODES * N_MAX], P0[MODES * N_MAX * N_MAX];

/* Mode j; dense[j] is the same and does not know. */
static void make_mode(const struct shape *s, int j)
{
    jl_real F[N_MAX * N_MAX], G[N_MAX * N_MAX], Q[N_MAX * N_MAX];
    jl_real H[M_MAX * N_MAX], R[M_MAX * M_MAX], w_bar[N_MAX];
    int n = s->n, m = s->m, p = j == 0 ? 1 : n, i, k;

    for (i = 0; i < n; i++)
        for (k = 0; k < n; k++)
            F[i * n + k] = i / s->block != k / s->block ? 0
                : rnd() / (jl_real)s->block
                + (i != k ? 0 : i % 2 ? -JL_C(0.5) : JL_C(0.5));
    fill(G, n * p, 1);
    for (i = 0; i < n * p; i += 2)
        G[i] = 0;
    fill(H, m * n, 1);
    for (i = 0; i < m * n && s->every > 0; i++)
        H[i] = (jl_real)(i % n == i / n * s->every);
    fill(w_bar, p, 1);
    make_cov(Q, p, JL_C(0.01));
    make_cov(R, m, JL_C(0.5));
    assert_int_equal(jl_mode_init(&modes[j], n, m, p, mode_mem[j],
                                  JL_MODE_MEM(n, m, p)), JL_OK);
    assert_int_equal(jl_mode_set(&modes[j], F, G, Q, w_bar, H, R, scratch),
                     JL_OK);
    assert_int_equal(modes[j].block, s->block);
    assert_int_equal(modes[j].every, s->every);
    dense[j] = modes[j];
    dense[j].block = n;
    dense[j].every = 0;
    fill(x0 + j * n, n, 2);
    make_cov(P0 + j * n * n, n, JL_C(0.1));
}

/* Measurement k: now and then there is none. */
static const jl_real *next_z(jl_real *z, int m, int k)
{
    fill(z, m, 3);
    return k % 7 == 3 ? NULL : z;
}

static void check_equal(const jl_real *a, const jl_real *b, int count)
{
    int i;

    for (i = 0; i < count; i++)
        assert_true(a[i] == b[i]);      /* not NaN; 0 is -0 */
}

/* --- tests ---------------------------------------------------------------- */

enum { STRUCTURED, DENSE, FIXED, KINDS };

static void check_kf(const struct shape *s, const jl_kf_form *form)
{
    static jl_real mem[KINDS][JL_KF_STATE(N_MAX, M_MAX)];
    jl_real z[M_MAX], loglik[KINDS];
    int i, k, n = s->n, m = s->m, state = JL_KF_STATE(n, m);
    jl_kf kf[KINDS];

    make_mode(s, 1);
    for (i = 0; i < KINDS; i++) {
        assert_int_equal(jl_kf_init(&kf[i], i == DENSE ? &dense[1] : &modes[1],
                                    i == FIXED ? jl_kf_fixed(form, n, m) : form,
                                    mem[i], state), JL_OK);
        assert_int_equal(jl_kf_set(&kf[i], x0 + n, P0 + n * n, scratch),
                         JL_OK);
    }
    for (k = 0; k < STEPS; k++) {
        const jl_real *zk = next_z(z, m, k);

        for (i = 0; i < KINDS; i++) {
            if (k % 2)
                assert_int_equal(jl_kf_predict(&kf[i], scratch), JL_OK);
            assert_int_equal((k % 2 ? jl_kf_update : jl_kf_step)
                             (&kf[i], &loglik[i], zk, scratch), JL_OK);
        }
        check_equal(mem[STRUCTURED], mem[DENSE], state);
        check_equal(&loglik[STRUCTURED], &loglik[DENSE], 1);
        check_equal(&kf[STRUCTURED].innovation.nis, &kf[DENSE].innovation.nis,
                    1);
        assert_same_bits(mem[STRUCTURED], mem[FIXED], sizeof **mem
                         * (size_t)state);
        assert_same_bits(&loglik[STRUCTURED], &loglik[FIXED], sizeof *loglik);
    }
}

static void check_imm(const struct shape *s, const jl_kf_form *form,
                      int mixing)
{
    static jl_real mem[KINDS][JL_IMM_STATE(MODES, N_MAX, M_MAX)];
    static const jl_real Pi[MODES * MODES] = {
        JL_C(0.75), JL_C(0.125), JL_C(0.125), JL_C(0.125), JL_C(0.75),
        JL_C(0.125), JL_C(0.125), JL_C(0.125), JL_C(0.75)
    };
    static const jl_real mu[MODES] = { JL_C(0.25), JL_C(0.25), JL_C(0.5) };
    int i, j, k, n = s->n, m = s->m, state = JL_IMM_STATE(MODES, n, m);
    jl_real z[M_MAX];
    jl_imm imm[KINDS];

    for (j = 0; j < MODES; j++)
        make_mode(s, j);
    memset(mem, 0, sizeof mem);
    for (i = 0; i < KINDS; i++) {
        assert_int_equal(jl_imm_init(&imm[i], MODES,
                                     i == DENSE ? dense : modes,
                                     i == FIXED ? jl_kf_fixed(form, n, m)
                                     : form, mixing, mem[i], state), JL_OK);
        assert_int_equal(jl_imm_chain(&imm[i], Pi), JL_OK);
        assert_int_equal(jl_imm_set(&imm[i], x0, P0, mu, scratch), JL_OK);
    }
    for (k = 0; k < STEPS; k++) {
        const jl_real *zk = next_z(z, m, k);

        for (i = 0; i < KINDS; i++)
            assert_int_equal(jl_imm_step(&imm[i], zk, scratch), JL_OK);
        check_equal(mem[STRUCTURED], mem[DENSE], state);
        check_equal(&imm[STRUCTURED].loglik, &imm[DENSE].loglik, 1);
        assert_same_bits(mem[STRUCTURED], mem[FIXED], sizeof **mem
                         * (size_t)state);
        assert_same_bits(&imm[STRUCTURED].loglik, &imm[FIXED].loglik,
                         sizeof(jl_real));
    }
}

static void test_structure_kf_has_equal_numbers(void **state)
{
    int s, f;

    (void)state;
    for (s = 0; s < SHAPES; s++)
        for (f = 0; f < FORMS; f++) {
            seed = (uint32_t)(100 * s + f);
            check_kf(&shapes[s], forms[f]);
        }
}

static void test_structure_imm_has_equal_numbers(void **state)
{
    int s, f;

    (void)state;
    for (s = 0; s < SHAPES; s++)
        for (f = 0; f < FORMS; f++) {
            seed = (uint32_t)(100 * s + f);
            check_imm(&shapes[s], forms[f], JL_MIX_AUTO);
            check_imm(&shapes[s], forms[f], JL_MIX_GENERAL);
        }
}

/* Zeros that products of negative numbers leave in a model do not tell how many
 * a sum left out: a form for any size leaves out those outside blocks of 1, one
 * of fixed size those outside the blocks of motions. */
static void test_structure_zeros_have_one_sign(void **state)
{
    static const jl_real F[16] = { -1, 0, 0, 0, 0, -1, 0, 0,
                                   0, 0, -1, 0, 0, 0, 0, -1 };
    static const jl_real G[4] = { 0, -1, 0, 0 }, Q = 1, w_bar = 0;
    static const jl_real H[8] = { 1, 0, 0, 0, 0, 0, 1, 0 };
    static const jl_real R[4] = { 1, 0, 0, 1 }, x[4], z[2];
    jl_real mem[2][JL_KF_STATE(4, 2)], P[16];
    jl_kf kf[2];
    int f, i, k;

    (void)state;
    for (i = 0; i < 16; i++)
        P[i] = (jl_real)(i % 5 == 0);
    jl_mode_init(&modes[0], 4, 2, 1, mode_mem[0], JL_MODE_MEM(4, 2, 1));
    assert_int_equal(jl_mode_set(&modes[0], F, G, &Q, &w_bar, H, R, scratch),
                     JL_OK);
    for (f = 0; f < FORMS; f++) {
        for (i = 0; i < 2; i++) {
            jl_kf_init(&kf[i], &modes[0], i == 0 ? forms[f]
                       : jl_kf_fixed(forms[f], 4, 2), mem[i],
                       JL_KF_STATE(4, 2));
            jl_kf_set(&kf[i], x, P, scratch);
        }
        for (k = 0; k < 10; k++)
            for (i = 0; i < 2; i++) {
                assert_int_equal(k % 2 == 0 ? jl_kf_predict(&kf[i], scratch)
                                 : jl_kf_update(&kf[i], NULL, z, scratch),
                                 JL_OK);
                if (i == 1)
                    assert_same_bits(mem[0], mem[1], sizeof mem[0]);
            }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_structure_kf_has_equal_numbers),
        cmocka_unit_test(test_structure_imm_has_equal_numbers),
        cmocka_unit_test(test_structure_zeros_have_one_sign),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
