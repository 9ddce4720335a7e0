/* The IMM against 60-digit references: every case, form and mixing, in the
 * metric and the tolerances of the cases' makers. */
#include "metric.h"

#include "jumplink.h"

#define N 8
#define MODES 12

struct tolerance {
    double x, P, mu, loglik;
};

#if JL_REAL_FLOAT       /* five to ten times what was measured */
static const struct tolerance ordinary = { 5e-3, 1e-3, 5e-4, 5e-4 };
static const struct tolerance hardest_near = { 5e-2, 1e-2, 5e-4, 5e-4 };
#else
static const struct tolerance ordinary = { 1e-10, 1e-11, 1e-11, 1e-11 };
static const struct tolerance hard_joseph = { 5e-3, 2e-4, 5e-6, 5e-7 };
static const struct tolerance hard_sqrt = { 5e-3, 2e-7, 5e-8, 2e-7 };
static const struct tolerance hardest_sqrt = { 1e-4, 1e-5, 1e-9, 1e-7 };
#endif

/* Cases where R is 1e-14 and 1e-24 of P0.  In `hard` and `hardest` positions
 * are 1e5 +- 1e-3 and 1e4 +- 1e-6, which lack digits in double and do not fit
 * into float; `hard_near` and `hardest_near` are the same near the origin. */
static int is(const struct imm_case *c, const char *name)
{
    return strcmp(c->name, name) == 0;
}

/* What a form must meet; NULL: the case is not for it. */
static const struct tolerance *tolerance_of(const struct imm_case *c,
                                            const jl_kf_form *form)
{
#if JL_REAL_FLOAT
    if (is(c, "hard") || is(c, "hardest"))
        return NULL;
    if (is(c, "hardest_near"))
        return form == &jl_kf_sqrt ? &hardest_near : NULL;
    if (is(c, "hard_near"))
        return form == &jl_kf_sqrt ? &ordinary : NULL;
#else
    if (is(c, "hard") || is(c, "hard_near"))
        return form == &jl_kf_standard ? NULL
            : form == &jl_kf_joseph ? &hard_joseph
            : is(c, "hard") ? &hard_sqrt : &ordinary;
    if (is(c, "hardest") || is(c, "hardest_near"))
        return form != &jl_kf_sqrt ? NULL
            : is(c, "hardest") ? &hardest_sqrt : &ordinary;
#endif
    return &ordinary;
}

static void check_row(const struct imm_case *c, const struct tolerance *t,
                      const double *want, const double *sigma,
                      const jl_imm *imm)
{
    int a, b, n = c->n;

    for (a = 0; a < n; a++)
        assert_close((double)imm->xhat[a] / sigma[a], want[a] / sigma[a], t->x);
    want += n;
    for (a = 0; a < n; a++)
        for (b = a; b < n; b++, want++)
            assert_close((double)imm->Phat[a * n + b] / sigma[a] / sigma[b],
                         *want / sigma[a] / sigma[b], t->P);
    for (a = 0; a < c->M; a++)
        assert_close(imm->mu[a], want[a], t->mu);
    assert_close(((double)imm->loglik - want[c->M]) / (1 + fabs(want[c->M])),
                 0, t->loglik);
}

static const jl_real *real(jl_real *to, const double *from, int n)
{
    int i;

    for (i = 0; i < n; i++)
        to[i] = (jl_real)from[i];
    return to;
}

static void run(const struct imm_case *c, const jl_kf_form *form, int mixing,
                const struct tolerance *t)
{
    static jl_real mode_mem[MODES][JL_MODE_MEM(N, N, N)];
    static jl_real mem[JL_IMM_STATE(MODES, N, N)];
    static jl_real scratch[JL_IMM_SCRATCH(MODES, N, N)];
    static jl_real big[3][MODES * N * N], row[7][N * N];
    static double sigma[ROWS * N];
    jl_mode modes[MODES];
    jl_imm imm;
    int j, k, n = c->n, m = c->m, p = c->p, M = c->M;
    int width = metric_width(c);

    assert_true(M <= MODES && n <= N);
    for (j = 0; j < M; j++) {
        assert_int_equal(jl_mode_init(&modes[j], n, m, p, mode_mem[j],
                                      JL_MODE_MEM(N, N, N)), JL_OK);
        assert_int_equal(
            jl_mode_set(&modes[j], real(row[0], c->F + j * n * n, n * n),
                        real(row[1], c->G + j * n * p, n * p),
                        real(row[2], c->Q + j * p * p, p * p),
                        real(row[3], c->w_bar + j * p, p),
                        real(row[4], c->H + j * m * n, m * n),
                        real(row[5], c->R + j * m * m, m * m), scratch),
            JL_OK);
    }
    assert_int_equal(jl_imm_init(&imm, M, modes, form, mixing, mem,
                                 JL_IMM_STATE(MODES, N, N)), JL_OK);
    assert_int_equal(jl_imm_chain(&imm, real(big[0], c->Pi, M * M)), JL_OK);
    assert_int_equal(jl_imm_set(&imm, real(big[0], c->x0, M * n),
                                real(big[1], c->P0, M * n * n),
                                real(big[2], c->mu0, M), scratch), JL_OK);
    metric_sigmas(sigma, c);
    for (k = 0; k < c->rows; k++) {
        assert_int_equal(jl_imm_step(&imm, real(row[6], c->z + k * m, m),
                                     scratch), JL_OK);
        check_row(c, t, c->expected + k * width, sigma + k * n, &imm);
    }
}

static void test_imm_meets_reference(void **state)
{
    static const int mixings[] = { JL_MIX_AUTO, JL_MIX_GENERAL };
    const jl_kf_form *const forms[] = { &jl_kf_joseph, &jl_kf_standard,
                                        &jl_kf_sqrt };
    size_t c, f, x;
    int ran = 0;

    (void)state;
    for (c = 0; c < sizeof imm_cases / sizeof *imm_cases; c++)
        for (f = 0; f < 3; f++)
            for (x = 0; x < 2; x++) {
                const struct tolerance *t
                    = tolerance_of(&imm_cases[c], forms[f]);

                if (t != NULL) {
                    run(&imm_cases[c], forms[f], mixings[x], t);
                    ran++;
                }
            }
    assert_int_equal(ran, 2 * (JL_REAL_FLOAT ? 5 * 3 + 2 : 5 * 3 + 2 * 3));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_imm_meets_reference),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
