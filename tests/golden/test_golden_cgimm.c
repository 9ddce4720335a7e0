/* The constant-gain IMM against reference cases, in the metric of the cases'
 * makers: x in units of sqrt(R); mu, loglik absolute. */
#include "close.h"

#include "jumplink/cgimm.h"

#define MODES 2
#define N 3

struct cgimm_case {
    const char *name;
    int M, n, m, p, rows;
    const double *x0, *w0, *winf, *kc, *T, *R, *Pi, *mu0, *z;
    const double *expected;             /* rows of x, mu, loglik */
};

#include "cgimm_cases.h"

#if JL_REAL_FLOAT               /* measured: 5.4e-5, at 530 sigma */
#define NEAR 5e-4
#else
#define NEAR 1e-11              /* measured: 1.1e-13 */
#endif

/* A row of numbers, for jl_real. */
static const jl_real *real(jl_real *to, const double *from, int n)
{
    int i;

    for (i = 0; i < n; i++)
        to[i] = (jl_real)from[i];
    return to;
}

static void set_gains(jl_cg_gains *g, const struct cgimm_case *c, int j)
{
    memset(g, 0, sizeof *g);
    g->order = c->winf[j * N + 2] > 0 ? 3 : 2;
    real(g->start, c->w0 + j * N, N);
    real(g->steady, c->winf + j * N, N);
    real(g->k, c->kc + j * N, N);
}

static void run(const struct cgimm_case *c)
{
    static jl_real mem[JL_CGIMM_STATE(MODES, 1)];
    const double sigma = sqrt(c->R[0]);
    const double *want = c->expected;
    jl_cg_gains gains[MODES];
    jl_cgimm cg;
    jl_real x[MODES * N], mu[MODES], Pi[MODES * MODES];
    int j, k;

    assert_true(c->M == MODES && c->n == N && c->m == 1);
    for (j = 0; j < MODES; j++)
        set_gains(&gains[j], c, j);
    assert_int_equal(jl_cgimm_init(&cg, MODES, gains, 1, (jl_real)c->T[0],
                                   (jl_real)c->R[0],
                                   real(Pi, c->Pi, MODES * MODES), mem,
                                   JL_CGIMM_STATE(MODES, 1)), JL_OK);
    assert_int_equal(jl_cgimm_set(&cg, real(x, c->x0, MODES * N),
                                  real(mu, c->mu0, MODES)), JL_OK);
    for (k = 0; k < c->rows; k++, want += N + MODES + 1) {
        const jl_real z = (jl_real)c->z[k];

        assert_int_equal(jl_cgimm_step(&cg, &z), JL_OK);
        jl_cgimm_estimate(&cg, x);
        for (j = 0; j < N; j++)
            assert_close((double)x[j] / sigma, want[j] / sigma, NEAR);
        for (j = 0; j < MODES; j++)
            assert_close(cg.mu[j], want[N + j], NEAR);
        assert_close(jl_cgimm_loglik(&cg), want[N + MODES], NEAR);
    }
}

static void test_cgimm_meets_reference(void **state)
{
    size_t c;

    (void)state;
    assert_int_equal(sizeof cgimm_cases / sizeof *cgimm_cases, 2);
    for (c = 0; c < sizeof cgimm_cases / sizeof *cgimm_cases; c++)
        run(&cgimm_cases[c]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cgimm_meets_reference),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
